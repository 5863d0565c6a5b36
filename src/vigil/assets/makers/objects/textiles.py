"""Soft things: pillows, cloths, rugs, curtains, the teddy bear."""

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
    """Return a pillow, plump in the middle with pinched corners, lying flat (or standing in an upright box)."""
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
    """Return a cushion about the origin, thinnest along y, its seam pulled in between the corners."""
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
    """Return a cleaning cloth that lies crumpled."""
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


def rug(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a rug: bordered, striped or round, often fringed."""
    builder = Builder("Rug", size)
    width, height, depth = size
    name, tint = colour(rng, "red", "blue", "grey", "beige", "teal", "green", "navy", "cream")
    _, other = colour(rng, "cream", "beige", "navy", "orange", "white", "brown")
    kind = one_of(rng, ("bordered", "striped", "round" if 0.7 < width / depth < 1.4 else "bordered", "plain"))
    if kind == "round":
        for k, (share, tone) in enumerate(((1.0, tint), (0.8, other), (0.68, tint), (0.3, other))):
            part = shapes.cylinder(0.5, height * (0.7 + 0.1 * k), segments=32)
            part = shapes.scale(part, (share * width, 1, share * depth))
            builder.add(f"carpet/{tone}", shapes.translate(part, (0, height * (0.35 + 0.05 * k), 0)))
        return builder.build([kind], takes_room=False)
    fringe = 0.03 * width if kind != "plain" else 0.0
    body = width - 2 * fringe
    builder.add(f"carpet/{tint}", shapes.box((body, 0.9 * height, depth), (0, 0.45 * height, 0)))
    if kind == "bordered":
        for share, tone in ((0.12, other), (0.16, tint), (0.3, other), (0.33, tint)):
            inset = share * depth
            level = height * (0.9 + 0.1 * share / 0.33)
            piece = shapes.panel(body - 2 * inset, depth - 2 * inset, (0, level, 0), "+y", fit=False)
            builder.add(f"carpet/{tone}", piece)
    elif kind == "striped":
        for k in range(-3, 4):
            wide = (0.05 if k % 2 else 0.08) * body
            piece = shapes.panel(wide, depth, (k * 0.135 * body, height, 0), "+y", fit=False)
            builder.add(f"carpet/{other}", piece)
    if fringe:
        for side in (-1, 1):
            for k in range(24):
                spot = (side * (width / 2 - fringe / 2), 0.2 * height, (k - 11.5) * depth / 24)
                builder.add("fabric/#e8e0cc", shapes.panel(1.1 * fringe, 0.5 * depth / 24, spot, "+y", fit=False))
    return builder.build([kind] if kind == "striped" else [name, kind], takes_room=False)


def curtains(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a pair of drawn curtains on a rod; they open to both sides, three panels each."""
    builder = Builder("Curtains", size)
    name, tint = colour(rng, "cream", "grey", "blue", "red", "teal", "beige", "green", "navy", "white")
    weave = one_of(rng, ("fabric", "fabric", "stripes", "dots", "velvet"))
    metal = one_of(rng, ("metal/black", "metal/brass", "wood/walnut", "metal/brushed"))
    top = _rod(builder, metal)
    _panels(builder, f"{weave}/{tint}", top, left=3, right=3)
    return builder.build([name], takes_room=False)


def shower_curtain(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a drawn shower curtain on a rod; its panels open to one side."""
    builder = Builder("ShowerCurtain", size)
    name, tint = colour(rng, "white", "light blue", "teal", "pink", "yellow", "light green")
    weave = one_of(rng, ("dots", "stripes", "fabric", "plaid"))
    top = _rod(builder, "chrome")
    _panels(builder, f"{weave}/{tint}", top, left=4, right=0)
    return builder.build([name], takes_room=False)


def _rod(builder: Builder, metal: str) -> float:
    """Add the rod at the top and return the height at which the cloth ends."""
    width, height, depth = builder.width, builder.height, builder.depth
    thick = min(0.22 * depth, 0.016)
    y = height - 1.6 * thick
    builder.add(metal, shapes.tube([(-0.49 * width, y, 0), (0.49 * width, y, 0)], thick, 8))
    for side in (-1, 1):
        knob = shapes.ellipsoid((3.2 * thick,) * 3, (side * (0.5 * width - 1.6 * thick), y, 0), 8, 6)
        builder.add(metal, knob)
    return y - 0.5 * thick


def _panels(builder: Builder, cloth_look: str, top: float, *, left: int, right: int) -> None:
    """Add panels across the width; each slides outward onto the outermost one of its side."""
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
            builder.add(PartStyle(cloth_look, joint=joint, bears_open=True), shapes.translate(sheet, (middle, 0, z)))
            low, high = (middle - across / 2, 0, z - deep / 2), (middle + across / 2, top, z + deep / 2)
            builder.solid(low, high, joint)


def teddy_bear(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a sitting teddy bear that looks along +z."""
    builder = Builder("TeddyBear", size)
    name, tint = one_of(
        rng,
        (
            ("brown", "#8a5a34"),
            ("light brown", "#c2935a"),
            ("cream", "#dcc7a0"),
            ("grey", "#8f8f92"),
            ("dark brown", "#5a3a25"),
        ),
    )
    fur, pale = f"knit/{tint}", "knit/#e6d6b8" if name != "cream" else "knit/#f4ecd8"

    def ball(look: str, at: tuple[float, float, float], extent: tuple[float, float, float], fine: int = 7) -> None:
        builder.add(look, shapes.ellipsoid(extent, at, fine, 5 if fine > 6 else 4))

    ball(fur, (0, 0.3, 0), (0.56, 0.6, 0.5), 10)
    ball(pale, (0, 0.3, 0.06), (0.4, 0.46, 0.42), 7)
    ball(fur, (0, 0.72, 0.02), (0.52, 0.46, 0.48), 10)
    ball(pale, (0, 0.66, 0.2), (0.24, 0.18, 0.2), 6)
    ball("plastic/#241c18", (0, 0.7, 0.3), (0.09, 0.06, 0.06), 6)
    for side in (-1, 1):
        ball(fur, (0.21 * side, 0.92, 0), (0.19, 0.19, 0.1), 6)
        ball(pale, (0.21 * side, 0.92, 0.03), (0.12, 0.12, 0.08), 5)
        ball("plastic/#241c18", (0.1 * side, 0.77, 0.225), (0.06, 0.07, 0.05), 5)
        arm = shapes.ellipsoid((0.2, 0.42, 0.2), segments=7, rings=5)
        builder.add(fur, shapes.translate(shapes.rotate(arm, "z", 32 * side), (0.33 * side, 0.38, 0.08)))
        ball(fur, (0.22 * side, 0.1, 0.28), (0.22, 0.2, 0.46))
        ball(pale, (0.22 * side, 0.1, 0.46), (0.15, 0.15, 0.12), 5)
    if rng.random() < 0.6:
        _, bow = colour(rng, "red", "blue", "green", "pink")
        for side in (-1, 1):
            wing = shapes.ellipsoid((0.16, 0.1, 0.05), segments=4, rings=3)
            builder.add(
                f"velvet/{bow}", shapes.translate(shapes.rotate(wing, "z", 20 * side), (0.09 * side, 0.5, 0.26))
            )
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "Cloth": cloth,
    "Curtains": curtains,
    "Pillow": pillow,
    "Rug": rug,
    "ShowerCurtain": shower_curtain,
    "TeddyBear": teddy_bear,
}
