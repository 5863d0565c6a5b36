"""What THOR calls visible and interactable: points of an object near enough, in the picture, and met by a ray.

THOR's assets have visibility points of their own; here the points of a lattice in each part's box take their place.
"""

from dataclasses import dataclass, replace

import numpy as np

from vigil.pose import Pose
from vigil.scene.geometry import part_boxes, part_motion
from vigil.scene.things import Thing
from vigil.sim.core.views import project
from vigil.sim.staging import View
from vigil.thor.base.world import World

_LATTICE = np.stack(np.meshgrid(*[[0.05, 0.5, 0.95]] * 3), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Seen:
    """Whether something is seen, and whether nothing, glass included, is before it."""

    visible: bool = False
    interactable: bool = False


def points_of(thing: Thing) -> np.ndarray:
    """Returns the points (n, 3) by which a thing is seen."""
    parts = part_boxes(thing.asset)
    return np.concatenate([part_motion(thing, joint)(low + _LATTICE * (high - low)) for joint, low, high in parts])


def seen_from(world: World, things: list[Thing], pose: Pose | None = None) -> dict[str, Seen]:
    """Returns what is seen of things from the agent's pose, or another; what is in the hand always is."""
    view = world.view(pose)
    found = {thing.id: Seen(thing.is_held, thing.is_held) for thing in things}
    free = [thing for thing in things if not thing.is_held and _may_be_near(world, view, thing)]
    clouds = [_in_view(world, view, points_of(thing)) for thing in free]
    whole = [(thing, cloud) for thing, cloud in zip(free, clouds, strict=True) if len(cloud)]
    if not whole:
        return found
    rays = np.concatenate([cloud for _, cloud in whole]) - np.array(view.eye)
    rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-9)
    hard, _ = world.stage.meets(view.eye, rays)
    soft, _ = world.stage.meets(view.eye, rays, through_glass=True)
    index = {thing_id: number for number, thing_id in enumerate(world.stage.scene().things)}
    first = 0
    for thing, cloud in whole:
        part = slice(first, first + len(cloud))
        first += len(cloud)
        interactable = bool((hard[part] == index[thing.id]).any())
        found[thing.id] = Seen(interactable or bool((soft[part] == index[thing.id]).any()), interactable)
    return found


def wide(world: World) -> World:
    """Returns the world as one sees it without a limit of distance."""
    return replace(world, settings=world.settings.model_copy(update={"visibility_distance": 1e6}))


def _may_be_near(world: World, view: View, thing: Thing) -> bool:
    gap = np.hypot(thing.position.x - view.eye.x, thing.position.z - view.eye.z)
    return bool(gap <= world.settings.visibility_distance + np.linalg.norm(thing.asset.size) * 1.5)


def _in_view(world: World, view: View, points: np.ndarray) -> np.ndarray:
    """Returns the points near enough, in the floor plane, and in the picture."""
    gaps = np.hypot(points[:, 0] - view.eye.x, points[:, 2] - view.eye.z)
    flat = project(view, points)
    inside = ((flat[:, :2] >= 0.0) & (flat[:, :2] <= 1.0)).all(axis=1) & (flat[:, 2] > 0.0)
    return points[inside & (gaps <= world.settings.visibility_distance)]
