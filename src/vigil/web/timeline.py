"""Timeline: the data with which the viewer shows one recorded episode, with hidden state kept separate.

A model's output is given as plain strings; templates must escape it.
"""

import json
from typing import Any

from vigil.base.numbered_list import read_list
from vigil.errors import RecordError
from vigil.protocol.actions import InteractPixel, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import Chores
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.protocol.world import WorldState
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.scoring.goal_check import GoalRow, check, check_chore, label_at_reset
from vigil.scoring.goal_words import describe_goal
from vigil.scoring.outcomes import Outcome
from vigil.web.phrases import CATEGORIES, action_words, click_of, effect_words, verdict_words


def timeline_of(episode: Episode, record: EpisodeRecord, profile: Profile, outcome: Outcome | None) -> dict[str, Any]:
    """Return the viewer's data as JSON values. The parts named `hidden` are shown only if the user asks for them."""
    rows = _goal_rows(episode, record)
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


def _goal_rows(episode: Episode, record: EpisodeRecord) -> tuple[GoalRow, ...]:
    if record.initial is None:
        return ()
    try:
        return check(episode.goal, record).rows
    except RecordError:
        return ()


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
    found: list[dict[str, Any]] = []
    for number, (chore, words) in enumerate(
        zip(episode.goal.chores, read_list(episode.instruction), strict=True), start=1
    ):
        checked = check_chore(chore, record)
        expected = None if chore.question is None else label_at_reset(chore.question, record)
        claim = claims.get(number, "unclaimed" if asks else None)
        found.append(
            {
                "words": words,
                "rows": [row.semantic for row in checked.rows],
                "answer": expected,
                "claim": claim,
            }
        )
    return found


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
