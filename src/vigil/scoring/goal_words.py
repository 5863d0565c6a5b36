"""Goals in words: what must be true at the end of an episode, with the ids of the objects. Hidden from the agent."""

from typing import assert_never

from vigil.protocol.goals import (
    AgentNearTarget,
    AllOf,
    Chore,
    Chores,
    Constraint,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
)

_STATES = {
    ("is_open", True): "is open",
    ("is_open", False): "is closed",
    ("is_toggled", True): "is on",
    ("is_toggled", False): "is off",
}
_CONSTRAINTS = {
    "object_open": "is open",
    "object_closed": "is closed",
    "object_on": "is on",
    "object_off": "is off",
    "object_released": "is no longer in the hand",
}


def describe_goal(goal: Goal) -> str:
    """Return in words what must be true at the end, with the ids of the objects."""
    text = _describe_final(goal)
    if goal.chain:
        text += "; for progress alone: " + ", ".join(_describe_final(link) for link in goal.chain)
    if goal.constraint is not None:
        text += f"; and {_describe_constraint(goal.constraint)}"
    return text


def describe_chore(chore: Chore) -> str:
    """Return in words what must be true at the end for one chore to hold, with the ids of the objects."""
    if chore.question is not None:
        return f"the claim says whether {_describe_question(chore.question)}, with its state once in view and untouched"
    text = " and ".join(_describe_final(part) for part in chore.parts)
    if chore.condition is None:
        return text
    return f"{text} (at the reset, {_describe_final(chore.condition)}: {'yes' if chore.is_met else 'no'})"


def _describe_final(goal: Goal) -> str:
    target = goal.object_id
    match goal:
        case TargetGrounded():
            return f"the last ground click is on {target}"
        case AgentNearTarget():
            return f"the agent stands less than {goal.threshold_m:g} m from {target}"
        case ObjectInState() if goal.state == "is_visible":
            return f"{target} has been seen"
        case ObjectInState():
            return f"{target} {_STATES[goal.state, goal.value]}"
        case ObjectHeld():
            return f"{target} is in the hand"
        case ObjectAtReceptacle():
            return f"{target} is {'inside' if goal.inside else 'on'} {goal.receptacle_id}"
        case ReportStatus():
            return f"the report says whether {_describe_question(goal)}, with its state in view and untouched"
        case AllOf():
            return " and ".join(_describe_final(part) for part in goal.parts)
        case Chores():
            return "; ".join(f"{number}. {describe_chore(chore)}" for number, chore in enumerate(goal.chores, start=1))
        case _:
            assert_never(goal)


def _describe_question(goal: ReportStatus) -> str:
    return f"{goal.object_id} is {'open or closed' if goal.state == 'is_open' else 'on or off'}"


def _describe_constraint(constraint: Constraint) -> str:
    when = "at some moment" if constraint.latched else "at the end"
    if constraint.kind == "object_moved":
        return f"{constraint.object_id} has been moved by {constraint.distance_m:g} m or more ({when})"
    return f"{constraint.object_id} {_CONSTRAINTS[constraint.kind]} ({when})"
