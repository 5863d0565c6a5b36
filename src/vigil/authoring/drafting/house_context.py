"""A house, loaded to propose episodes in it: its things, random start poses, and phrases that mean its things."""

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import islice

import numpy as np
import shapely
from cachetools import LRUCache, cached
from shapely.geometry.base import BaseGeometry

from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.hard_starts import naming_cost, start_cost
from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.referring import (
    DESCRIPTION_CACHE_SIZE,
    DescribedThing,
    Phrase,
    description_key,
    items_as_seen,
    phrase_for,
    without_repeats,
)
from vigil.authoring.language.sentences import Forms, Sentences
from vigil.authoring.language.wording import Act, order_slots, pronoun_slots, say
from vigil.authoring.solving.look_targets import PointCount, places_seeing_enough, surface_points
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3, wrap_deg, yaw_towards
from vigil.errors import EpisodeError
from vigil.housegen.document import seed_of
from vigil.protocol.actions import REACH_M
from vigil.protocol.episode import Episode, HouseRef, Provenance
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.family import TargetSize
from vigil.protocol.goals import Goal
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, ObjectState, Setup
from vigil.scene.floor import has_room_to_move
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.things import Scene, Thing
from vigil.sim.privileged import PrivilegedSimulator

AUTHOR = "grammar"
OPENED_BELOW = 0.5
"""Doors between rooms whose openness is below this are opened at the start."""
TRIED_STARTS = 80
SIGHT_POINTS = 128
"""Number of points on a thing's surface whose visibility from a place is tested."""
SEEN_SHARE = 0.6
"""Minimum number of a thing's points that must be visible from a start, as a share of the number at the best place."""
SEEN_SHARE_HARD, DISTANCE_FACTOR = 0.3, 1.5
"""If hard starts are preferred: the share of points that replaces SEEN_SHARE, and a factor on the maximum distance."""
SPREADS_DEG = (42.0, 25.0, 12.0)
"""Maximum angles (deg) between a start's heading and the direction of its target, tried one after the other."""
MARGIN_PX = 20
"""Number of visible pixels required in addition to the number that the rules require."""
STANDING_POSE_SHARES = ((0.5, 0.5), (0.3, 0.5), (0.7, 0.5), (0.5, 0.3), (0.5, 0.7), (0.3, 0.3), (0.7, 0.7))
"""Places in which the agent stands while episodes are drafted, as shares of a room's extent along x and z."""

PositionMask = Callable[[np.ndarray], np.ndarray]
"""Function that takes places (n, 2) in x, z and returns a mask (n,) of the wanted places."""


@dataclass(frozen=True, slots=True)
class VisibilityTest:
    """A test of whether an object is clearly seen. It is applied to the object's state as observed from a pose."""

    min_px: int
    """Number of visible pixels below which the test always fails, so that it does not have to be run."""
    is_met: Callable[[ObjectState], bool]


@dataclass(frozen=True, slots=True)
class TaskSpec:
    """The parts of an episode that a proposal chooses."""

    start: Pose
    instruction: str
    goal: Goal
    bindings: dict[str, str]
    setup: Setup = field(default_factory=Setup)
    template: str = ""
    target_size: TargetSize | None = None


class HouseContext:
    """One house, loaded in a simulator, with functions that help to draft episodes in it."""

    def __init__(self, simulator: PrivilegedSimulator, house: House, rng: np.random.Generator) -> None:
        """Load the house. Raises HouseError if it is invalid, EpisodeError if it has no free place to stand."""
        self.simulator = simulator
        self.house = house
        self.rng = rng
        self.allowed_ids: frozenset[str] | None = None
        """Ids of the things that may be chosen; None if all things may be chosen."""
        self.tried_starts = TRIED_STARTS
        """Number of places that are tried for one start."""
        self.compared_starts = 1
        """Number of start poses drawn for each draft; the hardest is used.

        If it is more than one, objects that are hard to name come first.
        """
        self.forms: Forms = "public"
        """Sentence forms from which instructions are drawn: one of two halves (such as `public`), or all."""
        simulator.load(house)
        self._standing_poses = _standing_poses(simulator, house)
        self.begin(Setup())
        self.view = PrivilegedView(simulator)

    @property
    def prefers_hard_starts(self) -> bool:
        """Whether several starts are compared and the hardest is used."""
        return self.compared_starts > 1

    def begin(self, setup: Setup) -> None:
        """Reset the house with a setup, and open the closed doors between rooms. Raises EpisodeError if impossible."""
        complete = self.with_open_doors(setup)
        for home in self._standing_poses[:-1]:
            try:
                self.simulator.reset(home, complete)
            except EpisodeError:  # an opened door may occupy this place: try the next one
                continue
            return
        self.simulator.reset(self._standing_poses[-1], complete)

    def can_begin(self, setup: Setup) -> bool:
        """Reset the house with a setup and return True. If the setup is impossible, reset without it and return False.

        A setup is impossible if a leaf (door, lid or drawer) would go through a wall, or if a placement is invalid.
        """
        try:
            self.begin(setup)
        except EpisodeError:
            self.begin(Setup())
            return False
        return True

    def with_open_doors(self, setup: Setup) -> Setup:
        """Return a setup that also opens the closed doors between rooms, except doors that `setup` already changes."""
        doors = [door for door in self.house.document.doors if door.joins_rooms]
        doors = [door for door in doors if door.openable and (door.openness or 0.0) < OPENED_BELOW]
        opened = {door.id: ObjectSetup(openness=1.0) for door in doors}
        return setup.model_copy(update={"objects": {**opened, **setup.objects}})

    @property
    def items(self) -> dict[str, DescribedThing]:
        """Thing id -> description of the thing in its current state, as a person who sees it would describe it."""
        return items_as_seen(self.view.scene)

    def thing(self, thing_id: str) -> Thing:
        """Return a thing in its current state."""
        return self.view.scene.things[thing_id]

    def phrase(self, thing_id: str) -> Phrase | None:
        """Return the shortest phrase that means only this thing, in the current state; None if there is none."""
        return phrase_finder(self.view.scene)(thing_id)

    def say(self, sentences: Sentences, **slots: str) -> str:
        """Return a random sentence from the half of `sentences` that is in use, with its slots filled."""
        return say(sentences.of(self.forms), self.rng, **slots)

    def order(self, sentences: Sentences, act: Act | None, thing: Thing, phrase: Phrase | str | None) -> str:
        """Return a random sentence (of the forms in use) that asks for an act on a thing; `phrase` means the thing."""
        words = {} if act is None else order_slots(act, thing.category, str(phrase), self.rng)
        return self.say(sentences, target=str(phrase), **words | pronoun_slots(thing.category))

    def start_and_phrases(
        self, setup: Setup, things: Mapping[str, Thing], find_start: Callable[[dict[str, Phrase]], Pose | None]
    ) -> tuple[Pose, dict[str, Phrase]] | None:
        """Return a start in the house with a setup, and a phrase for each of `things` under the same key.

        `find_start` takes the phrases and returns the start. It is called while the house has the setup, which is
        removed afterwards. None if the setup is impossible, a thing cannot be named, or there is no start.
        """
        if not self.can_begin(setup):
            return None
        phrases = {key: phrase for key, thing in things.items() if (phrase := self.phrase(thing.id)) is not None}
        start = find_start(phrases)
        self.begin(Setup())
        return None if start is None or len(phrases) < len(things) else (start, phrases)

    def shuffled(self, things: list[Thing]) -> list[Thing]:
        """Return things in a random order."""
        return [things[index] for index in self.rng.permutation(len(things))]

    def things(self, is_wanted: Callable[[Thing], bool]) -> list[Thing]:
        """Return the wanted things that a phrase can name. Of each piece of furniture, at most one drawer is included.

        The order is random. If hard starts are preferred, the things that are hardest to name come first.
        """
        wanted = [thing for thing in self.view.scene.things.values() if thing.is_present and is_wanted(thing)]
        if self.allowed_ids is not None:
            wanted = [thing for thing in wanted if thing.id in self.allowed_ids]
        phrase_of = phrase_finder(self.view.scene)
        named = [thing for thing in self.shuffled(wanted) if phrase_of(thing.id)]
        drawers = {thing.parent: thing for thing in reversed(named) if thing.is_drawer}
        named = [thing for thing in named if not thing.is_drawer or drawers[thing.parent] is thing]
        if not self.prefers_hard_starts:
            return named
        items = self.items
        return sorted(named, key=lambda thing: -naming_cost(items[thing.id], items.values()))

    def starts(self, is_wanted: PositionMask, tried: int | None = None) -> Iterator[Vec3]:
        """Yield at most `tried` places that can be reached and are wanted, in a random order."""
        walks = self.view.walks()
        yield from self._drawn(walks.plan.cells[np.isfinite(walks.lengths)], is_wanted, tried or self.tried_starts)

    def places_in(self, region: BaseGeometry, is_wanted: PositionMask, tried: int) -> Iterator[Vec3]:
        """Yield at most `tried` wanted places in a region of the free floor, in a random order, reachable or not."""
        cells = self.view.plan().cells
        yield from self._drawn(cells[shapely.contains_xy(region, cells[:, 0], cells[:, 1])], is_wanted, tried)

    def _drawn(self, cells: np.ndarray, is_wanted: PositionMask, tried: int) -> Iterator[Vec3]:
        cells = cells[is_wanted(cells)] if len(cells) else cells
        for index in self.rng.permutation(len(cells))[:tried]:
            x, z = (round(float(value), 3) for value in cells[index])
            yield Vec3(x, 0.0, z)

    def facing(self, place: Vec3, thing: Thing, horizon: float, spread_deg: float, aside_deg: float = 0.0) -> Pose:
        """Return a pose at `place` whose heading is `aside_deg` right of a thing's direction, plus a random angle.

        The random angle is at most `spread_deg` to either side; `horizon` is the camera's pitch (deg).
        """
        yaw = yaw_towards(place, thing.position) + aside_deg + float(self.rng.uniform(-spread_deg, spread_deg))
        return Pose(position=place, rotation=float(round(wrap_deg(yaw)) % 360), horizon=horizon)

    def has_room_to_move(self, pose: Pose) -> bool:
        """Return whether the agent has room to move at a pose, which every start requires."""
        return has_room_to_move(self.view.plan().tight, pose)

    def is_out_of_view_from(self, pose: Pose, thing_id: str) -> bool:
        """Return whether no pixel shows a thing from a pose."""
        with self.view.at_pose(pose):
            return not self.view.is_in_frame(thing_id)

    def visible_points(self, place: Vec3, thing: Thing) -> PointCount:
        """Return a counter of a thing's points that are visible from a place in any direction; it counts on demand."""
        eye = Pose(position=place, rotation=0.0).eye
        return PointCount(
            surface_points(thing, SIGHT_POINTS),
            lambda points: self.view.sees(eye, points, thing.id, through_glass=True),
        )

    def is_visible_from(self, place: Vec3, thing: Thing) -> bool:
        """Return whether any sampled point of a thing is visible from a place, in any direction."""
        return self.visible_points(place, thing).is_at_least(1)

    def start_seeing(
        self,
        thing: Thing,
        away: tuple[float, float],
        horizon: float,
        is_clear: VisibilityTest,
        also: Callable[[Pose], bool] = lambda _: True,
    ) -> Pose | None:
        """Return a start pose from which a thing is clearly seen, and for which `also` is true; None if none is found.

        `away` has the minimum and the maximum distance (m) from the thing's box; `horizon` is the camera's pitch (deg).
        """
        farther = DISTANCE_FACTOR if self.prefers_hard_starts and away[1] > REACH_M else 1.0
        places = list(self.starts(self.away_from(thing, away[0], farther * away[1])))
        share = SEEN_SHARE_HARD if self.prefers_hard_starts else SEEN_SHARE

        def poses() -> Iterator[Pose]:
            for place in places_seeing_enough(places, lambda place: self.visible_points(place, thing), share):
                for spread_deg in SPREADS_DEG:
                    pose = self.facing(place, thing, horizon, spread_deg)
                    if self.has_room_to_move(pose) and also(pose) and self.sees_clearly(pose, [thing.id], is_clear):
                        yield pose
                        break

        return self.hardest(poses(), thing)

    def hardest(self, poses: Iterator[Pose], thing: Thing) -> Pose | None:
        """Return the hardest of the first `compared_starts` poses for an episode about a thing; None for no poses."""
        found = list(islice(poses, self.compared_starts))
        if len(found) < 2:
            return next(iter(found), None)
        items = self.items
        others = [other.id for other in confusable(items[thing.id], items.values())]
        return max(found, key=lambda pose: start_cost(self.view, thing, others, pose))

    def sees_clearly(self, pose: Pose, thing_ids: list[str], is_clear: VisibilityTest) -> bool:
        """Return whether all of the things are clearly seen from a pose."""
        view = self.view
        with view.at_pose(pose):
            return all(
                view.may_be_visible(thing_id, is_clear.min_px) and is_clear.is_met(view.state_of(thing_id))
                for thing_id in thing_ids
            )

    def away_from(self, thing: Thing, least_m: float, most_m: float) -> PositionMask:
        """Return the mask of places whose distance (m) from a thing's box is between `least_m` and `most_m`."""
        box = body_box(thing)

        def mask(places: np.ndarray) -> np.ndarray:
            distances = box_distances(box, places)
            return (distances >= least_m) & (distances <= most_m)

        return mask

    def rejection(self, family: Family, kind: str, rule: str, message: str, instruction: str = "") -> Rejection:
        """Return the rejection of a proposal for this house."""
        where = self.house.name
        return Rejection(family=family, kind=kind, house=where, rule=rule, message=message, instruction=instruction)

    def draft(self, family: Family, ask: TaskSpec) -> Episode:
        """Return an episode in this house that is not checked yet; its id is "draft"."""
        spec = FAMILIES[family]
        return Episode(
            id="draft",
            family=family,
            house=HouseRef(name=self.house.name, sha256=self.house.sha256),
            start=ask.start,
            setup=self.with_open_doors(ask.setup),
            instruction=without_repeats(ask.instruction, [item.name for item in self.items.values()]),
            goal=ask.goal,
            bindings=ask.bindings,
            max_steps=spec.max_steps,
            max_invalid=spec.max_invalid,
            target_size=ask.target_size,
            provenance=Provenance(author=AUTHOR, template=ask.template, seed=seed_of(self.house)),
        )


def _standing_poses(simulator: PrivilegedSimulator, house: House) -> list[Pose]:
    """Return free poses in which to stand while episodes are drafted: the house's start, then places in all rooms.

    Raises EpisodeError if there are none.
    """
    homes = [house.start] if house.start is not None else []
    for room in simulator.scene().rooms:
        low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
        for share_x, share_z in STANDING_POSE_SHARES:
            x, z = float(low[0] + share_x * (high[0] - low[0])), float(low[1] + share_z * (high[1] - low[1]))
            homes.append(Pose(position=Vec3(x, 0.0, z), rotation=0.0))
    free = [home for home in homes if simulator.can_stand(home.position)]
    if not free:
        raise EpisodeError(
            f"House {house.name!r} does not have a free place where the agent can stand, so it cannot hold an episode."
        )
    return free


@cached(LRUCache(DESCRIPTION_CACHE_SIZE), key=description_key, lock=threading.Lock())
def phrase_finder(scene: Scene) -> Callable[[str], Phrase | None]:
    """Return a function that takes a thing's id and returns the shortest phrase that means only this thing, or None.

    The phrase is what a person would say who sees the things in the current state of the scene.
    """
    items = items_as_seen(scene)
    return cache(lambda thing_id: phrase_for(items[thing_id], items.values()))
