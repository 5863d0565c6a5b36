"""Soft things: pillows and cloths."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.meshes import cross
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

WEAVES = ("fabric", "fabric", "stripes", "plaid", "dots", "knit", "velvet")


def pillow(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a pillow, thick in the middle, with pinched corners. It lies flat or, in an upright box, stands."""
    builder = Builder("Pillow", size)
    name, tint = colour(
        rng, "white", "red", "blue", "teal", "yellow", "grey", "green", "pink", "navy", "cream", "orange"
    )
    weave = one_of(rng, WEAVES)
    thin = int(np.argmin(size))
    order = {0: [1, 0, 2], 1: [0, 1, 2], 2: [0, 2, 1]}[thin]
    part = _plump(np.array(size)[order])
    if thin != 1:
        part = shapes.rotate(part, "z" if thin == 0 else "x", 90)
    builder.add(f"{weave}/{tint}", shapes.translate(part, (0, size.y / 2, 0)))
    return builder.build([name] if weave in ("fabric", "velvet") else [name, weave])


def _plump(size: np.ndarray) -> shapes.Mesh:
    """Return a cushion around the origin, thinnest along y. Its seam is pulled in between the corners."""
    width, height, depth = size
    steps = 8
    ticks = np.linspace(-1, 1, steps + 1)
    u, v = (grid.ravel() for grid in np.meshgrid(ticks, ticks, indexing="ij"))
    pinch_u, pinch_v = 1 - 0.07 * (1 - v**2), 1 - 0.07 * (1 - u**2)
    thick = np.clip((1 - u**2) * (1 - v**2), 0, 1) ** 0.45
    x, z = u * pinch_v * width / 2, v * pinch_u * depth / 2
    faces = []
    for i in range(steps):
        for j in range(steps):
            a, b = i * (steps + 1) + j, (i + 1) * (steps + 1) + j
            faces += [(a, a + 1, b + 1), (a, b + 1, b)]
    top_faces = np.array(faces)
    top = np.c_[x, thick * height / 2, z]
    bulge = thick.reshape(steps + 1, -1)
    slope_u, slope_v = (np.asarray(np.gradient(bulge, axis=axis)).ravel() * steps / 2 for axis in (0, 1))
    normals = np.c_[-slope_u * height / width, np.ones(len(u)) + 0.05, -slope_v * height / depth]
    first, second, third = top[top_faces[0]]
    if cross(second - first, third - first)[1] < 0:
        top_faces = top_faces[:, ::-1]
    upper = shapes.mesh(top, top_faces, normals, np.c_[x, z])
    return shapes.merge([upper, shapes.scale(upper, (1, -1, 1))])


def cleaning_cloth(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a crumpled cleaning cloth."""
    builder = Builder("Cloth", size)
    width, height, depth = size
    name, tint = colour(rng, "blue", "yellow", "green", "pink", "white", "orange", "red")
    weave = one_of(rng, ("fabric", "dots", "stripes", "plaid", "knit"))
    steps = 9
    ticks = np.linspace(-1, 1, steps)
    u, v = np.meshgrid(ticks, ticks, indexing="ij")
    phase = rng.uniform(0, 6, 6)
    waves = np.sin(3 * u + phase[0]) + np.sin(4 * v + phase[1]) + np.sin(3 * (u - v) + phase[2])
    edge = 1 + 0.06 * np.sin(5 * np.arctan2(v, u) + phase[3])
    lift = (waves - waves.min()) / np.ptp(waves)
    rings = []
    for row in range(steps):
        front = np.c_[u[row] * edge[row] * width / 2, lift[row] * 0.8 * height, v[row] * edge[row] * depth / 2]
        back = front[::-1] + np.array([0, 0.16 * height, 0])
        rings.append(np.concatenate([front, back, front[:1]]))
    builder.add(f"{weave}/{tint}", creased(shapes.loft(np.array(rings))))
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "Cloth": cleaning_cloth,
    "Pillow": pillow,
}
