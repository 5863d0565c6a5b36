"""Macro actions of a body that errs and sees no more of what is in its way than the frames have shown.

What to do and from where it can be done it is told (`vigil.authoring.solving.macro_actions`); the way there it finds by
sight, turn by turn, and after each action it looks at what has become of it.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from vigil.authoring.solving import moves
from vigil.authoring.solving.aim import in_frame, surface_points
from vigil.authoring.solving.clearance import WaysTo
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.noisy_body import NoisyBody
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.solving.paths import Point2
from vigil.authoring.solving.viewpoints import Viewpoint, view_ahead
from vigil.base.geometry import Pose, Vec3, heading, turn_between, yaw_towards
from vigil.protocol.actions import REACH_M, STEP_M, Action, Intent, InteractPixel, Navigate
from vigil.scene.geometry import box_of
from vigil.scene.things import Thing
from vigil.sim.core.sight import project

SLACK_M = 0.3
ARRIVED_M, EXACTLY_M = 0.2, 0.06
"""How near a place is as good as there, at first and where that was not enough."""
FACED_DEG, TILTED_DEG = 6.0, 5.0
ASIDE_DEG = 15
CLEAR_PX = 8
"""How far from the frame's border a click is aimed, if one can turn."""
SEEN_POINTS = 16
SIGHT_M = 4.0
LOOKS = 3
LOOK_ABOUT_DEG = (25.0, -50.0)
"""Turns, one after the other, when what should be in view is not."""


class NoisyMacroActions(MacroActions):
    """The macro actions of a body that errs. They go on trying; who plays them counts the steps."""

    slacks_m = (SLACK_M, 0.0)

    def __init__(self, oracle: Oracle, rng: np.random.Generator) -> None:
        super().__init__(oracle, may_tilt=True)
        self._body = NoisyBody(rng)
        self._known = KnownFloor(oracle, self._body)
        self._refused: float | None = None
        """The heading in which the last walk got nowhere."""

    def go(self, view: Viewpoint, is_there: Callable[[], bool] | None = None) -> Iterator[Action]:
        """Walks to a view and faces it; with `is_there` stops as soon as that holds, else goes nearer and looks about.

        Raises Unsolvable when there is no way.
        """
        if is_there is None:
            yield from self._approach(view, lambda: False)
            return
        for within_m in (ARRIVED_M, EXACTLY_M):
            yield from self._approach(view, is_there, within_m)
        for angle in LOOK_ABOUT_DEG:
            if is_there():
                return
            yield from self._body.turn(self.oracle.agent.rotation, self.oracle.agent.rotation + angle)

    def _approach(self, view: Viewpoint, is_there: Callable[[], bool], within_m: float = ARRIVED_M) -> Iterator[Action]:
        here = self.oracle.agent.position
        yield from self._walk_to(view.corners[-1] if view.corners else (here.x, here.z), is_there, within_m)
        for _ in range(LOOKS):
            faced = [] if is_there() else list(self._face(view.pose))
            yield from faced
            if not faced:
                return

    def act(self, intent: Intent, thing_id: str) -> Iterator[Action]:
        """Goes to where a click on the thing works, and clicks until one sees that it has worked. Raises Unsolvable."""
        thing, in_hand = self.oracle.scene.things[thing_id], self.oracle.held

        def facts() -> tuple:
            return thing.openness, thing.is_toggled, thing.is_held

        before = facts()
        while facts() == before:
            yield from self._try(
                lambda: self._pixel_of(intent, thing), lambda: self.find(intent, thing_id)[0], intent
            )  # fmt: skip
            if self.oracle.held not in (in_hand, thing_id):
                yield from self.put_down(lambda: True)

    def place(self, receptacle_id: str, *, inside: bool, is_thorough: bool = False) -> Iterator[Action]:
        """Puts what is in the hand inside a receptacle, or on it; what went elsewhere is taken up again.

        Raises Unsolvable.
        """
        held = self.oracle.held
        spots = self.spots_of(receptacle_id, inside=inside)
        query = self.query_of(spots, 0.0)
        while held is not None and not spots.hold(self.oracle.scene.things[held]):
            if self.oracle.held != held:
                yield from self.act("pick", held)
            yield from self._try(
                lambda: self.placing_pixel(view_ahead(self.oracle, query), spots),
                lambda: self.find_place(spots, is_thorough=is_thorough)[0],
                "place",
            )

    def put_down(self, is_good: Callable[[], bool]) -> Iterator[Action]:
        """Drops what is in the hand near by, where `is_good` says that it is out of the way. Raises Unsolvable."""
        drop = InteractPixel(intent="drop")

        def can_drop() -> bool:
            return self.oracle.trial(drop, lambda _: is_good()) is None

        while not can_drop():
            yield from self._go_on(self.find_drop(is_good), can_drop)
        yield drop

    def click(self, intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
        """Returns a click near a pixel."""
        return self._body.click(intent, pixel)

    def _try(
        self, aim: Callable[[], tuple[int, int] | None], view: Callable[[], Viewpoint], intent: Intent
    ) -> Iterator[Action]:
        """Yields one click at what is aimed at, or else what brings one to where it can be aimed at."""
        aimed = self._once_a_moment(aim)
        pixel = aimed()
        if pixel is None or not _is_clear(pixel):
            yield from self._go_on(view(), lambda: _is_clear(aimed()))
            pixel = aimed()
        if pixel is not None:
            yield self.click(intent, pixel)

    def _once_a_moment(self, aim: Callable[[], tuple[int, int] | None]) -> Callable[[], tuple[int, int] | None]:
        """Returns a function that answers as `aim` does, and works it out anew only where the world has changed."""
        last: tuple[tuple, tuple[int, int] | None] | None = None

        def aimed() -> tuple[int, int] | None:
            nonlocal last
            now = self.oracle.moment()
            if last is None or last[0] != now:
                last = now, aim()
            return last[1]

        return aimed

    def _go_on(self, view: Viewpoint, is_there: Callable[[], bool]) -> Iterator[Action]:
        """Yields what brings one to a view; at least one action: who stands about right goes nearer, or turns."""
        for within_m in (ARRIVED_M, EXACTLY_M):
            is_idle = True
            for action in self._approach(view, is_there, within_m):
                is_idle = False
                yield action
            if not is_idle or is_there():
                return
        yield Navigate(mode="turn_right", magnitude=float(ASIDE_DEG))

    def _pixel_of(self, intent: Intent, thing: Thing) -> tuple[int, int] | None:
        """Returns where a click would work now."""
        if box_of(thing).floor_distance(self.oracle.agent.position) > REACH_M:
            return None
        pixel = self.oracle.clickable(thing.id)
        return pixel if pixel is not None and self.oracle.trial(moves.click(intent, pixel)) is None else None

    def _walk_to(self, place: Point2, is_there: Callable[[], bool], within_m: float) -> Iterator[Action]:
        while True:
            self._known.look()
            here = self.oracle.agent
            if is_there() or math.dist((here.position.x, here.position.z), place) <= within_m:
                return
            yield from self._move(here, self._known.ways_to(place), self._known.judged_room())

    def _move(self, here: Pose, ways: WaysTo, room: np.ndarray) -> Iterator[Action]:
        """Yields one turn or one walk on the way. Raises Unsolvable when there is no way."""
        at = here.position.x, here.position.z
        corner = ways.waypoint(at, room)
        if corner is None:
            raise Unsolvable("What is known of the floor leaves no way.")
        wanted = yaw_towards(here.position, Vec3(corner[0], here.position.y, corner[1]))
        length = math.dist(at, corner)
        if self._refused is not None:
            wanted, length = self._heading_aside(at, wanted, lambda end: ways.cost_of(at, end, room)), STEP_M
        if abs(turn_between(here.rotation, wanted)) > FACED_DEG:
            yield from self._body.turn(here.rotation, wanted)
            return
        walk = self._body.walk(length)
        with self.oracle.rehearsal():
            effect = self.oracle.step(walk)
        yield walk
        self._known.learn(effect.blocked_by)
        self._refused = None if effect.moved_m else here.rotation

    def _heading_aside(self, at: Point2, wanted: float, cost_of: Callable[[Point2], float]) -> float:
        """Returns the best heading for one step that is not the refused one."""
        headings = [(wanted + turn) % 360.0 for turn in range(-180, 180, ASIDE_DEG)]
        refused = self._refused or 0.0

        def cost(yaw: float) -> float:
            x, z = heading(yaw)
            return cost_of((at[0] + STEP_M * x, at[1] + STEP_M * z))

        others = [yaw for yaw in headings if abs(turn_between(refused, yaw)) > FACED_DEG]
        return min(others, key=cost)

    def _face(self, pose: Pose) -> Iterator[Action]:
        here = self.oracle.agent
        if abs(turn_between(here.rotation, pose.rotation)) > FACED_DEG:
            yield from self._body.turn(here.rotation, pose.rotation)
        if abs(pose.horizon - here.horizon) > TILTED_DEG:
            yield from moves.tilt(here.horizon, round(pose.horizon))


class KnownFloor:
    """What one knows of the floor: all walls, and the things that the frames have shown or one has run into.

    How far away those stand is misjudged, anew from each place: a little near by, more from afar.
    """

    def __init__(self, oracle: Oracle, body: NoisyBody) -> None:
        self._oracle = oracle
        self._body = body
        self._known: set[str] = set()
        self._points: dict[tuple, np.ndarray] = {}
        self._ways: tuple[object, WaysTo] | None = None
        self._judged_at: Vec3 | None = None
        self._shifts_m: dict[str, Point2] = {}

    def look(self) -> None:
        """Takes in the things near by of which the frame shows something."""
        here, grid = self._oracle.agent, self._oracle.clearance()
        things = [
            thing
            for thing in self._oracle.scene.things.values()
            if thing.id not in self._known and grid.is_in_the_way(thing)
        ]
        if not things:
            return
        spread = [self._points_of(thing) for thing in things]
        owners, points = np.repeat(np.arange(len(things)), [len(each) for each in spread]), np.concatenate(spread)
        near = np.hypot(points[:, 0] - here.position.x, points[:, 2] - here.position.z) <= SIGHT_M
        pixels = project(here, points)
        shown = near & (pixels[:, 2] > 0.0) & in_frame(pixels)
        for owner in np.unique(owners[shown]):
            if self._oracle.sees(here.eye, points[shown & (owners == owner)], things[owner].id).any():
                self._known.add(things[owner].id)

    def _points_of(self, thing: Thing) -> np.ndarray:
        """Returns SEEN_POINTS points or more of a thing's surface as it is now."""
        key = thing.id, thing.position, thing.rotation, thing.openness, thing.is_toggled
        if key not in self._points:
            self._points[key] = surface_points(thing, SEEN_POINTS)
        return self._points[key]

    def learn(self, thing_id: str | None) -> None:
        """Takes in what one has run into; a wall is known already."""
        if thing_id in self._oracle.scene.things:
            self._known.add(thing_id)

    def ways_to(self, place: Point2) -> WaysTo:
        """Returns the ways to a place over what is known."""
        things = self._things()
        key = place, tuple((thing.id, thing.position, thing.rotation, thing.openness) for thing in things.values())
        if self._ways is None or self._ways[0] != key:
            grid = self._oracle.clearance()
            self._ways = key, WaysTo(grid, grid.room(things), place)
        return self._ways[1]

    def judged_room(self) -> np.ndarray:
        """Returns the room that one takes there to be, as `ClearanceGrid.room`."""
        here, things = self._oracle.agent.position, self._things()
        if here != self._judged_at:
            self._judged_at, self._shifts_m = here, {}
        for thing in things.values():
            if thing.id not in self._shifts_m:
                gap_m = box_of(thing).floor_distance(here)
                x, z = heading(yaw_towards(here, thing.position))
                error_m = self._body.judged(gap_m) - gap_m
                self._shifts_m[thing.id] = error_m * x, error_m * z
        return self._oracle.clearance().room(things, self._shifts_m)

    def _things(self) -> dict[str, Thing]:
        things, grid = self._oracle.scene.things, self._oracle.clearance()
        return {name: things[name] for name in sorted(self._known) if grid.is_in_the_way(things[name])}


def _is_clear(pixel: tuple[int, int] | None) -> bool:
    if pixel is None:
        return False
    return bool(in_frame(np.array([pixel]), CLEAR_PX)[0])
