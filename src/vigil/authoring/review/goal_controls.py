"""The negative controls of each kind of goal: outcomes in which it only seems that the goal was reached."""

from collections.abc import Iterator
from itertools import islice
from typing import assert_never

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.authoring.review.control_worlds import ControlWorlds
from vigil.authoring.review.placements import placements_in_openings, placements_on, placements_on_neighbours
from vigil.authoring.review.synthetic_records import SyntheticStep, changed_setup
from vigil.base.geometry import floor_distance, wrap_deg
from vigil.protocol.actions import Report
from vigil.protocol.goals import (
    OTHER_LABEL,
    AgentNearTarget,
    AllOf,
    Chores,
    Goal,
    GoalPart,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
)
from vigil.protocol.world import Placement, Setup
from vigil.records.record import EpisodeRecord
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.things import Thing

STOPPED_SHORT_M = (0.03, 0.4)
"""Minimum and maximum distance (m) beyond the goal's threshold at which the agent stops short."""
NEAR_OTHER_M = 1.2
"""Maximum distance (m) between the agent and the look-alike, in the control in which it approaches the look-alike."""
LOOK_M = (0.8, 2.5)
"""Minimum and maximum distance (m) from which the agent looks at the look-alike."""
TRIED_NEIGHBOURS = 4
ON_TOP_NOT_INSIDE, INSIDE_NOT_ON_TOP = "on top instead of inside", "within it instead of on it"

ControlRecords = Iterator[tuple[str, EpisodeRecord | None]]
"""Pairs of a negative control's name and its record. The record is None if the control is impossible in this house."""


def controls_of_goal(goal: Goal, worlds: ControlWorlds) -> ControlRecords:
    """Yield the negative controls of an episode's goal. The simulator may be left in any state."""
    match goal:
        case TargetGrounded():
            yield from _grounding_controls(worlds)
        case AgentNearTarget():
            yield from _approach_controls(goal, worlds)
        case ObjectInState() if goal.state == "is_visible":
            yield "the look-alike is seen", worlds.from_reset(_look_alike_seen(worlds))
        case ObjectInState() | ObjectHeld():
            yield "the look-alike instead", worlds.from_reset(_applied_to(worlds.look_alike, goal, worlds))
            yield "the neighbour instead", worlds.from_reset(_applied_to(_neighbour(goal, worlds), goal, worlds))
            yield "done and undone", worlds.undone(worlds.episode.setup)
        case ObjectAtReceptacle():
            yield from _placement_controls(goal, worlds)
        case ReportStatus():
            yield from _report_controls(goal, worlds)
        case AllOf():
            yield from _all_but_one(goal, worlds)
            yield "done and undone", worlds.undone(worlds.episode.setup)
        case Chores():
            yield "done and undone", worlds.undone(worlds.episode.setup)
        case _:
            assert_never(goal)
    if goal.constraint is not None and goal.constraint.kind != "object_released":
        yield "the constraint is not resolved", worlds.from_reset(_attained(goal.object_id, goal, worlds))


def _grounding_controls(worlds: ControlWorlds) -> ControlRecords:
    look_alike = worlds.click_on([worlds.look_alike] if worlds.look_alike else [])
    near = sorted(
        (thing for thing in worlds.view.scene.things.values() if thing.category != worlds.target.category),
        key=lambda thing: floor_distance(thing.position, worlds.target.position),
    )
    neighbour = worlds.click_on(near[:TRIED_NEIGHBOURS])
    yield "the look-alike instead", worlds.from_reset(look_alike)
    yield "the neighbour instead", worlds.from_reset(neighbour)
    yield "done and undone", worlds.after_solution(neighbour)


def _approach_controls(goal: AgentNearTarget, worlds: ControlWorlds) -> ControlRecords:
    cells = worlds.view.plan().cells
    away = box_distances(body_box(worlds.target), cells) - goal.threshold_m
    short = cells[(away > STOPPED_SHORT_M[0]) & (away < STOPPED_SHORT_M[1])]
    yield "stopped short", worlds.from_reset(_at(short, worlds))
    by_look_alike = None
    if worlds.look_alike is not None:
        near = box_distances(body_box(worlds.look_alike), cells) < min(NEAR_OTHER_M, goal.threshold_m)
        by_look_alike = _at(cells[near & (away > STOPPED_SHORT_M[0])], worlds)
    yield "the look-alike instead", worlds.from_reset(by_look_alike)
    yield "done and undone", worlds.undone(worlds.episode.setup, worlds.episode.start)


def _at(cells: np.ndarray, worlds: ControlWorlds) -> list[SyntheticStep] | None:
    pose = next(worlds.poses(cells, worlds.target), None)
    return None if pose is None else worlds.row(worlds.episode.setup, pose)


def _look_alike_seen(worlds: ControlWorlds) -> list[SyntheticStep] | None:
    """Return a step at which the look-alike is observable but the target is not visible; None if this is impossible."""
    look_alike = worlds.look_alike
    if look_alike is None:
        return None
    cells = worlds.view.plan().cells
    away = box_distances(body_box(look_alike), cells)
    for pose in worlds.poses(cells[(away > LOOK_M[0]) & (away < LOOK_M[1])], look_alike):
        world = worlds.world(worlds.episode.setup, pose)
        is_hidden = world is not None and not world.objects[worlds.target.id].visible_px
        if world is not None and is_hidden and is_observable(worlds.view.state_of(look_alike.id)):
            return [SyntheticStep(world)]
    return None


def _applied_to(
    thing: Thing | None, goal: ObjectInState | ObjectHeld, worlds: ControlWorlds
) -> list[SyntheticStep] | None:
    """Return a step after which `thing`, not the target, is as the goal requires; None if this is impossible."""
    return None if thing is None or not _allows(thing, goal) else _attained(thing.id, goal, worlds)


def _attained(object_id: str, goal: Goal, worlds: ControlWorlds) -> list[SyntheticStep] | None:
    """Return a step after which a thing is in the state that the goal requires; for goals without a state, in the hand.

    Everything else is as at the reset. None if this is impossible.
    """
    if isinstance(goal, ObjectInState):
        state = {"openness": float(goal.value)} if goal.state == "is_open" else {"is_toggled": goal.value}
        return worlds.row(changed_setup(worlds.episode.setup, object_id, **state))
    return worlds.row(worlds.episode.setup.model_copy(update={"held": object_id}))


def _allows(thing: Thing, goal: ObjectInState | ObjectHeld) -> bool:
    if isinstance(goal, ObjectHeld):
        return thing.is_pickupable
    return thing.is_openable if goal.state == "is_open" else thing.is_toggleable


def _neighbour(goal: ObjectInState | ObjectHeld, worlds: ControlWorlds) -> Thing | None:
    """Return the nearest thing of another category to which the goal's act can be done."""
    return worlds.nearest(lambda thing: thing.category != worlds.target.category and _allows(thing, goal))


def _all_but_one(goal: AllOf, worlds: ControlWorlds) -> ControlRecords:
    """Yield controls in which one part of a goal does not hold: its object has another state or a wrong place."""
    for part in goal.parts:
        setup = _setup_without_part(part, goal, worlds)
        yield "all but one", worlds.undone(setup)
        if isinstance(part, ObjectAtReceptacle):
            for name, setups in _misplaced(part, worlds, setup):
                yield from ((name, worlds.undone(each)) for each in setups)


def _setup_without_part(left: GoalPart, goal: AllOf, worlds: ControlWorlds) -> Setup:
    """Return the setup in which all parts of a goal hold except `left`."""
    setup, things = worlds.episode.setup, worlds.view.scene.things
    for part in goal.parts:
        if isinstance(part, ObjectInState):
            value = part.value != (part is left)
            state = {"openness": float(value)} if part.state == "is_open" else {"is_toggled": value}
            setup = changed_setup(setup, part.object_id, **state)
        elif part is not left:
            places = placements_on(things[part.receptacle_id], things[part.object_id], inside=part.inside)
            if (place := next(places, None)) is not None:
                setup = changed_setup(setup, part.object_id, placement=place)
    return setup


def _placement_controls(goal: ObjectAtReceptacle, worlds: ControlWorlds) -> ControlRecords:
    start = worlds.episode.setup
    yield "done and undone", worlds.undone(start)
    yield "put there and taken again", worlds.undone(start.model_copy(update={"held": worlds.target.id}))
    for name, setups in _misplaced(goal, worlds, start):
        yield from ((name, worlds.from_reset(worlds.row(setup))) for setup in setups)
        if not setups:
            yield name, None


def _misplaced(goal: ObjectAtReceptacle, worlds: ControlWorlds, setup: Setup) -> list[tuple[str, list[Setup]]]:
    """Return (name, setups) of each control in which the wrong object is used or an object is at a wrong place."""
    if not worlds.set_up(setup):
        return []
    scene, things = worlds.view.scene, worlds.view.scene.things
    target, receptacle = things[goal.object_id], things[goal.receptacle_id]
    look_alike = worlds.look_alike if target.id == worlds.target.id else None
    kind = CATALOG[target.category]
    others = [
        thing
        for thing in things.values()
        if thing.category == receptacle.category
        and thing.id != receptacle.id
        and CATALOG[thing.category].can_hold(kind)
    ]
    elsewhere = list(
        placements_on(receptacle, target, inside=False)
        if goal.inside
        else placements_in_openings(scene, receptacle, target)
    )

    def put(thing: Thing, placement: Placement) -> Setup:
        return changed_setup(setup, thing.id, placement=placement)

    return [
        ("the neighbour instead", [put(target, at) for at in placements_on_neighbours(scene, receptacle, target)]),
        ("the receptacle's look-alike instead", [
            put(target, at)
            for other in others[:1]
            for at in islice(placements_on(other, target, inside=goal.inside), 1)
        ]),
        ("the look-alike instead", [
            put(other, at)
            for other in ([look_alike] if look_alike is not None else [])
            for at in islice(placements_on(receptacle, other, inside=goal.inside), 1)
        ]),
        (ON_TOP_NOT_INSIDE if goal.inside else INSIDE_NOT_ON_TOP, [put(target, at) for at in elsewhere]),
    ]  # fmt: skip


def _report_controls(goal: ReportStatus, worlds: ControlWorlds) -> ControlRecords:
    last = worlds.record.steps[-1].action
    assert isinstance(last, Report)
    label = last.status
    thing, is_toggle = worlds.target, goal.state == "is_toggled"
    other = {"is_toggled": not thing.is_toggled} if is_toggle else {"openness": 0.0 if label == "open" else 1.0}
    setup, start = worlds.episode.setup, worlds.episode.start
    changed, restored = worlds.row(changed_setup(setup, thing.id, **other)), worlds.row(setup)
    away = start.model_copy(update={"rotation": wrap_deg(start.rotation + 180.0)})
    yield "changed, and reported as changed", worlds.from_reset(changed, OTHER_LABEL[label])
    yield "changed, and reported as it was", worlds.from_reset(changed, label)
    twice = None if changed is None or restored is None else [*changed, *restored]
    yield "done and undone", worlds.from_reset(twice, label)
    yield "reported with the back to it", worlds.from_reset(worlds.row(setup, away), label)
