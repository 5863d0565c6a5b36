"""Putting things down: at the free spot nearest to a clicked point, or straight down in front of the body.

A spot is the place under the thing's middle. It is at most 0.3 m from the clicked point; if the clicked point is above
the surface, only the horizontal distance counts. The thing's yaw changes only if the thing does not fit otherwise; then
its sides are aligned with the surface's sides. Spots on a fixed grid are tried in order of distance, so the same state
always gives the same spot.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from vigil.assets.kernel.asset import Surface
from vigil.base.geometry import Vec3, heading, wrap_deg
from vigil.scene.geometry import Motion, Prism, place_of, prisms_of
from vigil.scene.outlines import polygon_of
from vigil.scene.partitions import bounds_overlap
from vigil.scene.supports import (
    TOUCH_M,
    containers_of,
    contents,
    furniture_of,
    interior_surfaces_around,
    is_over,
    is_shut,
    level_surfaces,
    offset_from,
    surface_frame,
)
from vigil.scene.things import Thing
from vigil.sim.core.click_target import target_kind
from vigil.sim.core.state import SceneState

SPOT_WITHIN_M = 0.3
"""Greatest distance (m) of a spot from the clicked point."""
SPOT_STEP_M = 0.025
"""Step (m) of the grid of spots."""
FIRST_TRIED = 9
"""Number of the nearest spots that are tried first. If none of these is free, all others are tried together."""
EDGE_INSIDE_M = 0.01
"""How far (m) a thing may reach over the edge of a surface that is behind a door or in a drawer."""
EDGE_M = 0.03
"""How far (m) a thing may reach over the edge of a surface that is neither behind a door nor in a drawer."""
WALL_GAP_M = 0.0001
"""Least distance (m) between a thing that is put down and walls, windows and shut doors."""
OWN_SLACK_M = 0.01
"""How far (m) a thing may reach into a back, side or post of the receptacle on which it is put."""
DROP_AHEAD_M = (0.4, 0.3, 0.5)
"""Distances (m) ahead of the body at which a thing is dropped, in the order in which they are tried."""
DROP_FROM_M = 1.0
"""Height (m) from which a thing drops."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldBox:
    """The upright box around the held thing and everything that rests on it, in the held thing's frame (m)."""

    low: np.ndarray
    """Corner (3,) of the box with the least coordinates."""
    high: np.ndarray
    """Corner (3,) of the box with the greatest coordinates."""

    @property
    def height(self) -> float:
        """Height (m) of the held thing together with everything that rests on it."""
        return float(self.high[1] - self.low[1])

    def footprint(self, x: np.ndarray, z: np.ndarray, yaw: np.ndarray, *, drawn_in_m: float = TOUCH_M) -> np.ndarray:
        """Return the box's corners (n, 4, 2) on the floor plane at n places (`x`, `z`), each with its `yaw` in degrees.

        The box's sides are moved inward by `drawn_in_m`; a negative value moves them outward.
        """
        low, high = self.low[[0, 2]] + drawn_in_m, self.high[[0, 2]] - drawn_in_m
        middle = (low + high) / 2
        low, high = np.minimum(low, middle - 1e-3), np.maximum(high, middle + 1e-3)
        corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
        sin, cos = np.sin(np.radians(yaw))[:, None], np.cos(np.radians(yaw))[:, None]
        turned_x = corners[:, 0] * cos + corners[:, 1] * sin
        turned_z = corners[:, 1] * cos - corners[:, 0] * sin
        return np.stack([turned_x + x[:, None], turned_z + z[:, None]], axis=-1)


@dataclass(frozen=True, slots=True)
class FreeSpot:
    """A place where a thing can be put down."""

    position: Vec3
    yaw: float
    """Yaw (deg) that the thing gets at this place."""
    parent: str | None = None
    """Id of the thing on which the placed thing lies; None on the floor."""
    surface: str | None = None
    """Name of the parent's surface; None on the floor."""
    joint: str | None = None
    """Name of the parent's joint that carries the surface; None for a surface of the body, and on the floor."""


@dataclass(frozen=True, slots=True, eq=False)
class _CandidateSpots:
    """The n spots on a surface for a thing with one yaw; so far, only the edges and free height have been checked."""

    surface: Surface
    frame: Motion
    yaw: float
    keys: np.ndarray
    """Sort keys (n, 4): distance from the click (m), rank of the yaw, and x and z on the surface."""
    positions: np.ndarray
    """Positions (n, 3) in the house that the held thing would get."""


def held_box_of(state: SceneState, held: Thing) -> HeldBox:
    """Return the box around a held thing and everything that rests on it."""
    inverse = place_of(held).inverse()
    stack = [held, *contents(state.scene, held.id)]
    prisms = [prism for thing in stack for prism in prisms_of(thing)]
    points = [inverse(np.insert(each.polygon, 1, y, axis=1)) for each in prisms for y in (each.bottom, each.top)]
    half = np.array(held.asset.size) / 2
    points.append(np.stack([-half, half]))
    stacked = np.concatenate(points)
    return HeldBox(stacked.min(axis=0), stacked.max(axis=0))


def spot_on(state: SceneState, held: Thing, receptacle: Thing, clicked: Vec3) -> FreeSpot | None:
    """Return the free spot nearest to the clicked point; None if there is no free spot.

    The kind of the click (`target_kind`) decides whether the spot is inside the receptacle or on it.
    """
    bulk = held_box_of(state, held)
    kind = target_kind(receptacle, clicked)
    surfaces = [each for each in open_surfaces(receptacle) if kind == ("inside" if each[0].is_inside else "on")]
    options = [each for surface, frame in surfaces for each in _candidate_spots(bulk, held, surface, frame, clicked)]
    if not options:
        return None
    keys, positions = (np.concatenate([getattr(each, name) for each in options]) for name in ("keys", "positions"))
    owners = np.repeat(np.arange(len(options)), [len(each.keys) for each in options])
    yaws = np.array([each.yaw for each in options])[owners]
    order = np.lexsort(keys.T[::-1])
    order = order[_fits_in_hollows(state, bulk, positions[order], yaws[order], receptacle)]
    for chunk in (order[:FIRST_TRIED], order[FIRST_TRIED:]):
        free = _first_free(state, bulk, (positions[chunk], yaws[chunk]), receptacle, clicked)
        if free is not None:
            option, (x, z) = options[owners[chunk[free]]], keys[chunk[free], 2:]
            point = option.frame(np.array([[x, 0.0, z]]))[0]
            position = Vec3(float(point[0]), float(point[1] - bulk.low[1]), float(point[2]))
            return FreeSpot(position, option.yaw, receptacle.id, option.surface.name, option.surface.joint)
    return None


def spot_below(state: SceneState, held: Thing) -> FreeSpot | None:
    """Return the spot where the held thing comes to rest when it is dropped; None when no place ahead is free."""
    bulk = held_box_of(state, held)
    ahead_x, ahead_z = heading(state.agent.rotation)
    for ahead_m in DROP_AHEAD_M:
        x, z = state.agent.position.x + ahead_m * ahead_x, state.agent.position.z + ahead_m * ahead_z
        if not _is_cut_off(state, x, z):
            spot = _landing(state, held, bulk, x, z)
            if spot is not None:
                return spot
    return None


def put_down(state: SceneState, spot: FreeSpot) -> list[Thing]:
    """Put the held thing, and what rests on it, down at a spot; return all these things, the held thing first."""
    held = state.release()[0]
    held.parent, held.surface, held.parent_joint = spot.parent, spot.surface, spot.joint
    return state.move(held, spot.position, Vec3(0.0, wrap_deg(spot.yaw), 0.0))


def open_surfaces(receptacle: Thing) -> list[tuple[Surface, Motion]]:
    """Return (surface, frame) of a receptacle's horizontal surfaces that the hand can reach now."""
    shut = is_shut(receptacle)
    return [(surface, frame) for surface, frame in level_surfaces(receptacle) if not (surface.needs_opening and shut)]


def _yaw_of(frame: Motion) -> float:
    return math.degrees(math.atan2(frame.turn[0, 2], frame.turn[2, 2]))


def _candidate_spots(
    bulk: HeldBox, held: Thing, surface: Surface, frame: Motion, clicked: Vec3
) -> list[_CandidateSpots]:
    """Return, for each yaw to try, the spots near the click that the surface's edges and free height allow."""
    if bulk.height > surface.clearance + TOUCH_M:
        return []
    local = offset_from(frame, clicked)
    half = np.array([surface.size_x, surface.size_z]) / 2
    nearest = np.clip([local.x, local.z], -half, half)
    reach = math.floor(SPOT_WITHIN_M / SPOT_STEP_M)
    steps = np.arange(-reach, reach + 1) * SPOT_STEP_M
    places = nearest + np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    rise = 0.0 if is_over(surface, local) else local.y
    gaps = np.sqrt(((places - [local.x, local.z]) ** 2).sum(axis=1) + rise**2)
    keep = (np.abs(places) <= half + 1e-9).all(axis=1) & (gaps <= SPOT_WITHIN_M + 1e-9)
    places, gaps = places[keep], np.round(gaps[keep], 6)
    turn = _yaw_of(frame)
    found: list[_CandidateSpots] = []
    for rank, yaw in enumerate(dict.fromkeys((held.rotation.y, wrap_deg(turn), wrap_deg(turn + 90.0)))):
        corners = bulk.footprint(places[:, 0], places[:, 1], np.full(len(places), yaw - turn))
        fits = (np.abs(corners) <= _edge(surface)).all(axis=(1, 2))
        x, z = places[fits].T
        keys = np.column_stack([gaps[fits], np.full(len(x), float(rank)), x, z])
        positions = frame(np.column_stack([x, np.zeros(len(x)), z])) - np.array([0.0, bulk.low[1], 0.0])
        found.append(_CandidateSpots(surface, frame, yaw, keys, positions))
    return found


def _first_free(
    state: SceneState, bulk: HeldBox, spots: tuple[np.ndarray, np.ndarray], receptacle: Thing, clicked: Vec3
) -> int | None:
    """Return the index of the first spot at which nothing is in the way; None if there is no such spot.

    `spots` are positions (n, 3) and yaws (n,).
    """
    positions, yaws = spots
    columns = [positions[:, 0], positions[:, 2], yaws]
    bottoms = positions[:, 1] + bulk.low[1]
    free = np.flatnonzero(_unobstructed(state, bulk, columns, bottoms, receptacle))
    if len(free):
        hand = clicked.x, clicked.z
        free = free[~_is_separated(state, bulk, [column[free] for column in columns], bottoms[free], hand)]
    return int(free[0]) if len(free) else None


def _unobstructed(
    state: SceneState, bulk: HeldBox, columns: list[np.ndarray], bottoms: np.ndarray, receptacle: Thing
) -> np.ndarray:
    """Return a mask (n,) of the places at which no solid is in the way; `columns` are each place's x, z and yaw."""
    corners = bulk.footprint(*columns)
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    hollow = _container_ids(state, receptacle)
    is_free = np.ones(len(bottoms), dtype=bool)
    for owner, prism in _overlapping(state, lows, highs):
        x0, z0, x1, z1 = prism.bounds
        asked = is_free & (lows <= (x1, z1)).all(axis=1) & (highs >= (x0, z0)).all(axis=1)
        asked &= (prism.bottom < bottoms + bulk.height - TOUCH_M) & (prism.top > bottoms + TOUCH_M)
        left = np.flatnonzero(asked)
        if not len(left):
            continue
        shape = polygon_of(prism)
        if owner in hollow:  # the solids of a hollow thing are full, and what goes into it lies inside them
            middles = shapely.points(columns[0][left], columns[1][left])
            left = left[~(shapely.intersects(shape, middles) & (prism.bottom < bottoms[left] - TOUCH_M))]
            shape = shape.buffer(-OWN_SLACK_M)
        is_free[left] = ~shapely.intersects(shapely.polygons(corners[left]), shape)
        if not is_free.any():
            break
    return is_free


def _container_ids(state: SceneState, receptacle: Thing) -> set[str]:
    """Return the ids of a receptacle, of its containers and, if the receptacle is a drawer, of its furniture."""
    whole = furniture_of(state.scene, receptacle)
    return {each.id for each in (receptacle, whole, *containers_of(state.scene, receptacle)) if each is not None}


def _fits_in_hollows(
    state: SceneState, bulk: HeldBox, positions: np.ndarray, yaws: np.ndarray, receptacle: Thing
) -> np.ndarray:
    """Return a mask (n,) of the places at which the held thing and its load stay in the hollows around a receptacle.

    The places are `positions` (n, 3) and `yaws` (n,). The load is what rests on the held thing.
    """
    stays = np.ones(len(positions), dtype=bool)
    for owner, surface in interior_surfaces_around(state.scene, receptacle):
        frame = surface_frame(owner, surface)
        local = frame.inverse()(positions)
        corners = bulk.footprint(local[:, 0], local[:, 2], yaws - _yaw_of(frame))
        stays &= (np.abs(corners) <= _edge(surface)).all(axis=(1, 2))
        stays &= local[:, 1] + bulk.high[1] <= surface.clearance + TOUCH_M
    return stays


def _edge(surface: Surface) -> np.ndarray:
    """Return how far (x and z, in metres) from a surface's middle a thing on the surface may reach."""
    over = EDGE_INSIDE_M if surface.needs_opening else EDGE_M
    return np.array([surface.size_x, surface.size_z]) / 2 + over


def _overlapping(state: SceneState, lows: np.ndarray, highs: np.ndarray) -> Iterator[tuple[str, Prism]]:
    """Yield (id, prism) of the solids that overlap the rectangle around all places where the held box is tried.

    `lows` and `highs` (n, 2) are the least and greatest x, z of each place.
    """
    within = (*lows.min(axis=0, initial=np.inf).tolist(), *highs.max(axis=0, initial=-np.inf).tolist())
    yield from (each for each in state.solids(set()) if bounds_overlap(within, each[1]))


def _is_separated(
    state: SceneState, bulk: HeldBox, columns: list[np.ndarray], bottoms: np.ndarray, hand: tuple[float, float]
) -> np.ndarray:
    """Return a mask of the places that a wall, window or shut door crosses or separates from `hand` (x, z)."""
    outlines = shapely.polygons(bulk.footprint(*columns, drawn_in_m=-WALL_GAP_M))
    places = np.column_stack(columns[:2])
    ways = shapely.linestrings(np.stack([np.broadcast_to(hand, places.shape), places], axis=1))
    partitions = state.partitions
    return partitions.crosses(np.array(outlines), bottoms, bulk.height) | partitions.crosses(
        np.array(ways), bottoms, bulk.height
    )


def _is_cut_off(state: SceneState, x: float, z: float) -> bool:
    """Return whether a wall, or a thing at the height of the hand, is between the body and a place."""
    arm = shapely.LineString([(state.agent.position.x, state.agent.position.z), (x, z)])
    if state.partitions.crosses(np.array([arm]), np.array([0.0]), DROP_FROM_M).any():
        return True
    return any(
        prism.bottom < DROP_FROM_M < prism.top and polygon_of(prism).intersects(arm) for _, prism in state.solids(set())
    )


def _landing(state: SceneState, held: Thing, bulk: HeldBox, x: float, z: float) -> FreeSpot | None:
    """Return the spot where a thing that is dropped at (x, z) comes to rest: the highest surface below, or the floor.

    Return None if a wall or another solid is in the way, or if the thing does not fit there.
    """
    yaw = held.rotation.y
    column = [np.array([value]) for value in (x, z, yaw)]
    outline = shapely.polygons(bulk.footprint(*column, drawn_in_m=-WALL_GAP_M))
    if state.partitions.crosses(np.array(outline), np.array([0.0]), DROP_FROM_M + bulk.height).any():
        return None
    footprint = shapely.Polygon(bulk.footprint(*column)[0])
    below = [(owner, prism) for owner, prism in state.solids(set()) if polygon_of(prism).intersects(footprint)]
    below = [(owner, prism) for owner, prism in below if prism.bottom < DROP_FROM_M + bulk.height]
    things = {owner: state.scene.things[owner] for owner, _ in below if owner in state.scene.things}
    if len(things) < len({owner for owner, _ in below}):
        return None
    body = polygon_of(state.body())
    if not things:
        on_floor = state.collision_map.is_inside(footprint) and not body.intersects(footprint)
        return FreeSpot(Vec3(x, state.agent.position.y - float(bulk.low[1]), z), yaw) if on_floor else None
    landings = [spot for thing in things.values() for spot in _landings_on(thing, bulk, x, z, yaw)]
    if not landings:
        return None
    spot = max(landings, key=lambda each: each.position.y)
    rest, support = spot.position.y + float(bulk.low[1]), things[spot.parent or ""]
    hollow = _container_ids(state, support)
    is_clear = all(  # a solid that is around the place may rise above it
        prism.top <= rest + TOUCH_M or (owner in hollow and prism.bottom < rest - TOUCH_M) for owner, prism in below
    )
    is_clear &= bool(_fits_in_hollows(state, bulk, np.array([spot.position]), np.array([yaw]), support).all())
    return spot if is_clear and not body.intersects(footprint) else None


def _landings_on(thing: Thing, bulk: HeldBox, x: float, z: float, yaw: float) -> list[FreeSpot]:
    """Return a spot at (x, z) on each surface of `thing` where the held thing, with everything on it, fits."""
    found: list[FreeSpot] = []
    if not thing.is_receptacle:
        return found
    for surface, frame in open_surfaces(thing):
        local = offset_from(frame, Vec3(x, 0.0, z))
        if abs(local.x) > surface.size_x / 2 or abs(local.z) > surface.size_z / 2:
            continue  # a thin thing would lie with its middle over the edge
        height = float(frame.shift[1])
        corners = bulk.footprint(np.array([local.x]), np.array([local.z]), np.array([yaw - _yaw_of(frame)]))
        fits = (np.abs(corners) <= _edge(surface)).all() and bulk.height <= surface.clearance + TOUCH_M
        if fits and height < DROP_FROM_M:
            position = Vec3(x, height - float(bulk.low[1]), z)
            found.append(FreeSpot(position, yaw, thing.id, surface.name, surface.joint))
    return found
