"""Tables of parts of the runs' episodes: by stratum, and by level of difficulty.

Each function takes a Study and returns one Table. Source of the strata: the paper's section on task families.
"""

from vigil.analysis.measures.metrics import measure
from vigil.analysis.measures.rows import select_rows, values
from vigil.analysis.measures.strata import STRATA, by_stratum
from vigil.analysis.measures.study import Study, sorted_by_role
from vigil.analysis.tables.rows import RUN, clustered_rates, run_row, shown_name
from vigil.analysis.tables.run_tables import HOUSES_NOTE, WILSON_NOTE
from vigil.analysis.tables.table import Table, cells_of, counts, intervals, numbers, rate_cells, texts
from vigil.scoring.levels import LEVELS

_RATES = ("W", "B", "Delta", "FR", "NR", "IL", "Other")


def strata(study: Study) -> Table:
    """Return the rates of every run by stratum."""
    headings = {name: shown_name(name) for name in _RATES}
    columns = (RUN, *texts(stratum="Stratum"), *counts(n="n"), *intervals(**headings))
    parts = [(entry, by_stratum(entry.run.rows)) for entry in sorted_by_role(study.entries)]
    rows = [
        run_row(entry, {"stratum": part.name, "n": part.counts.n, **rate_cells(part.counts, _RATES)}, division)
        for division in STRATA
        for entry, strata in parts
        for part in strata[division]
    ]
    notes = (
        f"{WILSON_NOTE} Over all families the strata also differ in their mix of families. A target's size follows "
        "the rule of the protocol; distance is from the start to the target's box, in the floor plane.",
    )
    return Table("strata", "Results by stratum", columns, tuple(rows), notes)


def levels(study: Study) -> Table:
    """Return W, B and Delta of every run by level; the table has no rows if the pack's levels were not measured."""
    columns = (
        RUN,
        *texts(level="Level"),
        *counts(
            n=("n", lambda part: part.overall.n),
            houses=("Houses", lambda part: part.run.rows["house"].nunique()),
        ),
        *numbers(index=("Index", lambda part: float(values(part.run.rows, "level_index").mean()))),
        *clustered_rates("W", "B", "Delta"),
    )
    rows = []
    for level in LEVELS:
        for entry in sorted_by_role(study.entries):
            of_level = select_rows(entry.run.rows, values(entry.run.rows, "level", object) == level)
            if len(of_level):
                part = entry.part(of_level, measure(of_level))
                rows.append(run_row(part, {"level": level, **cells_of(columns, part)}))
    notes = (
        f"{HOUSES_NOTE} A level compares an episode with others of its family; over all families the levels may "
        "differ in their mix of families. The levels were measured by `vigil pack levels`; they are in the pack, or "
        "--levels gave them.",
    )
    return Table("levels", "Results by level of difficulty", columns, tuple(rows), notes)
