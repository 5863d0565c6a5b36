"""Result tables: those of the paper's tables that show what models did, by the paper's names.

Own rows first, then the published ones, marked. Each function takes a Study and returns one Table.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from vigil.analysis.measures.metrics import Measures, by_family, measure
from vigil.analysis.measures.pairs import Pair, mean_difference
from vigil.analysis.measures.paper import NOTE, NR_NOTE, PublishedModel
from vigil.analysis.measures.study import RunEntry, Study, by_b, by_group
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Row,
    Table,
    counts,
    intervals,
    numbers,
    percent,
    points,
    printed,
    texts,
    with_best_bold,
)
from vigil.episode import FAMILIES
from vigil.rates import RATES

PUBLISHED = "Published: the paper's own pack and simulator"
MODEL = Column("model", "Model", "text")
_FAMILY_COLUMNS = tuple(Column(family, f"{family} W/B", "pair") for family in FAMILIES)
_ALL = Column("All", "All W/B", "pair")
_DELTA = Column("Delta", "Δ (pp)")
_TESTED = ("W", "B", "FR", "NR")
_INTERVAL_NOTE = "Intervals: paired bootstrap over houses."
_P_NOTE = "p: McNemar, exact, not corrected for the number of tests."
_FR_TINT_FROM, _NR_TINT_FROM = 85.0, 40.0


def global_cross_section(study: Study) -> Table:
    """Returns W/B overall and per family with the gap, best B first."""
    columns = (MODEL, _ALL, _DELTA, *_FAMILY_COLUMNS)
    rows = [_row(entry, _cross_section(entry)) for entry in study.main_panel()]
    rows += _published(
        study, "global_cross_section", lambda row: {**_pairs(row), "All": (row["W"], row["B"]), "Delta": row["delta"]}
    )
    return Table(
        "global_cross_section",
        "Outcomes per family under native control: W/B in %",
        columns,
        tuple(with_best_bold(rows, columns[1:], lowest=frozenset({"Delta"}))),
        ("W: the world reached the goal. B: it did, closed by a matching report.", *_base_note(study)),
    )


def full_panel(study: Study) -> Table:
    """Returns W/B overall and per family, grouped as in the paper."""
    activated = Column("activated", "Activated", "text")
    rows = [
        _row(entry, {**_cross_section(entry), "activated": entry.run.model.activated}, group=entry.group)
        for entry in by_group(study.main_panel())
    ]
    if study.published:
        rows += [
            _published_row(model, {**_pairs(row), "All": (row["W"], row["B"])}, group=f"{model.group}, published")
            for model, row in study.published.rows("full_panel")
        ]
    columns = (MODEL, activated, _ALL, *_FAMILY_COLUMNS)
    return Table("full_panel", "Primary panel: W/B in %", columns, tuple(rows), _base_note(study))


def extended_panel(study: Study) -> Table:
    """Returns the rows that the exclusion rule takes out of the main tables."""
    columns = (
        MODEL,
        *numbers(B="B %", W="W %"),
        _DELTA,
        *numbers(FR="FR %", NR="NR %", IL="IL %", NoRep="NoRep %", mean_steps="Steps"),
    )
    rows = [
        _row(entry, rates(entry.overall)) for entry in by_b(e for e in study.entries if e.is_base and e.is_excluded)
    ]
    rows += _published(study, "extended_panel", lambda row: {**row, "Delta": row["delta"]})
    rule = "Excluded from the main tables: B = 0, or more than 50 % of the episodes ended at the invalid-action limit."
    return Table(
        "extended_panel", "Extended panel: rows outside of the main tables", columns, tuple(rows), (rule, NR_NOTE)
    )


def proprio_minimal(study: Study) -> Table:
    """Returns base against action feedback: events per episode and differences."""
    events = ("too_far", "path_blocked", "retry")
    columns = (
        MODEL,
        *counts(n="n"),
        *(
            Column(f"{event} {side}", f"{event} {shown}", "number2")
            for event in events
            for side, shown in (("base", "base"), ("fb", "+FB"))
        ),
        *intervals(**{f"d{name}": f"Δ{name} (pp)" for name in _TESTED}),
        *(Column(f"p_{name}", f"p ({name})", "p") for name in _TESTED),
    )
    rows = [_intervention_row(study, pair) for pair in study.pairing.feedback]
    if study.published:
        for model, row in study.published.rows("proprio_minimal"):
            cells = {f"{event} {side}": row[event][i] for event in events for i, side in enumerate(("base", "fb"))}
            shifts = {f"d{name}": (row[f"d{name}"], None, None) for name in _TESTED}
            rows.append(_published_row(model, {**cells, **shifts}))
    notes = (
        f"Means per episode over the episodes that both runs have scored; differences: +FB minus base. "
        f"{_INTERVAL_NOTE} {_P_NOTE}",
        "retry: every repeat of an identical interact_pixel (intent, x, y) after the first.",
    )
    return Table("proprio_minimal", "Intervention: action feedback", columns, tuple(rows), notes)


def counterfactual(study: Study) -> Table:
    """Returns B under other ways of reporting on the same trajectories."""
    columns = (
        MODEL,
        *numbers(
            B="B %", Always="Always %", Rand="Rand. %", Oracle="Oracle %", AlwaysReported="Always, where reported %"
        ),
    )
    rows = []
    for entry in study.main_panel():
        m = entry.overall
        always, b = percent(m.share("Always")), percent(m.share("B"))
        cells = {
            "B": b,
            "Always": always,
            "Rand": percent(m.means["random"]),
            "Oracle": percent(m.share("W")),
            "AlwaysReported": percent(m.share("Always_reported")),
        }
        rows.append(_row(entry, cells, bold=_beats(always, b)))
    if study.published:
        rows += [
            _published_row(model, row, bold=_beats(row["Always"], row["B"]))
            for model, row in study.published.rows("counterfactual")
        ]
    notes = (
        "Always: a success report appended to, or put in place of, each trajectory's end (bold where it beats "
        "B). Rand.: a "
        "uniform choice of the two admissible labels, in expectation W/2. Oracle = W.",
    )
    return Table("counterfactual", "Counterfactual report policies", columns, tuple(rows), notes)


def belief_lag(study: Study) -> Table:
    """Returns closure lag and premature commitment."""
    columns = (
        MODEL,
        *counts(W_plus="W+"),
        *numbers(lag="Lag (steps)", lag_without_sv="Lag without SV", lag_from_reset="Lag from reset"),
        *counts(NoRep_W1="NoRep | W=1", NR_W1="NR | W=1", IL_W1="IL | W=1", FS="FS"),
        *numbers(FS_zero="FS @0 %", FS_high="FS > 0.75 %"),
    )
    rows = []
    for entry in study.main_panel():
        m = entry.overall
        sizes = {name: m.counts[name] for name in ("NoRep_W1", "NR_W1", "IL_W1", "FS")}
        lags = {name: m.means[name] for name in ("lag", "lag_without_sv", "lag_from_reset")}
        shares = {"FS_zero": percent(m.share("P_zero_FS")), "FS_high": percent(m.share("P_high_FS"))}
        rows.append(_row(entry, {"W_plus": m.counts["W"], **sizes, **lags, **shares}))
    renamed = {"NR_W1": "NoRep_W1", "zero_progress_pct": "FS_zero"}
    rows += _published(study, "belief_lag", lambda row: {renamed.get(name, name): row[name] for name in row})
    notes = (
        "Lag: steps from the first step after which the goal held to the matching report, over episodes with B = "
        "1. FS: "
        "success reported with W=0; @0: at zero progress. The paper's column `NR` counts W=1 episodes without a "
        "report, IL "
        "included: here NoRep | W=1.",
    )
    return Table("belief_lag", "Closure lag and premature commitment", columns, tuple(rows), notes)


def conditional_report(study: Study) -> Table:
    """Returns report rates conditioned on the world."""
    columns = (
        MODEL,
        *numbers(
            W="W %",
            B="B %",
            Stop="Stop %",
            P_rep_W0="P(rep | W=0) %",
            P_norep_W1="P(no rep | W=1) %",
            P_FR_W0="P(FR | W=0) %",
        ),
        *counts(n_W0="n W=0", n_W1="n W=1"),
    )
    rows = []
    for entry in study.main_panel():
        cells = conditional(entry.overall)
        rows.append(_row(entry, cells, tints=_tints(cells)))
    if study.published:
        rows += [_published_row(m, row, tints=_tints(row)) for m, row in study.published.rows("conditional_report")]
    notes = (
        f"Tinted: P(rep | W=0) of {_FR_TINT_FROM:.0f} % or more (closing without the world) and P(no rep | W=1) of "
        f"{_NR_TINT_FROM:.0f} % or more (the world without closing).",
    )
    return Table("conditional_report", "Conditional report rates", columns, tuple(rows), notes)


def prompt_sensitivity(study: Study) -> Table:
    """Returns W/B under the neutral prompt with the shifts from the default one."""
    columns = (
        MODEL,
        _ALL,
        *intervals(dW="ΔW (pp)", dB="ΔB (pp)"),
        *(Column(f"p_{name}", f"p ({name})", "p") for name in "WB"),
        *_FAMILY_COLUMNS,
        *texts(largest="Largest shift of W or B in a family (pp)"),
    )
    by_run = {entry.name: entry for entry in study.entries}
    rows = []
    for pair in study.pairing.prompt:
        other = by_run[pair.other.name]
        shifts = {"dW": _shift(pair, "W"), "dB": _shift(pair, "B"), "largest": _largest_shift(pair)}
        tests = {f"p_{name}": pair.p(name) for name in "WB"}
        rows.append(_row(other, {**_cross_section(other), **shifts, **tests}))
    rows += _published(study, "prompt_sensitivity", lambda row: {**_pairs(row), "All": (row["W"], row["B"])})
    notes = (
        "Neutral prompt: both anti-hallucination lines left out, nothing else changed. Shifts: neutral minus default, "
        f"over the episodes that both runs have scored. {_INTERVAL_NOTE} {_P_NOTE} The largest shift is the widest of "
        "sixteen: a pointer, not a finding.",
    )
    return Table(
        "prompt_sensitivity", "Prompt sensitivity: neutral-report variant, W/B in %", columns, tuple(rows), notes
    )


def open_repeat_robustness(study: Study) -> Table:
    """Returns mean and half-range over repeated runs."""
    names = ("W", "B", "Delta", "FR", "NR", "NoRep")
    columns = (
        MODEL,
        *counts(runs="Runs"),
        *(Column(name, "Δ (pp)" if name == "Delta" else f"{name} %", "spread") for name in names),
    )
    by_run = {entry.name: entry for entry in study.entries}
    rows = []
    for run, tables in zip(study.pairing.repeated, study.pairing.repeats, strict=True):
        measured = [rates(measure(table)) for table in tables]
        spreads = {name: spread([one[name] for one in measured]) for name in names}
        rows.append(_row(by_run[run.name], {"runs": len(tables), **spreads}))
    rows += _published(study, "open_repeat_robustness", lambda row: {**row, "Delta": row["delta"], "runs": 2})
    notes = ("Mean ± half-range over runs (or epochs) under the same settings. " + NR_NOTE,)
    return Table("open_repeat_robustness", "Repeated runs", columns, tuple(rows), notes)


def rates(measures: Measures) -> dict[str, float | None]:
    """Returns the plain rates in percent, with mean steps."""
    return {**{name: percent(measures.share(name)) for name in RATES}, "mean_steps": measures.means["steps"]}


def conditional(measures: Measures) -> dict[str, Any]:
    """Returns report rates given the world, in percent, with the sizes of both sets."""
    return {
        "W": percent(measures.share("W")),
        "B": percent(measures.share("B")),
        "Stop": percent(measures.share("Stop")),
        "P_rep_W0": percent(measures.share("P_rep_W0")),
        "P_norep_W1": percent(measures.share("P_norep_W1")),
        "P_FR_W0": percent(measures.share("P_FR_W0")),
        "n_W0": measures.counts["W0"],
        "n_W1": measures.counts["W"],
    }


def spread(values: Sequence[float | None]) -> tuple[float, float] | None:
    """Returns mean and half-range."""
    known = [value for value in values if value is not None]
    return (float(np.mean(known)), (max(known) - min(known)) / 2) if known else None


def _cross_section(entry: RunEntry) -> dict[str, Any]:
    pair = {
        family: (percent(measures.share("W")), percent(measures.share("B")))
        for family, measures in entry.families.items()
    }
    overall = entry.overall
    return {
        "All": (percent(overall.share("W")), percent(overall.share("B"))),
        "Delta": percent(overall.share("Delta")),
        **pair,
    }


def _pairs(row: dict[str, Any]) -> dict[str, Any]:
    return {family: tuple(pair) for family, pair in row["families"].items()}


def _row(
    entry: RunEntry, cells: dict[str, Any], *, group: str = "", bold: Iterable[str] = (), tints: dict | None = None
) -> Row:
    return Row(
        {"model": entry.name, **cells},
        group=group,
        is_privileged=entry.run.model.is_privileged,
        bold=frozenset(bold),
        tints=tints or {},
    )


def _published(study: Study, table: str, cells_of: Callable[[dict[str, Any]], dict[str, Any]]) -> list[Row]:
    if study.published is None:
        return []
    return [_published_row(model, cells_of(row)) for model, row in study.published.rows(table)]


def _published_row(
    model: PublishedModel,
    cells: dict[str, Any],
    *,
    group: str = PUBLISHED,
    bold: Iterable[str] = (),
    tints: dict | None = None,
) -> Row:
    known = {"model": model.name, "activated": model.activated, **{k: v for k, v in cells.items() if k != "model"}}
    return Row(known, group=group, is_published=True, bold=frozenset(bold), tints=tints or {})


def _base_note(study: Study) -> tuple[str, ...]:
    aside = [entry.name for entry in study.entries if not entry.is_base]
    out = [entry.name for entry in study.base() if entry.is_excluded]
    notes = [NOTE] if study.published else []
    if aside:
        notes.append(f"Under another profile or prompt, so not here: {', '.join(aside)}.")
    if out:
        notes.append(f"In the extended panel by its exclusion rule: {', '.join(out)}.")
    return tuple(notes)


def _beats(always: float | None, actual: float | None) -> list[str]:
    return ["Always"] if always is not None and actual is not None and always > actual else []


def _tints(cells: dict[str, Any]) -> dict[str, str]:
    found = {}
    if (cells["P_rep_W0"] or 0.0) >= _FR_TINT_FROM:
        found["P_rep_W0"] = "FR"
    if (cells["P_norep_W1"] or 0.0) >= _NR_TINT_FROM:
        found["P_norep_W1"] = "NR"
    return found


def _intervention_row(study: Study, pair: Pair) -> Row:
    entry = next(entry for entry in study.entries if entry.name == pair.base.name)
    base, other, tests = pair_measures(pair)
    cells: dict[str, Any] = {"n": base.n, **tests}
    for event in ("too_far", "path_blocked", "retry"):
        cells |= {f"{event} base": base.means[event], f"{event} fb": other.means[event]}
    cells |= {f"d{name}": _shift(pair, name) for name in _TESTED}
    return _row(entry, cells)


def pair_measures(pair: Pair) -> tuple[Measures, Measures, dict[str, float | None]]:
    """Returns both runs' measures over the episodes that they share, with McNemar's p for W, B, FR and NR."""
    base, other = pair.tables()
    tests: dict[str, float | None] = {f"p_{name}": pair.p(name) for name in _TESTED}
    return measure(base), measure(other), tests


def _shift(pair: Pair, name: str) -> RateCell:
    found = mean_difference(pair, name)
    return None if found is None else points(*found)


def _largest_shift(pair: Pair) -> str | None:
    base, other = (by_family(rows) for rows in pair.tables())
    shifts = [
        (100 * ((other[family].share(name) or 0.0) - (base[family].share(name) or 0.0)), family, name)
        for family in base
        for name in ("W", "B")
    ]
    if not shifts:
        return None
    size, family, name = max(shifts, key=lambda shift: abs(shift[0]))
    return f"{family} {name} {printed(size, 'signed1')}" if size else "none"
