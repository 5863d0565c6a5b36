"""Additional tables: analyses that the paper has only in its text or figures, and analyses that it does not have.

Each function takes a Study and returns one Table. Source: `protocol.md` section 6.
"""

import json
from collections import Counter
from collections.abc import Sequence
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
    measure,
    regimes,
)
from vigil.analysis.measures.rows import ACTION_KINDS, select_rows, values
from vigil.analysis.measures.strata import STRATA, by_stratum
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_role
from vigil.analysis.tables.rows import (
    MODEL,
    RUN,
    clustered_rates,
    precise_means,
    published_row,
    rates,
    role_row,
    run_means,
    run_row,
    run_rows,
    shown_name,
    tallies,
)
from vigil.analysis.tables.table import (
    Column,
    RateCell,
    Table,
    TableRow,
    cells_of,
    counts,
    intervals,
    numbers,
    pp_cell,
    rate_cell,
    rate_cells,
    texts,
    titled,
)
from vigil.protocol.actions import STATUSES
from vigil.protocol.goals import STATE_LABELS
from vigil.scoring.levels import LEVELS
from vigil.scoring.rates import RATES, rate_of
from vigil.scoring.summary import describe_invalid_replies

_STRATA_RATES = ("W", "B", "Delta", "FR", "NR", "IL", "Other")
_THINKING = {True: "yes", False: "no", None: "not said"}
_STATE_LABELS = tuple(label for pair in STATE_LABELS.values() for label in pair)


def overview(study: Study) -> Table:
    """Return every rate of every run with its interval."""
    columns = (
        RUN,
        *texts(complete=("Scored", lambda entry: f"{entry.run.n}/{max(entry.run.n, entry.run.n_planned)}")),
        *counts(errors=("Errors", lambda entry: len(entry.run.errors))),
        *tuple(
            column
            for name in RATES
            for column in (clustered_rates(name) if name == "Delta" else rates(**{name: shown_name(name)}))
        ),
        *intervals(W_macro=("W, mean of families %", lambda entry: _macro(entry, "W"))),
        *intervals(B_macro=("B, mean of families %", lambda entry: _macro(entry, "B"))),
        *run_means(mean_steps=("Steps", "steps")),
    )
    return titled("overview", columns, rows_by_b(study, columns))


def _macro(entry: RunEntry, name: str) -> RateCell:
    """Return the mean of a rate over the families, with its interval."""
    return pp_cell(macro(entry.families, name), macro_interval(entry.run.rows, name))


def outcome_partition(study: Study) -> Table:
    """Return the shares of the five labels among all episodes, and of the categories of outcomes, such as verified
    success."""
    categories = {
        "verified_success": "Verified success", "unsupported_commitment": "Unsupported commitment",
        "post_attainment_drift": "Post-attainment drift", "missed_execution": "Missed execution",
    }  # fmt: skip
    columns = (
        RUN,
        *rates(**{name: f"{name} %" for name in LABELS}),
        *rates(**{key: f"{heading} %" for key, heading in categories.items()}),
        *rates(lost="Attained and lost again %", tampered="State tampered %"),
    )
    return titled("outcome_partition", columns, rows_by_b(study, columns))


def after_goal(study: Study) -> Table:
    """Return the shares of the kinds of actions after the goal first held, in W=1 episodes."""
    averages = {"": "% pooled", " mean": "% episode mean"}
    columns = (
        RUN,
        *tallies(n=("W=1", "W")),
        *intervals(**{f"{kind}{how}": f"{kind} {shown}" for how, shown in averages.items() for kind in ACTION_KINDS}),
    )
    rows = []
    for entry in sorted_by_role(study.entries):
        shares, ends = after_goal_shares(entry.run.rows), after_goal_intervals(entry.run.rows)
        cells = {
            f"{kind}{how}": None if pair is None else pp_cell(pair[i], ends[kind][i])
            for kind, pair in shares.items()
            for i, how in enumerate(averages)
        }
        rows.append(role_row(entry, {**cells_of(columns, entry), **cells}))
    return titled("after_goal", columns, rows)


def sv_statuses(study: Study) -> Table:
    """Return the statuses that were reported in state-verification episodes."""
    columns = (
        RUN,
        *counts(n="SV episodes"),
        *counts(**{status: status for status in STATUSES}, raw="unrecognised", none="no report"),
        *intervals(label_share="State labels among reports %"),
    )
    rows = []
    for entry in sorted_by_role(study.entries):
        rows_of = entry.run.rows
        sv = select_rows(rows_of, values(rows_of, "goal_kind", object) == "report_status")
        reports = values(sv, "reported", object)
        said = Counter(reports.tolist())
        is_label, is_report = np.isin(reports, _STATE_LABELS), reports != None  # noqa: E711 - element by element
        cells = {
            "n": len(sv),
            **{status: said[status] for status in STATUSES},
            "raw": sum(raw is not None for raw in values(sv, "raw_status", object)),
            "none": len(sv) - sum(said[status] for status in STATUSES),
            "label_share": rate_cell(rate_of(is_label, is_report, values(sv, "episode_id", str))),
        }
        rows.append(role_row(entry, cells))
    return titled("sv_statuses", columns, rows)


def composition(study: Study) -> Table:
    """Return a table of rates of each compositional family, next to the rates of the diagnostic families whose skills
    it combines."""
    columns = (
        RUN,
        *intervals(PG="PG W %", DA="DA W %", PGxDA="PG x DA %"),
        *intervals(AI="AI W %", AI_B="AI B %", AI_conv="AI B/W %"),
        *intervals(VS="VS W %", VSxDA="VS x DA %"),
        *intervals(SI="SI W %", SI_B="SI B %", SI_conv="SI B/W %"),
        *texts(floor="On the execution floor"),
    )
    rows = [role_row(entry, _composed(entry)) for entry in sorted_by_role(study.entries)]
    return titled("composition", columns, rows, floor_w=100 * FLOOR_W)


def stop_only(study: Study) -> Table:
    """Return the scores under a protocol that notes only whether the agent reported, not what it reported."""
    columns = (
        RUN,
        *rates(B="B %", StopOnly="Stop-only %", hidden=("Hidden by it (pp)", "FR_W1")),
        *tallies(FR_W1="Mismatched reports, W=1", FR_W0="Mismatched reports, W=0"),
    )
    return titled("stop_only", columns, rows_by_b(study, columns))


def regime_table(study: Study) -> Table:
    """Return the closure regime of each run by published thresholds."""
    columns = (
        RUN,
        *rates(B_W=("P(B | W=1) %", "P_B_W1"), FR_W0=("P(FR | W=0) %", "P_FR_W0")),
        *rates(NoRep_W1=("P(no rep | W=1) %", "P_norep_W1"), IL="IL %"),
        *texts(regime=("Regime", _regimes_of)),
    )
    return titled(
        "regimes",
        columns,
        rows_by_b(study, columns),
        low_compliance=LOW_COMPLIANCE,
        fr_heavy=FR_HEAVY,
        nr_heavy=NR_HEAVY,
        state_coupled=STATE_COUPLED,
    )


def _regimes_of(entry: RunEntry) -> str | None:
    """Return the names of a run's regimes, with `borderline` where the interval contains the threshold."""
    found = regimes(entry.overall) if entry.overall.n else {}
    names = (name if sure in ("", "clear") else f"{name} ({sure})" for name, sure in found.items())
    return ", ".join(names) or None


def invalid_replies(study: Study) -> Table:
    """Return means per episode: invalid replies by kind, events (such as retries), tokens and seconds."""
    fine = ("protocol_failures", "malformed_actions", "truncated", "would_parse_leniently")
    fine += ("retry", "too_far", "path_blocked")
    columns = (
        RUN,
        *precise_means(**{name: name.replace("_", " ") for name in fine}),
        *run_means(input_tokens="input tokens", output_tokens="output tokens", seconds="seconds"),
    )
    said = ((entry.name, _no_actions(entry.run.rows)) for entry in sorted_by_role(study.entries))
    return titled(
        "invalid_replies", columns, rows_by_b(study, columns), *(f"{name}: {text}." for name, text in said if text)
    )


def _no_actions(rows: pd.DataFrame) -> str:
    return describe_invalid_replies(
        int(rows["steps"].to_numpy().sum()),
        map(json.loads, rows["invalid_reasons"]),
        int(rows["would_parse_leniently"].to_numpy().sum()),
    )


def runs(study: Study) -> Table:
    """Return a table of the settings of each run."""
    columns = (
        RUN,
        *texts(
            run_id=("Id", lambda entry: entry.run.header.run_id),
            agent=("Agent", lambda entry: entry.run.header.spec.agent),
            thinking=("Thinking", lambda entry: _THINKING[entry.run.model.is_thinking]),
            sampling=("Sampling", _sampling),
            profile=("Profile", lambda entry: entry.run.header.spec.profile.name),
            prompt=("Prompt", _prompt),
            coordinates=("Coordinates, replies, image", _coordinates),
            pack=("Pack", lambda entry: f"{entry.run.header.spec.pack} {entry.run.header.spec.pack_sha256[:12]}"),
            simulator=(
                "Simulator",
                lambda entry: entry.run.header.simulator_version or entry.run.header.spec.simulator,
            ),
            vigil=("vigil", _code),
            versions=("Rules, shapes, grammar", _versions),
            started=("Started (UTC)", lambda entry: entry.run.header.started.strftime("%Y-%m-%d %H:%M")),
            repeated=("Started more than once", _repeated),
        ),
    )
    return titled("runs", columns, run_rows(study.entries, columns))


def models(study: Study) -> Table:
    """Return the evaluated models: group, serving mode, and their name in the provider's API."""
    columns = (
        MODEL,
        *texts(
            kind=("Group", lambda entry: entry.group),
            thinking=("Thinking", lambda entry: _THINKING[entry.run.model.is_thinking]),
            activated=("Activated", lambda entry: entry.run.model.activated),
            panel=("Panel", lambda entry: entry.panel),
            api=("API identifier", lambda entry: entry.run.header.spec.agent),
            answered=("Answered as", lambda entry: ", ".join(entry.run.header.answering_models)),
        ),
    )
    rows = run_rows(study.entries, columns)
    for model in study.published.models if study.published else ():
        cells = {"kind": model.group, "thinking": _THINKING[model.thinking], "panel": model.panel.replace("_", " ")}
        rows.append(published_row(model, {**cells, "api": model.api_identifier}))
    return titled("models", columns, rows)


def _sampling(entry: RunEntry) -> str:
    sampling = sorted(entry.run.header.spec.sampling.items())
    return ", ".join(f"{key}={value}" for key, value in sampling) or "none sent"


def _prompt(entry: RunEntry) -> str:
    spec = entry.run.header.spec
    policy, profile = spec.prompt_policy.split("/")[0], spec.profile
    return f"{profile.prompt_variant}, {policy} {spec.prompt_policy_sha256[:8]}, as {profile.system_role}"


def _coordinates(entry: RunEntry) -> str:
    profile = entry.run.header.spec.profile
    return f"{profile.coordinates}, {profile.reply_policy}, {profile.image_format}"


def _code(entry: RunEntry) -> str:
    """Return the versions of VIGIL's code with which the sessions of a run were played."""
    header = entry.run.header
    versions = []
    for session in (header, *header.resumed):
        changed = "(changed)" if session.is_dirty else ""
        parts = (header.package_version, (session.commit or "")[:8], changed)
        versions.append(" ".join(part for part in parts if part))
    return ", then ".join(dict.fromkeys(versions))


def _versions(entry: RunEntry) -> str:
    return ", ".join(str(number) for number in entry.run.header.spec.versions.model_dump().values())


def _repeated(entry: RunEntry) -> str:
    attempts = entry.run.attempts
    again = sum(count > 1 for count in attempts)
    return f"{again} episodes, at most {max(attempts)} times" if again else "none"


def rows_by_b(study: Study, columns: Sequence[Column]) -> tuple[TableRow, ...]:
    """Return one row for each run, best B first."""
    return tuple(role_row(entry, cells_of(columns, entry)) for entry in sorted_by_role(study.entries))


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
    """Return a table of every rate, for every run and family."""
    columns = (
        RUN,
        *texts(family="Family"),
        *counts(n=("n", lambda part: part.overall.n)),
        *rates(**{name: shown_name(name) for name in RATES}),
        *run_means(mean_steps=("Steps", "steps")),
    )
    rows = []
    for entry in sorted_by_role(study.entries):
        found = {"all": entry, **dict(entry.family_parts())}
        rows += [role_row(part, {"family": name, **cells_of(columns, part)}) for name, part in found.items()]
    return titled("family_rates", columns, rows)


def strata(study: Study) -> Table:
    """Return the rates of every run by stratum."""
    headings = {name: shown_name(name) for name in _STRATA_RATES}
    columns = (RUN, *texts(stratum="Stratum"), *counts(n="n"), *intervals(**headings))
    parts = [(entry, by_stratum(entry.run.rows)) for entry in sorted_by_role(study.entries)]
    rows = [
        run_row(entry, {"stratum": part.name, "n": part.counts.n, **rate_cells(part.counts, _STRATA_RATES)}, division)
        for division in STRATA
        for entry, strata in parts
        for part in strata[division]
    ]
    return titled("strata", columns, rows)


def levels(study: Study) -> Table:
    """Return W, B and Delta of every run by level; the table has no rows if the pack's levels were not measured."""
    columns = (
        RUN,
        *texts(level="Level"),
        *counts(n=("n", lambda part: part.overall.n), houses=("Houses", lambda part: part.run.rows["house"].nunique())),
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
    return titled("levels", columns, rows)
