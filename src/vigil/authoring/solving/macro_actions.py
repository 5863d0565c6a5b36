"""Macro actions with privileged access: walk to a place, click a thing so that the click works, put an object down.

Each click is first tried in the simulator and undone, to be sure that it does what is planned.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from vigil.assets.kernel.asset import Surface
from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.viewpoints import PositionCost, Viewpoint, ViewpointQuery, viewpoints
from vigil.base.geometry import Box
from vigil.errors import EpisodeError
from vigil.protocol.actions import REACH_M, Action, Intent, InteractPixel
from vigil.protocol.world import Effect, RefusalCode
from vigil.scene.geometry import Motion, body_box, box_distances
from vigil.scene.supports import TOUCH_M, headroom, level_surfaces
from vigil.scene.things import Thing

REACH_MARGIN_M = 0.04
"""Distance (m) by which the agent goes closer to a thing than a click on it requires."""
TOO_CLOSE_M, ALMOST_OUT_OF_REACH_M = 0.35, 0.3
"""Places cost more if they are nearer to a thing than TOO_CLOSE_M, or farther from it than the reach minus
ALMOST_OUT_OF_REACH_M."""
COMFORTABLE_M, FAR_COST = 0.8, 0.5
"""Places cost more if they are over COMFORTABLE_M from the point where an object is put: FAR_COST per further metre."""
MAX_TRIED, MAX_TRIED_EXHAUSTIVE = 40, 400
ARRIVED_M = 0.03
REPLANS = 3
PLACE_PIXELS = 8
SURFACE_GRID, SURFACE_SHARE, ABOVE_SURFACE_M = 5, 0.4, 0.002
"""Grid of points on a surface: points per side, distance from the middle (share of the side), height (m) above it."""
CAVITY_POINTS, CAVITY_WALL_M = 256, 0.08
"""Number of points sampled on a receptacle, and maximum distance (m) from a surface to the wall of its cavity."""
DROP_PLACES_M = 0.5
"""Approximate distance (m) between the places where the agent tries to drop an object."""
POSITION_INDEPENDENT_REFUSALS: frozenset[RefusalCode | None] = frozenset(
    {
        *("interlock", "hand_full", "hand_empty", "already_so", "blocked_by_object", "receptacle_closed"),
        *("not_openable", "not_toggleable", "not_pickupable", "not_a_receptacle", "object_occupied", "out_of_order"),
    }
)
"""Reasons of refusals that do not depend on where the agent stands."""
DROP_TURNS_DEG = (0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0)


class Unsolvable(EpisodeError):
    """Error for a solver that finds no way; the message says what it could not do."""


class MacroActions:
    """The macro actions of an agent with privileged access."""

    reach_slacks_m: tuple[float, ...] = (0.0,)
    """Distances (m) by which the agent tries to go closer than required, in the order in which they are tried."""
    min_picked_px: int = 0
    """Number of a thing's pixels that the agent wants to see when it picks the thing up. It accepts fewer where no
    reachable place shows so many."""

    def __init__(self, view: PrivilegedView, *, may_tilt: bool, is_exhaustive: bool = False) -> None:
        """If `is_exhaustive`, search more places, without margins: a failure then proves that the act is impossible."""
        self.view = view
        self.may_tilt = may_tilt
        self._margin_m = 0.0 if is_exhaustive else REACH_MARGIN_M
        self._max_viewpoints = MAX_TRIED_EXHAUSTIVE if is_exhaustive else MAX_TRIED
        self._is_exhaustive = is_exhaustive

    def go(self, viewpoint: Viewpoint, has_arrived: Callable[[], bool] | None = None) -> Iterator[Action]:
        """Yield the walk to a viewpoint and the turn to its pose. Raises Unsolvable if the way is blocked.

        `has_arrived` has no effect here. Subclasses that do not walk exactly use it.
        """
        del has_arrived
        yield from self._walk(viewpoint)
        yield from primitive_actions.turn_by_steps(self.view.agent.rotation, viewpoint.pose.rotation)
        yield from primitive_actions.tilt(self.view.agent.horizon, viewpoint.pose.horizon)

    def act(self, intent: Intent, thing_id: str) -> Iterator[Action]:
        """Yield the walk to a place from which a click on a thing works, and the click. Raises Unsolvable."""
        viewpoint, pixel = self.find_click(intent, thing_id)
        yield from self.go(viewpoint)
        yield self.click(intent, self.view.click_pixel(thing_id) or pixel)

    def find_click(self, intent: Intent, thing_id: str) -> tuple[Viewpoint, tuple[int, int]]:
        """Return the nearest viewpoint from which a click on a thing works, and the pixel. Raises Unsolvable."""
        wanted = (self.min_picked_px, 0) if intent == "pick" and self.min_picked_px else (0,)
        for min_px, slack_m in product(wanted, self.reach_slacks_m):
            found = self._view_to_click(intent, thing_id, REACH_M - self._margin_m - slack_m, min_px)
            if found is not None:
                return found
        raise Unsolvable(f"There is no reachable place from which {intent!r} works on {thing_id!r}.")

    def _view_to_click(
        self, intent: Intent, thing_id: str, reach_m: float, min_px: int
    ) -> tuple[Viewpoint, tuple[int, int]] | None:
        thing = self.view.scene.things[thing_id]
        query = ViewpointQuery(
            thing_id, surface_points(thing), near_box(body_box(thing), reach_m), self.may_tilt, least_seen=2
        )
        walks = self.view.walks(is_exact=self._is_exhaustive)
        for number, viewpoint in enumerate(viewpoints(self.view, walks, query)):
            if number >= self._max_viewpoints:
                break
            with self.view.at_pose(viewpoint.pose):
                if min_px and self.view.state_of(thing_id).visible_px < min_px:
                    continue
                pixel = self.view.click_pixel(thing_id)
                refusal = None if pixel is None else self.view.try_interaction(primitive_actions.click(intent, pixel))
            if pixel is not None and refusal is None:
                return viewpoint, pixel
            if refusal in POSITION_INDEPENDENT_REFUSALS:
                raise Unsolvable(f"{intent!r} on {thing_id!r} is refused from every reachable place: {refusal}.")
        return None

    def place(self, receptacle_id: str, *, inside: bool, is_thorough: bool = False) -> Iterator[Action]:
        """Yield the actions that put the held object inside a receptacle, or on it. Raises Unsolvable.

        If the receptacle has no upper surface, the object is put on an inner surface that can be reached without
        opening. If `is_thorough` is True and no place is found on all surfaces together, each surface is searched
        separately.
        """
        viewpoint, pixel = self.find_place(
            self.placement_targets(receptacle_id, inside=inside), is_thorough=is_thorough
        )
        yield from self.go(viewpoint)
        yield self.click("place", pixel)

    def placement_targets(self, receptacle_id: str, *, inside: bool) -> "PlacementTargets":
        """Return the places for an object inside or on a receptacle. Raises Unsolvable if there is no surface."""
        receptacle = self.view.scene.things[receptacle_id]
        surfaces = _surfaces_for(receptacle, inside=inside)
        return _targets_on(receptacle, surfaces, inside=inside)

    def find_place(
        self, targets: "PlacementTargets", *, is_thorough: bool = False
    ) -> tuple[Viewpoint, tuple[int, int]]:
        """Return the nearest viewpoint from which the held object can be placed, and the pixel. Raises Unsolvable."""
        parts = self._parts_of(targets)
        tall = [part for part in parts if not self._has_height(part)]
        for part in (targets, *(parts if is_thorough else ())) if len(tall) < len(parts) else ():
            found = None if part in tall else self._view_to_place(part)
            if found is not None:
                return found
        raise Unsolvable(
            f"There is no reachable place from which {self.view.held!r} can be put on {targets.receptacle_id!r}."
        )

    def _parts_of(self, targets: "PlacementTargets") -> "list[PlacementTargets]":
        receptacle = self.view.scene.things[targets.receptacle_id]
        surfaces = [each for each in level_surfaces(receptacle) if each[0].name in targets.surfaces]
        return [_targets_on(receptacle, [each], inside=each[0].is_inside) for each in surfaces]

    def _has_height(self, targets: "PlacementTargets") -> bool:
        """Return whether one of the surfaces has enough free height above it for the held object.

        True if nothing is held.
        """
        things, held = self.view.scene.things, self.view.held
        if held is None:
            return True
        receptacle, height = things[targets.receptacle_id], things[held].asset.size.y
        surfaces = [surface for surface, _ in level_surfaces(receptacle) if surface.name in targets.surfaces]
        return any(height <= surface.clearance + TOUCH_M for surface in surfaces)

    def _view_to_place(self, targets: "PlacementTargets") -> tuple[Viewpoint, tuple[int, int]] | None:
        for slack_m in self.reach_slacks_m:
            tried = islice(viewpoints(self.view, self.view.walks(), self.query_of(targets, slack_m)), MAX_TRIED)
            for viewpoint in tried:
                pixel = self.placing_pixel(viewpoint, targets)
                if pixel is not None:
                    return viewpoint, pixel
        return None

    def query_of(self, targets: "PlacementTargets", slack_m: float) -> ViewpointQuery:
        """Return the query for viewpoints to place an object from; `slack_m` is subtracted from the reach."""
        places = near_points(targets.points, REACH_M - REACH_MARGIN_M - slack_m)
        return ViewpointQuery(targets.receptacle_id, targets.points, places, self.may_tilt, least_seen=1)

    def put_down(self, is_good: Callable[[], bool]) -> Iterator[Action]:
        """Yield the actions that drop the held object nearby so that `is_good` is then true. Raises Unsolvable."""
        yield from self.go(self.find_drop(is_good))
        yield InteractPixel(intent="drop")

    def find_drop(self, is_good: Callable[[], bool]) -> Viewpoint:
        """Return the nearest pose at which `is_good` is true after the held object is dropped. Raises Unsolvable."""
        view = self.view
        here = view.agent
        for viewpoint in [Viewpoint(here, (), np.empty((0, 2)), 0), *_nearby_viewpoints(view)]:
            for turn in DROP_TURNS_DEG:
                pose = viewpoint.pose.model_copy(update={"rotation": (viewpoint.pose.rotation + turn) % 360.0})
                with view.at_pose(pose):
                    is_free = view.try_interaction(InteractPixel(intent="drop"), lambda _: is_good()) is None
                if is_free:
                    return Viewpoint(pose, viewpoint.corners, viewpoint.pixels, viewpoint.seen)
        raise Unsolvable(f"There is no free place nearby to put down {view.held!r}.")

    def _walk(self, viewpoint: Viewpoint) -> Iterator[Action]:
        if not viewpoint.corners:
            return
        corners = list(viewpoint.corners)
        for _ in range(REPLANS):
            for corner in corners:
                yield from primitive_actions.towards(self.view.agent, corner)
            end = self.view.agent.position
            if math.dist((end.x, end.z), viewpoint.corners[-1]) <= ARRIVED_M:
                return
            corners = self.view.corners_to(viewpoint.corners[-1])
        raise Unsolvable(f"The way to {viewpoint.corners[-1]} is blocked.")

    def placing_pixel(self, viewpoint: Viewpoint, targets: "PlacementTargets") -> tuple[int, int] | None:
        """Return a pixel in a viewpoint's frame on which a click places the held object at a target; None if none is
        found."""
        view, held = self.view, self.view.held
        if held is None:
            return None

        def rests(effect: Effect) -> bool:
            is_near = effect.click_m is not None and effect.click_m <= REACH_M - self._margin_m
            return is_near and targets.contains(view.scene.things[held])

        with view.at_pose(viewpoint.pose):
            for x, y in viewpoint.pixels[:PLACE_PIXELS]:
                pixel = int(x), int(y)
                if (
                    view.object_at(pixel) == targets.receptacle_id
                    and view.try_interaction(primitive_actions.click("place", pixel), rests) is None
                ):
                    return pixel
        return None

    def click(self, intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
        """Return the click on a pixel."""
        return primitive_actions.click(intent, pixel)


@dataclass(frozen=True, slots=True, eq=False)
class PlacementTargets:
    """Places for an object on or in a receptacle."""

    receptacle_id: str
    surfaces: frozenset[str]
    """Names of the receptacle's surfaces on which the places are."""
    points: np.ndarray
    """Points (n, 3) on these surfaces that the agent can look at and click."""

    def contains(self, thing: Thing) -> bool:
        """Return whether a thing rests on one of the surfaces."""
        return thing.parent == self.receptacle_id and thing.surface in self.surfaces


def near_box(box: Box, most_m: float) -> PositionCost:
    """Return the cost function of places: inf beyond `most_m` from a box, higher if very near or barely in reach."""

    def cost(places: np.ndarray) -> np.ndarray:
        distances = box_distances(box, places)
        far = np.maximum(distances - (most_m - ALMOST_OUT_OF_REACH_M), 0.0)
        return np.where(distances <= most_m, far + np.maximum(TOO_CLOSE_M - distances, 0.0), np.inf)

    return cost


def near_points(points: np.ndarray, most_m: float) -> PositionCost:
    """Return the cost function of places: finite only where a point (n, 3) is within `most_m` in the floor plane."""

    spots = points[:, [0, 2]]
    low, high = spots.min(axis=0) - most_m, spots.max(axis=0) + most_m

    def cost(places: np.ndarray) -> np.ndarray:
        gaps = np.full(len(places), np.inf)
        near = ((places >= low) & (places <= high)).all(axis=1)  # the others are too far away
        gaps[near] = np.linalg.norm(places[near, None, :] - spots[None, :, :], axis=2).min(axis=1)
        return np.where(gaps <= most_m, FAR_COST * np.maximum(gaps - COMFORTABLE_M, 0.0), np.inf)

    return cost


def _surfaces_for(receptacle: Thing, *, inside: bool) -> list[tuple[Surface, Motion]]:
    """Return the level surfaces inside a receptacle, each with its frame; if not `inside`, those on the receptacle.

    If there are none on the receptacle, return the surfaces inside that can be reached without opening. Raises
    Unsolvable if there are none.
    """
    level = list(level_surfaces(receptacle))
    wanted = [(surface, frame) for surface, frame in level if surface.is_inside == inside]
    if not inside and not wanted:
        wanted = [(surface, frame) for surface, frame in level if not surface.needs_opening]
    if not wanted:
        where = "inside" if inside else "to put things on"
        raise Unsolvable(f"{receptacle.id!r} has no level surface {where}.")
    return wanted


def _targets_on(receptacle: Thing, surfaces: list[tuple[Surface, Motion]], *, inside: bool) -> PlacementTargets:
    """Return the places for an object on these surfaces of a receptacle."""
    points = _surface_grid(surfaces)
    if inside:
        points = np.concatenate([points, _cavity_points(receptacle, surfaces)])
    return PlacementTargets(receptacle.id, frozenset(surface.name for surface, _ in surfaces), points)


def _surface_grid(surfaces: list[tuple[Surface, Motion]]) -> np.ndarray:
    """Return points (n, 3) that are spread over these surfaces."""
    found: list[np.ndarray] = []
    for surface, frame in surfaces:
        along = np.linspace(-SURFACE_SHARE, SURFACE_SHARE, SURFACE_GRID)
        x, z = (axis.ravel() for axis in np.meshgrid(along * surface.size_x, along * surface.size_z))
        found.append(frame(np.column_stack([x, np.full(len(x), ABOVE_SURFACE_M), z])))
    return np.concatenate(found)


def _cavity_points(receptacle: Thing, surfaces: list[tuple[Surface, Motion]]) -> np.ndarray:
    """Return points (n, 3) on the walls and floors of a receptacle's cavities (round or not), above its surfaces."""
    points = surface_points(receptacle, CAVITY_POINTS)
    is_in = np.zeros(len(points), dtype=bool)
    for surface, frame in surfaces:
        x, y, z = frame.inverse()(points).T
        beside = np.maximum(np.abs(x) - surface.size_x / 2, np.abs(z) - surface.size_z / 2)
        is_in |= (beside <= CAVITY_WALL_M) & (y >= -CAVITY_WALL_M) & (y <= headroom(receptacle.asset, surface))
    return points[is_in]


def _nearby_viewpoints(view: PrivilegedView) -> Iterator[Viewpoint]:
    """Yield at most `MAX_TRIED` viewpoints without a thing to look at, about `DROP_PLACES_M` apart, nearest first."""
    walks = view.walks()
    cells = walks.plan.cells
    if not len(cells):
        return
    order = np.argsort(walks.lengths, kind="stable")
    _, first = np.unique(np.round(cells[order] / DROP_PLACES_M).astype(np.int64), axis=0, return_index=True)
    for cell in order[np.sort(first)][:MAX_TRIED]:
        corners = walks.corners_to(int(cell))
        if corners:
            x, z = corners[-1]
            here = view.agent
            position = here.position._replace(x=x, z=z)
            before = corners[-2] if len(corners) > 1 else (here.position.x, here.position.z)
            yaw = math.degrees(math.atan2(x - before[0], z - before[1])) % 360.0
            pose = here.model_copy(update={"position": position, "rotation": yaw})
            yield Viewpoint(pose, tuple(corners), np.empty((0, 2)), 0)
