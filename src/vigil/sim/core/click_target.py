"""The kind of place that a click on a receptacle means: on it, inside it, or behind a closed door, lid or drawer of it.

A held object is put down at the clicked point or near it. A click on the top never puts the object inside the
receptacle, and a click inside never puts it on top.
"""

import math
from typing import Literal

import shapely

from vigil.assets.kernel.asset import Surface
from vigil.base.geometry import Vec3, rotate_floor
from vigil.scene.geometry import Motion, body_box, prisms_of
from vigil.scene.supports import TOUCH_M, headroom, is_over, is_shut, level_surfaces, offset_from
from vigil.scene.things import Thing

TargetKind = Literal["inside", "on", "shut"]

LEAF_M = 0.015
"""A click at most this far (m) from a leaf (door, lid or drawer) counts as a click on the leaf."""
SIDE_M = 0.01
"""A click at most this deep (m) inside the box of the receptacle's body counts as a click on the body's outer side."""


def target_kind(receptacle: Thing, point: Vec3) -> TargetKind:
    """Return which kind of place a click at a point of a receptacle means: "on", "inside" or "shut".

    The first of these rules that applies decides. A point in a hollow means the hollow. A point above a top means the
    top. A click on a leaf or drawer means the hollow behind it. A click on an outer side of furniture with leaves or
    drawers means its top. Any other click means the nearest surface. A hollow that must be opened first is "shut".
    """
    surfaces = list(level_surfaces(receptacle))
    if not surfaces:
        return "on"
    gaps = [_gap(receptacle, surface, frame, point) for surface, frame in surfaces]
    nearest = surfaces[min(range(len(gaps)), key=gaps.__getitem__)][0]
    if nearest.is_inside and min(gaps) == 0.0:
        return _kind(receptacle, nearest)
    if any(not surface.is_inside and is_over(surface, offset_from(frame, point)) for surface, frame in surfaces):
        return "on"
    behind = next((surface for surface, _ in surfaces if surface.needs_opening), None)
    if behind is not None and _is_on_leaf(receptacle, point):
        return _kind(receptacle, behind)
    if behind is not None and _is_on_outer_side(receptacle, point):
        return "on"
    return _kind(receptacle, nearest)


def _kind(receptacle: Thing, surface: Surface) -> TargetKind:
    if surface.needs_opening and is_shut(receptacle):
        return "shut"
    return "inside" if surface.is_inside else "on"


def _gap(receptacle: Thing, surface: Surface, frame: Motion, point: Vec3) -> float:
    """Return the distance (m) from a point to the free space above a surface; a hollow's rim limits this space."""
    local = offset_from(frame, point)
    above = headroom(receptacle.asset, surface) if surface.is_inside else surface.clearance
    rise = max(-TOUCH_M - local.y, local.y - above, 0.0)
    return math.hypot(max(abs(local.x) - surface.size_x / 2, 0.0), rise, max(abs(local.z) - surface.size_z / 2, 0.0))


def _is_on_outer_side(receptacle: Thing, point: Vec3) -> bool:
    """Return whether a point is on one of the four upright sides of the box of the receptacle's body."""
    box = body_box(receptacle)
    x, z = rotate_floor(point.x - box.center.x, point.z - box.center.z, -box.yaw)
    return abs(x) > box.size.x / 2 - SIDE_M or abs(z) > box.size.z / 2 - SIDE_M


def _is_on_leaf(receptacle: Thing, point: Vec3) -> bool:
    place = shapely.Point(point.x, point.z)
    return any(
        prism.joint is not None
        and prism.bottom - LEAF_M <= point.y <= prism.top + LEAF_M
        and shapely.Polygon(prism.polygon).distance(place) <= LEAF_M
        for prism in prisms_of(receptacle)
    )
