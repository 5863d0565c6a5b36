"""Which thing rests on which: surfaces in the house's frame, contents of things, and chains of support."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from vigil.assets.kernel.asset import Asset, Surface
from vigil.base.geometry import Vec3
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.geometry import Motion, bounding_box, joint_of, part_motion
from vigil.scene.things import Scene, Thing

LEVEL_WITHIN = 0.99
"""Things can rest on a surface if the vertical component of the surface's upward axis is at least this."""
OVER_M = 0.1
"""Tolerance (m) of the rule `object_at_receptacle` (protocol.md section 4), above and around a surface."""
BESIDE_M = 0.1
"""A click at most this far (m) outside a surface's rectangle counts as on the surface, because the rectangle ends a
little before the visible edge."""
TOUCH_M = 0.003
"""Two solids that overlap by at most this (m) only touch."""
FARTHEST_SURFACE = 2.0
"""Greatest distance of a thing's surfaces from the thing, as a multiple of the diagonal of its box. Leaves and drawers
move by less than this."""
LEVEL_SLACK_M = 1e-3
"""How far (m) a thing may reach into the surface that it lies on, or above the rim of the hollow that it lies in."""


def surface_named(thing: Thing, name: str | None) -> Surface | None:
    """Return the thing's surface called `name`; None if there is none."""
    return next((surface for surface in thing.asset.surfaces if surface.name == name), None)


def surface_frame(thing: Thing, surface: Surface, openness: float | None = None) -> Motion:
    """Return the motion from the surface's frame to the house; the frame's origin is the surface's middle."""
    motion = part_motion(thing, surface.joint, openness)
    return Motion(motion.turn, motion(np.array(surface.center)[None])[0])


def is_level(frame: Motion) -> bool:
    """Return whether a surface with this frame is level and faces up."""
    return float(frame.turn[1, 1]) >= LEVEL_WITHIN


def offset_from(frame: Motion, point: Vec3) -> Vec3:
    """Return a point of the house in a surface's frame; its y is the height above the surface."""
    x, y, z = frame.inverse()(np.array(point)[None])[0]
    return Vec3(float(x), float(y), float(z))


def is_over(surface: Surface, local: Vec3) -> bool:
    """Return whether a point in a surface's frame is in the free space above it, or at most `BESIDE_M` to the side."""
    is_beside = abs(local.x) > surface.size_x / 2 + BESIDE_M or abs(local.z) > surface.size_z / 2 + BESIDE_M
    return not is_beside and -TOUCH_M <= local.y <= surface.clearance + TOUCH_M


def is_shut(thing: Thing) -> bool:
    """Return whether the thing has moving parts and is closed, so that things inside it cannot be reached."""
    return bool(thing.asset.joints) and thing.openness < CLOSED_BELOW


def is_inside_closed(scene: Scene, thing: Thing) -> bool:
    """Return whether the thing is inside a shut thing, directly or inside other things."""
    return any(surface and surface.needs_opening and is_shut(parent) for parent, surface in _supports_of(scene, thing))


def containers_of(scene: Scene, thing: Thing) -> list[Thing]:
    """Return the things that contain the thing, nearest first.

    A container has an interior surface that carries the thing, directly or through other things. For a surface in a
    drawer, the drawer is a container, and then its furniture.
    """
    hollows = (parent for parent, _ in interior_surfaces_around(scene, thing))
    return [each for parent in hollows for each in (parent, furniture_of(scene, parent)) if each is not None]


def interior_surfaces_around(scene: Scene, thing: Thing) -> list[tuple[Thing, Surface]]:
    """Return (owner, surface) for each interior surface in the thing's chain of supports."""
    rests = _supports_of(scene, thing)
    return [(parent, surface) for parent, surface in rests if surface is not None and surface.is_inside]


def supports_not_lain_on(scene: Scene, thing: Thing, others: Iterable[Thing]) -> tuple[str, ...]:
    """Return the ids of those supports of a thing on which the thing does not count as lying, nearest first.

    These are the things that must be opened to reach the thing (whether they are open or shut now), and everything that
    supports these. If the thing is in the hollow of something that cannot be picked up, everything below the hollow is
    added: a thing in a sink does not lie on the counter. (A bowl can be picked up, so a thing in a bowl lies on the
    table.)

    If the thing's support is not known, return the sorted ids of those `others` that have surfaces below the thing, but
    none that can be reached without opening.
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
    """Return whether things on a surface of `parent` do not count as lying on `receptacle`.

    `receptacle` is `parent` itself or one of the things that support it.
    """
    return surface.needs_opening or (parent is not receptacle and _is_fixed_hollow(parent, surface))


def _is_fixed_hollow(parent: Thing, surface: Surface | None) -> bool:
    return surface is not None and surface.is_inside and not parent.is_pickupable


def furniture_of(scene: Scene, thing: Thing) -> Thing | None:
    """Return the furniture that a drawer is part of; None for a thing that is not a drawer."""
    return scene.things.get(thing.parent or "") if thing.is_drawer else None


def drawers_of(scene: Scene, thing: Thing) -> list[Thing]:
    """Return the drawers that are parts of a thing, in the order of the scene's things."""
    return [part for part in scene.things.values() if part.is_drawer and part.parent == thing.id]


def _supports_of(scene: Scene, thing: Thing) -> Iterator[tuple[Thing, Surface | None]]:
    """Yield the thing's chain of supports, nearest first: each supporting thing and its surface (None if unknown)."""
    for parent in ancestors(scene, thing):
        yield parent, surface_named(parent, thing.surface)
        thing = parent


def ancestors(scene: Scene, thing: Thing) -> list[Thing]:
    """Return the thing's chain of supports: the thing that it rests on, the thing that this one rests on, and so on."""
    chain: list[Thing] = []
    while thing.parent is not None and thing.parent in scene.things:
        thing = scene.things[thing.parent]
        chain.append(thing)
    return chain


def children(scene: Scene, parent_id: str) -> list[Thing]:
    """Return the things that are present and rest directly on or in a thing, in the order of the scene's things."""
    return [thing for thing in scene.things.values() if thing.parent == parent_id and thing.is_present]


def contents(scene: Scene, thing_id: str) -> list[Thing]:
    """Return all things that rest on or in a thing, directly or on other things, nearest first."""
    found = children(scene, thing_id)
    for child in found:
        found.extend(children(scene, child.id))
    return found


def moved_by_joint(scene: Scene, thing: Thing, joint: str) -> list[Thing]:
    """Return all things that one joint of the thing carries, directly or on other things."""
    direct = [child for child in children(scene, thing.id) if child.parent_joint == joint]
    return direct + [deeper for child in direct for deeper in contents(scene, child.id)]


def receptacles_below(thing: Thing, others: Iterable[Thing]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the sorted ids of the receptacles among `others` that have a surface below the thing, by the rule of
    `object_at_receptacle`, and of those that have an interior surface below it."""
    below = {other.id: _surfaces_below(thing, other) for other in _receptacles(thing, others)}
    over = sorted(name for name, surfaces in below.items() if surfaces)
    return tuple(over), tuple(name for name in over if any(surface.is_inside for surface in below[name]))


def _receptacles(thing: Thing, others: Iterable[Thing]) -> Iterator[Thing]:
    """Yield the receptacles among `others` on or in which the thing may lie; none if the thing is held or absent."""
    for other in others if thing.is_present and not thing.is_held else ():
        if other.is_receptacle and other.is_present and not other.is_held and other is not thing:
            yield other


def _surfaces_below(thing: Thing, receptacle: Thing) -> list[Surface]:
    """Return the surfaces of a receptacle that are below the thing, by the rule of `object_at_receptacle`.

    The rectangle of a surface is enlarged only if the thing's support is not known. If the support is known, a thing
    that lies next to the receptacle must not count as lying on it.
    """
    away_m = math.hypot(thing.position.x - receptacle.position.x, thing.position.z - receptacle.position.z)
    if away_m > FARTHEST_SURFACE * math.hypot(*receptacle.asset.size) + 2 * OVER_M:
        return []
    box = bounding_box(thing)
    low = Vec3(thing.position.x, box.bottom, thing.position.z)
    growth = OVER_M if thing.parent is None else 0.0
    return [
        surface
        for surface, frame in level_surfaces(receptacle)
        if _is_over(surface, offset_from(frame, low), growth) and _is_in_hollow(receptacle, surface, frame, low)
    ]


def _is_over(surface: Surface, point: Vec3, growth: float) -> bool:
    """Return whether a point in the surface's frame is at most `OVER_M` above the surface, enlarged by `growth` (m)."""
    is_beside = abs(point.x) > surface.size_x / 2 + growth or abs(point.z) > surface.size_z / 2 + growth
    return not is_beside and -1e-6 <= point.y + LEVEL_SLACK_M <= OVER_M + LEVEL_SLACK_M


def _is_in_hollow(receptacle: Thing, surface: Surface, frame: Motion, point: Vec3) -> bool:
    """Return whether a point above an interior surface is within the receptacle's box and below the hollow's ceiling or
    rim.

    For a surface that is not interior, return True.
    """
    if not surface.is_inside:
        return True
    x, height, z = offset_from(frame, point)
    size, center = receptacle.asset.size, surface.center
    is_in_box = abs(center.x + x) <= size.x / 2 and abs(center.z + z) <= size.z / 2
    return is_in_box and height < headroom(receptacle.asset, surface) - LEVEL_SLACK_M


def headroom(asset: Asset, surface: Surface) -> float:
    """Return the height (m) of the hollow above an interior surface, up to the next solid or the asset's rim."""
    return min(surface.clearance, asset.size.y / 2 - surface.center.y)


def level_surfaces(thing: Thing) -> Iterator[tuple[Surface, Motion]]:
    """Yield the surfaces of the thing that are level at present, with their frames."""
    for surface in thing.asset.surfaces:
        frame = surface_frame(thing, surface)
        if is_level(frame):
            yield surface, frame


def moves_with(thing: Thing, other: Thing, carriers: list[Thing]) -> bool:
    """Return whether `other` is inside `thing` or moves with one of its drawers; if so, doors of `thing` cannot hit it.

    `carriers` are the `ancestors` of `other`.
    """
    if thing not in carriers:
        return False
    child = next(each for each in [other, *carriers] if each.parent == thing.id)
    surface = surface_named(thing, child.surface)
    if surface is None or surface.needs_opening:
        return True
    return surface.joint is not None and not joint_is_hinge(thing, surface.joint)


def joint_is_hinge(thing: Thing, joint: str | None) -> bool:
    """Return whether the joint called `joint` is a hinge; False for an unknown name."""
    found = joint_of(thing.asset, joint)
    return found is not None and found.kind == "hinge"
