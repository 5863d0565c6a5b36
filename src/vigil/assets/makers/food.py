"""Food: tomatoes, potatoes, bread and lettuce."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3


def tomato(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a tomato: ribbed, with a green star of sepals."""
    builder = Builder("Tomato", size)
    width, height, depth = size
    tint = one_of(rng, ("#cf2b1f", "#d9441f", "#b9201c"))
    ball = shapes.ellipsoid((width, 0.93 * height, depth), (0, 0.465 * height, 0), segments=20, rings=8)
    vertices = ball.vertices.astype(np.float64)
    ribs = 1 - 0.035 * (1 + np.cos(5 * np.arctan2(vertices[:, 0], vertices[:, 2])))
    vertices[:, [0, 2]] *= ribs[:, None]
    builder.add(f"plastic/{tint}", shapes.mesh(vertices, ball.faces, ball.normals, ball.uvs))
    green = "plastic/#4f8a35"
    for k in range(5):
        leaf = shapes.extrude([(0.0, -0.05), (0.2, -0.06), (0.34, 0.0), (0.2, 0.06), (0.0, 0.05)], 0.0, 0.012)
        leaf = shapes.rotate(shapes.scale(leaf, (width, width, width)), "z", -14)
        builder.add(green, shapes.translate(shapes.rotate(leaf, "y", 72 * k + 10), (0, 0.925 * height, 0)))
    builder.add(green, shapes.cylinder(0.03 * width, 0.08 * height, (0, 0.96 * height, 0), segments=6))
    return builder.build(["red"])


def potato(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a potato: a lumpy ellipsoid with dark eyes."""
    builder = Builder("Potato", size)
    tint = one_of(rng, ("#b08a52", "#9c7443", "#c2a066", "#8f4f43"))
    lump = shapes.ellipsoid(size, (0, size.y / 2, 0), segments=16, rings=9)
    phase = rng.uniform(0, 6, 3)
    low, high = shapes.bounds([lump])
    unit = (lump.vertices - (low + high) / 2) / (high - low)
    waves = np.sin(7 * unit[:, 0] + phase[0]) + np.sin(8 * unit[:, 1] + phase[1]) + np.sin(9 * unit[:, 2] + phase[2])
    vertices = (low + high) / 2 + unit * (high - low) * (1 + 0.09 * waves / 3)[:, None]
    builder.add(f"skin/{tint}", shapes.mesh(vertices, lump.faces, lump.normals, lump.uvs))
    for _ in range(5):
        angle, along = rng.uniform(0.3, 2.8), rng.uniform(-0.3, 0.3)
        radius = np.sqrt(1 - (2 * along) ** 2) / 2
        spot = (
            radius * np.cos(angle) * size.x * 0.93,
            size.y / 2 + radius * np.sin(angle) * size.y * 0.93,
            along * size.z,
        )
        builder.add("plastic/#5f452b", shapes.ellipsoid(np.array(size) * 0.09, spot, segments=6, rings=4))
    return builder.build()


def bread(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a loaf of bread along z: a tin loaf, a round-topped loaf with cuts, or a long loaf like a baguette."""
    builder = Builder("Bread", size)
    width, height, length = size
    kind = one_of(rng, ("tin", "oval", "tin"))
    crust = f"skin/{one_of(rng, ('#b9783a', '#a5652c', '#c68a4a'))}"
    crumb = "plastic/#e8cf9f"
    if kind == "tin":
        wall = [(-0.44, 0.0), (-0.46, 0.5), (-0.5, 0.62), (-0.46, 0.82), (-0.3, 0.96), (0.0, 1.0)]
        outline = [(x * width, y * height) for x, y in wall + [(-x, y) for x, y in reversed(wall[:-1])]]
        builder.add(crust, shapes.extrude(outline, -0.49 * length, 0.47 * length, "z"))
        face = [(0.88 * x, 0.02 * height + 0.93 * y) for x, y in outline]
        builder.add(crumb, shapes.extrude(face, 0.46 * length, 0.49 * length, "z"))
        builder.add(crust, shapes.extrude(outline, 0.482 * length, 0.4821 * length + 0.018 * length, "z"))
        builder.add(crumb, shapes.extrude(face, 0.499 * length, 0.502 * length, "z"))
    else:
        loaf = shapes.ellipsoid((width, 1.5 * height, length), (0, 0.25 * height, 0), segments=18, rings=10)
        vertices = loaf.vertices.astype(np.float64)
        vertices[:, 1] = np.maximum(vertices[:, 1], 0.0)  # it lies flat
        builder.add(crust, shapes.mesh(vertices, loaf.faces, loaf.normals, loaf.uvs))
    for z in (-0.3, -0.1, 0.1, 0.3):
        if kind == "oval":
            cut = shapes.ellipsoid((0.5 * width, 0.05 * height, 0.05 * length), segments=8, rings=4)
            top = 0.25 + 0.75 * np.sqrt(1 - (2 * z) ** 2)
            cut = shapes.rotate(cut, "y", 25)
            builder.add(crumb, shapes.translate(cut, (0, top * height * 0.985, z * length)))
    return builder.build([kind, "brown"])


def lettuce(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a head of lettuce: layers of frilled leaves around a pale heart."""
    builder = Builder("Lettuce", size)
    tints = one_of(
        rng, (("#5c9a3c", "#86bd55", "#b9d98a"), ("#4a8a3a", "#74ad4c", "#a8cf7a"), ("#6a8f45", "#94b862", "#c6dc9a"))
    )
    heart = shapes.ellipsoid((0.6, 0.78, 0.6), (0, 0.52, 0), segments=9, rings=5)
    pieces = [(tints[2], heart)]
    for layer, (count, lean, reach) in enumerate(((5, 22, 0.95), (4, 8, 0.98))):
        for k in range(count):
            leaf = _leaf_bowl(rng)
            leaf = shapes.rotate(shapes.scale(leaf, (0.62, reach, 0.3)), "x", lean)
            leaf = shapes.translate(leaf, (0, 0.02, 0.16 - 0.06 * layer))
            pieces.append((tints[min(layer, 1)], shapes.rotate(leaf, "y", 360 * (k + 0.5 * layer) / count)))
    for tint, piece in pieces:
        builder.add(f"leaf/{tint}", shapes.scale(piece, size))
    return builder.build(["green"])


def _leaf_bowl(rng: np.random.Generator) -> shapes.Mesh:
    """Return a leaf that stands on its stem, 1 high and about 1 wide; its hollow side faces inward (-z)."""
    wide = np.array([0.12, 0.62, 1.0, 0.95, 0.55])
    rings = []
    for level, half in enumerate(wide / 2):
        across = np.linspace(-1, 1, 4)
        ruffle = 0.12 * level / 4 * np.sin(5 * across + rng.uniform(0, 6))
        y = 0.25 * level - 0.06 * across**2 * (level == 4)
        out = 0.7 * np.sin(0.75 * np.pi * level / 4) - 0.5 * across**2 + ruffle
        front = np.c_[half * across, np.full(4, y), out]
        back = front[::-1] - [0, 0, 0.06]
        rings.append(np.concatenate([front, back, front[:1]]))
    return creased(shapes.loft(np.array(rings)))


MAKERS: dict[str, Maker] = {
    "Bread": lengthwise(bread),
    "Lettuce": lettuce,
    "Potato": potato,
    "Tomato": tomato,
}
