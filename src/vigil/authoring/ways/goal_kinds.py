"""Each kind of goal: the actions that bring it about, and the wrong ways that only look like it.

`vigil.goals` defines, checks and words a kind of goal; this module is all that making packs of it needs besides.
"""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import assert_never

import numpy as np

from vigil.actions import Action, Intent, Report, Status
from vigil.assets.catalog import CATALOG
from vigil.authoring.solving.aim import surface_points
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.solving.viewpoints import Places, ViewpointQuery, viewpoints
from vigil.authoring.ways.synthetic_records import SyntheticStep, with_change
from vigil.authoring.ways.wrong_places import neighbours, upon
from vigil.authoring.ways.wrong_worlds import WrongWorlds
from vigil.goals import (
    STATE_LABELS,
    STRICTLY_CLOSED,
    STRICTLY_OPEN,
    AgentNearTarget,
    AllOf,
    Goal,
    GoalPart,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
    state_label,
)
from vigil.pose import floor_distance, wrap_deg
from vigil.record import EpisodeRecord
from vigil.scene.geometry import box_distances, box_of
from vigil.scene.supports import is_shut, surface_named
from vigil.scene.things import Thing
from vigil.world import OPEN_ABOVE, Placement, Setup

NEAR_MARGIN_M = 0.06
CLEAR_PX = 260
SEE_NEAR_M, SEE_FAR_M = 0.6, 4.5
MOST_LOOKS = 60
SEEN_POINTS = (16, 4)
SHORT_M = (0.03, 0.4)
"""How far beyond the threshold of nearness one stops short."""
NEAR_OTHER_M = 1.2
LOOK_M = (0.8, 2.5)
TRIED_NEIGHBOURS = 4
OTHER_LABEL: dict[Status, Status] = {
    **dict(STATE_LABELS.values()),
    **{negative: positive for positive, negative in STATE_LABELS.values()},
}

Steps = Iterator[Action]
WrongRecords = Iterator[tuple[str, EpisodeRecord | None]]
"""Names of wrong ways with their records; None where the house does not allow it."""


def reach(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yields what brings a goal about, once nothing stands in its way."""
    match goal:
        case TargetGrounded():
            yield from _ground(goal, macro_actions)
        case AgentNearTarget():
            yield from _approach(goal, macro_actions)
        case ObjectInState() if goal.state == "is_visible":
            yield from _search(goal, macro_actions)
        case ReportStatus():
            pass  # the state is in view at the start
        case ObjectInState() | ObjectHeld() | ObjectAtReceptacle():
            yield from achieve(goal, macro_actions)
        case AllOf():
            yield from _achieve_all(goal, macro_actions)
        case _:
            assert_never(goal)


def closing_status(goal: Goal, oracle: Oracle) -> Status:
    """Returns the status of the report that closes an episode whose goal has been brought about."""
    if not isinstance(goal, ReportStatus):
        return "success"
    thing = oracle.scene.things[goal.object_id]
    return state_label(goal.state, is_toggled=thing.is_toggled, openness=thing.openness)


def closing_words(goal: Goal, said: Callable[[str], str], status: Status) -> str:
    """Returns the summary of a report: what was done, or the state that is seen; `said` is what a thing is called."""
    target = said(goal.object_id)
    match goal:
        case TargetGrounded():
            return f"I pointed at {target}."
        case AgentNearTarget():
            return f"I am near {target}."
        case ReportStatus():
            return f"{target[0].upper()}{target[1:]} is {status}."
        case ObjectInState() if goal.state == "is_visible":
            return f"I see {target}."
        case ObjectInState():
            done = ("opened", "closed") if goal.state == "is_open" else ("turned on", "turned off")
            return f"I {done[0] if goal.value else done[1]} {target}."
        case ObjectHeld():
            return f"I picked up {target}."
        case ObjectAtReceptacle():
            return f"I put {target} {'in' if goal.inside else 'on'} {said(goal.receptacle_id)}."
        case AllOf():
            return " ".join(closing_words(part, said, status) for part in goal.parts)
        case _:
            assert_never(goal)


def achieve(goal: Goal, macro_actions: MacroActions) -> Steps:
    """Yields the interactions that bring a goal about, walking included; none where it holds already.

    What lies in something closed is taken out of it.
    """
    if _holds(goal, macro_actions.oracle):
        return
    if isinstance(goal, ObjectAtReceptacle):
        yield from _in_hand(goal, macro_actions)
        yield from macro_actions.place(goal.receptacle_id, inside=goal.inside, is_thorough=not goal.chain)
        return
    if isinstance(goal, ObjectHeld):
        yield from _opened_around(goal.object_id, macro_actions)
    yield from macro_actions.act(_intent_of(goal), goal.object_id)


def closed_around(oracle: Oracle, object_id: str) -> list[str]:
    """Returns the ids of the closed things that a thing lies inside of."""
    around = [oracle.scene.things[name] for name in oracle.state_of(object_id).inside]
    return [thing.id for thing in around if thing.is_openable and thing.openness <= OPEN_ABOVE]


def _opened_around(object_id: str, macro_actions: MacroActions) -> Steps:
    """Yields what opens the closed things that a thing lies inside of."""
    for container in closed_around(macro_actions.oracle, object_id):
        yield from macro_actions.act("open_access", container)


def _in_hand(goal: ObjectAtReceptacle, macro_actions: MacroActions) -> Steps:
    """Yields what takes the target in the hand and opens where it is to go, as far as that is still to be done."""
    oracle = macro_actions.oracle
    if oracle.held != goal.object_id:
        yield from _opened_around(goal.object_id, macro_actions)
        yield from macro_actions.act("pick", goal.object_id)
    if goal.inside and is_shut(oracle.scene.things[goal.receptacle_id]):
        yield from macro_actions.act("open_access", goal.receptacle_id)


def _achieve_all(goal: AllOf, macro_actions: MacroActions) -> Steps:
    """Yields what brings all parts about: with a chain in its order, else what is to be put somewhere first, and then
    the nearest part, time by time."""
    things, left = macro_actions.oracle.scene.things, list(goal.parts)
    while left:
        here = macro_actions.oracle.agent.position
        placed = [part for part in left if isinstance(part, ObjectAtReceptacle)]
        if goal.chain or placed:
            part = left[0] if goal.chain else placed[0]
        else:
            part = min(left, key=lambda part: floor_distance(here, things[part.object_id].position))
        left.remove(part)
        yield from achieve(part, macro_actions)


def is_doable(goal: Goal, macro_actions: MacroActions) -> bool:
    """Whether the goal's own interaction works from some reachable place as things stand now."""
    try:
        macro_actions.find(_intent_of(goal), goal.object_id)
    except Unsolvable:
        return False
    return True


def _holds(goal: Goal, oracle: Oracle) -> bool:
    thing = oracle.scene.things[goal.object_id]
    if isinstance(goal, ObjectAtReceptacle):
        surface = surface_named(oracle.scene.things[goal.receptacle_id], thing.surface)
        is_there = thing.parent == goal.receptacle_id and oracle.held != thing.id
        return is_there and (not goal.inside or (surface is not None and surface.is_inside))
    if isinstance(goal, ObjectHeld):
        return oracle.held == goal.object_id
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return thing.openness >= STRICTLY_OPEN if goal.value else thing.openness <= STRICTLY_CLOSED
    return isinstance(goal, ObjectInState) and goal.state == "is_toggled" and thing.is_toggled == goal.value


def _intent_of(goal: Goal) -> Intent:
    if isinstance(goal, ObjectHeld):
        return "pick"
    if isinstance(goal, ObjectInState) and goal.state == "is_open":
        return "open_access" if goal.value else "close_access"
    if isinstance(goal, ObjectInState) and goal.state == "is_toggled":
        return "activate" if goal.value else "deactivate"
    raise Unsolvable(f"No interaction brings about a goal of kind {goal.kind!r}.")


def _ground(goal: TargetGrounded, macro_actions: MacroActions) -> Steps:
    pixel = macro_actions.oracle.clickable(goal.object_id)
    if pixel is None:
        raise Unsolvable(f"{goal.object_id!r} is not in the frame.")
    yield macro_actions.click("ground", pixel)


def _approach(goal: AgentNearTarget, macro_actions: MacroActions) -> Steps:
    oracle = macro_actions.oracle
    thing = oracle.scene.things[goal.object_id]
    walks = oracle.walks()
    for slack_m in macro_actions.slacks_m:
        places = _beside(oracle, goal, NEAR_MARGIN_M + slack_m)
        query = ViewpointQuery(thing.id, surface_points(thing), places, least_seen=1)
        view = next(viewpoints(oracle, walks, query), None)
        if view is not None:
            yield from macro_actions.go(view)
            return
    raise Unsolvable(f"No reachable place near enough to {thing.id!r}.")


def _beside(oracle: Oracle, goal: AgentNearTarget, margin_m: float) -> Places:
    """Returns the places that are near enough to a target by both distances, with a margin."""
    thing = oracle.scene.things[goal.object_id]
    box, most = box_of(thing), goal.threshold_m - margin_m

    def cost(places: np.ndarray) -> np.ndarray:
        edge = box_distances(box, places)
        centre = oracle.centre_distances(thing, places)
        return np.where((edge <= most) & (centre <= most), 0.0, np.inf)

    return cost


def _search(goal: ObjectInState, macro_actions: MacroActions) -> Steps:
    oracle = macro_actions.oracle
    thing = oracle.scene.things[goal.object_id]
    box = box_of(thing)

    def is_seen() -> bool:
        return is_observable(oracle.state_of(thing.id))

    def cost(places: np.ndarray) -> np.ndarray:
        distances = box_distances(box, places)
        return np.where((distances >= SEE_NEAR_M) & (distances <= SEE_FAR_M), 0.0, np.inf)

    for least in SEEN_POINTS:
        query = ViewpointQuery(
            thing.id, surface_points(thing), cost, may_tilt=True, least_seen=least, through_glass=True
        )
        for view in islice(viewpoints(oracle, oracle.walks(), query), MOST_LOOKS):
            with oracle.standing_at(view.pose):
                state = oracle.state_of(thing.id)
            if state.visible and state.visible_px >= CLEAR_PX and is_observable(state):
                yield from macro_actions.go(view, is_seen)
                if is_seen():
                    return
    raise Unsolvable(f"No reachable place from which {thing.id!r} is clearly seen.")


def wrongly_reached(goal: Goal, worlds: WrongWorlds) -> WrongRecords:
    """Yields the wrong ways of an episode's goal. The simulator is left anywhere."""
    match goal:
        case TargetGrounded():
            yield from _wrongly_grounded(worlds)
        case AgentNearTarget():
            yield from _not_near(goal, worlds)
        case ObjectInState() if goal.state == "is_visible":
            yield "the look-alike is seen", worlds.from_reset(_sight_of_alike(worlds))
        case ObjectInState() | ObjectHeld():
            yield "the look-alike instead", worlds.from_reset(_done_to(worlds.alike, goal, worlds))
            yield "the neighbour instead", worlds.from_reset(_done_to(_neighbour(goal, worlds), goal, worlds))
            yield "done and undone", worlds.undone(worlds.episode.setup)
        case ObjectAtReceptacle():
            yield from _wrongly_placed(goal, worlds)
        case ReportStatus():
            yield from _wrongly_reported(goal, worlds)
        case AllOf():
            yield from _all_but_one(goal, worlds)
            yield "done and undone", worlds.undone(worlds.episode.setup)
        case _:
            assert_never(goal)
    if goal.constraint is not None and goal.constraint.kind != "object_released":
        yield "the constraint is not resolved", worlds.from_reset(_unresolved(goal, worlds))


def _wrongly_grounded(worlds: WrongWorlds) -> WrongRecords:
    alike = worlds.click_on([worlds.alike] if worlds.alike else [])
    near = sorted(
        (thing for thing in worlds.oracle.scene.things.values() if thing.category != worlds.target.category),
        key=lambda thing: floor_distance(thing.position, worlds.target.position),
    )
    neighbour = worlds.click_on(near[:TRIED_NEIGHBOURS])
    yield "the look-alike instead", worlds.from_reset(alike)
    yield "the neighbour instead", worlds.from_reset(neighbour)
    yield "done and undone", worlds.after_solution(neighbour)


def _not_near(goal: AgentNearTarget, worlds: WrongWorlds) -> WrongRecords:
    cells = worlds.oracle.plan().cells
    away = box_distances(box_of(worlds.target), cells) - goal.threshold_m
    short = cells[(away > SHORT_M[0]) & (away < SHORT_M[1])]
    yield "stopped short", worlds.from_reset(_at(short, worlds))
    by_alike = None
    if worlds.alike is not None:
        near = box_distances(box_of(worlds.alike), cells) < min(NEAR_OTHER_M, goal.threshold_m)
        by_alike = _at(cells[near & (away > SHORT_M[0])], worlds)
    yield "the look-alike instead", worlds.from_reset(by_alike)
    yield "done and undone", worlds.undone(worlds.episode.setup, worlds.episode.start)


def _at(cells: np.ndarray, worlds: WrongWorlds) -> list[SyntheticStep] | None:
    pose = next(worlds.poses(cells, worlds.target), None)
    return None if pose is None else worlds.synthetic.row(worlds.episode.setup, pose)


def _sight_of_alike(worlds: WrongWorlds) -> list[SyntheticStep] | None:
    """Returns the row of a look at another thing of the category while the target is out of view."""
    alike = worlds.alike
    if alike is None:
        return None
    cells = worlds.oracle.plan().cells
    away = box_distances(box_of(alike), cells)
    for pose in worlds.poses(cells[(away > LOOK_M[0]) & (away < LOOK_M[1])], alike):
        world = worlds.synthetic.world(worlds.episode.setup, pose)
        is_hidden = world is not None and not world.objects[worlds.target.id].visible_px
        if world is not None and is_hidden and is_observable(worlds.oracle.state_of(alike.id)):
            return [SyntheticStep(world)]
    return None


def _done_to(thing: Thing | None, goal: ObjectInState | ObjectHeld, worlds: WrongWorlds) -> list[SyntheticStep] | None:
    """Returns the row in which what a goal asks for was done to another thing."""
    return None if thing is None or not _allows(thing, goal) else _attained(thing.id, goal, worlds)


def _attained(object_id: str, goal: Goal, worlds: WrongWorlds) -> list[SyntheticStep] | None:
    """Returns the row in which a thing is in the state that a goal asks for, or else in the hand."""
    if isinstance(goal, ObjectInState):
        state = {"openness": float(goal.value)} if goal.state == "is_open" else {"is_toggled": goal.value}
        return worlds.synthetic.row(worlds.synthetic.changed(object_id, **state))
    return worlds.synthetic.row(worlds.episode.setup.model_copy(update={"held": object_id}))


def _allows(thing: Thing, goal: ObjectInState | ObjectHeld) -> bool:
    if isinstance(goal, ObjectHeld):
        return thing.is_pickupable
    return thing.is_openable if goal.state == "is_open" else thing.is_toggleable


def _neighbour(goal: ObjectInState | ObjectHeld, worlds: WrongWorlds) -> Thing | None:
    """Returns the nearest thing of another category with which the same can be done."""
    return worlds.nearest(lambda thing: thing.category != worlds.target.category and _allows(thing, goal))


def _all_but_one(goal: AllOf, worlds: WrongWorlds) -> WrongRecords:
    """Yields the wrong ways in which one part of a goal is not there, or what it is about lies at another place."""
    for part in goal.parts:
        setup = _but_for(part, goal, worlds)
        yield "all but one", worlds.undone(setup)
        if isinstance(part, ObjectAtReceptacle):
            for name, setups in _misplaced(part, worlds, setup):
                yield from ((name, worlds.undone(each)) for each in setups)


def _but_for(left: GoalPart, goal: AllOf, worlds: WrongWorlds) -> Setup:
    """Returns the setup in which all parts of a goal hold but one, which does not."""
    setup, things = worlds.episode.setup, worlds.oracle.scene.things
    for part in goal.parts:
        if isinstance(part, ObjectInState):
            value = part.value != (part is left)
            state = {"openness": float(value)} if part.state == "is_open" else {"is_toggled": value}
            setup = with_change(setup, part.object_id, **state)
        elif part is not left:
            places = upon(things[part.receptacle_id], things[part.object_id], inside=part.inside)
            if (place := next(places, None)) is not None:
                setup = with_change(setup, part.object_id, placement=place)
    return setup


def _unresolved(goal: Goal, worlds: WrongWorlds) -> list[SyntheticStep] | None:
    """Returns the row in which the goal's own state is there, and its constraint as it was at the reset."""
    return _attained(goal.object_id, goal, worlds)


def _wrongly_placed(goal: ObjectAtReceptacle, worlds: WrongWorlds) -> WrongRecords:
    start = worlds.episode.setup
    yield "done and undone", worlds.undone(start)
    yield "put there and taken again", worlds.undone(start.model_copy(update={"held": worlds.target.id}))
    for name, setups in _misplaced(goal, worlds, start):
        yield from ((name, worlds.from_reset(worlds.synthetic.row(setup))) for setup in setups)
        if not setups:
            yield name, None


def _misplaced(goal: ObjectAtReceptacle, worlds: WrongWorlds, setup: Setup) -> list[tuple[str, list[Setup]]]:
    """Returns a setup changed so that something was put somewhere, but not the right thing into the right one."""
    worlds.synthetic.set_up(worlds.episode.setup)
    things = worlds.oracle.scene.things
    target, receptacle = things[goal.object_id], things[goal.receptacle_id]
    alike = worlds.alike if target.id == worlds.target.id else None
    kind = CATALOG[target.category]
    others = [
        thing
        for thing in things.values()
        if thing.category == receptacle.category and thing.id != receptacle.id and CATALOG[thing.category].takes(kind)
    ]
    on_top = list(upon(receptacle, target, inside=False)) if goal.inside else []

    def put(thing: Thing, placement: Placement) -> Setup:
        return with_change(setup, thing.id, placement=placement)

    found = [
        ("the neighbour instead", [put(target, at) for at in neighbours(things, receptacle, target)]),
        ("the receptacle's look-alike instead", [
            put(target, at) for other in others[:1] for at in islice(upon(other, target, inside=goal.inside), 1)
        ]),
        ("the look-alike instead", [
            put(other, at)
            for other in ([alike] if alike is not None else [])
            for at in islice(upon(receptacle, other, inside=goal.inside), 1)
        ]),
    ]  # fmt: skip
    if goal.inside:
        found.append(("on top instead of inside", [put(target, at) for at in on_top]))
    return found


def _wrongly_reported(goal: ReportStatus, worlds: WrongWorlds) -> WrongRecords:
    label = _label(worlds.record)
    thing, is_toggle = worlds.target, goal.state == "is_toggled"
    other = {"is_toggled": not thing.is_toggled} if is_toggle else {"openness": 0.0 if label == "open" else 1.0}
    changed = worlds.synthetic.row(worlds.synthetic.changed(thing.id, **other))
    restored = worlds.synthetic.row(worlds.episode.setup)
    start = worlds.episode.start
    away = start.model_copy(update={"rotation": wrap_deg(start.rotation + 180.0)})
    yield "changed, and reported as changed", worlds.from_reset(changed, OTHER_LABEL[label])
    yield "changed, and reported as it was", worlds.from_reset(changed, label)
    twice = None if changed is None or restored is None else [*changed, *restored]
    yield "done and undone", worlds.from_reset(twice, label)
    yield "reported with the back to it", worlds.from_reset(worlds.synthetic.row(worlds.episode.setup, away), label)


def _label(record: EpisodeRecord) -> Status:
    """Returns the label that the solution reports."""
    last = record.steps[-1].action
    assert isinstance(last, Report)
    return last.status
