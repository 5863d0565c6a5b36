"""Room on a receptacle for a thing: a search over all places and headings, by the simulator's rules.

The search may find room where there is none: it ignores walls, ceilings and the agent's body, and tries every heading.
But if it finds no room, every click or drop on the receptacle fails.
"""

import copy
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.assets.kernel.asset import Surface
from vigil.authoring.drafting.filling import can_hold
from vigil.base.geometry import Pose, Vec3, rotate_floor
from vigil.scene.geometry import Motion, Prism, prisms_of
from vigil.scene.outlines import polygon_of
from vigil.scene.supports import TOUCH_M, ancestors, contents, ends_lying_on, level_surfaces
from vigil.scene.things import Scene, Thing
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.placing import EDGE_M, spot_on
from vigil.sim.core.state import SceneState

TURN_STEP_DEG = 5.0
CLICKED_SHARES = np.linspace(-0.45, 0.45, 5)
"""Offsets of clicks from the middle of a surface, as shares of the lengths of its sides."""
ABOVE_M = 0.002
"""Height (m) of clicks above a surface, so that they do not lie inside the solid below it."""
MIN_M2 = 1e-6
"""Area (m2) below which a region of free places counts as a rounding error."""


def fits_on(scene: Scene, thing_id: str, receptacle_id: str, *, may_clear: bool = True) -> bool:
    """Return whether a thing can be put anywhere on a receptacle in the current state.

    If `may_clear` is True, all other objects that can be carried are first taken away. Then one of these objects, such
    as a tray, may be put between the thing and the receptacle.
    """
    thing, receptacle = scene.things[thing_id], scene.things[receptacle_id]
    gone = {thing_id, *(each.id for each in contents(scene, thing_id))}
    if may_clear:
        gone |= {each.id for each in scene.things.values() if each.is_pickupable}
    stands = [receptacle]
    if may_clear:  # what stands on the receptacle, directly or on others, and cannot be carried
        fixed = [each for each in scene.things.values() if each.is_present and not each.is_pickupable]
        stands += [each for each in fixed if receptacle in ancestors(scene, each) and _takes(each, thing)]
    if any(
        _free(scene, thing, stand, surface, frame, gone)
        for stand in stands
        for surface, frame in _bearing(stand, receptacle)
    ):
        return True
    carried = [each for each in scene.things.values() if each.is_present and each.is_pickupable and may_clear]
    trays = [each for each in carried if _takes(each, thing) and each.id != thing_id]
    return any(
        _free(scene, tray, receptacle, surface, frame, gone | {tray.id})
        for tray in trays
        for surface, frame in _bearing(receptacle, receptacle)
    )


def refuses_clicks(scene: Scene, agent: Pose, thing_id: str, receptacle_id: str, surface_name: str) -> bool:
    """Return whether all of several clicks on a surface, with a thing in the hand, are refused for lack of room."""
    copied = Scene(scene.rooms, scene.panels, {each.id: copy.copy(each) for each in scene.things.values()})
    state = SceneState(copied, agent, CollisionMap(copied))
    thing, receptacle = copied.things[thing_id], copied.things[receptacle_id]
    state.take(thing)
    surface, frame = next(each for each in level_surfaces(receptacle) if each[0].name == surface_name)
    x, z = np.meshgrid(CLICKED_SHARES * surface.size_x, CLICKED_SHARES * surface.size_z)
    points = frame(np.column_stack([x.ravel(), np.full(x.size, ABOVE_M), z.ravel()]))
    return all(spot_on(state, thing, receptacle, Vec3(*map(float, point))) is None for point in points)


def free_surfaces(scene: Scene, thing_id: str, receptacle_id: str) -> set[str]:
    """Return the names of a receptacle's surfaces with room for a thing."""
    thing, receptacle = scene.things[thing_id], scene.things[receptacle_id]
    return {
        surface.name
        for surface, frame in level_surfaces(receptacle)
        if _free(scene, thing, receptacle, surface, frame, {thing_id})
    }


def _bearing(stand: Thing, receptacle: Thing) -> list[tuple[Surface, Motion]]:
    """Return the level surfaces of a stand, such as a tray, on which a thing still counts as on the receptacle."""
    return [each for each in level_surfaces(stand) if not ends_lying_on(stand, each[0], receptacle)]


def _takes(receptacle: Thing, thing: Thing) -> bool:
    return receptacle.is_receptacle and can_hold(receptacle, thing)


def _free(scene: Scene, thing: Thing, receptacle: Thing, surface: Surface, frame: Motion, gone: set[str]) -> bool:
    """Return whether one surface has a free place for a thing, at any heading."""
    height = float(frame.shift[1])
    solids = [
        polygon_of(prism) for prism in _solids_between(scene, receptacle, gone, height, height + thing.asset.size.y)
    ]
    x, z = surface.size_x / 2 + EDGE_M, surface.size_z / 2 + EDGE_M  # things may extend beyond the edge
    corners = frame(np.array([[-x, 0.0, -z], [x, 0.0, -z], [x, 0.0, z], [-x, 0.0, z]]))
    flat = shapely.Polygon(corners[:, [0, 2]])
    solids = [each for each in solids if each.intersects(flat.buffer(2 * EDGE_M))]
    size = np.array([thing.asset.size.x, thing.asset.size.z]) - 2 * TOUCH_M
    return any(_is_free(flat, solids, size, float(yaw)) for yaw in np.arange(0.0, 180.0, TURN_STEP_DEG))


def _solids_between(scene: Scene, receptacle: Thing, gone: set[str], low: float, high: float) -> Iterable[Prism]:
    """Yield the solids between the heights `low` and `high` (m), except those of the receptacle itself."""
    for other in scene.things.values():
        if other.is_present and not other.is_held and other.id not in gone and other.id != receptacle.id:
            for prism in prisms_of(other):
                if prism.bottom < high - TOUCH_M and prism.top > low + TOUCH_M:
                    yield prism


def _is_free(flat: shapely.Polygon, solids: Sequence[BaseGeometry], size: np.ndarray, yaw: float) -> bool:
    """Return whether a rectangle of size (x, z; m) and heading `yaw` (deg) fits into an outline, clear of solids."""
    half = [rotate_floor(x * size[0] / 2, z * size[1] / 2, yaw) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    rectangle = np.array(half)
    middles: BaseGeometry = flat
    for corner in rectangle:
        middles = middles.intersection(shapely.transform(flat, lambda points, corner=corner: points - corner))
    for solid in solids:
        if middles.area <= MIN_M2:
            return False
        points = shapely.get_coordinates(solid.convex_hull)
        grown = shapely.MultiPoint((points[:, None, :] - rectangle[None, :, :]).reshape(-1, 2)).convex_hull
        middles = middles.difference(grown)
    return bool(middles.area > MIN_M2)
