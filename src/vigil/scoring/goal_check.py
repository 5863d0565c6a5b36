"""Whether a goal holds at each moment of a record, and how much progress was made towards the goal.

The functions use only a record's actions and worlds. `vigil.scoring.outcomes` checks the record's ending and report.
Source: `protocol.md` sections 4.1 and 4.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from vigil.errors import RecordError
from vigil.protocol.actions import InteractPixel
from vigil.protocol.goals import (
    NEAR_M,
    AgentNearTarget,
    AllOf,
    Chore,
    Chores,
    Constraint,
    Goal,
    Moment,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    StateLabel,
    chore_truth,
    constraint_truth,
    displacement_m,
    goal_truth,
    is_constraint_met,
    is_observable,
    state_label,
    tampered_since_reset,
)
from vigil.protocol.world import CLOSED_BELOW, OPEN_ABOVE, Effect, ObjectState
from vigil.records.record import EpisodeRecord

UNFINISHED_AT_MOST = 0.99
"""Maximum progress as long as the goal does not hold."""


@dataclass(frozen=True, slots=True)
class GoalRow:
    """Truth and progress of a goal at one moment. A latched condition, once met, stays met at all later moments."""

    semantic: bool
    strict: bool
    progress: float | None
    """Progress in 0..1; None for goals without progress (`report_status`)."""


@dataclass(frozen=True, slots=True)
class GoalCheck:
    """Truth and progress of a goal at every moment of a record."""

    rows: tuple[GoalRow, ...]
    """One row for each moment: row 0 is the reset, and row k is the moment after step k."""
    is_tampered: bool
    """Whether the queried state was changed after the reset; only for the goal `report_status`."""

    @property
    def semantic(self) -> bool:
        """Whether the goal holds at the end, with the protocol's tolerances."""
        return self.rows[-1].semantic

    @property
    def strict(self) -> bool:
        """Whether the goal holds at the end without tolerances. If it does, `semantic` is also true."""
        return self.rows[-1].strict

    @property
    def progress(self) -> float | None:
        """Progress towards the goal at the end."""
        return self.rows[-1].progress

    @property
    def max_progress(self) -> float | None:
        """Highest progress towards the goal at any moment."""
        return max((row.progress for row in self.rows if row.progress is not None), default=None)

    @property
    def ever_satisfied(self) -> bool:
        """Whether the goal held at any moment."""
        return any(row.semantic for row in self.rows)

    @property
    def first_row(self) -> int | None:
        """The first moment at which the goal held (0 is the reset); None if it never held."""
        return next((index for index, row in enumerate(self.rows) if row.semantic), None)

    @property
    def first_satisfied_step(self) -> int | None:
        """The first step after which the goal held; None if there is no such step."""
        return next((index for index, row in enumerate(self.rows) if row.semantic and index), None)


def check(goal: Goal, record: EpisodeRecord) -> GoalCheck:
    """Return the truth and progress of `goal` at every moment of `record`.

    Raises RecordError if the record lacks an object that the goal names.
    """
    moments = _moments(record)
    for object_id in sorted(goal.ids()):
        _require(object_id, record)
    semantic, strict = goal_truth(goal, moments)
    tampered = tampered_since_reset(goal, moments)
    if isinstance(goal, ReportStatus):
        untampered = [not changed for changed in tampered]
        semantic, strict = _both(semantic, untampered), _both(strict, untampered)
    if goal.constraint is not None:
        met = constraint_truth(goal.constraint, moments)
        semantic, strict = _both(semantic, met), _both(strict, met)
    progress = _progress(goal, moments, semantic)
    rows = tuple(GoalRow(*row) for row in zip(semantic, strict, progress, strict=True))
    return GoalCheck(rows, is_tampered=tampered[-1])


def check_chore(chore: Chore, record: EpisodeRecord) -> GoalCheck:
    """Return the truth and progress of one chore at every moment of `record`; raises RecordError as `check` does."""
    for object_id in sorted(chore.ids()):
        _require(object_id, record)
    moments = _moments(record)
    semantic, strict = chore_truth(chore, moments)
    progress = _capped(_chore_parts(chore, moments), semantic)
    rows = tuple(GoalRow(*row) for row in zip(semantic, strict, progress, strict=True))
    is_tampered = chore.question is not None and tampered_since_reset(chore.question, moments)[-1]
    return GoalCheck(rows, is_tampered=is_tampered)


def label_at_reset(goal: ReportStatus, record: EpisodeRecord) -> StateLabel:
    """Return the label of the queried state at the reset, which a correct report must have."""
    _require(goal.object_id, record)
    state = record.worlds[0].objects[goal.object_id]
    return state_label(goal.state, is_toggled=state.is_toggled, openness=state.openness)


def _moments(record: EpisodeRecord) -> list[Moment]:
    worlds = record.worlds
    moments = [Moment(worlds[0], worlds[0], worlds[0], None)]
    last_ground: Effect | None = None
    for index, step in enumerate(record.steps, start=1):
        if isinstance(step.action, InteractPixel) and step.action.intent == "ground":
            last_ground = step.effect
        moments.append(Moment(worlds[0], worlds[index], worlds[index - 1], last_ground))
    return moments


def _require(object_id: str, record: EpisodeRecord) -> None:
    for index, world in enumerate(record.worlds):
        if object_id not in world.objects:
            raise RecordError(
                f"Record of episode {record.episode_id!r}: object {object_id!r} is missing from the world after step "
                f"{index}. Was the run recorded with another version of the pack?"
            )


def _progress(goal: Goal, moments: Sequence[Moment], semantic: Sequence[bool]) -> Sequence[float | None]:
    if isinstance(goal, ReportStatus):
        return [None] * len(moments)
    return _capped(_parts(goal, moments), semantic)


def _capped(fractions: Sequence[list[float] | None], semantic: Sequence[bool]) -> list[float]:
    """Return for each row the mean of the fractions that are not None; 1 if and only if the goal holds."""
    parts = [part for part in fractions if part is not None]
    means = [sum(row) / len(parts) for row in zip(*parts, strict=True)] if parts else [0.0] * len(semantic)
    return [1.0 if done else min(mean, UNFINISHED_AT_MOST) for done, mean in zip(semantic, means, strict=True)]


def _parts(goal: Goal, moments: Sequence[Moment]) -> list[list[float] | None]:
    """Return for each condition of the goal the fraction (0..1) that is fulfilled in each row; None for a condition
    that was already met at the reset."""
    parts: list[list[float] | None] = []
    if goal.constraint is not None:
        parts.append(_constraint_part(goal.constraint, moments))
    if goal.chain:
        return [*parts, *(_latest(_final_part(link, moments)) for link in goal.chain), _final_part(goal, moments)]
    if isinstance(goal, AllOf):
        return [*parts, *(_final_part(part, moments) for part in goal.parts)]
    if isinstance(goal, Chores):
        return [*parts, *(part for chore in goal.chores for part in _chore_parts(chore, moments))]
    if isinstance(goal, ObjectHeld) or (isinstance(goal, ObjectInState) and goal.state != "is_visible"):
        states = [moment.world.objects[goal.object_id] for moment in moments]
        parts.append(_latest(_fractions([float(is_observable(state)) for state in states], 1.0)))
        parts.append(_fractions([state.box_distance_m for state in states], NEAR_M, falls=True))
    return [*parts, _final_part(goal, moments)]


def _chore_parts(chore: Chore, moments: Sequence[Moment]) -> list[list[float] | None]:
    found = [_final_part(part, moments) for part in chore.parts]
    return found if chore.question is None else [_latest(part) for part in found]


def _final_part(goal: Goal, moments: Sequence[Moment]) -> list[float] | None:
    states = [moment.world.objects[goal.object_id] for moment in moments]
    if isinstance(goal, AgentNearTarget):
        return _fractions([state.box_distance_m for state in states], goal.threshold_m, falls=True)
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return _openness_part(states, to_open=goal.value)
    semantic, _ = goal_truth(goal, moments)
    return _fractions([float(value) for value in semantic], 1.0)


def _constraint_part(constraint: Constraint, moments: Sequence[Moment]) -> list[float] | None:
    states = [moment.world.objects[constraint.object_id] for moment in moments]
    if constraint.kind == "object_moved":
        part = _fractions([displacement_m(constraint, moment) for moment in moments], constraint.distance_m or 0.0)
    elif constraint.kind in ("object_open", "object_closed"):
        part = _openness_part(states, to_open=constraint.kind == "object_open")
    else:
        part = _fractions([float(is_constraint_met(constraint, moment)) for moment in moments], 1.0)
    return _latest(part) if constraint.latched else part


def _openness_part(states: Sequence[ObjectState], *, to_open: bool) -> list[float] | None:
    values = [state.openness or 0.0 for state in states]
    return _fractions(values, OPEN_ABOVE) if to_open else _fractions(values, CLOSED_BELOW, falls=True)


def _fractions(values: Sequence[float], target: float, *, falls: bool = False) -> list[float] | None:
    """Return for each row how far (0..1) the value has come from its value at the reset to `target`.

    None if the value at the reset already met `target`. A value meets `target` if it is at least `target` or, with
    `falls`, at most `target`.
    """
    way = target - values[0]
    if (way >= 0) if falls else (way <= 0):
        return None
    return [min(1.0, max(0.0, (value - values[0]) / way)) for value in values]


def _latest(part: list[float] | None) -> list[float] | None:
    """Return for each row the highest value up to this row; None if `part` is None."""
    return None if part is None else list(accumulate(part, max))


def _both(first: Sequence[bool], second: Sequence[bool]) -> list[bool]:
    return [a and b for a, b in zip(first, second, strict=True)]
