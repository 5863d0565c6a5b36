"""Thoughts and reports of demonstrations. They follow only from the picture and the instruction.

The solver knows the hidden world, but its words must not show this. They mention only things that the instruction
names. They call a thing seen only if enough of it is in the frame, and not seen only if no part of it is in the
frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import assert_never

from vigil.authoring.language.referring import Phrase, items_as_seen, items_of, mentions, resolve_mentions
from vigil.authoring.solving.goal_actions import report_summary
from vigil.protocol.actions import Action, Intent, InteractPixel, Look, Navigate, Report, Status
from vigil.protocol.goals import Goal, is_observable
from vigil.protocol.observation import FRAME_WIDTH
from vigil.protocol.world import ObjectState
from vigil.scene.things import Scene

SIDE_SHARE = 0.35
"""Share of the frame's width that counts as its left side; the right side has the same width."""
MOVES = {
    "forward": "walk forward",
    "backward": "step back",
    "turn_left": "turn left",
    "turn_right": "turn right",
}
WORDS: dict[Intent, str] = {
    "ground": "point at",
    "open_access": "open",
    "close_access": "close",
    "activate": "turn on",
    "deactivate": "turn off",
    "pick": "pick up",
    "place": "put what I hold at",
}
GAVE_UP = "I could not do what was asked."


@dataclass(frozen=True, slots=True)
class SubjectInView:
    """The thing that a thought is about (the next thing to interact with, or the target), and how a frame shows it."""

    phrase: Phrase
    """Phrase for the subject in the instruction."""
    is_seen: bool = False
    """Whether the subject is observable in the frame."""
    is_out_of_view: bool = False
    """Whether no part of the subject is in the frame. If the subject is neither seen nor out of view, the thought does
    not say whether it is seen."""
    x: float | None = None
    """Horizontal position (px) of the subject's middle in the frame; None if the subject is out of view."""


def phrases_mentioned(instruction: str, scene: Scene, held: str | None) -> dict[str, Phrase]:
    """Return thing id -> the first phrase that means only this thing; `held` is the id of the thing in the hand."""
    items = items_of(scene)
    phrases = mentions(instruction, [item.name for item in items.values()])
    meant = resolve_mentions(phrases, items.values(), items.get(held or ""))
    found = [(fitting[0], phrase) for phrase, fitting in zip(phrases, meant, strict=True) if len(fitting) == 1]
    seen = items_as_seen(scene)
    said = [
        (item.id, replace(phrase, is_inside=seen[item.id].is_inside, is_on_shelf=seen[item.id].is_on_shelf))
        for item, phrase in found
    ]
    return dict(reversed(said))  # the first mention counts, since later ones may not say where a thing is


def subject_in(state: ObjectState, phrase: Phrase, x: float | None) -> SubjectInView:
    """Return the subject with its visibility, from its state at the frame and the position x (px) of its middle."""
    is_seen = is_observable(state) and not state.is_held
    return SubjectInView(phrase, is_seen, state.visible_px == 0 and not state.is_held, x)


def thought_text(action: Action, subject: SubjectInView, report: str) -> str:
    """Return the thought before an action, a sentence about the subject. For a report, the thought is `report`."""
    match action:
        case Navigate():
            return _sight(subject, MOVES[action.mode])
        case Look():
            return _sight(subject, f"look {action.direction}")
        case InteractPixel() if action.intent == "drop":
            return "I put down what I hold."
        case InteractPixel():
            return f"I {WORDS[action.intent]} {subject.phrase.without_place}."
        case Report():
            return report
        case _:
            assert_never(action)


def _sight(subject: SubjectInView, done: str) -> str:
    if subject.is_seen:
        place = "" if subject.x is None else f" {_side(subject.x)}"
        return f"I see {subject.phrase}{place}; I {done}."
    if subject.is_out_of_view:
        return f"I do not see {subject.phrase}; I {done}."
    return f"I {done}."


def _side(x: float) -> str:
    if x < SIDE_SHARE * FRAME_WIDTH:
        return "on the left"
    return "on the right" if x > (1 - SIDE_SHARE) * FRAME_WIDTH else "ahead"


def report_text(goal: Goal, phrases: Mapping[str, Phrase], status: Status) -> str:
    """Return the summary of a closing report. `phrases` has the instruction's phrases by thing id."""
    return report_summary(goal, lambda object_id: str(phrases[object_id].without_place), status)
