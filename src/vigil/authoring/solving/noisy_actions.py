"""Macro actions with motor noise. The agent knows only those obstacles that it has seen or hit.

What to do, and from where it can be done, comes from `vigil.authoring.solving.macro_actions`. The way to this place is
found step by step from what the frames have shown. The result of each action is checked before the next action.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.clearance import RoutesTo
from vigil.authoring.solving.look_targets import in_frame, surface_points
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.viewpoints import Viewpoint, current_viewpoint
from vigil.base.geometry import Pose, Vec3, heading, turn_between, yaw_towards
from vigil.protocol.actions import MAX_STEPS_PER_ACTION, REACH_M, STEP_M, Action, Intent, InteractPixel, Navigate
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.scene.floor import Point2
from vigil.scene.geometry import body_box
from vigil.scene.things import Thing
from vigil.sim.core.sight import project

SLACK_M = 0.3
"""Distance (m) by which the agent goes closer than required, if it can."""
ARRIVED_M, EXACTLY_M = 0.2, 0.06
"""Distance (m) from a place at which the agent counts as arrived; smaller distance (m) for a second try."""
FACED_DEG, TILTED_DEG = 6.0, 5.0
"""Errors (deg) of heading and of pitch that are not corrected if they are at most this large."""
ASIDE_DEG = 15
"""Step (deg) between the headings tried after a collision, and size of the turn made if nothing else helps."""
CLEAR_PX = 8
"""Minimum distance (px) of a clicked pixel from the frame's border, if the agent can turn."""
SEEN_POINTS = 16
"""Number of a thing's points that are tested for being in a frame."""
SIGHT_M = 4.0
"""Maximum distance (m) at which the agent notices obstacles."""
LOOKS = 3
LOOK_ABOUT_DEG = (25.0, -50.0)
"""Turns (deg), one after the other, that the agent makes if it does not see what it expects to see."""


TURN_ERROR_DEG = 5.0


CLICK_ERROR_PX = 6.0


DISTANCE_ERROR = 0.15


class MotorNoise:
    """Makes actions (turns in whole degrees, walks in whole steps) with random errors, uniform up to a bound."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def turn(self, from_yaw: float, to_yaw: float) -> Iterator[Navigate]:
        """Yield a turn to a heading with an error of at most `TURN_ERROR_DEG`; nothing if it rounds to 0 degrees."""
        angle = round(turn_between(from_yaw, to_yaw) + self._rng.uniform(-TURN_ERROR_DEG, TURN_ERROR_DEG))
        yield from primitive_actions.turn_by_steps(0.0, float(angle))

    def walk(self, distance_m: float) -> Navigate:
        """Return a walk of about `distance_m`, with an error, in whole steps (at least one)."""
        steps = max(1, round(self.perceived_distance(distance_m) / STEP_M))
        return Navigate(mode="forward", magnitude=float(min(steps, MAX_STEPS_PER_ACTION)))

    def perceived_distance(self, distance_m: float) -> float:
        """Return a distance (m), changed by a relative error of at most `DISTANCE_ERROR`."""
        return distance_m * (1.0 + self._rng.uniform(-DISTANCE_ERROR, DISTANCE_ERROR))

    def click(self, intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
        """Return a click at most `CLICK_ERROR_PX` away from a pixel, but within the frame."""
        away, direction = self._rng.uniform(0.0, CLICK_ERROR_PX), self._rng.uniform(0.0, 2 * math.pi)
        x, y = pixel[0] + away * math.cos(direction), pixel[1] + away * math.sin(direction)
        inside = min(max(round(x), 0), FRAME_WIDTH - 1), min(max(round(y), 0), FRAME_HEIGHT - 1)
        return primitive_actions.click(intent, inside)


class NoisyMacroActions(MacroActions):
    """Macro actions with motor noise. They repeat until they succeed, so the caller must limit the number of steps."""

    reach_slacks_m = (SLACK_M, 0.0)

    def __init__(self, view: PrivilegedView, rng: np.random.Generator) -> None:
        super().__init__(view, may_tilt=True)
        self._motor = MotorNoise(rng)
        self._known = KnownFloor(view, self._motor)
        self._refused: float | None = None
        """Heading (deg) of the last walk if it was blocked; None if it was not."""

    def go(self, viewpoint: Viewpoint, has_arrived: Callable[[], bool] | None = None) -> Iterator[Action]:
        """Yield the walk to a viewpoint and the turn to its pose. Raises Unsolvable if no way is known.

        With `has_arrived`, stop as soon as it returns True. If it is still False at the end, go closer and look around.
        """
        if has_arrived is None:
            yield from self._approach(viewpoint, lambda: False)
            return
        for within_m in (ARRIVED_M, EXACTLY_M):
            yield from self._approach(viewpoint, has_arrived, within_m)
        for angle in LOOK_ABOUT_DEG:
            if has_arrived():
                return
            yield from self._motor.turn(self.view.agent.rotation, self.view.agent.rotation + angle)

    def _approach(
        self, viewpoint: Viewpoint, has_arrived: Callable[[], bool], within_m: float = ARRIVED_M
    ) -> Iterator[Action]:
        here = self.view.agent.position
        yield from self._walk_to(
            viewpoint.corners[-1] if viewpoint.corners else (here.x, here.z), has_arrived, within_m
        )
        for _ in range(LOOKS):
            faced = [] if has_arrived() else list(self._face(viewpoint.pose))
            yield from faced
            if not faced:
                return

    def act(self, intent: Intent, thing_id: str) -> Iterator[Action]:
        """Yield the walk to a place from which a click on a thing works, then clicks until the thing has changed.

        Raises Unsolvable.
        """
        thing, in_hand = self.view.scene.things[thing_id], self.view.held

        def facts() -> tuple:
            return thing.openness, thing.is_toggled, thing.is_held

        before = facts()
        while facts() == before:
            yield from self._try(
                lambda: self._pixel_of(intent, thing), lambda: self.find_click(intent, thing_id)[0], intent
            )  # fmt: skip
            if self.view.held not in (in_hand, thing_id):
                yield from self.put_down(lambda: True)

    def place(self, receptacle_id: str, *, inside: bool, is_thorough: bool = False) -> Iterator[Action]:
        """Yield the actions that put the held object inside a receptacle, or on it. Raises Unsolvable.

        If the object lands elsewhere, it is picked up again.
        """
        held = self.view.held
        targets = self.placement_targets(receptacle_id, inside=inside)
        query = self.query_of(targets, 0.0)
        while held is not None and not targets.contains(self.view.scene.things[held]):
            if self.view.held != held:
                yield from self.act("pick", held)
            yield from self._try(
                lambda: self.placing_pixel(current_viewpoint(self.view, query), targets),
                lambda: self.find_place(targets, is_thorough=is_thorough)[0],
                "place",
            )

    def put_down(self, is_good: Callable[[], bool]) -> Iterator[Action]:
        """Yield the actions that drop the held object nearby so that `is_good` is then true. Raises Unsolvable."""
        drop = InteractPixel(intent="drop")

        def can_drop() -> bool:
            return self.view.try_interaction(drop, lambda _: is_good()) is None

        while not can_drop():
            yield from self._approach_or_turn(self.find_drop(is_good), can_drop)
        yield drop

    def click(self, intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
        """Return a click near a pixel, with a random error."""
        return self._motor.click(intent, pixel)

    def _try(
        self, find_pixel: Callable[[], tuple[int, int] | None], viewpoint: Callable[[], Viewpoint], intent: Intent
    ) -> Iterator[Action]:
        """Yield a click on the pixel of `find_pixel`. If that is None or near the frame's border, approach first."""
        cached_pixel = self._cached_per_state(find_pixel)
        pixel = cached_pixel()
        if pixel is None or not _is_clear(pixel):
            yield from self._approach_or_turn(viewpoint(), lambda: _is_clear(cached_pixel()))
            pixel = cached_pixel()
        if pixel is not None:
            yield self.click(intent, pixel)

    def _cached_per_state(
        self, find_pixel: Callable[[], tuple[int, int] | None]
    ) -> Callable[[], tuple[int, int] | None]:
        """Return a function that caches the result of `find_pixel` until the world changes."""
        last: tuple[tuple, tuple[int, int] | None] | None = None

        def cached_pixel() -> tuple[int, int] | None:
            nonlocal last
            now = self.view.state_key()
            if last is None or last[0] != now:
                last = now, find_pixel()
            return last[1]

        return cached_pixel

    def _approach_or_turn(self, viewpoint: Viewpoint, has_arrived: Callable[[], bool]) -> Iterator[Action]:
        """Yield the approach to a viewpoint, with at least one action: if need be, a step closer or a turn."""
        for within_m in (ARRIVED_M, EXACTLY_M):
            is_idle = True
            for action in self._approach(viewpoint, has_arrived, within_m):
                is_idle = False
                yield action
            if not is_idle or has_arrived():
                return
        yield Navigate(mode="turn_right", magnitude=float(ASIDE_DEG))

    def _pixel_of(self, intent: Intent, thing: Thing) -> tuple[int, int] | None:
        """Return the pixel of a thing on which a click works in the current state; None if there is none."""
        if body_box(thing).floor_distance(self.view.agent.position) > REACH_M:
            return None
        pixel = self.view.click_pixel(thing.id)
        return (
            pixel
            if pixel is not None and self.view.try_interaction(primitive_actions.click(intent, pixel)) is None
            else None
        )

    def _walk_to(self, place: Point2, has_arrived: Callable[[], bool], within_m: float) -> Iterator[Action]:
        while True:
            self._known.observe_frame()
            here = self.view.agent
            if has_arrived() or math.dist((here.position.x, here.position.z), place) <= within_m:
                return
            yield from self._move(here, self._known.routes_to(place), self._known.perceived_clearances())

    def _move(self, here: Pose, routes: RoutesTo, clearances: np.ndarray) -> Iterator[Action]:
        """Yield the next turn or walk along the route. Raises Unsolvable if there is no route."""
        at = here.position.x, here.position.z
        corner = routes.waypoint(at, clearances)
        if corner is None:
            raise Unsolvable("The solver does not know of a free way over the parts of the floor that it has seen.")
        wanted = yaw_towards(here.position, Vec3(corner[0], here.position.y, corner[1]))
        length = math.dist(at, corner)
        if self._refused is not None:
            wanted, length = self._heading_aside(at, wanted, lambda end: routes.cost_of(at, end, clearances)), STEP_M
        if abs(turn_between(here.rotation, wanted)) > FACED_DEG:
            yield from self._motor.turn(here.rotation, wanted)
            return
        walk = self._motor.walk(length)
        with self.view.rollback():
            effect = self.view.step(walk)
        yield walk
        self._known.add_collision(effect.blocked_by)
        self._refused = None if effect.moved_m else here.rotation

    def _heading_aside(self, at: Point2, wanted: float, cost_of: Callable[[Point2], float]) -> float:
        """Return the heading (deg) for a step after which the route costs least. The blocked heading is left out."""
        headings = [(wanted + turn) % 360.0 for turn in range(-180, 180, ASIDE_DEG)]
        refused = self._refused or 0.0

        def cost(yaw: float) -> float:
            x, z = heading(yaw)
            return cost_of((at[0] + STEP_M * x, at[1] + STEP_M * z))

        others = [yaw for yaw in headings if abs(turn_between(refused, yaw)) > FACED_DEG]
        return min(others, key=cost)

    def _face(self, pose: Pose) -> Iterator[Action]:
        here = self.view.agent
        if abs(turn_between(here.rotation, pose.rotation)) > FACED_DEG:
            yield from self._motor.turn(here.rotation, pose.rotation)
        if abs(pose.horizon - here.horizon) > TILTED_DEG:
            yield from primitive_actions.tilt(here.horizon, round(pose.horizon))


class KnownFloor:
    """The floor as the agent knows it: all walls, and the things that it saw in frames or collided with.

    The distances to these things have an error, which is proportional to the distance and drawn again at each place.
    """

    def __init__(self, view: PrivilegedView, motor: MotorNoise) -> None:
        self._view = view
        self._motor = motor
        self._known: set[str] = set()
        self._points: dict[tuple, np.ndarray] = {}
        self._routes: tuple[object, RoutesTo] | None = None
        self._perceived_at: Vec3 | None = None
        self._shifts_m: dict[str, Point2] = {}

    def observe_frame(self) -> None:
        """Add the things within `SIGHT_M` that the current frame shows."""
        here, grid = self._view.agent, self._view.clearance_grid()
        things = [
            thing
            for thing in self._view.scene.things.values()
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
            if self._view.sees(here.eye, points[shown & (owners == owner)], things[owner].id).any():
                self._known.add(things[owner].id)

    def _points_of(self, thing: Thing) -> np.ndarray:
        """Return at least `SEEN_POINTS` points (n, 3) on a thing's surface in its current state; they are cached."""
        key = thing.id, thing.position, thing.rotation, thing.openness, thing.is_toggled
        if key not in self._points:
            self._points[key] = surface_points(thing, SEEN_POINTS)
        return self._points[key]

    def add_collision(self, thing_id: str | None) -> None:
        """Add the thing with which the agent collided. A wall is not added, because all walls are known."""
        if thing_id in self._view.scene.things:
            self._known.add(thing_id)

    def routes_to(self, place: Point2) -> RoutesTo:
        """Return the routes to a place (x, z; m) that avoid the known obstacles."""
        things = self._things()
        key = place, tuple((thing.id, thing.position, thing.rotation, thing.openness) for thing in things.values())
        if self._routes is None or self._routes[0] != key:
            grid = self._view.clearance_grid()
            self._routes = key, RoutesTo(grid, grid.clearances(things), place)
        return self._routes[1]

    def perceived_clearances(self) -> np.ndarray:
        """Return the clearances that the agent assumes, in the form of `ClearanceGrid.clearances`."""
        here, things = self._view.agent.position, self._things()
        if here != self._perceived_at:
            self._perceived_at, self._shifts_m = here, {}
        for thing in things.values():
            if thing.id not in self._shifts_m:
                gap_m = body_box(thing).floor_distance(here)
                x, z = heading(yaw_towards(here, thing.position))
                error_m = self._motor.perceived_distance(gap_m) - gap_m
                self._shifts_m[thing.id] = error_m * x, error_m * z
        return self._view.clearance_grid().clearances(things, self._shifts_m)

    def _things(self) -> dict[str, Thing]:
        things, grid = self._view.scene.things, self._view.clearance_grid()
        return {name: things[name] for name in sorted(self._known) if grid.is_in_the_way(things[name])}


def _is_clear(pixel: tuple[int, int] | None) -> bool:
    if pixel is None:
        return False
    return bool(in_frame(np.array([pixel]), CLEAR_PX)[0])
