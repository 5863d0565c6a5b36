"""What a demonstration says besides its action: a thought and a report, of what the picture and the instruction show.

The solver knows the hidden world; its words do not. They name only things that the instruction names, say that one is
seen only where enough of it is in the frame to be told, and that one is not seen only where nothing of it is.
"""

from dataclasses import dataclass
from typing import assert_never

from vigil.actions import Action, Intent, InteractPixel, Look, Navigate, Report, Status
from vigil.assets.catalog import CATALOG
from vigil.goals import (
    AgentNearTarget,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
)
from vigil.observation import FRAME_WIDTH
from vigil.world import WorldState

ASIDE = 0.35
"""Share of the frame's width that counts as its left, and as its right side."""
MOVES = {
    "forward": "walk forward",
    "backward": "step back",
    "turn_left": "turn left",
    "turn_right": "turn right",
}
DEEDS: dict[Intent, str] = {
    "ground": "point at",
    "open_access": "open",
    "close_access": "close",
    "activate": "turn on",
    "deactivate": "turn off",
    "pick": "pick up",
    "place": "put what I hold at",
}
DONE = {
    ("is_open", True): "opened", ("is_open", False): "closed",
    ("is_toggled", True): "turned on", ("is_toggled", False): "turned off",
}  # fmt: skip
GIVEN_UP = "I could not do what was asked."


@dataclass(frozen=True, slots=True)
class Subject:
    """The thing that the next interaction, or else the goal, is about, as far as it is seen."""

    name: str
    is_seen: bool = False
    is_out_of_view: bool = False
    """Nothing of it is in the frame; between this and being seen, nothing is said."""
    x: float | None = None
    """Of its middle in the frame, in pixels."""


def subject_in(world: WorldState, object_id: str, x: float | None) -> Subject:
    """Returns a thing of an episode as its frame shows it."""
    state = world.objects[object_id]
    is_seen = is_observable(state) and not state.is_held
    return Subject(_name(world, object_id), is_seen, state.visible_px == 0 and not state.is_held, x)


def thought_of(action: Action, subject: Subject, report: str) -> str:
    """Returns the short sentence that goes with an action; `report` is what a closing report says."""
    match action:
        case Navigate():
            return _sight(subject, MOVES[action.mode])
        case Look():
            return _sight(subject, f"look {action.direction}")
        case InteractPixel() if action.intent == "drop":
            return "I put down what I hold."
        case InteractPixel():
            return f"I {DEEDS[action.intent]} the {subject.name}."
        case Report():
            return report
        case _:
            assert_never(action)


def _sight(subject: Subject, deed: str) -> str:
    if subject.is_seen:
        place = "" if subject.x is None else f" {_side(subject.x)}"
        return f"I see the {subject.name}{place}; I {deed}."
    if subject.is_out_of_view:
        return f"I do not see the {subject.name}; I {deed}."
    return f"I {deed}."


def _side(x: float) -> str:
    if x < ASIDE * FRAME_WIDTH:
        return "on the left"
    return "on the right" if x > (1 - ASIDE) * FRAME_WIDTH else "ahead"


def report_of(goal: Goal, world: WorldState, status: Status) -> str:
    """Returns what a closing report says: of what was done, or of the state that is seen."""
    target = _name(world, goal.object_id)
    match goal:
        case TargetGrounded():
            return f"I pointed at the {target}."
        case AgentNearTarget():
            return f"I am near the {target}."
        case ReportStatus():
            return f"The {target} is {status}."
        case ObjectInState() if goal.state == "is_visible":
            return f"I see the {target}."
        case ObjectInState():
            return f"I {DONE[goal.state, goal.value]} the {target}."
        case ObjectHeld():
            return f"I picked up the {target}."
        case ObjectAtReceptacle():
            return f"I put the {target} {'in' if goal.inside else 'on'} the {_name(world, goal.receptacle_id)}."
        case _:
            assert_never(goal)


def _name(world: WorldState, object_id: str) -> str:
    return CATALOG[world.objects[object_id].category].spoken
