"""Statues and table ornaments."""

from collections.abc import Callable, Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import COLOURS, colour, one_of
from vigil.base.geometry import Vec3

STONES = (
    ("white", "ceramic/#eceae4"),
    ("grey", "stone/#8f8d88"),
    ("bronze", "metal/#8c6a3f"),
    ("black", "ceramic/#2a2a2c"),
    ("gold", "metal/gold"),
    ("terracotta", "stone/#b8674a"),
    ("blue", "ceramic/#2f5ba0"),
)

Triple = tuple[float, float, float]
"""A position or lengths: x, y, z."""


def statue(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a statue: in a low box a dog or a reclining curve, in a high one a bust, a figure, a cat or a bird."""
    builder = Builder("Statue", size)
    name, stone = one_of(rng, STONES)
    form = one_of(rng, _forms(size.y / max(size.x, size.z)))
    form(builder, stone)
    return builder.build([name, form.__name__.strip("_")])


def _forms(slimness: float) -> tuple[Callable[[Builder, str], None], ...]:
    """Return the kinds of statue that look right in a box of a given ratio of height to width."""
    if slimness < 0.9:
        return _dog, _horse, _knot
    if slimness < 1.5:
        return _bust, _cat, _hand
    return (_figure, _cat, _hand) if slimness < 2.0 else (_figure,)


def _ball(builder: Builder, look: str, at: Triple, extent: Triple, fine: int = 10) -> None:
    builder.add(look, shapes.ellipsoid(extent, at, fine, max(5, fine // 2)))


def _limb(builder: Builder, look: str, path: Sequence[Triple], radii: Sequence[float]) -> None:
    builder.add(look, shapes.tube(path, radii, 7))


def _plinth(builder: Builder, look: str, width: float = 0.8, depth: float = 0.8) -> None:
    builder.add(look, shapes.box((width, 0.08, depth), (0, 0.04, 0), 0.015))


def _dog(builder: Builder, stone: str) -> None:
    """Add a standing dog that looks along +x."""
    _ball(builder, stone, (-0.05, 0.5, 0), (0.72, 0.3, 0.3), 12)
    _ball(builder, stone, (0.22, 0.55, 0), (0.34, 0.36, 0.32))
    _limb(builder, stone, [(0.28, 0.6, 0), (0.4, 0.82, 0)], [0.13, 0.1])
    _ball(builder, stone, (0.42, 0.86, 0), (0.28, 0.24, 0.24))
    _limb(builder, stone, [(0.48, 0.84, 0), (0.64, 0.8, 0)], [0.08, 0.055])
    for side in (-1, 1):
        ear = shapes.ellipsoid((0.1, 0.2, 0.05), segments=6, rings=5)
        builder.add(stone, shapes.translate(shapes.rotate(ear, "z", -20), (0.34, 0.9, 0.11 * side)))
        for x in (-0.32, 0.26):
            _limb(
                builder,
                stone,
                [(x, 0.45, 0.09 * side), (x, 0.2, 0.1 * side), (x + 0.02, 0.0, 0.1 * side)],
                [0.09, 0.055, 0.05],
            )
    _limb(builder, stone, [(-0.38, 0.55, 0), (-0.52, 0.7, 0), (-0.54, 0.86, 0)], [0.05, 0.04, 0.02])


def _horse(builder: Builder, stone: str) -> None:
    """Add a horse that looks along +x, on a plinth."""
    _plinth(builder, "wood/walnut", 1.2, 0.4)
    _ball(builder, stone, (-0.05, 0.62, 0), (0.78, 0.32, 0.3), 12)
    _limb(builder, stone, [(0.26, 0.68, 0), (0.42, 0.98, 0)], [0.15, 0.09])
    _limb(builder, stone, [(0.38, 1.0, 0), (0.6, 0.86, 0)], [0.1, 0.06])
    _limb(builder, stone, [(0.34, 1.08, 0), (0.22, 0.92, 0), (0.14, 0.78, 0)], [0.03, 0.06, 0.03])
    for side in (-1, 1):
        _limb(builder, stone, [(0.38, 1.02, 0.05 * side), (0.37, 1.13, 0.06 * side)], [0.035, 0.01])
        for x in (-0.34, 0.24):
            _limb(
                builder,
                stone,
                [(x, 0.55, 0.09 * side), (x + 0.03, 0.3, 0.1 * side), (x, 0.06, 0.1 * side)],
                [0.1, 0.045, 0.045],
            )
    _limb(builder, stone, [(-0.42, 0.7, 0), (-0.55, 0.6, 0), (-0.58, 0.35, 0)], [0.04, 0.06, 0.02])


def _knot(builder: Builder, stone: str) -> None:
    """Add a horizontal figure of eight: an abstract piece."""
    angles = np.linspace(0, 2 * np.pi, 33)
    path = np.c_[np.sin(angles), 0.4 + 0.25 * np.cos(2 * angles) * np.sign(1), 0.45 * np.sin(2 * angles)]
    builder.add(stone, shapes.tube(path, 0.15, 8))
    _plinth(builder, "wood/black", 1.0, 0.7)


def _bust(builder: Builder, stone: str) -> None:
    """Add a head with shoulders on a foot, looking along +z."""
    foot = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.05), (0.16, 0.1), (0.14, 0.2), (0.0, 0.2)]
    builder.add(stone, shapes.lathe(foot, segments=14))
    rings = [
        _oval((0.0, 0.18, 0.0), 0.14, 0.12),
        _oval((0.0, 0.3, 0.0), 0.36, 0.18),
        _oval((0.0, 0.42, 0.0), 0.42, 0.2),
        _oval((0.0, 0.52, -0.01), 0.24, 0.16),
        _oval((0.0, 0.58, 0.0), 0.11, 0.11),
    ]
    builder.add(stone, shapes.loft(np.array(rings)))
    _limb(builder, stone, [(0, 0.55, 0), (0, 0.7, 0.02)], [0.1, 0.09])
    _ball(builder, stone, (0, 0.82, 0.03), (0.28, 0.36, 0.32), 12)
    _ball(builder, stone, (0, 0.88, -0.02), (0.33, 0.28, 0.34), 10)
    _limb(builder, stone, [(0, 0.86, 0.19), (0, 0.79, 0.225), (0, 0.77, 0.19)], [0.02, 0.035, 0.02])
    for side in (-1, 1):
        _ball(builder, stone, (0.075 * side, 0.855, 0.165), (0.08, 0.03, 0.05), 6)
        _ball(builder, stone, (0.15 * side, 0.82, 0.02), (0.05, 0.11, 0.08), 6)
    _ball(builder, stone, (0, 0.72, 0.17), (0.1, 0.035, 0.05), 6)


def _oval(at: Triple, half_x: float, half_z: float) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, 15)
    return np.c_[at[0] + half_x * np.sin(angles), np.full(15, at[1]), at[2] + half_z * np.cos(angles)]


def _figure(builder: Builder, stone: str) -> None:
    """Add a standing figure that waves."""
    _plinth(builder, stone, 0.5, 0.4)
    for side in (-1, 1):
        _limb(
            builder,
            stone,
            [(0.08 * side, 0.06, 0), (0.085 * side, 0.28, 0.01), (0.07 * side, 0.5, 0)],
            [0.05, 0.06, 0.085],
        )
        _ball(builder, stone, (0.085 * side, 0.1, 0.05), (0.09, 0.06, 0.18), 6)
    _limb(builder, stone, [(0, 0.46, 0), (0, 0.56, 0), (0, 0.74, 0), (0, 0.8, 0)], [0.13, 0.11, 0.155, 0.1])
    _limb(builder, stone, [(-0.15, 0.75, 0), (-0.22, 0.6, 0.02), (-0.18, 0.46, 0.05)], [0.05, 0.045, 0.035])
    _limb(builder, stone, [(0.14, 0.75, 0), (0.27, 0.84, 0.02), (0.24, 1.02, 0.03)], [0.05, 0.045, 0.04])
    _limb(builder, stone, [(0, 0.78, 0), (0, 0.86, 0)], [0.05, 0.05])
    _ball(builder, stone, (0, 0.93, 0.01), (0.17, 0.2, 0.18), 10)


def _cat(builder: Builder, stone: str) -> None:
    """Add a sitting cat that looks along +z."""
    _limb(
        builder, stone, [(0, 0.02, -0.04), (0, 0.22, -0.06), (0, 0.5, 0.02), (0, 0.66, 0.06)], [0.25, 0.26, 0.17, 0.11]
    )
    _ball(builder, stone, (0, 0.76, 0.1), (0.3, 0.26, 0.27), 12)
    _ball(builder, stone, (0, 0.72, 0.22), (0.12, 0.08, 0.08), 6)
    for side in (-1, 1):
        _limb(builder, stone, [(0.09 * side, 0.84, 0.08), (0.115 * side, 1.0, 0.07)], [0.07, 0.008])
        _limb(builder, stone, [(0.09 * side, 0.45, 0.12), (0.09 * side, 0.05, 0.19)], [0.07, 0.05])
        _ball(builder, stone, (0.09 * side, 0.04, 0.23), (0.11, 0.08, 0.15), 7)
        _ball(builder, stone, (0.2 * side, 0.13, 0.0), (0.18, 0.26, 0.36), 8)
        eye = COLOURS["black"] if "2a2a2c" not in stone else COLOURS["yellow"]
        _ball(builder, f"plastic/{eye}", (0.065 * side, 0.79, 0.22), (0.05, 0.05, 0.04), 6)
    tail = [(0, 0.05, -0.26), (0.2, 0.04, -0.22), (0.3, 0.05, 0.0), (0.24, 0.05, 0.16)]
    _limb(builder, stone, tail, [0.05, 0.05, 0.045, 0.03])


def _hand(builder: Builder, stone: str) -> None:
    """Add an open hand that stands on its wrist."""
    builder.add(
        stone, shapes.lathe([(0.0, 0.0), (0.24, 0.0), (0.24, 0.05), (0.15, 0.09), (0.13, 0.3), (0.0, 0.3)], segments=12)
    )
    palm = shapes.rounded_box((0.36, 0.36, 0.14), (0, 0.44, 0), 0.06)
    builder.add(stone, palm)
    for x, tall, lean in ((-0.14, 0.88, -0.07), (-0.05, 0.98, -0.02), (0.045, 1.0, 0.02), (0.14, 0.92, 0.07)):
        _limb(builder, stone, [(x, 0.56, 0), (x + lean / 2, 0.75, 0.02), (x + lean, tall, 0.05)], [0.05, 0.045, 0.03])
    _limb(builder, stone, [(0.15, 0.36, 0.02), (0.27, 0.5, 0.07), (0.3, 0.64, 0.1)], [0.06, 0.05, 0.035])


def table_top_decor(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a table ornament: a sailing boat, balls on a tray, or an open ring."""
    builder = Builder("TableTopDecor", size)
    forms = (_balls,) if size.y < 0.55 * size.x else (_boat, _ring)
    form = one_of(rng, forms)
    form(builder, rng)
    return builder.build([form.__name__.strip("_")])


def _boat(builder: Builder, rng: np.random.Generator) -> None:
    _, tint = colour(rng, "blue", "red", "green", "brown", "navy")
    rings = []
    for z, half, low in ((-0.5, 0.14, 0.05), (-0.2, 0.17, 0.0), (0.2, 0.14, 0.0), (0.5, 0.01, 0.08)):
        rings.append([(-half, 0.22, z), (-half * 0.5, low, z), (half * 0.5, low, z), (half, 0.22, z), (-half, 0.22, z)])
    along = shapes.rotate(creased(shapes.loft(np.array(rings))), "y", 90)
    builder.add(f"plastic/{tint}", along)
    builder.add("wood/oak", shapes.box((0.86, 0.02, 0.22), (-0.06, 0.215, 0)))
    builder.add("wood/walnut", shapes.cylinder(0.015, 0.8, (0.05, 0.6, 0), segments=6))
    for outline in ([(0.07, 0.28), (0.45, 0.28), (0.07, 0.92)], [(0.03, 0.28), (-0.42, 0.28), (0.03, 0.98)]):
        builder.add("fabric/#f2f1ee", shapes.extrude(outline, -0.008, 0.008, "z"))
    builder.add("wood/walnut", shapes.box((0.5, 0.03, 0.3), (0, 0.0, 0)))


def _balls(builder: Builder, rng: np.random.Generator) -> None:
    width, height, depth = builder.width, builder.height, builder.depth
    floor = 0.06 * height
    tray = shapes.lathe([(0.0, 0.0), (0.9, 0.0), (1.0, 0.3), (0.94, 0.3), (0.85, 0.06), (0.0, 0.06)], segments=20)
    tone = one_of(rng, ("wood/walnut", "metal/gold", "ceramic/#2a2a2c"))
    builder.add(tone, shapes.scale(tray, (width / 2, height, depth / 2)))
    _, tint = colour(rng, "teal", "white", "orange", "grey", "navy")
    tints = (tint, colour(rng, "cream", "yellow", "white")[1], colour(rng, "brown", "beige", "black")[1])
    weave = one_of(rng, ("ceramic", "wicker", "ceramic"))
    largest = min((height - floor) / 2, 0.21 * width, 0.36 * depth)
    for shade, x, z, share in zip(tints, (-0.24, 0.1, 0.31), (0.02, -0.04, 0.1), (0.86, 1.0, 0.6), strict=True):
        radius = share * largest
        spot = (x * width, floor + radius, z * depth)
        builder.add(f"{weave}/{shade}", shapes.ellipsoid((2 * radius,) * 3, spot, 14, 8))


def _ring(builder: Builder, rng: np.random.Generator) -> None:
    metal = one_of(rng, ("gold", "black", "copper"))
    angles = np.linspace(0, 2 * np.pi, 25)
    for radius, lift in ((0.42, 0.48), (0.26, 0.36)):
        loop = np.c_[radius * np.sin(angles), lift + radius * np.cos(angles), 0.1 * np.sin(angles)]
        builder.add(f"metal/{metal}", shapes.tube(loop, 0.045, 7))
    builder.add("stone/#d8d4ca", shapes.box((0.6, 0.09, 0.3), (0, 0.045, 0), 0.015))


MAKERS: dict[str, Maker] = {
    "Statue": statue,
    "TableTopDecor": table_top_decor,
}
