"""Additional tables: analyses that the paper presents in text or figures only, and analyses that it does not have.

Each function takes a Study and returns one Table. Source: `protocol.md` section 6.
"""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from vigil.analysis.measures.metrics import (
    FLOOR_W,
    FR_HEAVY,
    LABELS,
    LOW_COMPLIANCE,
    NR_HEAVY,
    STATE_COUPLED,
    after_goal_intervals,
    after_goal_shares,
    macro,
    macro_interval,
    mean_with_interval,
    regimes,
)
from vigil.analysis.measures.rows import ACTION_KINDS, select_rows, values
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_b
from vigil.analysis.tables.results import all_rates, published_row
from vigil.analysis.tables.table import (
    Column,
    Table,
    TableRow,
    counts,
    intervals,
    points,
    rate_cell,
    rate_cells,
    texts,
)
from vigil.protocol.actions import STATUSES
from vigil.protocol.goals import STATE_LABELS
from vigil.records.record import Resumption, RunHeader
from vigil.scoring.rates import RATES, rate_of
from vigil.scoring.summary import describe_invalid_replies

MODEL = Column("model", "Run", "text")
WILSON_NOTE = "Intervals: Wilson."
HOUSES_NOTE = "Intervals: bootstrap over houses; not given below five houses, or if all agree."
_STATE_LABELS = tuple(label for pair in STATE_LABELS.values() for label in pair)


def overview(study: Study) -> Table:
    """Return every rate of every run with its interval."""
    columns = (
        MODEL,
        *texts(complete="Scored"),
        *counts(errors="Errors"),
        *intervals(**{name: shown_name(name) for name in RATES}),
        *intervals(W_macro="W, mean of families %", B_macro="B, mean of families %", mean_steps="Steps"),
    )
    rows = []
    for entry in sorted_by_b(study.entries):
        run = entry.run
        rows.append(
            row_of(
                entry,
                complete=f"{run.n}/{max(run.n, run.n_planned)}",
                errors=len(run.errors),
                **{
                    f"{name}_macro": points(macro(entry.families, name), macro_interval(entry.families, name))
                    for name in "WB"
                },
                **all_rates(entry),
            )
        )
    notes = (
        "Rates: Wilson intervals. Δ = W - B and steps: bootstrap over houses (2,000 resamples; not given "
        "below five houses, or if all agree). Means of families: the families' Wilson intervals combined (MOVER).",
    )
    return Table("overview", "All rates, all episodes", columns, tuple(rows), notes)


def outcome_partition(study: Study) -> Table:
    """Return the partition of all episodes, and the four categories."""
    categories = {
        "verified_success": "Verified success", "unsupported_commitment": "Unsupported commitment",
        "post_attainment_drift": "Post-attainment drift", "missed_execution": "Missed execution",
    }  # fmt: skip
    columns = (
        MODEL,
        *intervals(**{name: f"{name} %" for name in LABELS}),
        *intervals(**{key: f"{heading} %" for key, heading in categories.items()}),
        *intervals(lost="Attained and lost again %", tampered="State tampered %"),
    )
    names = (*LABELS, *categories, "lost", "tampered")
    rows = _row_a_run(study, lambda entry: rate_cells(entry.overall, names))
    return Table("outcome_partition", "Outcome partition", columns, rows, (WILSON_NOTE,))


def after_goal(study: Study) -> Table:
    """Return the actions after the goal first held, in W=1 episodes."""
    columns = (
        MODEL,
        *counts(n="W=1"),
        *intervals(
            **{
                f"{kind}{how}": f"{kind} {shown}"
                for how, shown in (("", "% pooled"), (" mean", "% episode mean"))
                for kind in ACTION_KINDS
            }
        ),
    )
    rows = []
    for entry in sorted_by_b(study.entries):
        shares, ends = after_goal_shares(entry.run.rows), after_goal_intervals(entry.run.rows)
        cells = {
            f"{kind}{how}": None if pair is None else points(pair[i], ends[kind][i])
            for kind, pair in shares.items()
            for i, how in enumerate(("", " mean"))
        }
        rows.append(row_of(entry, n=entry.overall.counts["W"], **cells))
    title = "Shares of actions after the goal first held (W=1 episodes)"
    return Table("after_goal", title, columns, tuple(rows), (HOUSES_NOTE,))


def sv_statuses(study: Study) -> Table:
    """Return the statuses that were reported in state-verification episodes."""
    columns = (
        MODEL,
        *counts(n="SV episodes"),
        *(Column(status, status, "count") for status in STATUSES),
        *counts(raw="unrecognised", none="no report"),
        *intervals(label_share="State labels among reports %"),
    )
    rows = []
    for entry in sorted_by_b(study.entries):
        rows_of = entry.run.rows
        sv = select_rows(rows_of, values(rows_of, "goal_kind", object) == "report_status")
        said = Counter(values(sv, "reported", object).tolist())
        cells = {status: said[status] for status in STATUSES}
        reports = values(sv, "reported", object)
        is_label, is_report = np.isin(reports, _STATE_LABELS), reports != None  # noqa: E711 - element by element
        labels = rate_of(is_label, is_report, values(sv, "episode_id", str))
        rows.append(
            row_of(
                entry,
                n=len(sv),
                **cells,
                raw=sum(raw is not None for raw in values(sv, "raw_status", object)),
                none=len(sv) - sum(cells.values()),
                label_share=rate_cell(labels),
            )
        )
    notes = (
        "A model that reports success or fail here has not understood that the task asks for a state. `unrecognised` "
        "is among `invalid`.",
    )
    return Table("sv_statuses", "State verification: statuses reported", columns, tuple(rows), notes)


def composition(study: Study) -> Table:
    """Return composed families compared with their constituents."""
    columns = (
        MODEL,
        *intervals(
            PG="PG W %",
            DA="DA W %",
            PGxDA="PG x DA %",
            AI="AI W %",
            AI_B="AI B %",
            AI_conv="AI B/W %",
            VS="VS W %",
            VSxDA="VS x DA %",
            SI="SI W %",
            SI_B="SI B %",
            SI_conv="SI B/W %",
        ),
        *texts(floor="On the execution floor"),
    )
    rows = _row_a_run(study, _composed)
    notes = (
        "PG x DA and VS x DA: the product of the parts, if they were independent; the ends of their intervals are "
        "multiplied too, which makes them wide. B/W: share of achieved states that a matching report closed. "
        f"Execution floor: families with W below {100 * FLOOR_W:.0f} %, where Δ says nothing, because it is bounded "
        "by W.",
    )
    return Table("composition", "Compositional families and their parts", columns, rows, notes)


def stop_only(study: Study) -> Table:
    """Return the scores under a protocol that ignores the content of reports."""
    columns = (
        MODEL,
        *intervals(B="B %", StopOnly="Stop-only %", hidden="Hidden by it (pp)"),
        *counts(FR_W1="Mismatched reports, W=1", FR_W0="Mismatched reports, W=0"),
    )

    def cells(entry: RunEntry) -> dict[str, Any]:
        m = entry.overall
        mismatched = {name: m.counts[name] for name in ("FR_W1", "FR_W0")}
        return {**rate_cells(m, ("B", "StopOnly")), "hidden": rate_cell(m.rate("FR_W1")), **mismatched}

    notes = (
        "Stop-only: W=1 and the episode closed by any report. It hides achieved states that were closed with a "
        "wrong report, and it cannot distinguish a false claim from an honest fail.",
    )
    return Table("stop_only", "What a stop-only protocol would score", columns, _row_a_run(study, cells), notes)


def regime_table(study: Study) -> Table:
    """Return the closure regime of each run by published thresholds."""
    columns = (
        MODEL,
        *intervals(B_W="P(B | W=1) %", FR_W0="P(FR | W=0) %", NoRep_W1="P(no rep | W=1) %", IL="IL %"),
        *texts(regime="Regime"),
    )

    def cells(entry: RunEntry) -> dict[str, Any]:
        m = entry.overall
        found = regimes(m) if m.n else {}
        shown = ", ".join(
            name if verdict in ("", "clear") else f"{name} ({verdict})" for name, verdict in found.items()
        )
        return {
            "B_W": rate_cell(m.rate("P_B_W1")),
            "FR_W0": rate_cell(m.rate("P_FR_W0")),
            "NoRep_W1": rate_cell(m.rate("P_norep_W1")),
            "IL": rate_cell(m.rate("IL")),
            "regime": shown or None,
        }

    notes = (
        f"low-compliance: IL > {LOW_COMPLIANCE:.0%}; FR-heavy: P(FR | W=0) > {FR_HEAVY:.0%}; NR-heavy: P(no rep | "
        f"W=1) > {NR_HEAVY:.0%}; state-coupled: none of these and "
        f"P(B | W=1) > {STATE_COUPLED:.0%}; else mixed. borderline: the interval reaches across the threshold.",
    )
    return Table("regimes", "Closure regimes", columns, _row_a_run(study, cells), notes)


def invalid_replies(study: Study) -> Table:
    """Return the kinds of invalid replies and their effect."""
    fine = ("protocol_failures", "malformed_actions", "truncated", "would_parse_leniently")
    fine += ("retry", "too_far", "path_blocked")
    coarse = ("input_tokens", "output_tokens", "seconds")
    columns = (
        MODEL,
        *(Column(name, f"{name.replace('_', ' ')} [95\u00a0%]", "mean") for name in fine),
        *intervals(**{name: name.replace("_", " ") for name in coarse}),
    )
    rows = _row_a_run(
        study, lambda entry: {name: mean_with_interval(entry.run.rows, name) for name in (*fine, *coarse)}
    )
    title = "Replies that are not actions, events and cost: means per episode"
    said = ((entry.name, _no_actions(entry.run.rows)) for entry in sorted_by_b(study.entries))
    notes = (HOUSES_NOTE, *(f"{name}: {text}." for name, text in said if text))
    return Table("invalid_replies", title, columns, rows, notes)


def _no_actions(rows: pd.DataFrame) -> str:
    return describe_invalid_replies(
        int(rows["steps"].to_numpy().sum()),
        map(json.loads, rows["invalid_reasons"]),
        int(rows["would_parse_leniently"].to_numpy().sum()),
    )


def runs(study: Study) -> Table:
    """Return the settings of each run."""
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
        repeated="Started more than once",
    )
    rows = []
    for entry in study.entries:
        header, spec = entry.run.header, entry.run.header.spec
        policy, role = spec.prompt_policy.split("/")[0], spec.profile.system_role
        facts = {
            "model": entry.name,
            "run_id": header.run_id,
            "agent": spec.agent,
            "thinking": {True: "yes", False: "no", None: "not said"}[entry.run.model.is_thinking],
            "sampling": ", ".join(f"{key}={value}" for key, value in sorted(spec.sampling.items())) or "none sent",
            "profile": spec.profile.name,
            "prompt": f"{spec.profile.prompt_variant}, {policy} {spec.prompt_policy_sha256[:8]}, as {role}",
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


def models(study: Study) -> Table:
    """Return the evaluated models: group, serving mode, and name in their API."""
    columns = texts(
        model="Model",
        kind="Group",
        thinking="Thinking",
        activated="Activated",
        panel="Panel",
        api="API identifier",
        answered="Answered as",
    )
    thinking = {True: "yes", False: "no", None: "not said"}
    rows = []
    for entry in study.entries:
        info = entry.run.model
        panel = "aside" if not entry.is_base else "excluded" if entry.is_excluded else "main"
        header = entry.run.header
        cells = {"kind": info.group, "thinking": thinking[info.is_thinking], "activated": info.activated}
        cells["answered"] = ", ".join(header.answering_models)
        rows.append(row_of(entry, **cells, panel=panel, api=header.spec.agent))
    for model in study.published.models if study.published else ():
        cells = {"kind": model.group, "thinking": thinking[model.thinking], "panel": model.panel.replace("_", " ")}
        rows.append(published_row(model, {**cells, "api": model.api_identifier}))
    notes = (
        "Your runs: the requested name, with its provider, and the names in the answers. Published: the "
        "identifiers that the paper prints, for closed models only. Aside: under another profile or prompt. Thinking: "
        "whether reasoning came with the answers; if none did, as the name or the settings say.",
    )
    return Table("models", "Models and their API identifiers", columns, tuple(rows), notes)


def _repeated(attempts: Sequence[int]) -> str:
    again = sum(count > 1 for count in attempts)
    return f"{again} episodes, at most {max(attempts)} times" if again else "none"


def _code(header: RunHeader, session: RunHeader | Resumption) -> str:
    """Return the version of the code in a session of a run."""
    changed = "(changed)" if session.is_dirty else ""
    return " ".join(part for part in (header.package_version, (session.commit or "")[:8], changed) if part)


def row_of(entry: RunEntry, **cells: Any) -> TableRow:
    """Return a run's row: its name, the cells, and whether its agent is privileged."""
    return TableRow({"model": entry.name, **cells}, is_privileged=entry.run.model.is_privileged)


def _row_a_run(study: Study, cells: Callable[[RunEntry], dict[str, Any]]) -> tuple[TableRow, ...]:
    """Return one row for each run, best B first."""
    return tuple(row_of(entry, **cells(entry)) for entry in sorted_by_b(study.entries))


def shown_name(name: str) -> str:
    """Return a rate's heading with its unit."""
    return "Δ (pp)" if name == "Delta" else f"{name} %"


def _composed(entry: RunEntry) -> dict[str, Any]:
    families = entry.families
    cells: dict[str, Any] = {family: rate_cell(measures.rate("W")) for family, measures in families.items()}
    for name, parts in (("PGxDA", ("PG", "DA")), ("VSxDA", ("VS", "DA"))):
        first, second = (cells.get(part) for part in parts)
        if first and second:
            cells[name] = tuple(one * two / 100 for one, two in zip(first, second, strict=True))
    for family in ("AI", "SI"):
        if family in families:
            cells[f"{family}_B"] = rate_cell(families[family].rate("B"))
            cells[f"{family}_conv"] = rate_cell(families[family].rate("P_B_W1"))
    low = [family for family, measures in families.items() if (measures.share("W") or 0.0) < FLOOR_W]
    return {**cells, "floor": ", ".join(low) or "none"}


def family_rates(study: Study) -> Table:
    """Return every rate of every run, family by family."""
    columns = (
        MODEL,
        *texts(family="Family"),
        *counts(n="n"),
        *intervals(**{name: shown_name(name) for name in RATES}, mean_steps="Steps"),
    )
    rows = []
    for entry in sorted_by_b(study.entries):
        table = entry.run.rows
        parts = {
            family: (m, select_rows(table, table["family"].to_numpy() == family))
            for family, m in entry.families.items()
        }
        for family, (m, part) in {"all": (entry.overall, table), **parts}.items():
            cells = {**rate_cells(m, RATES), "mean_steps": mean_with_interval(part, "steps")}
            rows.append(row_of(entry, family=family, n=m.n, **cells))
    notes = (f"{WILSON_NOTE} Steps: bootstrap over houses, not given below five or if all agree.",)
    return Table("family_rates", "All rates per family", columns, tuple(rows), notes)
