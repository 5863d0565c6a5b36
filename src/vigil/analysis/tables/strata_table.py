"""Strata table: the rates of every run on each kind of episode. Source: the paper's section on task families."""

from dataclasses import replace

from vigil.analysis.measures.strata import STRATA, by_stratum
from vigil.analysis.measures.study import Study, sorted_by_b
from vigil.analysis.tables.run_tables import MODEL, WILSON_NOTE, row_of, shown_name
from vigil.analysis.tables.table import Table, TableRow, counts, intervals, rate_cells, texts

_RATES = ("W", "B", "Delta", "FR", "NR", "IL", "Other")


def strata(study: Study) -> Table:
    """Return the rates of every run by stratum."""
    headings = {name: shown_name(name) for name in _RATES}
    columns = (MODEL, *texts(stratum="Stratum"), *counts(n="n"), *intervals(**headings))
    parts = [(entry, by_stratum(entry.run.rows)) for entry in sorted_by_b(study.entries)]
    rows: list[TableRow] = []
    for way in STRATA:
        for entry, ways in parts:
            for part in ways[way]:
                cells = rate_cells(part.counts, _RATES)
                row = row_of(entry, stratum=part.name, n=part.counts.n, **cells)
                rows.append(replace(row, group=way))
    notes = (
        f"{WILSON_NOTE} Over all families the strata also differ in their mix of families. A target's size follows "
        "the rule of the protocol; distance is from the start to the target's box, in the floor plane.",
    )
    return Table("strata", "Results by stratum", columns, tuple(rows), notes)
