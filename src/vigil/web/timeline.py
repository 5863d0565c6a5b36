"""Timeline and frames: the data with which the viewer shows one recorded episode, with hidden state kept separate.

A model's output is given as plain strings; templates must escape it. Frames come from saved files or are drawn again.
Each frame is compared with the recorded hash.
"""

import json
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

from vigil.agents.frame_encoding import decode_frame
from vigil.base.numbered_list import read_list
from vigil.errors import RecordError, SettingError, VigilError
from vigil.protocol.actions import InteractPixel, PhysicalAction, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import Chores
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.protocol.world import WorldState
from vigil.records.probe_file import read_probes
from vigil.records.reasoning_file import reasoning_by_step
from vigil.records.record import EpisodeRecord, Key, StepRecord
from vigil.runner.workers.frames import frame_sha256
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings
from vigil.scoring.goal_check import GoalRow, check, check_chore, label_at_reset
from vigil.scoring.goal_words import describe_goal
from vigil.scoring.outcomes import Outcome
from vigil.web.drawing import RenderService
from vigil.web.library import LibraryPack, LibraryRun
from vigil.web.phrases import CATEGORIES, action_words, click_of, effect_words, verdict_words

Origin = Literal["saved", "redrawn"]
ORIGINS: dict[Origin, str] = {
    "saved": "As saved with the run",
    "redrawn": "Drawn again from the recorded actions",
}


def timeline_of(episode: Episode, record: EpisodeRecord, profile: Profile, outcome: Outcome | None) -> dict[str, Any]:
    """Return the viewer's data as JSON values. The parts named `hidden` are shown only if the user asks for them."""
    rows: tuple[GoalRow, ...] = ()
    with suppress(RecordError):
        rows = () if record.initial is None else check(episode.goal, record).rows
    return {
        "episode": episode.id,
        "epoch": record.epoch,
        "attempt": record.attempt,
        "family": episode.family,
        "family_name": FAMILIES[episode.family].name,
        "instruction": episode.instruction,
        "steps": [_step(step, profile, rows) for step in record.steps],
        "end": record.end,
        "error": None if record.error is None else {"at": record.error.boundary, "message": record.error.message},
        "hidden": _hidden(episode, record, rows, outcome),
    }


def _step(step: StepRecord, profile: Profile, rows: tuple[GoalRow, ...]) -> dict[str, Any]:
    parsed = read_reply(step.reply, profile).parsed
    action, reply = step.action, step.reply
    return {
        "index": step.index,
        "action": action_words(action, step.invalid),
        "skill": action.skill_name if action else "invalid",
        "intent": action.intent if isinstance(action, InteractPixel) else None,
        "click": click_of(action),
        "summary": getattr(action, "summary", None),
        "invalid": None if step.invalid is None else step.invalid.model_dump(),
        "thought": _text(getattr(parsed, "thought", None)),
        "cognitive_state": _text(getattr(parsed, "cognitive_state", None)),
        "reply": reply.text,
        "finish_reason": reply.finish_reason,
        "reasoning_chars": reply.reasoning_chars,
        "tokens": None if reply.usage is None else [reply.usage.input_tokens, reply.usage.output_tokens],
        "seconds": reply.seconds,
        "hidden": {"effect": effect_words(step.effect)},
    }


def _hidden(
    episode: Episode, record: EpisodeRecord, rows: tuple[GoalRow, ...], outcome: Outcome | None
) -> dict[str, Any]:
    first = next((index for index, row in enumerate(rows) if row.semantic), None)
    worlds = record.worlds if record.initial is not None else ()
    return {
        "goal": describe_goal(episode.goal),
        "bindings": dict(sorted(episode.bindings.items())),
        "max_steps": episode.max_steps,
        "max_invalid": episode.max_invalid,
        "first_row": first,
        "worlds": [_world(world, episode) for world in worlds],
        "rows": [{"W": row.semantic, "strict": row.strict, "progress": row.progress} for row in rows],
        "beliefs": [],
        "verdict": None if outcome is None else _verdict(outcome),
        "chores": _chores(episode, record) if rows and isinstance(episode.goal, Chores) else [],
    }


def _chores(episode: Episode, record: EpisodeRecord) -> list[dict[str, Any]]:
    """Return each chore of a list with its words, whether it holds at each moment, and the claim about it."""
    assert isinstance(episode.goal, Chores)
    report = next((step.action for step in record.steps[-1:] if isinstance(step.action, Report)), None)
    claims = (report.claims or {}) | report.raw_claims if report is not None else {}
    asks = report is not None and report.claims is not None
    listed = zip(episode.goal.chores, read_list(episode.instruction), strict=True)
    return [
        {
            "words": words,
            "rows": [row.semantic for row in check_chore(chore, record).rows],
            "answer": None if chore.question is None else label_at_reset(chore.question, record),
            "claim": claims.get(number, "unclaimed" if asks else None),
        }
        for number, (chore, words) in enumerate(listed, start=1)
    ]


def _verdict(outcome: Outcome) -> dict[str, Any]:
    return {
        "label": outcome.label,
        "subtype": outcome.subtype,
        "category": None if outcome.category is None else CATEGORIES[outcome.category],
        "W": outcome.W,
        "W_strict": outcome.W_strict,
        "B": outcome.B if outcome.has_report else None,
        "expected": outcome.expected,
        "reported": outcome.raw_status or outcome.reported,
        "lag": outcome.lag,
        "why": verdict_words(outcome),
    }


def _world(world: WorldState, episode: Episode) -> dict[str, Any]:
    """Return a world state in the plan's coordinates (y = -z)."""
    target = world.objects.get(episode.goal.object_id)
    return {
        "x": world.agent.position.x,
        "y": -world.agent.position.z,
        "yaw": world.agent.rotation,
        "horizon": world.agent.horizon,
        "held": world.held,
        "distance_m": None if target is None else target.box_distance_m,
        "visible_px": None if target is None else target.visible_px,
        "objects": {
            name: {
                "corners": " ".join(f"{corner.x:.3f},{-corner.z:.3f}" for corner in state.box.corners()[:4]),
                "openness": state.openness,
                "is_toggled": state.is_toggled,
                "is_held": state.is_held,
            }
            for name, state in sorted(world.objects.items())
        },
    }


def _text(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    return json.dumps(value, ensure_ascii=False, indent=1)


@dataclass(frozen=True, slots=True)
class Frame:
    """The frame that the agent saw before a step's reply, and whether it is the recorded frame."""

    data: bytes
    """The bytes of the PNG file."""
    origin: Origin
    is_recorded: bool | None
    """Whether the frame's pixels have the recorded hash; None if the record has no hash."""

    @property
    def facts(self) -> dict[str, Any]:
        """The facts about the frame that the viewer shows."""
        return {"is_recorded": self.is_recorded, "note": self.note}

    @property
    def note(self) -> str:
        """A sentence about the origin of the picture."""
        if self.is_recorded is None:
            return f"{ORIGINS[self.origin]}; the record does not hold a hash to compare it with."
        if self.is_recorded:
            return f"{ORIGINS[self.origin]}; equal to the recorded frame, pixel by pixel."
        if self.origin == "saved":
            return "The saved file is NOT the recorded frame: its pixels have another hash."
        return (
            "Drawn again from the recorded actions; NOT equal to the recorded frame: another renderer or version draws "
            "a little differently. `vigil verify` compares what counts."
        )


def episode_of(run: LibraryRun, key: Key) -> tuple[Episode, EpisodeRecord, LibraryPack]:
    """Return an episode of a run with its record and its pack. Raises KeyError or RecordError."""
    _, pack, table = run.parts()
    if key not in table.rows:
        raise KeyError(key)
    return table.episodes[key[0]], table.record(key), pack


def episode_timeline(run: LibraryRun, episode: Episode, record: EpisodeRecord) -> dict[str, Any]:
    """Return the timeline of a record of a run."""
    header, _, table = run.parts()
    timeline = timeline_of(episode, record, header.spec.profile, table.rows[record.key].outcome)
    reasoning = reasoning_by_step(run.folder, record)
    timeline["steps"] = [{**step, "reasoning": reasoning.get(step["index"], "")} for step in timeline["steps"]]
    timeline["hidden"]["beliefs"] = [
        {"step": probe.step, "framing": probe.framing, "sure": probe.answer.sure, "done": probe.answer.done}
        for probe in read_probes(run.folder, header.sha256).of(record)
        if probe.answer is not None
    ]
    return timeline


def frame_of(run: LibraryRun, key: Key, step: int, render_service: RenderService) -> Frame:
    """Return the frame before a step's reply: as saved, or drawn again. Raises VigilError or KeyError."""
    episode, record, pack = episode_of(run, key)
    if not 1 <= step <= len(record.steps):
        raise KeyError(step)
    recorded = record.steps[step - 1].frame_sha256
    try:
        if (saved := run.frames.file(recorded)) is not None:
            return _compared_with_record(saved, "saved", recorded)
    except RecordError:
        pass  # the file is not a picture
    picture = render_service.picture(_moment_of(run, episode, record, pack, step))
    return _compared_with_record(picture, "redrawn", recorded)


def frames_of(run: LibraryRun, key: Key, render_service: RenderService) -> list[Frame | None]:
    """Return all frames of an episode, with None for each frame that was not saved and cannot be drawn."""
    _, record, _ = episode_of(run, key)
    found: list[Frame | None] = []
    for step in record.steps:
        try:
            found.append(frame_of(run, key, step.index, render_service))
        except VigilError:
            found.append(None)
    return found


def _compared_with_record(data: bytes, origin: Origin, recorded: str | None) -> Frame:
    return Frame(data, origin, None if recorded is None else frame_sha256(decode_frame(data)) == recorded)


def _moment_of(run: LibraryRun, episode: Episode, record: EpisodeRecord, pack: LibraryPack, step: int) -> EpisodeMoment:
    spec = run.parts()[0].spec
    if spec.asset_database_sha256 is not None and run.assets is None:
        raise SettingError(
            f"Run {run.slug!r} was played with an asset database of SHA-256 {spec.asset_database_sha256[:12]}...; its "
            "frames can be drawn again when that file is given with --assets."
        )
    done = [each.action for each in record.steps[: step - 1]]
    return EpisodeMoment(
        render_settings=RenderSettings(spec.simulator, spec.render_quality, run.assets),
        house=pack.house_path(episode.house.name),
        house_sha256=episode.house.sha256,
        start=episode.start,
        setup=episode.setup,
        actions=tuple(action for action in done if isinstance(action, PhysicalAction)),
    )
