"""Levels table: the rates of every run on easy, medium, hard and extreme episodes."""

from vigil.analysis.measures.metrics import clustered_intervals, measure
from vigil.analysis.measures.rows import select_rows, values
from vigil.analysis.measures.study import Study, sorted_by_b
from vigil.analysis.tables.run_tables import HOUSES_NOTE, MODEL, row_of, shown_name
from vigil.analysis.tables.table import Table, counts, intervals, numbers, points, texts
from vigil.scoring.levels import LEVELS

_RATES = ("W", "B", "Delta")


def levels(study: Study) -> Table:
    """Return W, B and Delta of every run by level; without rows if the pack's levels were not measured."""
    headings = {name: shown_name(name) for name in _RATES}
    columns = (MODEL, *texts(level="Level"), *counts(n="n", houses="Houses"), *numbers(index="Index"))
    rows = []
    for level in LEVELS:
        for entry in sorted_by_b(study.entries):
            of_level = select_rows(entry.run.rows, values(entry.run.rows, "level", object) == level)
            if not len(of_level):
                continue
            measures, clusters = measure(of_level), clustered_intervals(of_level)
            cells = {name: points(measures.share(name), clusters[name]) for name in _RATES}
            index = float(values(of_level, "level_index").mean())
            houses = of_level["house"].nunique()
            rows.append(row_of(entry, level=level, n=measures.n, houses=houses, index=index, **cells))
    notes = (
        f"{HOUSES_NOTE} A level compares an episode with others of its family; over all families the levels may "
        "differ in their mix of families. The levels were measured by `vigil pack levels`; they are in the pack, or "
        "--levels gave them.",
    )
    return Table("levels", "Results by level of difficulty", (*columns, *intervals(**headings)), tuple(rows), notes)
