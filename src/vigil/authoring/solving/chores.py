"""Solver of lists of chores: it does all that can be done, in an order found by search, and makes true claims."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.authoring.solving.chore_order import ChoreModel, Entanglement, entanglement, shortest_order, walk_lengths
from vigil.authoring.solving.evidence import (
    FAR_COST,
    can_be_partly_open,
    gap_evidence,
    notice_evidence,
    object_evidence,
    surface_evidence,
    viewpoint_showing,
    viewpoint_showing_state,
)
from vigil.authoring.solving.goal_actions import achieve_goal, expected_status, holds, is_doable
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.actions import Action, ChoreClaim, Report, Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Chore, ChorePart, Chores, ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import OPEN_ABOVE
from vigil.scene.supports import children
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

PLACE = "place_{}"
"""Role of the thing on which, by a chore's sentence, the chore's object lies; `{}` is the chore's number."""
BLOCKER = "blocker_{}"
"""Role of the furniture that keeps a chore's thing from opening, or leaves no room on a chore's receptacle."""
OBSTACLE = "obstacle_{}"
"""Role of the object that must be carried away before a chore's thing can open."""


MIN_PICKED_PX = 100
"""Number of an object's pixels that the solver sees when it picks the object up: about 10 by 10."""


class UnsolvableChore(Unsolvable):
    """Error for a list with a chore, at index `place`, that the solver finds no way to do."""

    def __init__(self, place: int, message: str) -> None:
        super().__init__(f"Chore {place + 1}: {message}")
        self.place = place


@dataclass(frozen=True, slots=True)
class ChorePlan:
    """The order in which to do the chores of a list."""

    order: tuple[int, ...]
    """Indices of all chores in the order in which the agent does them, or only looks at something for them."""
    entanglement: Entanglement = field(repr=False)
    walk_m: float
    """Length (m) of the walk, on a coarse grid."""
    lengths: np.ndarray = field(repr=False)
    """Lengths (n + 1, n) of the walks between chores, in metres."""


def solve_chores(
    episode: Episode, macro_actions: MacroActions, conceded: Mapping[int, Status] | None = None
) -> Iterator[Action]:
    """Yield the actions that do all chores of a list that can be done, and the report with true claims.

    `conceded` maps the indices of the chores that cannot be met to their claims; None to find out which these are.
    Raises UnsolvableChore if there is no way to do one of the others.
    """
    goal, view = episode.goal, macro_actions.view
    assert isinstance(goal, Chores)
    macro_actions.min_picked_px = MIN_PICKED_PX
    conceded = _concessions(episode, macro_actions) if conceded is None else conceded
    plan = plan_chores(episode, view, conceded)
    claims: dict[int, ChoreClaim] = {}
    held = [is_done(chore, view) for chore in goal.chores]
    looked: set[int] = set()
    for place in plan.order:
        try:
            for other in {*_conditions_on(goal, place)} - looked - {place}:
                yield from _look(episode, other, macro_actions)
                looked.add(other)
            if place in conceded:
                yield from _look(episode, place, macro_actions)
            else:
                must_look = held[place] if goal.chores[place].condition is None else place not in looked
                yield from _do(episode, place, macro_actions, must_look=must_look)
            looked.add(place)
        except Unsolvable as error:
            raise UnsolvableChore(place, str(error)) from None
    for place, chore in enumerate(goal.chores):
        if chore.question is not None:
            claims[place + 1] = expected_status(chore.question, view)
        else:
            claims[place + 1] = "success" if is_done(chore, view) else conceded.get(place, "fail")
    is_all_done = not conceded and "fail" not in claims.values()
    yield Report(
        status="success" if is_all_done else "fail",
        summary="I did the chores." if is_all_done else "I did what could be done.",
        claims=claims,
    )


def _conditions_on(goal: Chores, place: int) -> Iterator[int]:
    """Yield the indices of the chores whose condition is about a thing of the chore at index `place`."""
    ids = goal.chores[place].ids()
    for other, chore in enumerate(goal.chores):
        if chore.condition is not None and chore.condition.object_id in ids:
            yield other


def _concessions(episode: Episode, macro_actions: MacroActions) -> dict[int, Status]:
    """Return the claims about the chores that cannot be met in the current state, by the chores' indices."""
    goal = episode.goal
    assert isinstance(goal, Chores)
    return {
        place: status
        for place, chore in enumerate(goal.chores)
        if OBSTACLE.format(place + 1) not in episode.bindings
        and (status := concession(chore, macro_actions)) is not None
    }


def plan_chores(episode: Episode, view: PrivilegedView, conceded: Collection[int]) -> ChorePlan:
    """Return the order of chores with the shortest walk; `conceded` are the indices of chores that cannot be met.

    Raises Unsolvable if no order does all other chores.
    """
    goal = episode.goal
    assert isinstance(goal, Chores)
    model, doable = ChoreModel(view.scene), [each for each in range(len(goal.chores)) if each not in conceded]
    found = entanglement(model, goal.chores, doable)
    if found is None:
        raise Unsolvable("No order of the chores does all of them.")
    stops = [_stops(episode, place, is_conceded=place in conceded) for place in range(len(goal.chores))]
    lengths = walk_lengths(view, stops)
    order, walk_m = shortest_order(lengths, found.before)
    return ChorePlan(tuple(order), found, walk_m, lengths)


def concession(chore: Chore, macro_actions: MacroActions) -> Status | None:
    """Return the status to claim for a chore that cannot be met in the current state; None if the chore can be met."""
    view = macro_actions.view
    for part in chore.parts:
        thing = view.scene.things[part.object_id]
        if not thing.is_present:
            return "invalid"
        if isinstance(part, ObjectInState) and part.value and not holds(part, view):
            if part.state == "is_toggled" and thing.is_broken:
                return "fail"
            if part.state == "is_open" and not _is_interlocked(thing) and not _can(part, macro_actions):
                return "fail"
        if isinstance(part, ObjectAtReceptacle) and not _has_only_movable(view, part) and not _can(part, macro_actions):
            return "fail"
    return None


def _is_interlocked(thing: Thing) -> bool:
    """Return whether a machine runs, and therefore does not open."""
    return thing.is_toggled and CATALOG[thing.category].runs_only_when_closed


def _has_only_movable(view: PrivilegedView, part: ObjectAtReceptacle) -> bool:
    """Return whether all things on a receptacle can be carried away, so that the agent can make room."""
    return all(child.is_pickupable or child.is_drawer for child in children(view.scene, part.receptacle_id))


def _can(part: ObjectInState | ObjectAtReceptacle, macro_actions: MacroActions) -> bool:
    """Return whether a part of a chore can be brought about in the current state. The state is not changed."""
    view = macro_actions.view
    try:
        with view.rollback():
            for action in achieve_goal(part, macro_actions):
                view.step(action)  # pyright: ignore[reportArgumentType] - a goal is never reached by a report
    except Unsolvable:
        return False
    return True


def _stops(episode: Episode, place: int, *, is_conceded: bool) -> tuple[str, str]:
    """Return the ids of the things at which a chore begins and ends."""
    goal = episode.goal
    assert isinstance(goal, Chores)
    chore, first = goal.chores[place], goal.chores[place].parts[0]
    if is_conceded:
        at = episode.bindings.get(PLACE.format(place + 1), _stood_at(first))
        return at, at
    begin = first.object_id if chore.condition is None else chore.condition.object_id
    return begin, _stood_at(first)


def _stood_at(part: ChorePart) -> str:
    return part.receptacle_id if isinstance(part, ObjectAtReceptacle) else part.object_id


def _do(episode: Episode, place: int, macro_actions: MacroActions, *, must_look: bool) -> Iterator[Action]:
    """Yield the actions of a chore that can be met; `must_look` says whether it held at the start, or depends on a
    condition that was not looked at."""
    goal, view = episode.goal, macro_actions.view
    assert isinstance(goal, Chores)
    chore = goal.chores[place]
    if chore.question is not None:
        yield from macro_actions.go(viewpoint_showing_state(view, chore.question.object_id, chore.question.state))
    elif must_look and (chore.condition is not None or is_done(chore, view)):
        yield from _look(episode, place, macro_actions)
    for part in sorted(chore.parts, key=lambda part: isinstance(part, ObjectInState)):  # places come first
        if isinstance(part, ObjectInState | ObjectAtReceptacle) and not holds(part, view):
            if (obstacle := episode.bindings.get(OBSTACLE.format(place + 1))) is not None:
                yield from macro_actions.act("pick", obstacle)
                yield from macro_actions.put_down(lambda part=part: is_doable(part, macro_actions))
            yield from _achieve(part, macro_actions)


def _look(episode: Episode, place: int, macro_actions: MacroActions) -> Iterator[Action]:
    """Yield the walks to places from which the agent sees why a chore needs no act, or which branch of it applies."""
    for evidence in evidence_of(episode, place, macro_actions.view):
        yield from macro_actions.go(viewpoint_showing(macro_actions.view, evidence, FAR_COST))


def check_looks(episode: Episode, places: Iterable[int], view: PrivilegedView) -> None:
    """Raise UnsolvableChore if the agent cannot clearly see the evidence for a chore whose index is in `places`.

    `view` is in the state of the episode's start.
    """
    goal = episode.goal
    assert isinstance(goal, Chores)
    for place in places:
        try:
            question = goal.chores[place].question
            if question is not None:
                viewpoint_showing_state(view, question.object_id, question.state)
            else:
                for evidence in evidence_of(episode, place, view):
                    viewpoint_showing(view, evidence, FAR_COST)
        except Unsolvable as error:
            raise UnsolvableChore(place, str(error)) from None


def _achieve(part: ObjectInState | ObjectAtReceptacle, macro_actions: MacroActions) -> Iterator[Action]:
    """Yield the actions that bring about a part of a chore. If need be, the machine is first closed or turned off."""
    things = macro_actions.view.scene.things
    machine = things[_stood_at(part)]
    if CATALOG[machine.category].runs_only_when_closed:
        starts = isinstance(part, ObjectInState) and part.state == "is_toggled" and part.value
        opens = isinstance(part, ObjectAtReceptacle) or (part.state == "is_open" and part.value)
        if starts and machine.openness > 0.0:
            yield from macro_actions.act("close_access", machine.id)
        if opens and machine.is_toggled:
            yield from macro_actions.act("deactivate", machine.id)
    yield from achieve_goal(part, macro_actions)


def evidence_of(episode: Episode, place: int, view: PrivilegedView) -> list[tuple[Evidence, ...]]:
    """Return the evidence that a chore cannot be met, or holds already, or which branch of it applies.

    Each tuple is to be seen in one view. `view` is in the state of the episode's start, or in another state in which
    the chore's things have not changed.
    """
    goal = episode.goal
    assert isinstance(goal, Chores)
    chore, things, number = goal.chores[place], view.scene.things, place + 1
    part = chore.parts[0] if chore.condition is None else chore.condition
    thing = things[part.object_id]
    if not thing.is_present:
        surface = surface_evidence(things[episode.bindings[PLACE.format(number)]], thing.surface)
        return [surface] if surface else []
    if thing.is_broken and (notice := notice_evidence(thing)) is not None:
        return [(notice,)]
    blocker = episode.bindings.get(BLOCKER.format(number))
    if blocker is not None:
        return [(object_evidence(_stood_at(part)), object_evidence(blocker))]
    if isinstance(part, ObjectInState) and part.state == "is_open" and can_be_partly_open(thing):
        return [(gap_evidence(thing, 0.0 if thing.openness < OPEN_ABOVE else thing.openness),)]
    return [(object_evidence(part.object_id),)]


def is_done(chore: Chore, view: PrivilegedView) -> bool:
    """Return whether all parts of a chore hold now; False for a question."""
    parts: Sequence[ChorePart] = chore.parts
    return chore.question is None and all(
        view.scene.things[part.object_id].is_present and holds(part, view) for part in parts
    )
