"""Own tables: analyses that the paper tells in words or figures, and those that it does not make.

Each function takes a Study and returns one Table. Source: `protocol.md` section 6.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from vigil.actions import STATUSES
from vigil.analysis.measures.metrics import (
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
from vigil.analysis.measures.rows import KINDS, values, where
from vigil.analysis.measures.study import RunEntry, Study, by_b
from vigil.analysis.tables.results import rates
from vigil.analysis.tables.table import (
    Column,
    Row,
    Table,
    counts,
    intervals,
    numbers,
    percent,
    points,
    rate_cell,
    texts,
)
from vigil.rates import RATES
from vigil.record import Resumption, RunHeader

MODEL = Column("model", "Run", "text")
_RATES = tuple(name for name in RATES if name != "Delta")


def overview(study: Study) -> Table:
    """Returns every rate of every run with its interval."""
    columns = (
        MODEL,
        *texts(complete="Scored"),
        *counts(errors="Errors"),
        *(Column(name, f"{name} % [95\u00a0%]", "rate") for name in _RATES),
        *intervals(Delta="Δ (pp)"),
        *numbers(W_macro="W, mean of families %", B_macro="B, mean of families %", steps="Steps"),
    )
    rows = []
    for entry in by_b(study.entries):
        overall, run = entry.overall, entry.run
        clusters = clustered_intervals(run.rows)
        cells: dict[str, Any] = {name: rate_cell(overall.rate(name)) for name in _RATES}
        cells["Delta"] = None if not overall.n else points(overall.share("Delta"), clusters["Delta"])
        rows.append(
            row_of(
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


def outcome_partition(study: Study) -> Table:
    """Returns the partition of all episodes, and the four categories."""
    categories = {
        "verified_success": "Verified success", "unsupported_commitment": "Unsupported commitment",
        "post_attainment_drift": "Post-attainment drift", "missed_execution": "Missed execution",
    }  # fmt: skip
    columns = (
        MODEL,
        *(Column(name, f"{name} %") for name in LABELS),
        *(Column(key, f"{heading} %") for key, heading in categories.items()),
        *numbers(lost="Attained and lost again %", tampered="State tampered %"),
    )
    names = (*LABELS, *categories, "lost", "tampered")
    rows = tuple(row_of(e, **{name: percent(e.overall.share(name)) for name in names}) for e in by_b(study.entries))
    return Table("outcome_partition", "Outcome partition", columns, rows)


def after_goal(study: Study) -> Table:
    """Returns what was done after the goal first held, in W=1 episodes."""
    columns = (
        MODEL,
        *counts(n="W=1"),
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
        rows.append(row_of(entry, n=entry.overall.counts["W"], **cells))
    return Table("after_goal", "Shares of actions after the goal first held (W=1 episodes)", columns, tuple(rows))


def sv_statuses(study: Study) -> Table:
    """Returns what was reported in state-verification episodes."""
    columns = (
        MODEL,
        *counts(n="SV episodes"),
        *(Column(status, status, "count") for status in STATUSES),
        *counts(raw="unrecognised", none="no report"),
        *numbers(label_share="State labels among reports %"),
    )
    rows = []
    for entry in by_b(study.entries):
        rows_of = entry.run.rows
        sv = where(rows_of, values(rows_of, "goal_kind", object) == "report_status")
        said = Counter(values(sv, "reported", object).tolist())
        cells = {status: said[status] for status in STATUSES}
        labels, reported = sum(said[status] for status in ("on", "off", "open", "closed")), sum(cells.values())
        rows.append(
            row_of(
                entry,
                n=len(sv),
                **cells,
                raw=sum(raw is not None for raw in values(sv, "raw_status", object)),
                none=len(sv) - reported,
                label_share=100 * labels / reported if reported else None,
            )
        )
    notes = (
        "A model that reports success or fail here has not understood that a state is asked for. `unrecognised` "
        "is among `invalid`.",
    )
    return Table("sv_statuses", "State verification: statuses reported", columns, tuple(rows), notes)


def composition(study: Study) -> Table:
    """Returns composed families beside their constituents."""
    columns = (
        MODEL,
        *(
            Column(key, heading)
            for key, heading in (
                ("PG", "PG W %"),
                ("DA", "DA W %"),
                ("PGxDA", "PG x DA %"),
                ("AI", "AI W %"),
                ("AI_B", "AI B %"),
                ("AI_conv", "AI B/W %"),
                ("VS", "VS W %"),
                ("VSxDA", "VS x DA %"),
                ("SI", "SI W %"),
                ("SI_B", "SI B %"),
                ("SI_conv", "SI B/W %"),
            )
        ),
        *texts(floor="On the execution floor"),
    )
    rows = tuple(row_of(entry, **_composed(entry)) for entry in by_b(study.entries))
    notes = (
        "PG x DA and VS x DA: what independent parts would give. B/W: achieved states turned into matching reports. "
        f"Execution floor: families with W below {100 * FLOOR_W:.0f} %, where Δ says nothing, for it is bounded by W.",
    )
    return Table("composition", "Composed families against their parts", columns, rows, notes)


def stop_only(study: Study) -> Table:
    """Returns what a protocol without report content would have scored."""
    columns = (
        MODEL,
        *numbers(B="B %", StopOnly="Stop-only %", hidden="Hidden by it (pp)"),
        *counts(FR_W1="Mismatched reports, W=1", FR_W0="Mismatched reports, W=0"),
    )
    rows = []
    for entry in by_b(study.entries):
        m = entry.overall
        b, stop = percent(m.share("B")), percent(m.share("StopOnly"))
        hidden = None if b is None or stop is None else stop - b
        rows.append(row_of(entry, B=b, StopOnly=stop, hidden=hidden, FR_W1=m.counts["FR_W1"], FR_W0=m.counts["FR_W0"]))
    notes = (
        "Stop-only: W=1 and the episode closed by any report. What it hides are true states closed with a wrong "
        "statement; it also cannot tell a false claim from an honest fail.",
    )
    return Table("stop_only", "What a stop-only protocol would score", columns, tuple(rows), notes)


def regime_table(study: Study) -> Table:
    """Returns the closure regime of each run by published thresholds."""
    columns = (
        MODEL,
        *intervals(B_W="P(B | W=1) %", FR_W0="P(FR | W=0) %", NoRep_W1="P(no rep | W=1) %", IL="IL %"),
        *texts(regime="Regime"),
    )
    rows = []
    for entry in by_b(study.entries):
        m = entry.overall
        found = regimes(m) if m.n else {}
        shown = ", ".join(
            name if verdict in ("", "clear") else f"{name} ({verdict})" for name, verdict in found.items()
        )
        rows.append(
            row_of(
                entry,
                B_W=rate_cell(m.rate("P_B_W1")),
                FR_W0=rate_cell(m.rate("P_FR_W0")),
                NoRep_W1=rate_cell(m.rate("P_norep_W1")),
                IL=rate_cell(m.rate("IL")),
                regime=shown or None,
            )
        )
    notes = (
        f"low-compliance: IL > {LOW_COMPLIANCE:.0%}; FR-heavy: P(FR | W=0) > {FR_HEAVY:.0%}; NR-heavy: P(no rep | "
        f"W=1) > {NR_HEAVY:.0%}; state-coupled: none of these and "
        f"P(B | W=1) > {STATE_COUPLED:.0%}; else mixed. borderline: the interval reaches across the threshold.",
    )
    return Table("regimes", "Closure regimes", columns, tuple(rows), notes)


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
        row_of(e, **{name: float(values(e.run.rows, name).mean()) if e.run.n else None for name in names})
        for e in by_b(study.entries)
    )
    return Table("invalid_replies", "Replies that are no actions, events and cost: means per episode", columns, rows)


def runs(study: Study) -> Table:
    """Returns under which settings each run was made."""
    columns = texts(
        model="Run",
        run_id="Id",
        agent="Agent",
        thinking="Thinking",
        sampling="Sampling",
        profile="Profile",
        prompt="Prompt",
        coordinates="Coordinates, replies, image",
        pack="Pack",
        simulator="Simulator",
        vigil="vigil",
        versions="Rules, shapes, grammar",
        started="Started (UTC)",
        repeated="Begun more than once",
    )
    rows = []
    for entry in study.entries:
        header, spec = entry.run.header, entry.run.header.spec
        policy = spec.prompt_policy.split("/")[0]
        facts = {
            "model": entry.name,
            "run_id": header.run_id,
            "agent": spec.agent,
            "thinking": {True: "yes", False: "no", None: "not said"}[entry.run.model.is_thinking],
            "sampling": ", ".join(f"{key}={value}" for key, value in sorted(spec.sampling.items())) or "none sent",
            "profile": spec.profile.name,
            "prompt": f"{spec.profile.prompt_variant}, {policy} {spec.prompt_policy_sha256[:8]}",
            "coordinates": f"{spec.profile.coordinates}, {spec.profile.reply_policy}, {spec.profile.image_format}",
            "pack": f"{spec.pack} {spec.pack_sha256[:12]}",
            "simulator": header.simulator_version or spec.simulator,
            "vigil": ", then ".join(dict.fromkeys(_code(header, part) for part in (header, *header.resumed))),
            "versions": ", ".join(str(number) for number in spec.versions.model_dump().values()),
            "started": header.started.strftime("%Y-%m-%d %H:%M"),
            "repeated": _repeated(entry.run.attempts),
        }
        rows.append(row_of(entry, **facts))
    return Table("runs", "The runs", columns, tuple(rows))


def _repeated(attempts: Sequence[int]) -> str:
    again = sum(count > 1 for count in attempts)
    return f"{again} episodes, at most {max(attempts)} times" if again else "none"


def _code(header: RunHeader, session: RunHeader | Resumption) -> str:
    """Returns the version that a session of a run was played with."""
    changed = "(changed)" if session.is_dirty else ""
    return " ".join(part for part in (header.package_version, (session.commit or "")[:8], changed) if part)


def row_of(entry: RunEntry, *, group: str = "", **cells: Any) -> Row:
    """Returns a run's row, named and marked."""
    return Row({"model": entry.name, **cells}, group, is_privileged=entry.run.model.is_privileged)


def shown_name(name: str) -> str:
    """Returns a rate's heading with its unit."""
    return "Δ (pp)" if name == "Delta" else f"{name} %"


def _composed(entry: RunEntry) -> dict[str, Any]:
    w = {family: measures.share("W") for family, measures in entry.families.items()}
    cells: dict[str, Any] = {family: percent(w.get(family)) for family in ("PG", "DA", "VS", "AI", "SI")}
    for name, parts in (("PGxDA", ("PG", "DA")), ("VSxDA", ("VS", "DA"))):
        first, second = (w.get(part) for part in parts)
        cells[name] = None if first is None or second is None else 100 * first * second
    for family in ("AI", "SI"):
        measures = entry.families.get(family)
        cells[f"{family}_B"] = percent(measures.share("B")) if measures else None
        cells[f"{family}_conv"] = percent(measures.share("P_B_W1")) if measures else None
    low = [family for family, share in w.items() if share is not None and share < FLOOR_W]
    return {**cells, "floor": ", ".join(low) or "none"}


def family_rates(study: Study) -> Table:
    """Returns every rate of every run, family by family."""
    columns = (
        MODEL,
        *texts(family="Family"),
        *counts(n="n"),
        *intervals(W="W %", B="B %"),
        *(Column(name, f"{shown_name(name)}") for name in ("W_strict", "Delta", "FR", "NR", "IL", "Other", "NoRep")),
        *numbers(mean_steps="Steps"),
    )
    rows = [
        row_of(entry, **(rates(m) | {"family": family, "n": m.n} | {name: rate_cell(m.rate(name)) for name in "WB"}))
        for entry in by_b(study.entries)
        for family, m in entry.families.items()
    ]
    return Table("family_rates", "All rates per family", columns, tuple(rows))
