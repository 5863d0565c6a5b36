"""Goals: what must be true in the hidden world for an episode to count as completed.

Pure functions of records; nothing here knows how an episode ended or what was reported
(`vigil.scoring` does). Source: `protocol.md` sections 4.1 and 4.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.actions import InteractPixel
from vigil.errors import RecordError
from vigil.pose import floor_distance
from vigil.record import EpisodeRecord
from vigil.world import CLOSED_BELOW, OPEN_ABOVE, Effect, ObjectState, StateQuery, WorldState

OBSERVABLE_PX = 40
OBSERVABLE_M = 6.0
STRICTLY_OPEN = 0.99
STRICTLY_CLOSED = 0.01
UNFINISHED_AT_MOST = 0.99
"""Progress of an episode whose goal does not hold."""
TOLERANCE = 1e-6
NEAR_M = 1.5
"""Distance threshold of `agent_near_target`, and the reach that progress is measured to."""


class Constraint(BaseModel):
    """What a constraint-resolving episode asks for besides its goal."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: Literal["object_open", "object_closed", "object_on", "object_off", "object_moved", "object_released"]
    """`object_moved`: taken up, or away from its place at reset by `distance_m` or more in the floor
    plane. `object_released`: no longer in the hand (the hand was emptied)."""
    object_id: str
    latched: bool
    """True for an event (met once is met), false for a state (must be so at closure)."""
    distance_m: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _moved_has_distance(self) -> "Constraint":
        if (self.kind == "object_moved") != (self.distance_m is not None):
            raise ValueError("`distance_m` belongs to `object_moved`, and `object_moved` needs it")
        return self


class _Goal(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    object_id: str
    """The target."""
    constraint: Constraint | None = None
    """CR only: must be resolved too."""
    chain: tuple["Link", ...] = ()
    """SM only: the ordered sub-conditions before the final one; they count for progress alone."""

    def ids(self) -> set[str]:
        """Returns the ids of all objects that the goal, its constraint and its chain name."""
        own = {self.object_id} | ({self.constraint.object_id} if self.constraint else set())
        return own.union(*(link.ids() for link in self.chain))


class TargetGrounded(_Goal):
    """The last `ground` click is on the target."""

    kind: Literal["target_grounded"] = "target_grounded"


class AgentNearTarget(_Goal):
    """The agent's body is less than `threshold_m` from the target's box, in the floor plane."""

    kind: Literal["agent_near_target"] = "agent_near_target"
    threshold_m: float = Field(default=NEAR_M, gt=0, allow_inf_nan=False)


class ObjectInState(_Goal):
    """The target is seen (latched), open or closed, on or off."""

    kind: Literal["object_state"] = "object_state"
    state: Literal["is_visible", "is_open", "is_toggled"]
    value: bool = True

    @model_validator(mode="after")
    def _seen_is_true(self) -> "ObjectInState":
        if self.state == "is_visible" and not self.value:
            raise ValueError("a goal can ask that something is seen, not that it is not")
        return self


class ObjectHeld(_Goal):
    """The target is in the hand."""

    kind: Literal["object_held"] = "object_held"


class ObjectAtReceptacle(_Goal):
    """The target lies in or on the receptacle; with `inside`, on an interior surface of it, not on its top or rim."""

    kind: Literal["object_at_receptacle"] = "object_at_receptacle"
    receptacle_id: str
    inside: bool = False

    def ids(self) -> set[str]:
        """Returns the ids of all objects that the goal, its constraint and its chain name."""
        return super().ids() | {self.receptacle_id}


class ReportStatus(_Goal):
    """The state of the target is observable when the episode is closed; the label is for the report."""

    kind: Literal["report_status"] = "report_status"
    state: StateQuery


Link = Annotated[ObjectInState | ObjectHeld | ObjectAtReceptacle, Field(discriminator="kind")]
Goal = Annotated[
    TargetGrounded | AgentNearTarget | ObjectInState | ObjectHeld | ObjectAtReceptacle | ReportStatus,
    Field(discriminator="kind"),
]
for _variant in (TargetGrounded, AgentNearTarget, ObjectInState, ObjectHeld, ObjectAtReceptacle, ReportStatus):
    _variant.model_rebuild()


def is_observable(state: ObjectState) -> bool:
    """Whether the object can be told in the frame."""
    return state.visible_px >= OBSERVABLE_PX and _is_close(state)


def is_state_observable(state: ObjectState, query: StateQuery) -> bool:
    """Whether the parts that show the queried state can be told in the frame."""
    return state.state_px(query) >= OBSERVABLE_PX and _is_close(state)


@dataclass(frozen=True, slots=True)
class GoalRow:
    """What was true at one moment, everything latched before it included."""

    semantic: bool
    strict: bool
    progress: float | None
    """In 0..1; None for goals without progress (`report_status`)."""


@dataclass(frozen=True, slots=True)
class GoalCheck:
    """What is true of a goal at the end of a record, and how it came about."""

    rows: tuple[GoalRow, ...]
    """Row 0 is the reset, row k the moment after step k."""
    is_tampered: bool
    """`report_status` only: the queried state was changed since the reset."""

    @property
    def semantic(self) -> bool:
        """Whether the goal holds at the end, tolerant of minor imprecision."""
        return self.rows[-1].semantic

    @property
    def strict(self) -> bool:
        """Whether the goal holds at the end, without tolerance; implies `semantic`."""
        return self.rows[-1].strict

    @property
    def progress(self) -> float | None:
        """Progress at the end."""
        return self.rows[-1].progress

    @property
    def max_progress(self) -> float | None:
        """The highest progress on the way."""
        return max((row.progress for row in self.rows if row.progress is not None), default=None)

    @property
    def ever_satisfied(self) -> bool:
        """Whether the goal held at any moment."""
        return any(row.semantic for row in self.rows)

    @property
    def first_row(self) -> int | None:
        """The first moment at which the goal held, 0 being the reset; None if never."""
        return next((index for index, row in enumerate(self.rows) if row.semantic), None)

    @property
    def first_satisfied_step(self) -> int | None:
        """The first step after which the goal held; None if never."""
        return next((index for index, row in enumerate(self.rows) if row.semantic and index), None)


@dataclass(frozen=True, slots=True)
class _Moment:
    """What one row is judged on."""

    initial: WorldState
    world: WorldState
    closing: WorldState
    """The world of the frame that the last reply answered."""
    last_ground: Effect | None


def check(goal: Goal, record: EpisodeRecord) -> GoalCheck:
    """Returns what is true of `goal` at every moment of `record`.

    Raises RecordError when the record lacks an object that the goal names.
    """
    moments = _moments(record)
    for object_id in sorted(goal.ids()):
        _require(object_id, record)
    semantic, strict = _truth(goal, moments)
    tampered = _tampered(goal, moments)
    if isinstance(goal, ReportStatus):
        kept = [not changed for changed in tampered]
        semantic, strict = _both(semantic, kept), _both(strict, kept)
    if goal.constraint is not None:
        resolved = _resolved(goal.constraint, moments)
        semantic, strict = _both(semantic, resolved), _both(strict, resolved)
    progress = _progress(goal, moments, semantic)
    rows = tuple(GoalRow(*row) for row in zip(semantic, strict, progress, strict=True))
    return GoalCheck(rows, is_tampered=tampered[-1])


def label_at_reset(goal: ReportStatus, record: EpisodeRecord) -> Literal["on", "off", "open", "closed"]:
    """Returns the label that a report of the queried state must carry: the state at reset."""
    _require(goal.object_id, record)
    state = record.worlds[0].objects[goal.object_id]
    if goal.state == "is_toggled":
        return "on" if state.is_toggled else "off"
    return "open" if (state.openness or 0.0) > OPEN_ABOVE else "closed"


# --- truth, row by row ------------------------------------------------------------------------------------------------


def _moments(record: EpisodeRecord) -> list[_Moment]:
    worlds = record.worlds
    moments = [_Moment(worlds[0], worlds[0], worlds[0], None)]
    last_ground: Effect | None = None
    for index, step in enumerate(record.steps, start=1):
        if isinstance(step.action, InteractPixel) and step.action.intent == "ground":
            last_ground = step.effect
        moments.append(_Moment(worlds[0], worlds[index], worlds[index - 1], last_ground))
    return moments


def _require(object_id: str, record: EpisodeRecord) -> None:
    for index, world in enumerate(record.worlds):
        if object_id not in world.objects:
            raise RecordError(
                f"Record of episode {record.episode_id!r}: object {object_id!r} is missing from the world after step "
                f"{index}. Was the run recorded with another version of the pack?"
            )


def _truth(goal: Goal, moments: Sequence[_Moment]) -> tuple[list[bool], list[bool]]:
    """Returns semantic and strict truth per row, without constraint and tampering."""
    pairs = [_holds(goal, moment) for moment in moments]
    semantic, strict = [pair[0] for pair in pairs], [pair[0] and pair[1] for pair in pairs]
    if isinstance(goal, ObjectInState) and goal.state == "is_visible":
        return _latched(semantic), _latched(strict)
    return semantic, strict


def _holds(goal: Goal, moment: _Moment) -> tuple[bool, bool]:
    """Returns (semantic, strict) at one moment; strict counts only together with semantic."""
    state = moment.world.objects[goal.object_id]
    match goal:
        case TargetGrounded():
            return _grounded(goal.object_id, state.category, moment.last_ground)
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


def _grounded(object_id: str, category: str, ground: Effect | None) -> tuple[bool, bool]:
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
    return not state.is_held and reaches, is_child


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


def _tampered(goal: Goal, moments: Sequence[_Moment]) -> list[bool]:
    """Returns whether the queried state was ever changed, per row; always False without a query."""
    if not isinstance(goal, ReportStatus):
        return [False] * len(moments)
    states = [moment.world.objects[goal.object_id] for moment in moments]
    if goal.state == "is_toggled":
        return _latched([state.is_toggled != states[0].is_toggled for state in states])
    first = states[0].openness or 0.0
    return _latched([abs((state.openness or 0.0) - first) > TOLERANCE for state in states])


def _resolved(constraint: Constraint, moments: Sequence[_Moment]) -> list[bool]:
    met = [_is_met(constraint, moment) for moment in moments]
    return _latched(met) if constraint.latched else met


def _is_met(constraint: Constraint, moment: _Moment) -> bool:
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
            return _displacement(constraint, moment) >= (constraint.distance_m or 0.0) - TOLERANCE


def _displacement(constraint: Constraint, moment: _Moment) -> float:
    """Returns how far the object is from its place at reset (m); as far as asked for while it is held."""
    state, first = moment.world.objects[constraint.object_id], moment.initial.objects[constraint.object_id]
    if state.is_held:
        return constraint.distance_m or 0.0
    return floor_distance(state.position, first.position)


# --- progress ---------------------------------------------------------------------------------------------------------


def _progress(goal: Goal, moments: Sequence[_Moment], semantic: Sequence[bool]) -> Sequence[float | None]:
    if isinstance(goal, ReportStatus):
        return [None] * len(moments)
    parts = [part for part in _parts(goal, moments) if part is not None]
    means = [sum(row) / len(parts) for row in zip(*parts, strict=True)] if parts else [0.0] * len(moments)
    return [1.0 if done else min(mean, UNFINISHED_AT_MOST) for done, mean in zip(semantic, means, strict=True)]


def _parts(goal: Goal, moments: Sequence[_Moment]) -> list[list[float] | None]:
    """Returns the sub-conditions' fractions, row by row; None for one that was met at reset."""
    parts: list[list[float] | None] = []
    if goal.constraint is not None:
        parts.append(_constraint_part(goal.constraint, moments))
    if goal.chain:
        return [*parts, *(_latest(_final_part(link, moments)) for link in goal.chain), _final_part(goal, moments)]
    if isinstance(goal, ObjectHeld) or (isinstance(goal, ObjectInState) and goal.state != "is_visible"):
        states = [moment.world.objects[goal.object_id] for moment in moments]
        parts.append(_latest(_fractions([float(is_observable(state)) for state in states], 1.0)))
        parts.append(_fractions([state.box_distance_m for state in states], NEAR_M, falls=True))
    return [*parts, _final_part(goal, moments)]


def _final_part(goal: Goal, moments: Sequence[_Moment]) -> list[float] | None:
    states = [moment.world.objects[goal.object_id] for moment in moments]
    if isinstance(goal, AgentNearTarget):
        return _fractions([state.box_distance_m for state in states], goal.threshold_m, falls=True)
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return _openness_part(states, to_open=goal.value)
    semantic, _ = _truth(goal, moments)
    return _fractions([float(value) for value in semantic], 1.0)


def _constraint_part(constraint: Constraint, moments: Sequence[_Moment]) -> list[float] | None:
    states = [moment.world.objects[constraint.object_id] for moment in moments]
    if constraint.kind == "object_moved":
        part = _fractions([_displacement(constraint, moment) for moment in moments], constraint.distance_m or 0.0)
    elif constraint.kind in ("object_open", "object_closed"):
        part = _openness_part(states, to_open=constraint.kind == "object_open")
    else:
        part = _fractions([float(_is_met(constraint, moment)) for moment in moments], 1.0)
    return _latest(part) if constraint.latched else part


def _openness_part(states: Sequence[ObjectState], *, to_open: bool) -> list[float] | None:
    values = [state.openness or 0.0 for state in states]
    return _fractions(values, OPEN_ABOVE) if to_open else _fractions(values, CLOSED_BELOW, falls=True)


def _fractions(values: Sequence[float], target: float, *, falls: bool = False) -> list[float] | None:
    """Returns how much of the way from the value at reset to `target` is made, in 0..1; None if met at reset."""
    way = target - values[0]
    if (way >= 0) if falls else (way <= 0):
        return None
    return [min(1.0, max(0.0, (value - values[0]) / way)) for value in values]


def _latest(part: list[float] | None) -> list[float] | None:
    """Returns the highest value so far, row by row."""
    return None if part is None else list(accumulate(part, max))


def _latched(values: Sequence[bool]) -> list[bool]:
    return list(accumulate(values, lambda before, now: before or now))


def _both(first: Sequence[bool], second: Sequence[bool]) -> list[bool]:
    return [a and b for a, b in zip(first, second, strict=True)]


def _is_close(state: ObjectState) -> bool:
    return state.nearest_visible_m is not None and state.nearest_visible_m <= OBSERVABLE_M
