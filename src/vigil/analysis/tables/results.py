"""Result tables: the paper's tables of models' results under the default conditions, under the paper's names.

Your own rows come first, then the published rows, which are marked. Each function takes a Study and returns one Table.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from vigil.analysis.measures.metrics import RunMetrics, mean_with_interval
from vigil.analysis.measures.paper import NOTE, Panel
from vigil.analysis.measures.rows import select_rows
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_b, sorted_by_group
from vigil.analysis.tables.rows import (
    MODEL,
    clustered_rates,
    published_group,
    published_rows,
    rates,
    run_means,
    run_rows,
    side_by_side,
    tallies,
)
from vigil.analysis.tables.table import (
    Column,
    Table,
    TableRow,
    first_number,
    in_percent,
    intervals,
    rate_cell,
    texts,
    titled,
    with_best_bold,
)
from vigil.protocol.families import FAMILIES

EXCLUDED = "Excluded from the main tables (low compliance or zero B)"
OUTSIDE = {
    "excluded": EXCLUDED,
    "extended": "Extended panel, by the study's word",
    "supplementary": "Supplementary variants, by the study's word",
}
"""Panel outside the main tables -> heading over its rows."""
_NOT_HERE = {
    "condition": "Under another profile or prompt, and so not in this table",
    "repeat": "Repeats of a run in this table",
    "excluded": "In the extended panel by its exclusion rule",
    "extended": "In the extended panel by the study's word",
    "supplementary": "In the extended panel, as supplementary, by the study's word",
}
"""Panel -> why its runs have no row in a main table."""
_PRINTED_PANELS: dict[Panel, str] = {
    "excluded": "Published: excluded from the paper's main tables (low compliance or zero B)",
    "supplementary": "Published: the paper's supplementary variants",
}
_FR_TINT_FROM, _NR_TINT_FROM = 85.0, 40.0
_LEAST_TINTED = 5
"""Smallest number of episodes from which a rate may be tinted."""


def _w_and_b(measures: RunMetrics | None) -> tuple[Any, ...] | None:
    """Return W and B in percent, then the ends of their Wilson intervals; None without measures."""
    if measures is None:
        return None
    ends = (tuple(100 * end for end in measures.rate(name).interval or ()) for name in "WB")
    return in_percent(measures.share("W")), in_percent(measures.share("B")), *ends


ALL = Column("All", "All W/B", "pair", lambda entry: _w_and_b(entry.overall))
"""Column of W and B over all families."""


def family_columns() -> tuple[Column, ...]:
    """Return one column for each family, with W and B."""
    return tuple(
        Column(family, f"{family} W/B", "pair", lambda entry, family=family: _w_and_b(entry.families.get(family)))
        for family in FAMILIES
    )


def printed_pairs(row: dict[str, Any]) -> dict[str, Any]:
    """Return {family, or `All`: (W, B)}, as printed in a row of one of the paper's tables."""
    return {**{family: tuple(pair) for family, pair in row["families"].items()}, "All": (row["W"], row["B"])}


def global_cross_section(study: Study) -> Table:
    """Return a table of W and B, overall and for each family, and of the gap W - B, best B first."""
    columns = (MODEL, ALL, *clustered_rates("Delta"), *family_columns())
    rows = side_by_side(
        study,
        run_rows(study.main_panel(), columns),
        published_rows(study, "global_cross_section", lambda row: {**printed_pairs(row), "Delta": row["delta"]}),
    )
    return titled(
        "global_cross_section",
        columns,
        with_best_bold(rows, columns[1:], lowest=frozenset({"Delta"})),
        *_base_note(study),
    )


def full_panel(study: Study) -> Table:
    """Return a table of W and B, overall and for each family, grouped as in the paper."""
    activated = texts(activated=("Activated", lambda entry: entry.run.model.activated))
    columns = (MODEL, *activated, ALL, *family_columns())
    rows = side_by_side(
        study,
        run_rows(sorted_by_group(study.main_panel()), columns, lambda entry: entry.group),
        published_rows(study, "full_panel", printed_pairs, published_group),
    )
    return titled("full_panel", columns, rows, *_base_note(study))


def extended_panel(study: Study) -> Table:
    """Return the rows of runs that the exclusion rule removes from the main tables, and the rows of the paper's
    extended panel."""
    columns = (
        MODEL,
        *rates(B="B %", W="W %"),
        *clustered_rates("Delta"),
        *rates(FR="FR %", NR="NR %", IL="IL %", NoRep="NoRep %"),
        *run_means(mean_steps=("Steps", "steps")),
    )
    rows = side_by_side(
        study,
        run_rows(study.outside_main_panel(), columns, lambda entry: OUTSIDE[entry.panel]),
        published_rows(
            study,
            "extended_panel",
            lambda row: {**row, "Delta": row["delta"]},
            lambda model: _PRINTED_PANELS[model.panel],
        ),
    )
    return titled("extended_panel", columns, rows)


def counterfactual(study: Study) -> Table:
    """Return the B that each run would have if its reports followed a policy (always, random or oracle)."""

    def half_w(entry: RunEntry) -> Any:
        view = rate_cell(entry.overall.rate("W"))
        return None if view is None else tuple(end / 2 for end in view)

    columns = (
        MODEL,
        *rates(B="B %", Always="Always %"),
        *intervals(Rand=("Rand. %", half_w)),
        *rates(Oracle=("Oracle %", "W"), AlwaysReported=("Always, where reported %", "Always_reported")),
    )
    rows = [
        replace(row, bold=frozenset({"Always"} if _is_above(row, "Always", "B") else ()))
        for row in _own_and_published(study, "counterfactual", columns)
    ]
    return titled("counterfactual", columns, rows)


def belief_lag(study: Study) -> Table:
    """Return how long runs take to report once the goal holds, and how often they report success before it holds."""

    def lag_without_sv(entry: RunEntry) -> Any:
        rows = entry.run.rows
        return mean_with_interval(select_rows(rows, rows["expected"].isna().to_numpy()), "lag")

    columns = (
        MODEL,
        *tallies(W_plus=("W+", "W")),
        *run_means(lag="Lag (steps)"),
        *intervals(lag_without_sv=("Lag without SV", lag_without_sv)),
        *run_means(lag_from_reset="Lag from reset"),
        *tallies(NoRep_W1="NoRep | W=1", NR_W1="NR | W=1", IL_W1="IL | W=1", FS="FS"),
        *rates(FS_zero=("FS @0 %", "P_zero_FS"), FS_high=("FS > 0.75 %", "P_high_FS")),
    )
    renamed = {"NR_W1": "NoRep_W1", "zero_progress_pct": "FS_zero"}
    rows = _own_and_published(study, "belief_lag", columns, renamed)
    return titled("belief_lag", columns, rows)


def conditional_report(study: Study) -> Table:
    """Return rates of reports among the episodes with W=1 and among those with W=0."""
    columns = (
        MODEL,
        *rates(W="W %", B="B %", Stop="Stop %", P_rep_W0="P(rep | W=0) %", P_norep_W1="P(no rep | W=1) %"),
        *rates(P_FR_W0="P(FR | W=0) %"),
        *tallies(n_W0=("n W=0", "W0"), n_W1=("n W=1", "W")),
    )
    limits = {"P_rep_W0": ("FR", _FR_TINT_FROM, "n_W0"), "P_norep_W1": ("NR", _NR_TINT_FROM, "n_W1")}
    rows = []
    for row in _own_and_published(study, "conditional_report", columns):
        is_outside = row.group in OUTSIDE.values()
        tints = {
            key: label
            for key, (label, limit, size) in limits.items()
            if (first_number(row.cells[key]) or 0.0) >= limit and row.cells[size] >= _LEAST_TINTED and not is_outside
        }
        rows.append(replace(row, tints=tints))
    return titled(
        "conditional_report",
        columns,
        rows,
        fr_tint_from=_FR_TINT_FROM,
        nr_tint_from=_NR_TINT_FROM,
        least_tinted=_LEAST_TINTED,
    )


def _own_and_published(
    study: Study, table: str, columns: Sequence[Column], renamed: dict[str, str] | None = None
) -> list[TableRow]:
    """Return the rows of the main panel, then the rows of other panels under separate headings, then the published
    rows.

    `renamed` maps keys of columns in the paper's table to keys in this table.
    """
    names = renamed or {}
    own = [
        *run_rows(study.main_panel(), columns),
        *run_rows(study.outside_main_panel(), columns, lambda entry: OUTSIDE[entry.panel]),
    ]
    printed = published_rows(study, table, lambda row: {names.get(key, key): value for key, value in row.items()})
    return side_by_side(study, own, printed)


def _base_note(study: Study) -> tuple[str, ...]:
    notes = [NOTE] if study.published else []
    for panel, why in _NOT_HERE.items():
        names = [entry.name for entry in sorted_by_b(study.entries) if entry.panel == panel]
        if names:
            notes.append(f"{why}: {', '.join(names)}.")
    return tuple(notes)


def _is_above(row: TableRow, key: str, other: str) -> bool:
    one, two = first_number(row.cells[key]), first_number(row.cells[other])
    return one is not None and two is not None and one > two
