"""Which objects are visible and interactable in AI2-THOR's sense.

An object is visible if one of its points is near enough, in the image, and hit by a ray. AI2-THOR's assets have
hand-chosen visibility points; this engine uses the points of a lattice in the box of each part.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Pose, Vec3, floor_distance
from vigil.scene.geometry import part_boxes, part_motion
from vigil.scene.things import Thing
from vigil.sim.core.views import project_to_view
from vigil.sim.scene_editor import CameraView
from vigil.thor.base.floors import points_of_floor
from vigil.thor.base.world import World

_LATTICE = np.stack(np.meshgrid(*[[0.05, 0.5, 0.95]] * 3), axis=-1).reshape(-1, 3)
CAST_FIRST = 5
"""Rays are first cast to every fifth point. If one of these rays hits a thing, the thing needs no further rays."""
_NOT_CAST = -2
SHORT_OF_FLOOR_M = 0.01
"""A point of a floor counts as seen if a ray to it meets nothing until this distance (m) before the point."""


@dataclass(frozen=True, slots=True)
class Visibility:
    """Whether one object is visible and interactable."""

    visible: bool = False
    """Whether a point of the object is visible, directly or through glass."""
    interactable: bool = False
    """Whether a point of the object is visible with nothing in front of it, not even glass."""


def points_of(thing: Thing) -> np.ndarray:
    """Return the visibility points (n, 3) of a thing. The array is cached, so it must not be changed."""
    return _points(thing.asset, thing.position, thing.rotation, thing.openness)


@lru_cache(maxsize=1024)
def _points(asset: Asset, position: Vec3, rotation: Vec3, openness: float) -> np.ndarray:
    thing = Thing("", asset.category, asset, position, rotation, openness=openness)
    boxes = part_boxes(asset)
    return np.concatenate([part_motion(thing, joint)(low + _LATTICE * (high - low)) for joint, low, high in boxes])


@lru_cache(maxsize=1024)
def _reach_m(asset: Asset) -> float:
    """Return one and a half times the diagonal of an asset's box (m), within which all its points are."""
    return float(np.linalg.norm(asset.size) * 1.5)


@lru_cache(maxsize=1024)
def _has_glass(asset: Asset) -> bool:
    return any(part.is_glass for part in asset.parts)


def visibility_of(world: World, things: list[Thing], pose: Pose | None = None) -> dict[str, Visibility]:
    """Return {id: visibility} of things, seen from `pose` (default: the agent's). A held object is always visible."""
    view = world.view(pose)
    found = {thing.id: Visibility(thing.is_held, thing.is_held) for thing in things}
    found |= _floors_seen(world, view, [thing.id for thing in things if thing.id in world.floors])
    limit, eye = world.settings.visibility_distance, view.eye
    free = [
        thing
        for thing in things
        if thing.id not in world.floors
        and not thing.is_held
        and floor_distance(thing.position, eye) <= limit + _reach_m(thing.asset)
    ]
    if not free:
        return found
    scene = world.editor.scene().things
    numbers = {thing_id: number for number, thing_id in enumerate(scene)}
    clouds = [points_of(thing) for thing in free]
    points = np.concatenate(clouds)
    owners = np.repeat([numbers[thing.id] for thing in free], [len(cloud) for cloud in clouds])
    is_inside = _is_in_view(world, view, points)
    rays = points[is_inside] - np.array(view.eye)
    rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-9)
    is_glassy = np.array([*(_has_glass(thing.asset) for thing in scene.values()), False])
    interactable, visible = _met(world, view.eye, rays, owners[is_inside], is_glassy)
    for thing in free:
        number = numbers[thing.id]
        found[thing.id] = Visibility(number in interactable or number in visible, number in interactable)
    return found


def _floors_seen(world: World, view: CameraView, ids: list[str]) -> dict[str, Visibility]:
    """Return the visibility of floors, by the ids of their rooms."""
    rooms = [room for room in world.editor.scene().rooms if room.id in ids]
    if not rooms:
        return {}
    clouds = [points_of_floor(room) for room in rooms]
    points, owners = np.concatenate(clouds), np.repeat([room.id for room in rooms], [len(cloud) for cloud in clouds])
    is_inside = _is_in_view(world, view, points)
    rays = points[is_inside] - np.array(view.eye)
    lengths = np.linalg.norm(rays, axis=1)
    indices, distances = world.editor.meets(view.eye, rays / np.maximum(lengths, 1e-9)[:, None])
    seen = set(owners[is_inside][(indices < 0) & (distances > lengths - SHORT_OF_FLOOR_M)].tolist())
    return {name: Visibility(name in seen, name in seen) for name in ids}


def _met(
    world: World, eye: Vec3, rays: np.ndarray, owners: np.ndarray, is_glassy: np.ndarray
) -> tuple[set[int], set[int]]:
    """Return the indices of the things that rays (n, 3) hit directly, and of the things that rays hit through glass.

    `owners` (n,) has the index of the thing for which each ray is cast; a hit on another thing does not count.
    """
    hits = np.full(len(rays), _NOT_CAST)
    hits[::CAST_FIRST], _ = world.editor.meets(eye, rays[::CAST_FIRST])
    rest = (hits == _NOT_CAST) & ~np.isin(owners, owners[hits == owners])
    hits[rest], _ = world.editor.meets(eye, rays[rest])
    directly = owners[hits == owners]
    stopped = (hits >= 0) & is_glassy[hits] & ~np.isin(owners, directly)
    behind, _ = world.editor.meets(eye, rays[stopped], through_glass=True)
    return set(directly.tolist()), set(owners[stopped][behind == owners[stopped]].tolist())


def _is_in_view(world: World, view: CameraView, points: np.ndarray) -> np.ndarray:
    """Return a mask (n,) of the points (n, 3) that are in the image and near enough, measured on the floor plane."""
    gaps = np.hypot(points[:, 0] - view.eye.x, points[:, 2] - view.eye.z)
    flat = project_to_view(view, points)
    inside = ((flat[:, :2] >= 0.0) & (flat[:, :2] <= 1.0)).all(axis=1) & (flat[:, 2] > 0.0)
    return inside & (gaps <= world.settings.visibility_distance)
