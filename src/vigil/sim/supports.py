"""What rests on what: surfaces in the house's frame, contents, and chains of support."""

from collections.abc import Iterator

import numpy as np

from vigil.assets.asset import Surface
from vigil.pose import Vec3
from vigil.sim.geometry import Motion, joint_of, part_motion, whole_box
from vigil.sim.scene import Scene, Thing
from vigil.world import CLOSED_BELOW

LEVEL_WITHIN = 0.99
"""Least vertical component of a surface's upward axis for things to rest on it."""
OVER_M = 0.1
"""Tolerance of `object_at_receptacle` (protocol.md section 4): height above a surface, and growth of its rectangle."""


def surface_named(thing: Thing, name: str | None) -> Surface | None:
    """Returns the thing's surface of that name, if it has one."""
    return next((surface for surface in thing.asset.surfaces if surface.name == name), None)


def surface_frame(thing: Thing, surface: Surface, openness: float | None = None) -> Motion:
    """Returns the motion from the surface's own frame (origin at its middle) to the house."""
    motion = part_motion(thing, surface.joint, openness)
    return Motion(motion.turn, motion(np.array(surface.center)[None])[0])


def is_level(frame: Motion) -> bool:
    """Whether a surface with that frame lies flat, facing up."""
    return float(frame.turn[1, 1]) >= LEVEL_WITHIN


def offset_from(frame: Motion, point: Vec3) -> Vec3:
    """Returns a point in a surface's own frame: y is its height above the surface."""
    x, y, z = frame.inverse()(np.array(point)[None])[0]
    return Vec3(float(x), float(y), float(z))


def is_shut(thing: Thing) -> bool:
    """Whether what is inside the thing cannot be reached."""
    return bool(thing.asset.joints) and thing.openness < CLOSED_BELOW


def is_shut_in(scene: Scene, thing: Thing) -> bool:
    """Whether the thing lies inside something shut, however deep."""
    for below in [thing, *ancestors(scene, thing)]:
        parent = scene.things.get(below.parent or "")
        surface = parent and surface_named(parent, below.surface)
        if parent and surface and surface.is_inside and is_shut(parent):
            return True
    return False


def ancestors(scene: Scene, thing: Thing) -> list[Thing]:
    """Returns what the thing rests on, what that rests on, and so on."""
    chain: list[Thing] = []
    while thing.parent is not None and thing.parent in scene.things:
        thing = scene.things[thing.parent]
        chain.append(thing)
    return chain


def children(scene: Scene, parent_id: str) -> list[Thing]:
    """Returns what rests directly on or in a thing and is present, in the scene's order."""
    return [thing for thing in scene.things.values() if thing.parent == parent_id and thing.is_present]


def contents(scene: Scene, thing_id: str) -> list[Thing]:
    """Returns all that rests on or in a thing, however deep, nearest first."""
    found = children(scene, thing_id)
    for child in found:
        found.extend(children(scene, child.id))
    return found


def carried_by(scene: Scene, thing: Thing, joint: str) -> list[Thing]:
    """Returns what moves along with one of the thing's joints, however deep."""
    direct = [child for child in children(scene, thing.id) if child.parent_joint == joint]
    return direct + [deeper for child in direct for deeper in contents(scene, child.id)]


def rests_over(thing: Thing, receptacle: Thing) -> bool:
    """Whether the thing lies over one of the receptacle's surfaces within the goal's tolerance."""
    box = whole_box(thing)
    low = Vec3(thing.position.x, box.bottom, thing.position.z)
    for surface, frame in level_surfaces(receptacle):
        x, height, z = offset_from(frame, low)
        over = abs(x) <= surface.size_x / 2 + OVER_M and abs(z) <= surface.size_z / 2 + OVER_M
        if over and -1e-6 <= height + 1e-3 <= OVER_M + 1e-3:
            return True
    return False


def level_surfaces(thing: Thing) -> Iterator[tuple[Surface, Motion]]:
    """Yields the thing's surfaces that lie flat now, with their frames."""
    for surface in thing.asset.surfaces:
        frame = surface_frame(thing, surface)
        if is_level(frame):
            yield surface, frame


def joint_is_hinge(thing: Thing, joint: str | None) -> bool:
    """Whether a joint turns what it carries."""
    found = joint_of(thing.asset, joint)
    return found is not None and found.kind == "hinge"
