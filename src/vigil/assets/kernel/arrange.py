"""Arranges whole assets: turns them along the longest side of their box, or puts them at the bottom of a larger box."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset, Mesh, Solid, Surface
from vigil.assets.kernel.builder import box_solid
from vigil.assets.kernel.meshes import cross
from vigil.base.geometry import Vec3

Maker = Callable[[Vec3, np.random.Generator, Sequence[float]], Asset]
Silhouette = Sequence[tuple[float, float]]
"""Half of the outline of a round part (turned as on a lathe), as (radius, height) pairs."""


def lengthwise(maker: Maker) -> Maker:
    """Return a maker of things that lie along the longer of the box's sides x and z; `maker` makes things along z."""

    def make(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
        if size.x <= size.z:
            return maker(size, rng, levels)
        return quarter_turned(maker(Vec3(size.z, size.y, size.x), rng, levels), "y", 90)

    return make


def along_longest(maker: Maker) -> Maker:
    """Return a maker of slim things that lie along the longest side of the box; `maker` makes things along z.

    In a box that is higher than long, the things stand.
    """
    lying = lengthwise(maker)

    def make(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
        if size.y <= max(size.x, size.z):
            return lying(size, rng, levels)
        return quarter_turned(maker(Vec3(size.x, size.z, size.y), rng, levels), "x", -90)

    return make


def quarter_turned(asset: Asset, axis: shapes.Axis, degrees: int) -> Asset:
    """Return the asset turned by 90 degrees or a multiple about an axis; about x or z, the result has no surfaces."""
    matrix = np.round(shapes.rotation(axis, degrees))

    def point(value: Sequence[float]) -> Vec3:
        return Vec3(*(float(part) for part in matrix @ np.asarray(value)))

    def solid(old: Solid) -> Solid:
        corners = np.array([point((x, y, z)) for x, z in old.polygon for y in (old.bottom, old.top)])
        return box_solid(corners.min(0), corners.max(0), old.joint)

    def surface(old: Surface) -> Surface:
        return replace(old, center=point(old.center), size_x=old.size_z, size_z=old.size_x)

    body = asset.body
    if body is not None:
        ends = np.array([point(corner) for corner in body])
        body = (Vec3(*ends.min(0).tolist()), Vec3(*ends.max(0).tolist()))
    return replace(
        asset,
        size=Vec3(*(abs(side) for side in point(asset.size))),
        parts=tuple(replace(part, mesh=shapes.rotate(part.mesh, axis, degrees)) for part in asset.parts),
        solids=tuple(solid(old) for old in asset.solids),
        joints=tuple(replace(old, axis=point(old.axis), origin=point(old.origin)) for old in asset.joints),
        surfaces=tuple(surface(old) for old in asset.surfaces) if axis == "y" else (),
        body=body,
        glow=None if asset.glow is None else replace(asset.glow, position=point(asset.glow.position)),
    )


def lowered_into(asset: Asset, size: Vec3, forward: float = 0.0) -> Asset:
    """Return the asset at the bottom of a larger box, `forward` metres in front of the box's middle.

    This is for boxes that were measured while the thing was open.
    """
    drop = (asset.size.y - size.y) / 2

    def lower(value: Vec3) -> Vec3:
        return Vec3(value.x, value.y + drop, value.z + forward)

    def lowered(old: Solid) -> Solid:
        polygon = tuple((x, z + forward) for x, z in old.polygon)
        return replace(old, polygon=polygon, bottom=old.bottom + drop, top=old.top + drop)

    low, high = asset.body or (Vec3(*(-side / 2 for side in asset.size)), Vec3(*(side / 2 for side in asset.size)))
    return replace(
        asset,
        size=size,
        parts=tuple(replace(part, mesh=shapes.translate(part.mesh, (0, drop, forward))) for part in asset.parts),
        solids=tuple(lowered(old) for old in asset.solids),
        joints=tuple(replace(old, origin=lower(old.origin)) for old in asset.joints),
        surfaces=tuple(replace(old, center=lower(old.center)) for old in asset.surfaces),
        body=(lower(low), lower(high)),
        glow=None if asset.glow is None else replace(asset.glow, position=lower(asset.glow.position)),
    )


def lathed_oval(profile: Silhouette, width: float, depth: float, segments: int = 18) -> Mesh:
    """Return a lathed profile that is stretched to an oval; the profile's radii are shares of half the `width`."""
    part = shapes.lathe([(radius * width / 2, y) for radius, y in profile], segments=segments)
    return part if abs(width - depth) < 1e-6 else shapes.scale(part, (1.0, 1.0, depth / width))


def bend(part: Mesh, lift: Callable[[np.ndarray], np.ndarray]) -> Mesh:
    """Return the mesh with `lift(z)` added to each y, for handles and blades that curve along z."""
    vertices = part.vertices.astype(np.float64)
    step = 1e-3 * max(float(np.ptp(vertices[:, 2])), 1e-6)
    slope = (lift(vertices[:, 2] + step) - lift(vertices[:, 2] - step)) / (2 * step)
    moved = vertices + np.c_[np.zeros(len(vertices)), lift(vertices[:, 2]), np.zeros(len(vertices))]
    normals = part.normals.astype(np.float64)
    normals = np.c_[normals[:, 0], normals[:, 1], normals[:, 2] - slope * normals[:, 1]]
    return shapes.mesh(moved, part.faces, normals, part.uvs)


def creased(part: Mesh) -> Mesh:
    """Return the mesh with flat shading at its sharp folds, where smooth normals would look as if lit from behind."""
    corners = part.vertices[part.faces].astype(np.float64)
    across = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    across /= np.maximum(lengths, 1e-15)
    agreement = np.einsum("ij,ikj->ik", across, part.normals[part.faces]).min(1)
    sharp = (agreement < 0.4) & (lengths[:, 0] > 1e-15)
    if not sharp.any():
        return part
    own = part.faces[sharp].ravel()
    faces = part.faces.copy()
    faces[sharp] = len(part.vertices) + np.arange(len(own)).reshape(-1, 3)
    return shapes.mesh(
        np.concatenate([part.vertices, part.vertices[own]]),
        faces,
        np.concatenate([part.normals, np.repeat(across[sharp], 3, axis=0)]),
        np.concatenate([part.uvs, part.uvs[own]]),
    )


def strip(width_at: Sequence[tuple[float, float]], thickness: float, y: float = 0.0) -> Mesh:
    """Return a flat board along z, symmetric about x = 0; `width_at` has (z, half the width) pairs in order of z."""
    outline = [(half, z) for z, half in width_at] + [(-half, z) for z, half in reversed(width_at)]
    return shapes.extrude(outline, y - thickness / 2, y + thickness / 2)


def drape(width: float, height: float, waves: float, depth: float, *, thickness: float = 0.004) -> Mesh:
    """Return hanging cloth in folds: `width` along x, `height` along y from y = 0, and `depth` along z around z = 0."""
    count = max(6, round(6 * waves))
    x = np.linspace(-width / 2, width / 2, count + 1)
    swing = max(depth - thickness, 1e-4) / 2
    z = swing * np.sin(2 * np.pi * waves * (x / width + 0.5))
    front, back = np.c_[x, z + thickness / 2], np.c_[x, z - thickness / 2]
    return shapes.extrude(np.concatenate([front, back[::-1]]), 0.0, height)


def closed(outline: np.ndarray, height: float) -> np.ndarray:
    """Return an outline as a closed ring (n + 1, 3) at a height; the ring repeats the first point at its end."""
    ring = np.concatenate([outline, outline[:1]])
    return np.stack([ring[:, 0], np.full(len(ring), height), ring[:, 1]], 1)


def bin_shape(outline: np.ndarray, y: tuple[float, float], foot: float, wall: float, *, has_floor: bool = True) -> Mesh:
    """Return a bin, or only its rim. Its outline (n, 2) is that of the top; the bottom is `foot` times as large."""
    reach = np.abs(outline).max(0)
    inner = (reach - wall) / reach

    def at(height: float, scale: float, thin: bool = False) -> np.ndarray:
        return closed(outline * scale * (inner if thin else 1.0), height)

    low, high = y
    bottom = low + wall if has_floor else low
    parts = [
        shapes.loft(np.stack([at(bottom, foot, True), at(high, 1.0, True)]), cap=False),
        shapes.loft(np.stack([at(high, 1.0, True), at(high, 1.0)]), cap=False),
        shapes.loft(np.stack([at(high, 1.0), at(low, foot)]), cap=False),
        shapes.extrude(foot * outline * 0.99, low, low + wall)
        if has_floor
        else shapes.loft(np.stack([at(low, foot), at(low, foot, True)]), cap=False),
    ]
    return shapes.merge(parts)


def bin_lining(outline: np.ndarray, height: float, foot: float) -> Mesh:
    """Return the inner skin of a bin, slightly inside its walls."""
    reach = np.abs(outline).max(0)
    inner = (reach - 0.0135) / reach
    low, high = closed(outline * inner * foot, 0.013), closed(outline * inner, height - 0.01)
    floor = shapes.extrude(outline * inner * foot * 0.99, 0.013, 0.015)
    return shapes.merge([shapes.loft(np.stack([low, high]), cap=False), floor])


def framed(outer: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return the outline (n, 2) of a frame with a hole as one line, cut open where both outlines are farthest to +x."""
    outer, hole = (np.roll(each, -int(np.argmax(each[:, 0])), 0) for each in (outer, hole))
    return np.concatenate([outer, outer[:1], hole[:1], hole[:0:-1], hole[:1]])


def egg(width: float, length: float, middle: float, count: int = 20) -> np.ndarray:
    """Return an egg-shaped outline (n, 2) of x, z; its back is blunter than its front."""
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x = width / 2 * np.cos(angles) * np.where(np.sin(angles) < 0, 1.0, 1 - 0.12 * np.sin(angles))
    return np.stack([x / np.abs(x).max() * width / 2, middle + length / 2 * np.sin(angles)], 1)


def shrunk(outline: np.ndarray, share: float, shift: float = 0.0) -> np.ndarray:
    """Return an outline (n, 2) of x, z that is scaled about its middle and then moved by `shift` along z."""
    middle = outline.mean(0)
    return (outline - middle) * share + middle + [0.0, shift]


def inscribed(outline: np.ndarray, width: float, depth: float, inner_x: float, inner_z: float) -> np.ndarray:
    """Return an oval of `inner_x` by `inner_z`, with one point for each point of an outline of `width` by `depth`."""
    angles = np.arctan2(outline[:, 1] / depth, outline[:, 0] / width)
    return np.c_[np.cos(angles) * inner_x / 2, np.sin(angles) * inner_z / 2]


def outward(part: Mesh, is_outside: bool) -> Mesh:
    """Return a band around the z axis with faces that point away from the axis if `is_outside`, else towards it."""
    middle = part.vertices.mean(0)
    away = np.einsum("ij,ij->", (part.vertices - middle)[:, :2], part.normals[:, :2])
    flat = float(np.abs(part.normals[:, 2]).mean()) > 0.7
    if flat:
        wrong = (part.vertices[:, 2].mean() > 0) != (part.normals[:, 2].mean() > 0)
    else:
        wrong = (away < 0) == is_outside
    if not wrong:
        return part
    return Mesh(part.vertices, part.faces[:, ::-1], -part.normals, part.uvs)
