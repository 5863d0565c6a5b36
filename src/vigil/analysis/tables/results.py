"""Result tables: the paper's tables of models' results under the default conditions, by the paper's names.

Own rows come first, then the published rows, which are marked. Each function takes a Study and returns one Table.
"""

from collections.abc import Callable, Iterable
from typing import Any

from vigil.analysis.measures.metrics import RunMetrics, clustered_intervals, mean_with_interval
from vigil.analysis.measures.paper import NOTE, NR_NOTE, Panel, PublishedModel
from vigil.analysis.measures.rows import select_rows
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_group
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    counts,
    first_number,
    intervals,
    percent,
    points,
    rate_cell,
    rate_cells,
    texts,
    with_best_bold,
)
from vigil.protocol.families import FAMILIES
from vigil.scoring.rates import RATES

PUBLISHED = "Published: the paper's own pack and simulator"
EXCLUDED = "Excluded from the main tables (low compliance or zero B)"
_PRINTED_PANELS: dict[Panel, str] = {
    "excluded": "Published: excluded from the paper's main tables (low compliance or zero B)",
    "supplementary": "Published: the paper's supplementary variants",
}
MODEL = Column("model", "Model", "text")
ALL = Column("All", "All W/B", "pair")
INTERVALS_ELSEWHERE = "The intervals of W and B are in `family_rates`, one row per family and one for all."
_FR_TINT_FROM, _NR_TINT_FROM = 85.0, 40.0


def family_columns() -> tuple[Column, ...]:
    """Return a column of W and B for each family."""
    return tuple(Column(family, f"{family} W/B", "pair") for family in FAMILIES)


def global_cross_section(study: Study) -> Table:
    """Return W/B overall and per family with the gap, best B first."""
    columns = (MODEL, ALL, *intervals(Delta="Δ (pp)"), *family_columns())
    rows = [run_row(entry, cross_section(entry)) for entry in study.main_panel()]
    rows += published_rows(
        study, "global_cross_section", lambda row: {**pairs(row), "All": (row["W"], row["B"]), "Delta": row["delta"]}
    )
    return Table(
        "global_cross_section",
        "Outcomes per family under native control: W/B in %",
        columns,
        tuple(with_best_bold(rows, columns[1:], lowest=frozenset({"Delta"}))),
        (
            f"W: the world reached the goal. B: W, closed by a matching report. {INTERVALS_ELSEWHERE}",
            *_base_note(study),
        ),
    )


def full_panel(study: Study) -> Table:
    """Return W/B overall and per family, grouped as in the paper."""
    columns = (MODEL, *texts(activated="Activated"), ALL, *family_columns())
    rows = [
        run_row(entry, {**cross_section(entry), "activated": entry.run.model.activated}, group=entry.group)
        for entry in sorted_by_group(study.main_panel())
    ]
    if study.published:
        rows += [
            published_row(model, {**pairs(row), "All": (row["W"], row["B"])}, group=published_group(model))
            for model, row in study.published.rows("full_panel")
        ]
    notes = (INTERVALS_ELSEWHERE, *_base_note(study))
    return Table("full_panel", "Primary panel: W/B in %", columns, tuple(rows), notes)


def extended_panel(study: Study) -> Table:
    """Return the rows that the exclusion rule removes from the main tables, with the paper's two groups."""
    names = {"B": "B %", "W": "W %", "Delta": "Δ (pp)", "FR": "FR %", "NR": "NR %", "IL": "IL %", "NoRep": "NoRep %"}
    columns = (MODEL, *intervals(**names, mean_steps="Steps"))
    rows = [run_row(entry, all_rates(entry), group=EXCLUDED) for entry in study.excluded()]
    if study.published:
        rows += [
            published_row(model, {**row, "Delta": row["delta"]}, group=_PRINTED_PANELS[model.panel])
            for model, row in study.published.rows("extended_panel")
        ]
    notes = (
        "The rule for your runs: B = 0, or more than 50 % of the episodes ended at the invalid-action limit. The "
        "paper's supplementary variants are other sizes and serving modes than its panel, whatever their B and IL.",
        NR_NOTE,
    )
    return Table("extended_panel", "Extended panel: rows outside the main tables", columns, tuple(rows), notes)


def counterfactual(study: Study) -> Table:
    """Return B under counterfactual report policies on the same trajectories."""
    names = {"B": "B %", "Always": "Always %", "Rand": "Rand. %", "Oracle": "Oracle %"}
    columns = (MODEL, *intervals(**names, AlwaysReported="Always, where reported %"))

    def row(entry: RunEntry, group: str) -> TableRow:
        m = entry.overall
        view = rate_cell(m.rate("W"))
        cells = {
            **rate_cells(m, ("B", "Always")),
            "Rand": None if view is None else tuple(end / 2 for end in view),
            "Oracle": view,
            "AlwaysReported": rate_cell(m.rate("Always_reported")),
        }
        return run_row(entry, cells, group=group, bold=_beats(cells["Always"], cells["B"]))

    rows = _own_rows(study, row)
    if study.published:
        rows += [
            published_row(model, row, bold=_beats(row["Always"], row["B"]))
            for model, row in study.published.rows("counterfactual")
        ]
    notes = (
        "Always: a success report is appended to each trajectory or replaces its report "
        "(bold if above B). Rand.: a uniform choice of the two admissible labels, in expectation W/2. Oracle = W.",
    )
    return Table("counterfactual", "Counterfactual report policies", columns, tuple(rows), notes)


def belief_lag(study: Study) -> Table:
    """Return closure lag and premature commitment."""
    columns = (
        MODEL,
        *counts(W_plus="W+"),
        *intervals(lag="Lag (steps)", lag_without_sv="Lag without SV", lag_from_reset="Lag from reset"),
        *counts(NoRep_W1="NoRep | W=1", NR_W1="NR | W=1", IL_W1="IL | W=1", FS="FS"),
        *intervals(FS_zero="FS @0 %", FS_high="FS > 0.75 %"),
    )

    def row(entry: RunEntry, group: str) -> TableRow:
        m, table = entry.overall, entry.run.rows
        sizes = {name: m.counts[name] for name in ("NoRep_W1", "NR_W1", "IL_W1", "FS")}
        lags = {
            "lag": mean_with_interval(table, "lag"),
            "lag_without_sv": mean_with_interval(select_rows(table, table["expected"].isna().to_numpy()), "lag"),
            "lag_from_reset": mean_with_interval(table, "lag_from_reset"),
        }
        shares = {"FS_zero": rate_cell(m.rate("P_zero_FS")), "FS_high": rate_cell(m.rate("P_high_FS"))}
        return run_row(entry, {"W_plus": m.counts["W"], **sizes, **lags, **shares}, group=group)

    renamed = {"NR_W1": "NoRep_W1", "zero_progress_pct": "FS_zero"}
    rows = _own_rows(study, row)
    rows += published_rows(study, "belief_lag", lambda row: {renamed.get(name, name): row[name] for name in row})
    notes = (
        "Lag: steps from the first step after which the goal held to the matching report, over episodes with B = "
        "1; intervals: bootstrap over houses. FS: "
        "success reported with W=0; @0: at zero progress. The paper's column `NR` counts W=1 episodes without a "
        "report, IL "
        "included: here NoRep | W=1.",
    )
    return Table("belief_lag", "Closure lag and premature commitment", columns, tuple(rows), notes)


def conditional_report(study: Study) -> Table:
    """Return report rates conditioned on the world (W)."""
    names = {
        "W": "W %",
        "B": "B %",
        "Stop": "Stop %",
        "P_rep_W0": "P(rep | W=0) %",
        "P_norep_W1": "P(no rep | W=1) %",
        "P_FR_W0": "P(FR | W=0) %",
    }
    columns = (MODEL, *intervals(**names), *counts(n_W0="n W=0", n_W1="n W=1"))

    def row(entry: RunEntry, group: str) -> TableRow:
        m = entry.overall
        cells = {**rate_cells(m, names), "n_W0": m.counts["W0"], "n_W1": m.counts["W"]}
        return run_row(entry, cells, group=group, tints=_tints(cells))

    rows = _own_rows(study, row)
    if study.published:
        rows += [published_row(m, row, tints=_tints(row)) for m, row in study.published.rows("conditional_report")]
    notes = (
        f"Tinted: P(rep | W=0) of {_FR_TINT_FROM:.0f} % or more (closing without reaching the goal) and P(no rep | "
        f"W=1) of {_NR_TINT_FROM:.0f} % or more (reaching the goal without closing).",
    )
    return Table("conditional_report", "Conditional report rates", columns, tuple(rows), notes)


def all_rates(entry: RunEntry) -> dict[str, RateCell]:
    """Return every rate of a run, in percent with its interval, and the mean steps."""
    delta = clustered_intervals(entry.run.rows)["Delta"]
    cells = {**rate_cells(entry.overall, RATES), "mean_steps": mean_with_interval(entry.run.rows, "steps")}
    return {**cells, "Delta": points(entry.overall.share("Delta"), delta)}


def w_and_b(measures: RunMetrics) -> tuple[float | None, float | None]:
    """Return W and B in percent."""
    return percent(measures.share("W")), percent(measures.share("B"))


def cross_section(entry: RunEntry) -> dict[str, Any]:
    """Return W/B of a run, overall and per family, with the gap."""
    families = {family: w_and_b(measures) for family, measures in entry.families.items()}
    delta = points(entry.overall.share("Delta"), clustered_intervals(entry.run.rows)["Delta"])
    return {"All": w_and_b(entry.overall), "Delta": delta, **families}


def pairs(row: dict[str, Any]) -> dict[str, Any]:
    """Return W/B per family of a published row."""
    return {family: tuple(pair) for family, pair in row["families"].items()}


def run_row(
    entry: RunEntry, cells: dict[str, Any], *, group: str = "", bold: Iterable[str] = (), tints: dict | None = None
) -> TableRow:
    """Return a run's row, named and marked."""
    return TableRow(
        {"model": entry.name, **cells},
        group=group,
        is_privileged=entry.run.model.is_privileged,
        bold=frozenset(bold),
        tints=tints or {},
    )


def published_rows(study: Study, table: str, cells_of: Callable[[dict[str, Any]], dict[str, Any]]) -> list[TableRow]:
    """Return the marked rows of one of the paper's tables; empty if only own rows are wanted."""
    if study.published is None:
        return []
    return [published_row(model, cells_of(row)) for model, row in study.published.rows(table)]


def published_row(
    model: PublishedModel,
    cells: dict[str, Any],
    *,
    group: str = PUBLISHED,
    bold: Iterable[str] = (),
    tints: dict | None = None,
) -> TableRow:
    """Return a published row, named and marked."""
    known = {"model": model.name, "activated": model.activated, **{k: v for k, v in cells.items() if k != "model"}}
    return TableRow(known, group=group, is_published=True, bold=frozenset(bold), tints=tints or {})


def published_group(model: PublishedModel) -> str:
    """Return the heading of a published row in tables that also group own rows."""
    return f"{model.group}, published"


def _own_rows(study: Study, row: Callable[[RunEntry, str], TableRow]) -> list[TableRow]:
    """Return the rows of the main panel, then those of excluded runs under a separate heading."""
    return [
        *(row(entry, "") for entry in study.main_panel()),
        *(row(entry, EXCLUDED) for entry in study.excluded()),
    ]


def _base_note(study: Study) -> tuple[str, ...]:
    aside = [entry.name for entry in study.entries if not entry.is_base]
    out = [entry.name for entry in study.excluded()]
    notes = [NOTE] if study.published else []
    if aside:
        notes.append(f"Under another profile or prompt, and so not in this table: {', '.join(aside)}.")
    if out:
        notes.append(f"In the extended panel by its exclusion rule: {', '.join(out)}.")
    return tuple(notes)


def _beats(always: Any, actual: Any) -> list[str]:
    one, other = first_number(always), first_number(actual)
    return ["Always"] if one is not None and other is not None and one > other else []


def _tints(cells: dict[str, Any]) -> dict[str, str]:
    found = {}
    if (first_number(cells["P_rep_W0"]) or 0.0) >= _FR_TINT_FROM:
        found["P_rep_W0"] = "FR"
    if (first_number(cells["P_norep_W1"]) or 0.0) >= _NR_TINT_FROM:
        found["P_norep_W1"] = "NR"
    return found
