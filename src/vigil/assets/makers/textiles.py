"""Soft things: pillows, cloths, rugs, curtains and a teddy bear."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased, drape
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
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


def cloth(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
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


def curtains(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return two curtains on a rod. When closed, they cover the window; each opens to its own side in three panels."""
    builder = Builder("Curtains", size)
    name, tint = colour(rng, "cream", "grey", "blue", "red", "teal", "beige", "green", "navy", "white")
    weave = one_of(rng, ("fabric", "fabric", "stripes", "dots", "velvet"))
    metal = one_of(rng, ("metal/black", "metal/brass", "wood/walnut", "metal/brushed"))
    top = _rod(builder, metal)
    _panels(builder, f"{weave}/{tint}", top, left=3, right=3)
    return builder.build([name], takes_room=False)


def shower_curtain(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a shower curtain on a rod; it opens to one side."""
    builder = Builder("ShowerCurtain", size)
    name, tint = colour(rng, "white", "light blue", "teal", "pink", "yellow", "light green")
    weave = one_of(rng, ("dots", "stripes", "fabric", "plaid"))
    top = _rod(builder, "chrome")
    _panels(builder, f"{weave}/{tint}", top, left=4, right=0)
    return builder.build([name], takes_room=False)


def _rod(builder: Builder, metal: str) -> float:
    """Add the rod at the top; return the height of the cloth's upper edge."""
    width, height, depth = builder.width, builder.height, builder.depth
    thick = min(0.22 * depth, 0.016)
    y = height - 1.6 * thick
    builder.add(metal, shapes.tube([(-0.49 * width, y, 0), (0.49 * width, y, 0)], thick, 8))
    for side in (-1, 1):
        knob = shapes.ellipsoid((3.2 * thick,) * 3, (side * (0.5 * width - 1.6 * thick), y, 0), 8, 6)
        builder.add(metal, knob)
    return y - 0.5 * thick


def _panels(builder: Builder, cloth_look: str, top: float, *, left: int, right: int) -> None:
    """Add panels of cloth across the width. When open, all panels of one side lie over the outermost panel of this
    side.

    `left` and `right` are the numbers of panels that open to each side.
    """
    width, depth = builder.width, builder.depth
    across = width * 0.96 / (left + right)
    layers = max(left, right)
    deep = 0.9 * depth / layers
    for side, count in ((-1, left), (1, right)):
        start = -0.48 * width if side < 0 else 0.48 * width
        for k in range(count):
            middle = start - side * (k + 0.5) * across
            z = (k - (layers - 1) / 2) * deep
            sheet = drape(1.03 * across, top, max(2.0, across / 0.11), 0.9 * deep)
            joint = None
            if k:
                joint = builder.slide(f"panel_{'left' if side < 0 else 'right'}_{k}", (side, 0, 0), 0.97 * k * across)
            builder.add(PartStyle(cloth_look, joint, opens=True), shapes.translate(sheet, (middle, 0, z)))
            low, high = (middle - across / 2, 0, z - deep / 2), (middle + across / 2, top, z + deep / 2)
            builder.solid(low, high, joint)


MAKERS: dict[str, Maker] = {
    "Cloth": cloth,
    "Curtains": curtains,
    "Pillow": pillow,
    "ShowerCurtain": shower_curtain,
}
