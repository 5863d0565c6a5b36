"""Goals: what must be true in the hidden world for an episode to count as completed.

This module defines the kinds of goals and constraints, and decides whether each holds at one moment.
`vigil.scoring.goal_check` applies them to a record, and `vigil.scoring.goal_words` describes them. Source:
`protocol.md` sections 4.1 and 9.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Annotated, Literal, assert_never, get_args

from pydantic import Field, model_validator

from vigil.base.geometry import floor_distance
from vigil.base.models import FrozenModel
from vigil.protocol.world import CLOSED_BELOW, OPEN_ABOVE, Effect, ObjectState, StateQuery, WorldState

OBSERVABLE_PX = 40
OBSERVABLE_M = 6.0
STRICTLY_OPEN = 0.99
STRICTLY_CLOSED = 0.01
TOLERANCE = 1e-6
NEAR_M = 1.5
"""Default threshold (m) of `agent_near_target`; progress counts a target as reached within this distance."""
MAX_PARTS = 24
"""Maximum number of parts of an `all_of` goal; enough for a goal such as "everything in the home is closed"."""
MIN_CHORES, MAX_CHORES = 3, 10
MAX_CHORE_PARTS = 4


class Constraint(FrozenModel):
    """The additional condition that an episode of the family CR (constraint resolving) requires."""

    kind: Literal["object_open", "object_closed", "object_on", "object_off", "object_moved", "object_released"]
    """The condition to be met. `object_moved` is met if the object is in the hand, or at least `distance_m` from its
    place at the reset, in the floor plane. `object_released` is met if the object is not in the hand."""
    object_id: str
    latched: bool
    """Whether the constraint is an event, which stays met after it was met once. If False, it is a state, which must
    hold when the episode is closed."""
    distance_m: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _distance_fits_kind(self) -> "Constraint":
        if (self.kind == "object_moved") != (self.distance_m is not None):
            raise ValueError("`distance_m` must be given for `object_moved`, and for nothing else")
        return self


class _Goal(FrozenModel):
    object_id: str
    """Id of the target: the object that the goal is about."""
    constraint: Constraint | None = None
    """Constraint that must be resolved in addition to the goal; only in CR."""
    chain: tuple["ChainLink", ...] = ()
    """Conditions to be met in this order before the goal; they count only for progress. Only the family SM has them."""

    def ids(self) -> set[str]:
        """Return the ids of all objects that occur in the goal, its constraint or its chain."""
        constrained = () if self.constraint is None else (self.constraint.object_id,)
        return {self.object_id, *constrained}.union(*(link.ids() for link in self.chain))


class TargetGrounded(_Goal):
    """The last click with the intent `ground`, which only points, is on the target."""

    kind: Literal["target_grounded"] = "target_grounded"


class AgentNearTarget(_Goal):
    """The agent's body is less than `threshold_m` from the target's box, in the floor plane."""

    kind: Literal["agent_near_target"] = "agent_near_target"
    threshold_m: float = Field(default=NEAR_M, gt=0, allow_inf_nan=False)


class ObjectInState(_Goal):
    """The target is open, closed, on or off, as required. If `is_visible` is required, it is enough that the target was
    seen at any moment so far."""

    kind: Literal["object_state"] = "object_state"
    state: Literal["is_visible", "is_open", "is_toggled"]
    value: bool = True

    @model_validator(mode="after")
    def _visible_is_true(self) -> "ObjectInState":
        if self.state == "is_visible" and not self.value:
            raise ValueError("a goal can ask that an object is seen, but not that an object is not seen")
        return self


class ObjectHeld(_Goal):
    """The target is in the hand."""

    kind: Literal["object_held"] = "object_held"


class ObjectAtReceptacle(_Goal):
    """The target lies on top of the receptacle or on an open shelf of it. A target that lies inside, or on a part that
    opens (such as a drawer), does not count.

    If `inside` is True, the target must instead be in the receptacle, not on its top or rim. For W, it is enough that
    the target is over an interior surface (`ObjectState.over_inside`). For W_strict, it must rest on a surface of the
    receptacle itself.
    """

    kind: Literal["object_at_receptacle"] = "object_at_receptacle"
    receptacle_id: str
    inside: bool = False

    def ids(self) -> set[str]:
        """Return the ids of all objects that occur in the goal, its constraint or its chain."""
        return super().ids() | {self.receptacle_id}


class ReportStatus(_Goal):
    """The target's queried state is observable when the episode is closed. The reported label is checked separately."""

    kind: Literal["report_status"] = "report_status"
    state: StateQuery


ChainLink = Annotated[ObjectInState | ObjectHeld | ObjectAtReceptacle, Field(discriminator="kind")]


GoalPart = Annotated[ObjectInState | ObjectAtReceptacle, Field(discriminator="kind")]


def _check_parts(whole: str, parts: Iterable[_Goal], states: Iterable[_Goal | None]) -> None:
    """Raise ValueError if one of `states` asks only for visibility, or one of `parts` has a constraint or a chain."""
    if any(isinstance(each, ObjectInState) and each.state == "is_visible" for each in states):
        raise ValueError(f"each part of {whole} must be the place or the state of an object: open or closed, on or off")
    if any(part.constraint is not None or part.chain for part in parts):
        raise ValueError(f"a part of {whole} must not have a constraint or a chain")


class AllOf(_Goal):
    """Several objects are each in the required state or place; `object_id` is the first of these objects."""

    kind: Literal["all_of"] = "all_of"
    parts: tuple[GoalPart, ...] = Field(min_length=2, max_length=MAX_PARTS)

    @model_validator(mode="after")
    def _parts_are_distinct(self) -> "AllOf":
        ids = [part.object_id for part in self.parts]
        if len(set(ids)) < len(ids) or ids[0] != self.object_id:
            raise ValueError(
                "each part of `all_of` must be about a different object, and the first part about `object_id`"
            )
        _check_parts("`all_of`", self.parts, self.parts)
        return self

    def ids(self) -> set[str]:
        """Return the ids of all objects that occur in the goal, its constraint or its chain."""
        return super().ids().union(*(part.ids() for part in self.parts))


ChorePart = Annotated[ObjectInState | ObjectAtReceptacle | ReportStatus, Field(discriminator="kind")]


class Chore(FrozenModel):
    """One chore of a list. The chore holds when each of its parts holds. Its number is its place in the list, from 1.

    A chore that asks for a state is a *question* and has one part, `report_status`. It holds if the agent replied to a
    frame that showed the state, and nobody has changed the state since the reset.
    """

    parts: tuple[ChorePart, ...] = Field(min_length=1, max_length=MAX_CHORE_PARTS)
    """Conditions that must hold at the end. A conditional chore also has the condition that its other branch was not
    carried out."""
    condition: ObjectInState | None = None
    """The state on which a conditional chore depends; it is judged at the reset."""
    is_met: bool | None = None
    """Whether the condition holds at the reset; None if there is no condition."""

    @model_validator(mode="after")
    def _is_whole(self) -> "Chore":
        if (self.condition is None) != (self.is_met is None):
            raise ValueError("`is_met` must be given together with `condition`, and not without it")
        if len(self.parts) > 1 and any(isinstance(part, ReportStatus) for part in self.parts):
            raise ValueError("a chore that asks which state an object has must not have other parts")
        _check_parts("a chore", self.parts, (*self.parts, self.condition))
        return self

    @property
    def question(self) -> ReportStatus | None:
        """The state that the chore asks for; None if it asks for an act."""
        first = self.parts[0]
        return first if isinstance(first, ReportStatus) else None

    def ids(self) -> set[str]:
        """Return the ids of all objects that the chore names."""
        named = self.parts if self.condition is None else (*self.parts, self.condition)
        return set[str]().union(*(part.ids() for part in named))


class Chores(_Goal):
    """A list of chores, each of which must hold; `object_id` is the object of the first part of the first chore.

    A list may contain a chore that cannot be met. Such a list never holds as a whole. `vigil.scoring.chores` judges
    each chore.
    """

    kind: Literal["chores"] = "chores"
    chores: tuple[Chore, ...] = Field(min_length=MIN_CHORES, max_length=MAX_CHORES)

    @model_validator(mode="after")
    def _can_hold_together(self) -> "Chores":
        parts = [part for chore in self.chores for part in chore.parts]
        if parts[0].object_id != self.object_id or self.constraint is not None or self.chain:
            raise ValueError(
                "a list of chores must have the `object_id` of its first part, and must not have a constraint or a "
                "chain"
            )
        wanted: dict[tuple[str, str], bool] = {}
        for part in (part for part in parts if isinstance(part, ObjectInState)):
            if wanted.setdefault((part.object_id, part.state), part.value) != part.value:
                raise ValueError(f"two chores ask for opposite states of {part.object_id!r} at the end")
        return self

    def ids(self) -> set[str]:
        """Return the ids of all objects that the goal, its constraint and its chain name."""
        return super().ids().union(*(chore.ids() for chore in self.chores))


SingleGoal = TargetGrounded | AgentNearTarget | ObjectInState | ObjectHeld | ObjectAtReceptacle | ReportStatus | AllOf
"""A goal that is not a list of chores."""
Goal = Annotated[SingleGoal | Chores, Field(discriminator="kind")]
for _variant in (*get_args(SingleGoal), Chores):
    _variant.model_rebuild()


StateLabel = Literal["on", "off", "open", "closed"]
STATE_LABELS: dict[StateQuery, tuple[StateLabel, StateLabel]] = {
    "is_toggled": ("on", "off"),
    "is_open": ("open", "closed"),
}
"""Kind of state -> its two labels: the label if the state is true, and the label if it is false."""
OTHER_LABEL: dict[str, StateLabel] = {
    label: other for pair in STATE_LABELS.values() for label, other in (pair, pair[::-1])
}
"""Label of a state -> the label of the opposite state."""


def state_label(query: StateQuery, *, is_toggled: bool | None, openness: float | None) -> StateLabel:
    """Return the label of the state that `query` asks for: "on" or "off" for `is_toggled`, "open" or "closed" for
    `is_open`.

    None (the object cannot be toggled or opened) counts as off or closed.
    """
    positive, negative = STATE_LABELS[query]
    holds = bool(is_toggled) if query == "is_toggled" else (openness or 0.0) > OPEN_ABOVE
    return positive if holds else negative


def is_observable(state: ObjectState) -> bool:
    """Return whether the object can be recognized in the frame."""
    return _is_recognizable(state, state.visible_px)


def is_state_observable(state: ObjectState, query: StateQuery) -> bool:
    """Return whether the parts that show the queried state can be recognized in the frame."""
    return _is_recognizable(state, state.state_px(query))


def _is_recognizable(state: ObjectState, pixels: int) -> bool:
    nearest_m = state.nearest_visible_m
    return pixels >= OBSERVABLE_PX and nearest_m is not None and nearest_m <= OBSERVABLE_M


@dataclass(frozen=True, slots=True)
class Moment:
    """The hidden facts at one moment (after a step or at the reset) that decide whether a goal holds."""

    initial: WorldState
    world: WorldState
    closing: WorldState
    """World at the time of the frame to which the agent gave its last reply."""
    last_ground: Effect | None


def goal_truth(goal: Goal, moments: Sequence[Moment]) -> tuple[list[bool], list[bool]]:
    """Return whether the goal holds at each moment, as two lists: with tolerances, and without.

    The goal's constraint is ignored. That a queried state was changed after the reset is also ignored, except in lists
    of chores.
    """
    if isinstance(goal, Chores):
        return _both_all(chore_truth(chore, moments) for chore in goal.chores)
    pairs = [_holds(goal, moment) for moment in moments]
    semantic, strict = [pair[0] for pair in pairs], [pair[0] and pair[1] for pair in pairs]
    if isinstance(goal, ObjectInState) and goal.state == "is_visible":
        return latched(semantic), latched(strict)
    return semantic, strict


def chore_truth(chore: Chore, moments: Sequence[Moment]) -> tuple[list[bool], list[bool]]:
    """Return whether a chore holds at each moment, as two lists: with tolerances, and without."""
    if chore.question is None:
        return _both_all(goal_truth(part, moments) for part in chore.parts)
    semantic, strict = map(latched, goal_truth(chore.question, moments))
    untouched = [not changed for changed in tampered_since_reset(chore.question, moments)]
    return _both_all([(semantic, strict), (untouched, untouched)])


def _both_all(truths: Iterable[tuple[list[bool], list[bool]]]) -> tuple[list[bool], list[bool]]:
    """Return for each moment whether all `truths` hold. Each of them, and the result, is a pair of lists: with
    tolerances, and without."""
    semantic, strict = zip(*truths, strict=True)
    return [all(each) for each in zip(*semantic, strict=True)], [all(each) for each in zip(*strict, strict=True)]


def _holds(goal: SingleGoal, moment: Moment) -> tuple[bool, bool]:
    """Return whether the goal holds at one moment, as (with tolerances, without them).

    The caller counts the second value only if the first is also true.
    """
    state = moment.world.objects[goal.object_id]
    match goal:
        case TargetGrounded():
            return grounding_truth(goal.object_id, state.category, moment.last_ground)
        case AgentNearTarget():
            return state.box_distance_m < goal.threshold_m, state.center_distance_m < goal.threshold_m
        case ObjectInState():
            return _in_state(goal, state)
        case ObjectHeld():
            return state.is_held, True
        case ObjectAtReceptacle():
            return _at_receptacle(goal, state)
        case ReportStatus():
            seen = moment.closing.objects[goal.object_id]
            return is_state_observable(seen, goal.state), seen.visible
        case AllOf():
            found = [_holds(part, moment) for part in goal.parts]
            return all(semantic for semantic, _ in found), all(strict for _, strict in found)
        case _:
            assert_never(goal)


def grounding_truth(object_id: str, category: str, ground: Effect | None) -> tuple[bool, bool]:
    """Return whether a click is on an object, as (with tolerance, without).

    With tolerance, a click within 3 px of the object also counts, unless it hits another object of the same category.
    """
    if ground is None:
        return False, False
    is_own = ground.hit == object_id
    is_near = object_id in ground.near and ground.hit_category != category
    return is_own or is_near, is_own


def _at_receptacle(goal: ObjectAtReceptacle, state: ObjectState) -> tuple[bool, bool]:
    receptacle, is_child = goal.receptacle_id, state.parent == goal.receptacle_id
    if goal.inside:
        is_inside = receptacle in state.inside
        return not state.is_held and (is_inside or receptacle in state.over_inside), is_child and is_inside
    reaches = is_child or receptacle in state.support_chain or receptacle in state.over
    return not state.is_held and reaches and receptacle not in state.not_on, is_child


def _in_state(goal: ObjectInState, state: ObjectState) -> tuple[bool, bool]:
    if goal.state == "is_visible":
        return is_observable(state), state.visible
    if goal.state == "is_toggled":
        return state.is_toggled is goal.value, True
    if state.openness is None:
        return False, False
    if goal.value:
        return state.openness > OPEN_ABOVE, state.openness >= STRICTLY_OPEN
    return state.openness < CLOSED_BELOW, state.openness <= STRICTLY_CLOSED


def tampered_since_reset(goal: Goal, moments: Sequence[Moment]) -> list[bool]:
    """Return for each moment whether the queried state has changed since the reset; False for a goal without query."""
    if not isinstance(goal, ReportStatus):
        return [False] * len(moments)
    states = [moment.world.objects[goal.object_id] for moment in moments]
    if goal.state == "is_toggled":
        return latched([state.is_toggled != states[0].is_toggled for state in states])
    first = states[0].openness or 0.0
    return latched([abs((state.openness or 0.0) - first) > TOLERANCE for state in states])


def constraint_truth(constraint: Constraint, moments: Sequence[Moment]) -> list[bool]:
    """Return for each moment whether the constraint is resolved."""
    met = [is_constraint_met(constraint, moment) for moment in moments]
    return latched(met) if constraint.latched else met


def is_constraint_met(constraint: Constraint, moment: Moment) -> bool:
    """Return whether the constraint is met at one moment, regardless of earlier moments."""
    state = moment.world.objects[constraint.object_id]
    match constraint.kind:
        case "object_open":
            return state.openness is not None and state.openness > OPEN_ABOVE
        case "object_closed":
            return state.openness is not None and state.openness < CLOSED_BELOW
        case "object_on":
            return state.is_toggled is True
        case "object_off":
            return state.is_toggled is False
        case "object_released":
            return not state.is_held
        case "object_moved":
            return displacement_m(constraint, moment) >= (constraint.distance_m or 0.0) - TOLERANCE


def displacement_m(constraint: Constraint, moment: Moment) -> float:
    """Return the object's distance (m) from its place at the reset; if it is held, return the required distance."""
    state, first = moment.world.objects[constraint.object_id], moment.initial.objects[constraint.object_id]
    if state.is_held:
        return constraint.distance_m or 0.0
    return floor_distance(state.position, first.position)


def latched(values: Sequence[bool]) -> list[bool]:
    """Return for each position whether a value at this or an earlier position is true."""
    return list(accumulate(values, lambda before, now: before or now))
