"""Synthetic runs with the published counts: numbers that the paper prints are matched, the others are arbitrary."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from tests.support.builders import GOALS, RecordBuilder, episode, thing
from vigil.analysis.measures.paper import paper
from vigil.base.versions import PackVersions, Versions
from vigil.protocol.episode import Episode, HouseRef
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import (
    AgentNearTarget,
    Goal,
    ObjectAtReceptacle,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
)
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import policy_sha256, policy_version, rendered_sha256
from vigil.records.record import AgentKind, EpisodeRecord, RunHeader, RunSpec

PER_FAMILY = 125
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
FR = {
    "Gemini-3.1-Pro": 246,
    "Doubao-Seed-1.8": 372,
    "Qwen3.6-27B": 184,
    "Qwen3.5-27B": 255,
    "GPT-5.4": 540,
    "Claude-Sonnet-4": 699,
    "Qwen3-VL-32B (T)": 394,
    "MiMo-Embodied-7B": 228,
    "Qwen3-VL-32B": 258,
    "InternVL3.5-38B": 100,
}
"""False reports per thousand episodes: printed in the text or, for the last four, derived from the tables."""
NR = {"InternVL3.5-38B": 661, "Qwen3-VL-32B": 446, "MiMo-Embodied-7B": 431}
"""Episodes per thousand whose budget ended without a report, for models where the text prints them."""
UNSEEN = {"visible": False, "visible_px": 0, "open_px": 0, "toggle_px": 0, "nearest_visible_m": None}
PUBLISHED: tuple[Family, ...] = paper().families
"""The families of the paper, of which its numbers are."""


def reached(goal: Goal) -> dict[str, Any]:
    """Return the facts of the target when a family's sample goal is reached."""
    match goal:
        case AgentNearTarget():
            return {"box_distance_m": 1.0, "center_distance_m": 1.2}
        case ObjectInState(state="is_visible"):
            return {"visible": True, "visible_px": 500, "nearest_visible_m": 2.0}
        case ObjectInState():
            return {goal.state: True}
        case ObjectAtReceptacle():
            return {"parent": "table", "support_chain": ("table",)}
        case _:
            return {"is_held": True}


def can_advance(family: Family) -> bool:
    """Whether the sample goal of a family can be partly reached."""
    goal = GOALS[family]
    return not isinstance(goal, TargetGrounded | ReportStatus) and getattr(goal, "state", "") != "is_visible"


@dataclass(frozen=True)
class EpisodeScript:
    """Script of one episode; `end` is a status, NR or IL."""

    family: Family
    w: bool
    end: str
    wait: int = 0
    """Number of idle steps between attainment and the end, as far as the budget allows."""
    advanced: bool = False
    """Whether some progress was made although W does not hold."""


@cache
def record_of(script: EpisodeScript) -> EpisodeRecord:
    """Return the record of a script, for an episode with the id `@`."""
    builder, spec = _start_record(script), FAMILIES[script.family]
    closing = spec.max_invalid + 1 if script.end == "IL" else 1
    for _ in range(min(script.wait, spec.max_steps - closing - len(builder.steps))):
        builder.do()
    if script.end == "IL":
        for _ in range(closing):
            builder.invalid()
        record = builder.end("invalid_action_limit_exceeded")
    elif script.end == "NR":
        while len(builder.steps) < spec.max_steps:
            builder.do()
        record = builder.end()
    else:
        record = builder.report(script.end)
    return record.model_copy(update={"episode_id": "@"})


def _start_record(script: EpisodeScript) -> RecordBuilder:
    family = script.family
    goal = GOALS[family]
    if isinstance(goal, ReportStatus):
        return RecordBuilder(target=thing(is_toggled=True, **({} if script.w else UNSEEN)))
    if isinstance(goal, TargetGrounded):
        builder = RecordBuilder(target=thing())
        return builder.ground("target") if script.w else builder.do()
    is_search = getattr(goal, "state", "") == "is_visible"
    builder = RecordBuilder(
        target=thing(is_toggled=False, **(UNSEEN if is_search else {})),
        **{name: thing() for name in goal.ids() if name != "target"},
    )
    if goal.constraint is not None and script.w:
        builder.do(obstacle={"is_held": True})
    if script.w:
        return builder.do(target=reached(goal))
    if script.advanced:
        return builder.do(target={"is_held": True} if goal.chain else {"box_distance_m": 2.5})
    return builder.do()


@dataclass(frozen=True)
class Counts:
    """The paper's numbers of one anchor model, as counts of a thousand episodes."""

    w: dict[Family, int]
    b: dict[Family, int]
    reports_w0: int
    no_reports_w1: int
    false_reports: int
    false_successes: int
    at_zero: int
    lags: int
    """Sum of closure lags over episodes with B=1."""
    no_budget_left: int
    """Number of episodes with NR, among all without a report."""


def counts_of(model: str) -> Counts:
    """Return the counts of one of the ten anchor models."""
    tables = paper().tables
    row, lag, cond = (
        next(row for row in tables[name] if row["model"] == model)
        for name in ("global_cross_section", "belief_lag", "conditional_report")
    )
    w = {family: round(pair[0] * PER_FAMILY / 100) for family, pair in row["families"].items()}
    b = {family: round(pair[1] * PER_FAMILY / 100) for family, pair in row["families"].items()}
    stops = round(10 * cond["Stop"])
    return Counts(
        w=w,
        b=b,
        reports_w0=stops - (sum(w.values()) - lag["NR_W1"]),
        no_reports_w1=lag["NR_W1"],
        false_reports=FR[model],
        false_successes=lag["FS"],
        at_zero=round(lag["zero_progress_pct"] * lag["FS"] / 100),
        lags=round(lag["lag"] * sum(b.values())),
        no_budget_left=NR[model] if model in NR else 1000 - stops,
    )


def scripts_of(counts: Counts) -> dict[Family, list[EpisodeScript]]:
    """Return 125 scripts per family that match the counts."""
    waits = _waits(counts)
    no_reports = _no_reports(counts)
    missed = counts.no_reports_w1
    mismatched_w0 = counts.false_reports - (sum(counts.w.values()) - sum(counts.b.values()) - missed)
    reports = _reports_w0(counts, mismatched_w0)
    scripts: dict[Family, list[EpisodeScript]] = {}
    for family in PUBLISHED:
        matching, wrong = ("on", "off") if family == "SV" else ("success", "fail")
        scripts[family] = [EpisodeScript(family, True, matching, next(waits)) for _ in range(counts.b[family])]
        for _ in range(counts.w[family] - counts.b[family]):
            scripts[family].append(EpisodeScript(family, True, next(no_reports) if missed > 0 else wrong))
            missed -= 1
    for family in PUBLISHED:
        for status, advanced in reports[family]:
            scripts[family].append(EpisodeScript(family, False, status, advanced=advanced))
        rest = PER_FAMILY - len(scripts[family])
        scripts[family] += [EpisodeScript(family, False, next(no_reports)) for _ in range(rest)]
    return scripts


def _waits(counts: Counts) -> Iterator[int]:
    """Yield the idle steps of each B=1 episode, in the families' order, so that the lags add up to the printed sum."""
    closed = sum(counts.b.values())
    extra = counts.lags - (closed - counts.b["SV"])
    for index in range(closed):
        yield extra // closed + (index < extra % closed)


def _no_reports(counts: Counts) -> Iterator[str]:
    yield from ["NR"] * counts.no_budget_left
    while True:
        yield "IL"


def _reports_w0(counts: Counts, mismatched: int) -> dict[Family, list[tuple[str, bool]]]:
    """Return the reports of episodes with W=0: false successes, other mismatches, then honest failures."""
    wanted = [("success", True)] * (counts.false_successes - counts.at_zero)
    wanted += [("success", False)] * counts.at_zero
    wanted += [("open", False)] * (mismatched - counts.false_successes)
    wanted += [("fail", False)] * (counts.reports_w0 - mismatched)
    room = {family: PER_FAMILY - counts.w[family] for family in PUBLISHED if family != "SV"}
    found: dict[Family, list[tuple[str, bool]]] = {family: [] for family in PUBLISHED}
    for status, advanced in wanted:
        family = next(f for f in room if len(found[f]) < room[f] and (can_advance(f) or not advanced))
        found[family].append((status, advanced))
    return found


def make_episodes(per_family: int = PER_FAMILY) -> list[Episode]:
    """Return episodes of each published family over forty houses, by id."""
    found = [
        episode(family, id=f"{family}-{number:03}", house=HouseRef(name=f"house_{number % 40}", sha256="0" * 64))
        for family in PUBLISHED
        for number in range(per_family)
    ]
    return sorted(found, key=lambda one: one.id)


def write_pack(folder: Path, episodes: list[Episode], houses: Mapping[str, bytes] | None = None) -> str:
    """Write the parts of a pack that readers of runs need, and return its hash."""
    lines = b"".join(one.model_dump_json().encode() + b"\n" for one in episodes)
    families = {family: sum(one.family == family for one in episodes) for family in PUBLISHED}
    manifest = {
        "name": "synthetic",
        "episodes": len(episodes),
        "houses": 40,
        "families": {family: count for family, count in families.items() if count},
        "files": {
            "episodes.jsonl": hashlib.sha256(lines).hexdigest(),
            "solutions.jsonl": "0" * 64,
            **{f"houses/{name}.json": hashlib.sha256(data).hexdigest() for name, data in (houses or {}).items()},
        },
    }
    raw = json.dumps(manifest).encode()
    (folder / "houses").mkdir(parents=True, exist_ok=True)
    for name, data in (houses or {}).items():
        (folder / f"houses/{name}.json").write_bytes(data)
    (folder / "manifest.json").write_bytes(raw)
    (folder / "episodes.jsonl").write_bytes(lines)
    return hashlib.sha256(raw).hexdigest()


def write_run(
    folder: Path,
    pack: Path,
    agent: str,
    records: dict[str, EpisodeRecord],
    *,
    profile: Profile | None = None,
    thinking: bool = False,
    kind: AgentKind = "model",
    planned: list[str] | None = None,
    **spec: Any,
) -> Path:
    """Write a run with these `records` by episode id, and return its folder."""
    profile = profile or Profile()
    header = RunHeader(
        run_id=folder.name,
        nonce=hashlib.sha256(folder.name.encode()).hexdigest()[:32],
        spec=RunSpec(
            agent=agent,
            agent_kind=kind,
            profile=profile,
            versions=Versions.current(),
            pack_versions=PackVersions.current(),
            prompt_policy=policy_version(profile),
            prompt_policy_sha256=policy_sha256(profile),
            pack="synthetic",
            pack_sha256=hashlib.sha256((pack / "manifest.json").read_bytes()).hexdigest(),
            episode_ids=tuple(sorted(planned or records)),
            **{"sampling": THINKING if thinking else {}, **spec},
        ),
        package_version="0",
        simulator_version="none",
        started=NOON,
        host={"pack_folder": str(pack)},
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "run.json").write_text(header.model_dump_json(indent=1), encoding="utf-8")
    prompt = rendered_sha256(episode("AI").instruction, profile)
    with (folder / "episodes.jsonl").open("wb") as file:
        for episode_id, record in records.items():
            line = _line(record).replace(b'"run_id":"run"', b'"run_id":"%b"' % folder.name.encode(), 1)
            line = line.replace(b'"run_sha256":""', b'"run_sha256":"%b"' % header.sha256.encode(), 1)
            line = line.replace(b'"prompt_sha256":""', b'"prompt_sha256":"%b"' % prompt.encode(), 1)
            file.write(line.replace(b'"episode_id":"@"', b'"episode_id":"%b"' % episode_id.encode(), 1))
    return folder


_lines: dict[int, tuple[EpisodeRecord, bytes]] = {}


def _line(record: EpisodeRecord) -> bytes:
    """Return a record's line; equal objects are serialised once."""
    if id(record) not in _lines:
        _lines[id(record)] = (record, record.model_dump_json().encode() + b"\n")
    return _lines[id(record)][1]


def records_of(scripts: dict[Family, list[EpisodeScript]]) -> dict[str, EpisodeRecord]:
    """Return the records of scripts, by the ids of `make_episodes`."""
    return {
        f"{family}-{number:03}": record_of(script)
        for family, row in scripts.items()
        for number, script in enumerate(row)
    }


SMALL = 2
"""Number of episodes per family in a small pack."""
Write = Callable[..., Path]
"""Type of the fixture `write`, which writes a run on the small pack."""


def good(family: Family) -> EpisodeScript:
    """Return the script of an episode whose goal is reached and correctly reported."""
    return EpisodeScript(family, True, "on" if family == "SV" else "success")


def small_records(script_of: Callable[[Family], EpisodeScript] = good) -> dict[str, EpisodeRecord]:
    """Return records of the small pack, with one script per family."""
    return {f"{family}-{number:03}": record_of(script_of(family)) for family in PUBLISHED for number in range(SMALL)}


THINKING = {"extra_body": {"chat_template_kwargs": {"enable_thinking": True}}}
PROVIDERS = {
    "Gemini-3.1-Pro": "google",
    "Doubao-Seed-1.8": "volcano",
    "GPT-5.4": "openai",
    "Claude-Sonnet-4": "anthropic",
}


def write_anchor(folder: Path, pack: Path, model: str, **facts: Any) -> Path:
    """Write a run with the published counts of an anchor model."""
    name = model.removesuffix(" (T)")
    agent = f"{PROVIDERS.get(name, 'vllm')}/{name}"
    return write_run(folder, pack, agent, records_of(scripts_of(counts_of(model))), thinking=name != model, **facts)
