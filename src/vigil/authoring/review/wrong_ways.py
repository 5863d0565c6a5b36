"""Obvious wrong ways: outcomes that look like success and must not count as it.

On top instead of inside, the look-alike, the wrong neighbour, done and undone again. Planning the walks would take too
long, so each is brought about by the simulator's own set-up, and judged by the same scoring as any run.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import assert_never

import numpy as np

from vigil.actions import InteractPixel, Report, Status
from vigil.assets.catalog import CATALOG
from vigil.authoring.language.referring import LOOK_ALIKES
from vigil.authoring.review.synthetic_records import SyntheticStep, SyntheticWorlds, record_of
from vigil.authoring.review.wrong_places import neighbours, upon
from vigil.authoring.solving.moves import click
from vigil.authoring.solving.oracle import Oracle
from vigil.episode import Episode
from vigil.goals import (
    STATE_LABELS,
    AgentNearTarget,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
)
from vigil.pose import Pose, floor_distance, wrap_deg, yaw_towards
from vigil.record import EpisodeRecord
from vigil.scene.geometry import box_distances, box_of
from vigil.scene.things import Thing
from vigil.scoring import settle
from vigil.world import Placement, Setup

SHORT_M = (0.03, 0.4)
"""How far beyond the threshold of nearness one stops short."""
NEAR_OTHER_M = 1.2
LOOK_M = (0.8, 2.5)
TRIED_POSES, TRIED_NEIGHBOURS = 6, 4
OTHER_LABEL: dict[Status, Status] = {
    **dict(STATE_LABELS.values()),
    **{negative: positive for positive, negative in STATE_LABELS.values()},
}


@dataclass(frozen=True, slots=True)
class WrongWay:
    """One wrong way, with its record; None where the house does not allow it."""

    name: str
    record: EpisodeRecord | None


def wins(episode: Episode, way: WrongWay) -> bool:
    """Whether a wrong way counts as success."""
    if way.record is None:
        return False
    outcome = settle(episode, way.record)
    return outcome.W or outcome.B


def wrong_ways(scenes: SyntheticWorlds, oracle: Oracle, record: EpisodeRecord) -> list[WrongWay]:
    """Returns the wrong ways of an episode whose solution's record is given. The simulator is left anywhere."""
    maker = _WrongWays(scenes, oracle, record)
    return [WrongWay(name, made) for name, made in maker.all()]


Made = Iterator[tuple[str, EpisodeRecord | None]]


class _WrongWays:
    """Makes the wrong ways of one episode."""

    def __init__(self, scenes: SyntheticWorlds, oracle: Oracle, record: EpisodeRecord) -> None:
        self.scenes, self.oracle, self.record = scenes, oracle, record
        self.episode: Episode = scenes.episode
        scenes.set_up(self.episode.setup)
        self.target = oracle.scene.things[self.episode.goal.object_id]
        self.alike = self._look_alike()

    def all(self) -> Made:
        goal = self.episode.goal
        match goal:
            case TargetGrounded():
                yield from self._grounded()
            case AgentNearTarget():
                yield from self._near(goal)
            case ObjectInState() if goal.state == "is_visible":
                yield "the look-alike is seen", self._from_reset(self._sight_of_alike())
            case ObjectInState():
                yield "the look-alike instead", self._from_reset(self._in_state(self.alike, goal))
                yield "the neighbour instead", self._from_reset(self._in_state(self._neighbour(goal), goal))
                yield "done and undone", self._undone(self.episode.setup)
            case ObjectHeld():
                yield "the look-alike instead", self._from_reset(self._held(self.alike))
                yield "the neighbour instead", self._from_reset(self._held(self._neighbour(goal)))
                yield "done and undone", self._undone(self.episode.setup)
            case ObjectAtReceptacle():
                yield from self._placed(goal)
            case ReportStatus():
                yield from self._reported(goal)
            case _:
                assert_never(goal)
        if goal.constraint is not None and goal.constraint.kind != "object_released":
            yield "the constraint is not resolved", self._from_reset(self._unresolved())

    # what the records are made of

    def _from_reset(self, rows: list[SyntheticStep] | None, status: Status = "success") -> EpisodeRecord | None:
        return None if rows is None else record_of(self.record, rows, status)

    def _undone(self, setup: Setup, pose: Pose | None = None) -> EpisodeRecord | None:
        """Returns the record of the solution after which the world is as a setup says, seen from where it ended."""
        rows = self.scenes.row(setup, pose or self.record.worlds[-1].agent)
        return None if rows is None else record_of(self.record, rows, "success", after_solution=True)

    def _look_alike(self) -> Thing | None:
        """Returns the nearest other thing of the target's category, else of a name that may be taken for its own."""
        name = CATALOG[self.target.category].spoken
        groups = [group for group in LOOK_ALIKES if name in group]
        return self._nearest(lambda thing: thing.category == self.target.category) or self._nearest(
            lambda thing: any(CATALOG[thing.category].spoken in group for group in groups)
        )

    def _nearest(self, is_wanted: Callable[[Thing], bool]) -> Thing | None:
        """Returns the nearest to the target of the other things that are wanted."""
        others = [
            thing
            for thing in self.oracle.scene.things.values()
            if thing.is_present and thing.id != self.target.id and is_wanted(thing)
        ]
        return min(others, key=lambda thing: floor_distance(thing.position, self.target.position), default=None)

    # PG

    def _grounded(self) -> Made:
        alike = self._click_on([self.alike] if self.alike else [])
        near = sorted(
            (thing for thing in self.oracle.scene.things.values() if thing.category != self.target.category),
            key=lambda thing: floor_distance(thing.position, self.target.position),
        )
        neighbour = self._click_on(near[:TRIED_NEIGHBOURS])
        yield "the look-alike instead", self._from_reset(alike)
        yield "the neighbour instead", self._from_reset(neighbour)
        undone = None if neighbour is None else record_of(self.record, neighbour, "success", after_solution=True)
        yield "done and undone", undone

    def _click_on(self, things: list[Thing]) -> list[SyntheticStep] | None:
        """Returns the row of a click on the first of some things that is in view and clear of the target."""
        self.scenes.set_up(self.episode.setup)
        for thing in things:
            pixel = self.oracle.clickable(thing.id) if thing.is_present else None
            if pixel is not None:
                ground: InteractPixel = click("ground", pixel)
                effect = self.scenes.simulator.step(ground)
                if self.target.id not in effect.near:
                    return [SyntheticStep(self.scenes.simulator.world(self.episode.bound_ids()), ground, effect)]
        return None

    # DA and VS

    def _near(self, goal: AgentNearTarget) -> Made:
        cells = self.oracle.plan().cells
        away = box_distances(box_of(self.target), cells) - goal.threshold_m
        short = cells[(away > SHORT_M[0]) & (away < SHORT_M[1])]
        yield "stopped short", self._from_reset(self._at(short))
        by_alike = None
        if self.alike is not None:
            near = box_distances(box_of(self.alike), cells) < min(NEAR_OTHER_M, goal.threshold_m)
            by_alike = self._at(cells[near & (away > SHORT_M[0])])
        yield "the look-alike instead", self._from_reset(by_alike)
        yield "done and undone", self._undone(self.episode.setup, self.episode.start)

    def _at(self, cells: np.ndarray) -> list[SyntheticStep] | None:
        pose = next(self._poses(cells, self.target), None)
        return None if pose is None else self.scenes.row(self.episode.setup, pose)

    def _poses(self, cells: np.ndarray, thing: Thing) -> Iterator[Pose]:
        """Yields some of the places, spread over them all, each facing a thing."""
        for x, z in cells[:: max(1, len(cells) // TRIED_POSES)]:
            place = self.episode.start.position._replace(x=float(x), z=float(z))
            yaw = yaw_towards(place, thing.position)
            yield self.episode.start.model_copy(update={"position": place, "rotation": yaw})

    def _sight_of_alike(self) -> list[SyntheticStep] | None:
        """Returns the row of a look at another thing of the category while the target is out of view."""
        if self.alike is None:
            return None
        cells = self.oracle.plan().cells
        away = box_distances(box_of(self.alike), cells)
        for pose in self._poses(cells[(away > LOOK_M[0]) & (away < LOOK_M[1])], self.alike):
            world = self.scenes.world(self.episode.setup, pose)
            is_hidden = world is not None and not world.objects[self.target.id].visible_px
            if world is not None and is_hidden and is_observable(self.oracle.state_of(self.alike.id)):
                return [SyntheticStep(world)]
        return None

    # AI, SI, CR

    def _in_state(self, thing: Thing | None, goal: ObjectInState) -> list[SyntheticStep] | None:
        if thing is None or not _allows(thing, goal):
            return None
        return self.scenes.row(self.scenes.changed(thing.id, **_state(goal)))

    def _held(self, thing: Thing | None) -> list[SyntheticStep] | None:
        if thing is None or not thing.is_pickupable:
            return None
        return self.scenes.row(self.episode.setup.model_copy(update={"held": thing.id}))

    def _neighbour(self, goal: ObjectInState | ObjectHeld) -> Thing | None:
        """Returns the nearest thing of another category with which the same can be done."""
        return self._nearest(lambda thing: thing.category != self.target.category and _allows(thing, goal))

    def _unresolved(self) -> list[SyntheticStep] | None:
        """Returns the row in which the goal's own state is there, and its constraint as it was at the reset."""
        goal = self.episode.goal
        if isinstance(goal, ObjectInState):
            return self.scenes.row(self.scenes.changed(goal.object_id, **_state(goal)))
        return self.scenes.row(self.episode.setup.model_copy(update={"held": goal.object_id}))

    # SV

    def _reported(self, goal: ReportStatus) -> Made:
        label = _label(self.record)
        thing, is_toggle = self.target, goal.state == "is_toggled"
        other = {"is_toggled": not thing.is_toggled} if is_toggle else {"openness": 0.0 if label == "open" else 1.0}
        changed = self.scenes.row(self.scenes.changed(thing.id, **other))
        restored = self.scenes.row(self.episode.setup)
        start = self.episode.start
        away = start.model_copy(update={"rotation": wrap_deg(start.rotation + 180.0)})
        yield "changed, and reported as changed", self._from_reset(changed, OTHER_LABEL[label])
        yield "changed, and reported as it was", self._from_reset(changed, label)
        twice = None if changed is None or restored is None else [*changed, *restored]
        yield "done and undone", self._from_reset(twice, label)
        yield "reported with the back to it", self._from_reset(self.scenes.row(self.episode.setup, away), label)

    # SM

    def _placed(self, goal: ObjectAtReceptacle) -> Made:
        start = self.episode.setup
        yield "done and undone", self._undone(start)
        yield "put there and taken again", self._undone(start.model_copy(update={"held": self.target.id}))
        for name, setups in self._misplaced(goal):
            yield from ((name, self._from_reset(self.scenes.row(setup))) for setup in setups)
            if not setups:
                yield name, None

    def _misplaced(self, goal: ObjectAtReceptacle) -> list[tuple[str, list[Setup]]]:
        """Returns the setups in which something was put somewhere, but not the right thing into the right one."""
        self.scenes.set_up(self.episode.setup)
        things, target, alike = self.oracle.scene.things, self.target, self.alike
        receptacle = things[goal.receptacle_id]
        kind = CATALOG[target.category]
        others = [
            thing
            for thing in things.values()
            if thing.category == receptacle.category
            and thing.id != receptacle.id
            and CATALOG[thing.category].takes(kind)
        ]
        on_top = list(upon(receptacle, target, inside=False)) if goal.inside else []
        found = [
            ("the neighbour instead", [self._with(target, at) for at in neighbours(things, receptacle, target)]),
            ("the receptacle's look-alike instead", [
                self._with(target, at) for other in others[:1] for at in islice(_proper(other, target, goal), 1)
            ]),
            ("the look-alike instead", [
                self._with(other, at)
                for other in ([alike] if alike is not None else [])
                for at in islice(_proper(receptacle, other, goal), 1)
            ]),
        ]  # fmt: skip
        if goal.inside:
            found.append(("on top instead of inside", [self._with(target, at) for at in on_top]))
        return found

    def _with(self, thing: Thing, placement: Placement) -> Setup:
        return self.scenes.changed(thing.id, placement=placement)


def _proper(receptacle: Thing, thing: Thing, goal: ObjectAtReceptacle) -> Iterator[Placement]:
    """Yields the places of a thing in a receptacle that the goal's words ask for."""
    return upon(receptacle, thing, inside=goal.inside)


def _allows(thing: Thing, goal: ObjectInState | ObjectHeld) -> bool:
    if isinstance(goal, ObjectHeld):
        return thing.is_pickupable
    return thing.is_openable if goal.state == "is_open" else thing.is_toggleable


def _state(goal: ObjectInState) -> dict[str, float | bool]:
    return {"openness": float(goal.value)} if goal.state == "is_open" else {"is_toggled": goal.value}


def _label(record: EpisodeRecord) -> Status:
    """Returns the label that the solution reports."""
    last = record.steps[-1].action
    assert isinstance(last, Report)
    return last.status
