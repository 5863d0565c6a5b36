"""What rests on what: surfaces in the house's frame, contents, and chains of support."""

from collections.abc import Iterable, Iterator

import numpy as np

from vigil.assets.kernel.asset import Asset, Surface
from vigil.base.geometry import Vec3
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.geometry import Motion, bounding_box, joint_of, part_motion
from vigil.scene.things import Scene, Thing

LEVEL_WITHIN = 0.99
"""Least vertical component of a surface's upward axis for things to rest on it."""
OVER_M = 0.1
"""Tolerance of `object_at_receptacle` (protocol.md section 4): height above a surface, and growth of its rectangle."""
BESIDE_M = 0.1
"""How far beside a surface a click on it may lie: its surface ends a little before its edge."""
TOUCH_M = 0.003
"""Solids that overlap by less touch only."""
LEVEL_SLACK_M = 1e-3
"""How far a thing may be sunk into the surface that it lies on, or stand below the rim that it lies on."""


def surface_named(thing: Thing, name: str | None) -> Surface | None:
    """Return the thing's surface of that name, if it has one."""
    return next((surface for surface in thing.asset.surfaces if surface.name == name), None)


def surface_frame(thing: Thing, surface: Surface, openness: float | None = None) -> Motion:
    """Return the motion from the surface's own frame (origin at its middle) to the house."""
    motion = part_motion(thing, surface.joint, openness)
    return Motion(motion.turn, motion(np.array(surface.center)[None])[0])


def is_level(frame: Motion) -> bool:
    """Whether a surface with that frame lies flat, facing up."""
    return float(frame.turn[1, 1]) >= LEVEL_WITHIN


def offset_from(frame: Motion, point: Vec3) -> Vec3:
    """Return a point in a surface's own frame: y is its height above the surface."""
    x, y, z = frame.inverse()(np.array(point)[None])[0]
    return Vec3(float(x), float(y), float(z))


def is_over(surface: Surface, local: Vec3) -> bool:
    """Whether a point in a surface's own frame lies in the free space over it, or a little beside that."""
    is_beside = abs(local.x) > surface.size_x / 2 + BESIDE_M or abs(local.z) > surface.size_z / 2 + BESIDE_M
    return not is_beside and -TOUCH_M <= local.y <= surface.clearance + TOUCH_M


def is_shut(thing: Thing) -> bool:
    """Whether what is inside the thing cannot be reached."""
    return bool(thing.asset.joints) and thing.openness < CLOSED_BELOW


def is_inside_closed(scene: Scene, thing: Thing) -> bool:
    """Whether the thing lies inside something shut, however deep."""
    return any(surface and surface.needs_opening and is_shut(parent) for parent, surface in _supports_of(scene, thing))


def containers_of(scene: Scene, thing: Thing) -> list[Thing]:
    """Return what the thing lies inside of, nearest first.

    It, or something below it in its chain of supports, rests on a surface inside each of them, or of a drawer of them.
    """
    hollows = (parent for parent, _ in interior_surfaces_around(scene, thing))
    return [each for parent in hollows for each in (parent, furniture_of(scene, parent)) if each is not None]


def interior_surfaces_around(scene: Scene, thing: Thing) -> list[tuple[Thing, Surface]]:
    """Return the interior surfaces that the thing, or something below it, rests on, each with whose it is."""
    rests = _supports_of(scene, thing)
    return [(parent, surface) for parent, surface in rests if surface is not None and surface.is_inside]


def supports_not_lain_on(scene: Scene, thing: Thing, others: Iterable[Thing]) -> tuple[str, ...]:
    """Return the ids of what bears the thing though it does not lie on it, nearest first.

    That is what has to be opened to reach it, open or shut, with all that bears that; and what bears a hollow of
    something fixed that it lies in: in a bowl is on the table, too, in a sink is not on its counter.
    Of a thing without a known support: those among others over nothing of which it lies but what has to be opened.
    """
    if thing.parent is None:
        over = {other.id: _surfaces_below(thing, other) for other in _receptacles(thing, others)}
        return tuple(sorted(key for key, below in over.items() if below and all(at.needs_opening for at in below)))
    found: list[str] = []
    is_within = False
    for parent, surface in _supports_of(scene, thing):
        if is_within or (surface is not None and surface.needs_opening):
            found.append(parent.id)
        is_within = bool(found) or is_within or _is_fixed_hollow(parent, surface)
    return tuple(found)


def ends_lying_on(parent: Thing, surface: Surface, receptacle: Thing) -> bool:
    """Whether what lies on a surface of a thing that a receptacle bears, or is, does not lie on that receptacle."""
    return surface.needs_opening or (parent is not receptacle and _is_fixed_hollow(parent, surface))


def _is_fixed_hollow(parent: Thing, surface: Surface | None) -> bool:
    return surface is not None and surface.is_inside and not parent.is_pickupable


def furniture_of(scene: Scene, thing: Thing) -> Thing | None:
    """Return the furniture that a drawer is part of; None for what is no part."""
    return scene.things.get(thing.parent or "") if thing.is_drawer else None


def drawers_of(scene: Scene, thing: Thing) -> list[Thing]:
    """Return the drawers that are parts of a thing, in the scene's order."""
    return [part for part in scene.things.values() if part.is_drawer and part.parent == thing.id]


def _supports_of(scene: Scene, thing: Thing) -> Iterator[tuple[Thing, Surface | None]]:
    """Yield what the thing rests on, what that rests on, and so on, each with the surface where that is known."""
    for parent in ancestors(scene, thing):
        yield parent, surface_named(parent, thing.surface)
        thing = parent


def ancestors(scene: Scene, thing: Thing) -> list[Thing]:
    """Return what the thing rests on, what that rests on, and so on."""
    chain: list[Thing] = []
    while thing.parent is not None and thing.parent in scene.things:
        thing = scene.things[thing.parent]
        chain.append(thing)
    return chain


def children(scene: Scene, parent_id: str) -> list[Thing]:
    """Return what rests directly on or in a thing and is present, in the scene's order."""
    return [thing for thing in scene.things.values() if thing.parent == parent_id and thing.is_present]


def contents(scene: Scene, thing_id: str) -> list[Thing]:
    """Return all that rests on or in a thing, however deep, nearest first."""
    found = children(scene, thing_id)
    for child in found:
        found.extend(children(scene, child.id))
    return found


def moved_by_joint(scene: Scene, thing: Thing, joint: str) -> list[Thing]:
    """Return what moves along with one of the thing's joints, however deep."""
    direct = [child for child in children(scene, thing.id) if child.parent_joint == joint]
    return direct + [deeper for child in direct for deeper in contents(scene, child.id)]


def receptacles_below(thing: Thing, others: Iterable[Thing], *, inside: bool) -> tuple[str, ...]:
    """Return the sorted ids of the receptacles among others over a surface of which the thing lies."""
    return tuple(sorted(other.id for other in _receptacles(thing, others) if rests_over(thing, other, inside=inside)))


def _receptacles(thing: Thing, others: Iterable[Thing]) -> Iterator[Thing]:
    """Yield those among others on or in which the thing may lie; none while it is held or gone."""
    for other in others if thing.is_present and not thing.is_held else ():
        if other.is_receptacle and other.is_present and not other.is_held and other is not thing:
            yield other


def rests_over(thing: Thing, receptacle: Thing, *, inside: bool = False) -> bool:
    """Whether the thing lies over a surface of the receptacle (with `inside`: an interior one) by the goal's rule."""
    return any(surface.is_inside or not inside for surface in _surfaces_below(thing, receptacle))


def _surfaces_below(thing: Thing, receptacle: Thing) -> list[Surface]:
    """Return the surfaces of a receptacle over which the thing lies by the goal's rule.

    The rectangle is grown only for a thing whose support is not known: what rests on a neighbour lies on the neighbour.
    """
    box = bounding_box(thing)
    low = Vec3(thing.position.x, box.bottom, thing.position.z)
    growth = OVER_M if thing.parent is None else 0.0
    return [
        surface
        for surface, frame in level_surfaces(receptacle)
        if _is_over(surface, offset_from(frame, low), growth) and _is_in_hollow(receptacle, surface, frame, low)
    ]


def _is_over(surface: Surface, point: Vec3, growth: float) -> bool:
    """Whether a point in the surface's frame lies over the grown surface, at most `OVER_M` up."""
    is_beside = abs(point.x) > surface.size_x / 2 + growth or abs(point.z) > surface.size_z / 2 + growth
    return not is_beside and -1e-6 <= point.y + LEVEL_SLACK_M <= OVER_M + LEVEL_SLACK_M


def _is_in_hollow(receptacle: Thing, surface: Surface, frame: Motion, point: Vec3) -> bool:
    """Whether a point over an interior surface is below its ceiling or rim and within the receptacle's own box."""
    if not surface.is_inside:
        return True
    x, height, z = offset_from(frame, point)
    size, center = receptacle.asset.size, surface.center
    is_in_box = abs(center.x + x) <= size.x / 2 and abs(center.z + z) <= size.z / 2
    return is_in_box and height < headroom(receptacle.asset, surface) - LEVEL_SLACK_M


def headroom(asset: Asset, surface: Surface) -> float:
    """Return the height (m) of the hollow over an interior surface: up to what is above it, or to the asset's rim."""
    return min(surface.clearance, asset.size.y / 2 - surface.center.y)


def level_surfaces(thing: Thing) -> Iterator[tuple[Surface, Motion]]:
    """Yield the thing's surfaces that lie flat now, with their frames."""
    for surface in thing.asset.surfaces:
        frame = surface_frame(thing, surface)
        if is_level(frame):
            yield surface, frame


def joint_is_hinge(thing: Thing, joint: str | None) -> bool:
    """Whether a joint turns what it carries."""
    found = joint_of(thing.asset, joint)
    return found is not None and found.kind == "hinge"
