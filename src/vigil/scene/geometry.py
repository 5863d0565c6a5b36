"""Solid geometry of things: how position, rotation and openness move an asset's prisms, boxes and surfaces.

Only this module maps an asset's frame to the house's frame (`vigil.base.geometry`). The module needs no engine and
stores no state.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely

from vigil.assets.kernel.asset import Asset, Joint, Solid
from vigil.assets.kernel.meshes import turn_about
from vigil.base.caches import cached_while_alive
from vigil.base.geometry import Box, Vec3, rotate_floor, wrap_deg
from vigil.scene.things import Thing

UPRIGHT_WITHIN = 1e-6
"""A prism counts as upright if the vertical component of its axis differs from 1 by at most this."""


@dataclass(frozen=True, eq=False)
class Prism:
    """An upright convex prism in the house's frame."""

    polygon: np.ndarray
    """Corners (n, 2) as x, z in metres; two corners for a prism without thickness."""
    bottom: float
    """Height (m) of the lower face."""
    top: float
    """Height (m) of the upper face."""
    joint: str | None = None
    """Name of the joint that carries this solid; None if the solid belongs to the thing's body."""

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds on the floor in metres: least x, least z, greatest x, greatest z."""
        low, high = self.polygon.min(axis=0), self.polygon.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A rigid motion: `point @ turn.T + shift`."""

    turn: np.ndarray
    """Rotation matrix (3, 3)."""
    shift: np.ndarray
    """Translation (3,) in metres."""

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Return points (n, 3) moved by this motion."""
        return points @ self.turn.T + self.shift

    def after(self, first: "Motion") -> "Motion":
        """Return the motion that does `first`, then this one."""
        return Motion(self.turn @ first.turn, self.turn @ first.shift + self.shift)

    def inverse(self) -> "Motion":
        """Return the motion that undoes this one."""
        return Motion(self.turn.T, -(self.turn.T @ self.shift))


STILL = Motion(np.eye(3), np.zeros(3))
"""The identity motion."""


@lru_cache(maxsize=4096)
def axis_turn(axis: Vec3, angle_deg: float) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation about a unit axis, in the direction in which `Joint` counts angles.

    The matrix is cached, so the caller must not change it.
    """
    return turn_about(axis, angle_deg)


@lru_cache(maxsize=4096)
def rotation_matrix(rotation: Vec3) -> np.ndarray:
    """Return the matrix (3, 3) of Euler angles (deg) that are applied z, then x, then y.

    The matrix is cached, so the caller must not change it.
    """
    turn_x, turn_y, turn_z = (axis_turn(axis, angle) for axis, angle in zip(_AXES, rotation, strict=True))
    return turn_y @ turn_x @ turn_z


_AXES = (Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))


def euler_angles(turn: np.ndarray) -> Vec3:
    """Return the Euler angles (deg) of a rotation matrix; this is the inverse of `rotation_matrix`."""
    pitch = math.asin(max(-1.0, min(1.0, -float(turn[1, 2]))))
    if abs(turn[1, 2]) > 1.0 - 1e-9:
        return Vec3(math.degrees(pitch), wrap_deg(math.degrees(math.atan2(-turn[2, 0], turn[0, 0]))), 0.0)
    yaw = math.atan2(turn[0, 2], turn[2, 2])
    roll = math.atan2(turn[1, 0], turn[1, 1])
    return Vec3(math.degrees(pitch), wrap_deg(math.degrees(yaw)), math.degrees(roll))


def place_of(thing: Thing) -> Motion:
    """Return the motion from the thing's asset frame to the house."""
    return Motion(rotation_matrix(thing.rotation), np.array(thing.position))


def joint_motion(joint: Joint, openness: float) -> Motion:
    """Return the motion that takes the parts on a joint from closed to an openness, in the asset's frame."""
    if joint.kind == "slide":
        return Motion(np.eye(3), np.array(joint.axis) * joint.travel * openness)
    turn = axis_turn(joint.axis, joint.travel * openness)
    origin = np.array(joint.origin)
    return Motion(turn, origin - turn @ origin)


def joint_of(asset: Asset, name: str | None) -> Joint | None:
    """Return the asset's joint called `name`; None if `name` is None (the body) or unknown."""
    if name is None:
        return None
    return next((joint for joint in asset.joints if joint.name == name), None)


def part_motion(thing: Thing, joint_name: str | None, openness: float | None = None) -> Motion:
    """Return the motion from the closed asset's frame to the house, for the parts that a joint carries.

    If `joint_name` is None, return the body's motion. If `openness` is None, use the thing's present openness.
    """
    place, joint = place_of(thing), joint_of(thing.asset, joint_name)
    if joint is None:
        return place
    return place.after(joint_motion(joint, thing.openness if openness is None else openness))


def prisms_of(thing: Thing, openness: float | None = None) -> list[Prism]:
    """Return the thing's solids in the house's frame; None stands for the thing's present openness."""
    return _prisms(thing, thing.asset.solids, openness, STILL)


def moving_prisms_of(thing: Thing, openness: float | None = None, along: Motion = STILL) -> list[Prism]:
    """Return only the solids that the thing's joints carry, after a further motion `along`, e.g. of its carrier."""
    return _prisms(thing, [solid for solid in thing.asset.solids if solid.joint], openness, along)


def _prisms(thing: Thing, solids: Sequence[Solid], openness: float | None, along: Motion) -> list[Prism]:
    motions = {joint: along.after(part_motion(thing, joint, openness)) for joint in {solid.joint for solid in solids}}
    return [_moved(solid, motions[solid.joint]) for solid in solids]


@lru_cache(maxsize=16384)
def solid_corners(solid: Solid) -> np.ndarray:
    """Return the corners (2 n, 3) of a solid in the asset frame, the lower n first."""
    flat = np.array(solid.polygon)
    ring = [np.column_stack([flat[:, 0], np.full(len(flat), y), flat[:, 1]]) for y in (solid.bottom, solid.top)]
    return np.concatenate(ring)


def _moved(solid: Solid, motion: Motion) -> Prism:
    """Return a solid after a motion. If the solid does not stay upright, return an upright prism that contains it."""
    points = motion(solid_corners(solid))
    bottom, top = float(points[:, 1].min()), float(points[:, 1].max())
    if _keeps_upright(motion.turn):
        return Prism(points[: len(solid.polygon), [0, 2]], bottom, top, solid.joint)
    return Prism(convex_hull(points[:, [0, 2]]), bottom, top, solid.joint)


def is_upright(thing: Thing) -> bool:
    """Return whether the thing is upright; the prisms of an upright thing are exact."""
    return _keeps_upright(rotation_matrix(thing.rotation))


def _keeps_upright(turn: np.ndarray) -> bool:
    return bool(turn[1, 1] > 1.0 - UPRIGHT_WITHIN)


def convex_hull(points: np.ndarray) -> np.ndarray:
    """Return the corners (n, 2) of the convex hull of points (m, 2); two corners if all points lie on a line."""
    hull = shapely.MultiPoint(points).convex_hull
    corners = shapely.get_coordinates(hull)
    return corners[:-1] if isinstance(hull, shapely.Polygon) else corners


def body_box(thing: Thing) -> Box:
    """Return the upright box of the thing's body, without its doors, lids and drawers.

    If the asset has only moving parts, return the box of the whole asset.
    """
    if thing.asset.body is None:
        return bounding_box(thing)
    low, high = thing.asset.body
    return upright_box(thing, np.array(low), np.array(high))


def bounding_box(thing: Thing) -> Box:
    """Return the upright box of the whole asset when it is closed."""
    half = np.array(thing.asset.size) / 2
    return upright_box(thing, -half, half)


def box_distances(box: Box, places: np.ndarray) -> np.ndarray:
    """Return the distances (n,) in metres on the floor plane from places (n, 2) to a box; see `Box.floor_distance`."""
    x, z = rotate_floor(places[:, 0] - box.center.x, places[:, 1] - box.center.z, -box.yaw)
    return np.hypot(np.maximum(np.abs(x) - box.size.x / 2, 0.0), np.maximum(np.abs(z) - box.size.z / 2, 0.0))


def upright_box(thing: Thing, low: np.ndarray, high: np.ndarray) -> Box:
    """Return an upright box, turned by the thing's yaw, that contains the box from `low` to `high` (asset frame)."""
    turn_x, turn_z = axis_turn(_AXES[0], thing.rotation.x), axis_turn(_AXES[2], thing.rotation.z)
    tilt = turn_x @ turn_z
    size = np.abs(tilt) @ (high - low)
    middle = place_of(thing)(((low + high) / 2)[None])[0]
    return Box(center=Vec3(*map(float, middle)), size=Vec3(*map(float, size)), yaw=wrap_deg(thing.rotation.y))


def penetration(a: Prism, b: Prism) -> float:
    """Return the depth (m) to which two convex prisms overlap; 0 or less when they do not overlap.

    The depth is the smallest overlap along all separating axes. For a thin leaf, it is how far the leaf's edge reaches
    into the other prism.
    """
    depth = min(a.top - b.bottom, b.top - a.bottom)
    if depth <= 0.0:
        return depth
    axes = np.concatenate([_edge_normals(a.polygon), _edge_normals(b.polygon)])
    along_a, along_b = a.polygon @ axes.T, b.polygon @ axes.T
    overlap = np.minimum(along_a.max(axis=0) - along_b.min(axis=0), along_b.max(axis=0) - along_a.min(axis=0))
    return min(depth, float(overlap.min()))


def penetrations(prisms: list[Prism], others: list[Prism]) -> np.ndarray:
    """Return penetrations (m) of shape (len(prisms), len(others)); -1 for a pair whose floor bounds do not overlap."""
    bounds = np.array([other.bounds for other in others]).reshape(-1, 4)
    depths = np.full((len(prisms), len(others)), -1.0)
    for row, prism in enumerate(prisms):
        left, front, right, back = prism.bounds
        near = (bounds[:, 0] < right) & (bounds[:, 2] > left) & (bounds[:, 1] < back) & (bounds[:, 3] > front)
        for column in np.flatnonzero(near):
            depths[row, column] = penetration(prism, others[column])
    return depths


def _edge_normals(polygon: np.ndarray) -> np.ndarray:
    edges = np.concatenate([polygon[1:], polygon[:1]]) - polygon
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    edges = edges[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    return np.concatenate([normals, edges]) if len(polygon) == 2 else normals


@cached_while_alive
def part_boxes(asset: Asset) -> tuple[tuple[str | None, np.ndarray, np.ndarray], ...]:
    """Return (joint, lowest corner, highest corner) of the meshes on each joint, and of the body (joint None)."""
    corners: dict[str | None, list[np.ndarray]] = {}
    for part in asset.parts:
        if len(part.mesh.vertices):
            extremes = np.stack([part.mesh.vertices.min(axis=0), part.mesh.vertices.max(axis=0)]).astype(float)
            corners.setdefault(part.joint, []).append(extremes)
    if not corners:
        half = np.array(asset.size) / 2
        return ((None, -half, half),)
    stacked = {joint: np.concatenate(found) for joint, found in corners.items()}
    return tuple((joint, points.min(axis=0), points.max(axis=0)) for joint, points in stacked.items())


def box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the corners (8, 3) of a box: corner i has x, y, z of `high` where bit 4, 2, 1 of i is set, else `low`."""
    picks = np.array([[(i >> 2) & 1, (i >> 1) & 1, i & 1] for i in range(8)], dtype=bool)
    return np.where(picks, high, low)
