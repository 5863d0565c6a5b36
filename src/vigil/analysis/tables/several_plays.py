"""The table on several plays of each episode: the chances that all, and that any, of k plays succeed."""

from vigil.analysis.measures.several_plays import plays_of_k
from vigil.analysis.measures.study import Study
from vigil.analysis.tables.rows import MODEL, run_row
from vigil.analysis.tables.table import Table, counts, intervals, points

_MEASURES = ("W", "B")


def several_plays(study: Study) -> Table:
    """Return pass^k and the best of k plays for every run that played episodes several times."""
    columns = (
        MODEL,
        *counts(k="k", episodes="Episodes", plays="Plays"),
        *intervals(
            **{f"every_{name}": f"{name}: all of k %" for name in _MEASURES},
            **{f"any_{name}": f"{name}: any of k %" for name in _MEASURES},
        ),
    )
    rows = []
    for entry in study.entries:
        if entry.run.header.spec.epochs == 1:
            continue
        for each in zip(*(plays_of_k(entry.run.rows, name) for name in _MEASURES), strict=True):
            cells = {"k": each[0].k, "episodes": each[0].episodes, "plays": each[0].plays}
            for name, found in zip(_MEASURES, each, strict=True):
                cells |= {f"every_{name}": points(*found.every), f"any_{name}": points(*found.any)}
            rows.append(run_row(entry, cells))
    notes = (
        "k plays of one episode, over the episodes that were played at least k times; k = 1 is the mean. All of k is "
        "pass^k, and the worst of k plays; any of k is the best. Both count every set of k plays of an episode. "
        "Intervals resample houses.",
    )
    return Table("several_plays", "Several plays of each episode", columns, tuple(rows), notes)
