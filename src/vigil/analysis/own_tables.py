"""Own tables: analyses that the paper tells in words or figures, and those that it does not make.

Each function takes a Study and returns one Table. Source: `protocol.md` section 6.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from vigil.actions import STATUSES
from vigil.analysis.intervals import Interval, holm, smallest_difference, smallest_paired_difference
from vigil.analysis.metrics import (
    COMPARABLE_W_PP,
    FLOOR_W,
    FR_HEAVY,
    LABELS,
    LOW_COMPLIANCE,
    NR_HEAVY,
    STATE_COUPLED,
    after_goal_shares,
    clustered_intervals,
    macro,
    regimes,
)
from vigil.analysis.pairs import Comparison
from vigil.analysis.result_tables import rates
from vigil.analysis.rows import KINDS
from vigil.analysis.study import Entry, Study, by_b
from vigil.analysis.table import Column, Row, Table, percent, rate_cell

MODEL = Column("model", "Run", "text")
Cell = tuple[float, float | None, float | None] | None
_RATES = ("W", "W_strict", "B", "FR", "NR", "IL", "Other", "NoRep", "Stop")


def overview(study: Study) -> Table:
    """Returns every rate of every run with its interval."""
    columns = (
        MODEL, Column("complete", "Scored", "text"), Column("errors", "Errors", "count"),
        *(Column(name, f"{name} % [95 %]", "rate") for name in _RATES),
        Column("Delta", "Δ (pp) [95 %]", "rate"), Column("W_macro", "W, mean of families"), Column("B_macro", "B, mean of families"),
        Column("steps", "Steps"),
    )  # fmt: skip
    rows = []
    for entry in by_b(study.entries):
        overall, run = entry.overall, entry.run
        clusters = clustered_intervals(run.rows)
        cells: dict[str, Any] = {name: rate_cell(overall.rate(name)) for name in _RATES}
        cells["Delta"] = None if not overall.n else _clustered(percent(overall.share("Delta")), clusters, "Delta")
        rows.append(
            _row(
                entry,
                complete=f"{run.n}/{max(run.n, run.n_planned)}",
                errors=len(run.errors),
                W_macro=percent(macro(entry.families, "W")),
                B_macro=percent(macro(entry.families, "B")),
                steps=overall.means["steps"],
                **cells,
            )
        )
    notes = ("Rates: Wilson intervals. Δ = W - B: bootstrap over houses (2,000 resamples; none below five houses).",)
    return Table("overview", "All rates, all episodes", columns, tuple(rows), notes)


def clustered(study: Study) -> Table:
    """Returns W, B and Delta with intervals that know that episodes share houses."""
    names = ("W", "B", "Delta")
    columns = (
        MODEL,
        Column("n", "n", "count"),
        Column("houses", "Houses", "count"),
        *(Column(name, f"{_shown(name)} [95 %]", "rate") for name in names),
    )
    rows = []
    for entry in by_b(study.entries):
        clusters = clustered_intervals(entry.run.rows)
        cells = {name: _clustered(percent(entry.overall.share(name)), clusters, name) for name in names}
        rows.append(_row(entry, n=entry.overall.n, houses=entry.run.rows["house"].nunique(), **cells))
    return Table("clustered", "W, B and Δ with intervals clustered by house", columns, tuple(rows))


def outcome_partition(study: Study) -> Table:
    """Returns the partition of all episodes, and the four categories."""
    categories = {
        "verified_success": "Verified success", "unsupported_commitment": "Unsupported commitment",
        "post_attainment_drift": "Post-attainment drift", "missed_execution": "Missed execution",
    }  # fmt: skip
    columns = (
        MODEL, *(Column(name, f"{name} %") for name in LABELS), *(Column(key, f"{heading} %") for key, heading in categories.items()),
        Column("lost", "Attained and lost again %"), Column("tampered", "State tampered %"),
    )  # fmt: skip
    names = (*LABELS, *categories, "lost", "tampered")
    rows = tuple(_row(e, **{name: percent(e.overall.share(name)) for name in names}) for e in by_b(study.entries))
    return Table("outcome_partition", "Outcome partition", columns, rows)


def after_goal(study: Study) -> Table:
    """Returns what was done after the goal first held, in W=1 episodes."""
    columns = (
        MODEL,
        Column("n", "W=1", "count"),
        *(
            Column(f"{kind}{how}", f"{kind} {shown}")
            for how, shown in (("", "% pooled"), (" mean", "% episode mean"))
            for kind in KINDS
        ),
    )
    rows = []
    for entry in by_b(study.entries):
        shares = after_goal_shares(entry.run.rows)
        cells = {
            f"{kind}{how}": None if pair is None else 100 * pair[i]
            for kind, pair in shares.items()
            for i, how in enumerate(("", " mean"))
        }
        rows.append(_row(entry, n=entry.overall.counts["W"], **cells))
    return Table("after_goal", "Shares of actions after the goal first held (W=1 episodes)", columns, tuple(rows))


def comparisons(study: Study) -> Table:
    """Returns paired tests between runs of the same episodes."""
    columns = (
        Column("first", "First", "text"), Column("second", "Second", "text"), Column("n", "Shared episodes", "count"),
        Column("dW", "ΔW (pp) [95 %]", "rate"), Column("p_W", "p (W)", "p"), Column("dB", "ΔB (pp) [95 %]", "rate"), Column("p_B", "p (B)", "p"),
        Column("p_B_holm", "p (B), Holm", "p"), Column("dDelta", "Change of the gap (pp) [95 %]", "rate"), Column("verdict", "Different?", "text"),
    )  # fmt: skip
    adjusted_w, adjusted_b = (holm([getattr(c, name).p for c in study.comparisons]) for name in ("w", "b"))
    rows = [
        _comparison_row(comparison, p_w, p_b)
        for comparison, p_w, p_b in zip(study.comparisons, adjusted_w, adjusted_b, strict=True)
    ]
    notes = (
        "Second minus first, over the episodes that both have scored. p: McNemar, exact; intervals: paired bootstrap over "
        "houses. Called different only where p stays below 0.05 after Holm's correction for the tests of this table.",
    )
    return Table("comparisons", "Runs against each other on the same episodes", columns, tuple(rows), notes)


def comparable_pairs(study: Study) -> Table:
    """Returns pairs of rows with alike W and different B, own and published apart."""
    columns = (
        Column("first", "Higher B", "text"),
        Column("second", "Lower B", "text"),
        Column("W", "W % of both", "text"),
        Column("dW", "|ΔW| (pp)"),
        Column("dB", "ΔB (pp)"),
    )
    own = [
        (e.name, percent(e.overall.share("W")) or 0.0, percent(e.overall.share("B")) or 0.0)
        for e in study.base()
        if e.overall.n
    ]
    rows = _alike(own, is_published=False)
    if study.published:
        anchors = [(model.name, w, b) for model, w, b in study.published.points() if model.anchor]
        rows += _alike(anchors, is_published=True)
    notes = (
        f"W within {COMPARABLE_W_PP:.0f} pp; the five widest differences of B. Whether an own pair differs is for the paired tests to say.",
    )
    return Table("comparable_pairs", "Alike in W, apart in B", columns, tuple(rows), notes)


def sv_statuses(study: Study) -> Table:
    """Returns what was reported in state-verification episodes."""
    columns = (
        MODEL,
        Column("n", "SV episodes", "count"),
        *(Column(status, status, "count") for status in STATUSES),
        Column("raw", "unrecognised", "count"),
        Column("none", "no report", "count"),
        Column("label_share", "State labels among reports %"),
    )
    rows = []
    for entry in by_b(study.entries):
        sv = entry.run.rows[entry.run.rows["expected"].notna()]
        said = sv["reported"].value_counts()
        labels = sum(int(said.get(status, 0)) for status in ("on", "off", "open", "closed"))
        reported = int(sv["is_reported"].sum())
        cells = {status: int(said.get(status, 0)) for status in STATUSES}
        rows.append(
            _row(
                entry,
                n=len(sv),
                **cells,
                raw=int(sv["raw_status"].notna().sum()),
                none=len(sv) - reported,
                label_share=100 * labels / reported if reported else None,
            )
        )
    notes = (
        "A model that reports success or fail here has not understood that a state is asked for. `unrecognised` is among `invalid`.",
    )
    return Table("sv_statuses", "State verification: statuses reported", columns, tuple(rows), notes)


def composition(study: Study) -> Table:
    """Returns composed families beside their constituents."""
    columns = (
        MODEL, *(Column(key, heading) for key, heading in (("PG", "PG W %"), ("DA", "DA W %"), ("PGxDA", "PG x DA %"), ("AI", "AI W %"), ("AI_B", "AI B %"), ("AI_conv", "AI B/W %"), ("VS", "VS W %"), ("VSxDA", "VS x DA %"), ("SI", "SI W %"), ("SI_B", "SI B %"), ("SI_conv", "SI B/W %"))),
        Column("floor", "On the execution floor", "text"),
    )  # fmt: skip
    rows = tuple(_row(entry, **_composed(entry)) for entry in by_b(study.entries))
    notes = (
        "PG x DA and VS x DA: what independent parts would give. B/W: achieved states turned into matching reports. "
        f"Execution floor: families with W below {100 * FLOOR_W:.0f} %, where Δ says nothing, for it is bounded by W.",
    )
    return Table("composition", "Composed families against their parts", columns, rows, notes)


def stop_only(study: Study) -> Table:
    """Returns what a protocol without report content would have scored."""
    columns = (
        MODEL,
        Column("B", "B %"),
        Column("StopOnly", "Stop-only %"),
        Column("hidden", "Hidden by it (pp)"),
        Column("FR_W1", "Mismatched reports, W=1", "count"),
        Column("FR_W0", "Mismatched reports, W=0", "count"),
    )
    rows = []
    for entry in by_b(study.entries):
        m = entry.overall
        b, stop = percent(m.share("B")), percent(m.share("StopOnly"))
        hidden = None if b is None or stop is None else stop - b
        rows.append(_row(entry, B=b, StopOnly=stop, hidden=hidden, FR_W1=m.counts["FR_W1"], FR_W0=m.counts["FR_W0"]))
    notes = (
        "Stop-only: W=1 and the episode closed by any report. What it hides are true states closed with a wrong statement; it also cannot tell a false claim from an honest fail.",
    )
    return Table("stop_only", "What a stop-only protocol would score", columns, tuple(rows), notes)


def regime_table(study: Study) -> Table:
    """Returns the closure regime of each run by published thresholds."""
    columns = (
        MODEL, Column("B_W", "P(B | W=1) % [95 %]", "rate"), Column("FR_W0", "P(FR | W=0) % [95 %]", "rate"), Column("NoRep_W1", "P(no rep | W=1) % [95 %]", "rate"),
        Column("IL", "IL % [95 %]", "rate"), Column("regime", "Regime", "text"),
    )  # fmt: skip
    rows = []
    for entry in by_b(study.entries):
        m = entry.overall
        found = regimes(m) if m.n else {}
        shown = ", ".join(
            name if verdict in ("", "clear") else f"{name} ({verdict})" for name, verdict in found.items()
        )
        rows.append(
            _row(
                entry,
                B_W=rate_cell(m.rate("B", "W")),
                FR_W0=rate_cell(m.rate("FR_W0", "W0")),
                NoRep_W1=rate_cell(m.rate("NoRep_W1", "W")),
                IL=rate_cell(m.rate("IL")),
                regime=shown or None,
            )
        )
    notes = (
        f"low-compliance: IL > {LOW_COMPLIANCE:.0%}; FR-heavy: P(FR | W=0) > {FR_HEAVY:.0%}; NR-heavy: P(no rep | W=1) > {NR_HEAVY:.0%}; state-coupled: none of these and "
        f"P(B | W=1) > {STATE_COUPLED:.0%}; else mixed. borderline: the interval reaches across the threshold.",
    )
    return Table("regimes", "Closure regimes", columns, tuple(rows), notes)


def power(study: Study) -> Table:
    """Returns the smallest differences that the runs' numbers of episodes can show."""
    columns = (
        MODEL,
        Column("n", "n", "count"),
        Column("W", "in W, two systems (pp)"),
        Column("B", "in B, two systems (pp)"),
        Column("B_paired", "in B, paired, 10 % discordant (pp)"),
        Column("family", "in W of one family (pp)"),
    )
    rows = []
    for entry in by_b(study.entries):
        m = entry.overall
        smallest = min((part.n for part in entry.families.values()), default=0)
        rows.append(
            _row(
                entry,
                n=m.n,
                W=percent(smallest_difference(m.n, _inside(m.share("W")))),
                B=percent(smallest_difference(m.n, _inside(m.share("B")))),
                B_paired=percent(smallest_paired_difference(m.n, 0.1)),
                family=percent(smallest_difference(smallest, 0.5)),
            )
        )
    notes = ("At the 5 % level with 80 % power. Smaller differences may be real; so many episodes cannot show them.",)
    return Table("power", "Smallest difference that can be shown", columns, tuple(rows), notes)


def invalid_replies(study: Study) -> Table:
    """Returns how replies failed to be actions, and what they cost."""
    names = (
        "protocol_failures",
        "malformed_actions",
        "truncated",
        "would_parse_leniently",
        "retry",
        "too_far",
        "path_blocked",
        "input_tokens",
        "output_tokens",
        "seconds",
    )
    columns = (
        MODEL,
        *(
            Column(name, name.replace("_", " "), "number2" if index < 7 else "number1")
            for index, name in enumerate(names)
        ),
    )
    rows = tuple(
        _row(e, **{name: float(e.run.rows[name].mean()) if e.run.n else None for name in names})
        for e in by_b(study.entries)
    )
    return Table("invalid_replies", "Replies that are no actions, events and cost: means per episode", columns, rows)


def runs(study: Study) -> Table:
    """Returns under which settings each run was made."""
    columns = tuple(Column(key, heading, "text") for key, heading in _RUN_FACTS.items())
    rows = []
    for entry in study.entries:
        header, spec = entry.run.header, entry.run.header.spec
        facts = {
            "model": entry.name,
            "run_id": header.run_id,
            "agent": spec.agent,
            "thinking": {True: "yes", False: "no", None: "not said"}[entry.run.model.is_thinking],
            "sampling": ", ".join(f"{key}={value}" for key, value in sorted(spec.sampling.items())) or "none sent",
            "profile": spec.profile.name,
            "prompt": f"{spec.profile.prompt_variant}, {spec.prompt_policy} {spec.prompt_policy_sha256[:8]}",
            "coordinates": f"{spec.profile.coordinates}, {spec.profile.reply_policy}, {spec.profile.image_format}",
            "pack": f"{spec.pack} {spec.pack_sha256[:12]}",
            "simulator": header.simulator_version or spec.simulator,
            "vigil": " ".join(
                [header.package_version, (header.commit or "")[:8], "(changed)" if header.is_dirty else ""]
            ).strip(),
            "started": header.started.strftime("%Y-%m-%d %H:%M"),
        }
        rows.append(_row(entry, **facts))
    return Table("runs", "The runs", columns, tuple(rows))


_RUN_FACTS = {
    "model": "Run", "run_id": "Id", "agent": "Agent", "thinking": "Thinking", "sampling": "Sampling", "profile": "Profile", "prompt": "Prompt",
    "coordinates": "Coordinates, replies, image", "pack": "Pack", "simulator": "Simulator", "vigil": "vigil", "started": "Started (UTC)",
}  # fmt: skip


def _row(entry: Entry, **cells: Any) -> Row:
    return Row({"model": entry.name, **cells}, is_privileged=entry.run.model.is_privileged)


def _shown(name: str) -> str:
    return "Δ (pp)" if name == "Delta" else f"{name} %"


def _clustered(value: float | None, clusters: dict[str, Interval | None], name: str) -> Cell:
    interval = clusters[name]
    return _points(None if value is None else value / 100, interval)


def _comparison_row(comparison: Comparison, p_w: float, p_b: float) -> Row:
    different = [name for name, p in (("W", p_w), ("B", p_b)) if p < 0.05]
    return Row(
        {
            "first": comparison.first.name,
            "second": comparison.second.name,
            "n": comparison.n,
            "dW": _points(comparison.w.difference, comparison.w_interval),
            "p_W": comparison.w.p,
            "dB": _points(comparison.b.difference, comparison.b_interval),
            "p_B": comparison.b.p,
            "p_B_holm": p_b,
            "dDelta": _points(*comparison.delta),
            "verdict": f"in {' and '.join(different)}" if different else "not shown",
        }
    )


def _points(value: float | None, interval: Interval | None) -> Cell:
    if value is None:
        return None
    return (100 * value, None, None) if interval is None else (100 * value, 100 * interval[0], 100 * interval[1])


def _alike(points: Sequence[tuple[str, float, float]], *, is_published: bool) -> list[Row]:
    found = []
    for first, second in combinations(points, 2):
        high, low = sorted((first, second), key=lambda point: -point[2])
        if abs(high[1] - low[1]) <= COMPARABLE_W_PP + 1e-9 and high[2] > low[2]:
            found.append((high[2] - low[2], high, low))
    found.sort(key=lambda pair: (-pair[0], pair[1][0]))
    group = "Published anchors" if is_published else ""
    return [
        Row({"first": high[0], "second": low[0], "W": f"{high[1]:.1f} and {low[1]:.1f}", "dW": abs(high[1] - low[1]), "dB": gap}, group, is_published)
        for gap, high, low in found[:5]
    ]  # fmt: skip


def _composed(entry: Entry) -> dict[str, Any]:
    w = {family: measures.share("W") for family, measures in entry.families.items()}
    cells: dict[str, Any] = {family: percent(w.get(family)) for family in ("PG", "DA", "VS", "AI", "SI")}
    for name, parts in (("PGxDA", ("PG", "DA")), ("VSxDA", ("VS", "DA"))):
        first, second = (w.get(part) for part in parts)
        cells[name] = None if first is None or second is None else 100 * first * second
    for family in ("AI", "SI"):
        measures = entry.families.get(family)
        cells[f"{family}_B"] = percent(measures.share("B")) if measures else None
        cells[f"{family}_conv"] = percent(measures.share("B", "W")) if measures else None
    low = [family for family, share in w.items() if share is not None and share < FLOOR_W]
    return {**cells, "floor": ", ".join(low) or "none"}


def _inside(rate: float | None) -> float:
    """Returns a rate kept off 0 and 1, where the normal approximation would show any difference."""
    return min(0.95, max(0.05, rate if rate is not None else 0.5))


def family_rates(study: Study) -> Table:
    """Returns every rate of every run, family by family."""
    columns = (
        MODEL,
        Column("family", "Family", "text"),
        Column("n", "n", "count"),
        Column("W", "W % [95 %]", "rate"),
        Column("B", "B % [95 %]", "rate"),
        *(Column(name, f"{_shown(name)}") for name in ("W_strict", "Delta", "FR", "NR", "IL", "Other", "NoRep")),
        Column("mean_steps", "Steps"),
    )
    rows = [
        _row(entry, **{**rates(m), "family": family, "n": m.n, "W": rate_cell(m.rate("W")), "B": rate_cell(m.rate("B"))})
        for entry in by_b(study.entries)
        for family, m in entry.families.items()
    ]  # fmt: skip
    return Table("family_rates", "All rates per family", columns, tuple(rows))
