"""Cookware and cutlery: pots, pans, and tools for cooking and eating."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, along_longest, bend, lathed_oval, lengthwise, strip
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import colour, one_of
from vigil.assets.makers.objects.crockery import hollow
from vigil.base.geometry import Vec3

STEEL = "metal/brushed"
GRIPS = ("plastic/#1f2022", "wood/walnut", "plastic/#1f2022", "plastic/#b4262b")

CUTLERY = (
    ("silver", STEEL, STEEL),
    ("silver", "chrome", "chrome"),
    ("golden", "metal/gold", "metal/gold"),
    ("dark-handled", STEEL, "plastic/#1f2022"),
    ("wooden-handled", STEEL, "wood/walnut"),
    ("red-handled", STEEL, "plastic/#b4262b"),
    ("blue-handled", STEEL, "plastic/#2f5ba0"),
)
"""Colour word, metal of the head and material of the handle of cutlery."""


def pot(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a pot: straight walls, a rolled rim, two ears or, in a long box, one long handle and an ear."""
    builder = Builder("Pot", size)
    width, height, length = size
    name, tint = colour(rng, "red", "blue", "dark grey", "green", "orange", "cream")
    metal = rng.random() < 0.5
    body = "chrome" if metal else f"ceramic/{tint}"
    inside = "metal/brushed" if metal else "ceramic/#d9d5cc"
    grip = one_of(rng, GRIPS)
    long_handle = length > 1.35 * width
    thick = 0.05 * height + 0.004
    ear = 3.0 * thick
    across = min(width, 0.66 * length if long_handle else length - 2 * ear)
    middle = -length / 2 + ear + across / 2 if long_handle else 0.0
    _vessel(builder, (body, inside), (width, across), (0.98, 0.06), middle)
    lip = lathed_oval([(0.97, 0.94 * height), (1.03, 0.95 * height), (1.03, height), (0.97, height)], width, across)
    sole = lathed_oval([(0.99, 0.0), (1.0, 0.0), (1.0, 0.1 * height), (0.97, 0.1 * height)], width, across)
    builder.add(STEEL, shapes.translate(lip, (0, 0, middle)), shapes.translate(sole, (0, 0, middle)))
    edge = middle + 0.48 * across
    for side in (-1,) if long_handle else (-1, 1):
        builder.add(grip, _ear(width, (middle + side * 0.47 * across, 0.8 * height), side * ear, thick))
    if long_handle:
        sides = [(edge - 0.01 * length, 0.08), (edge + 0.3 * (length / 2 - edge), 0.06), (length / 2, 0.1)]
        bar = strip([(z, share * width) for z, share in sides], 0.14 * height, 0.82 * height)
        hole = shapes.cylinder(
            0.035 * width, 0.15 * height, (0, 0.82 * height, length / 2 - 0.06 * length), segments=10
        )
        builder.add(grip, bar)
        builder.add(STEEL, hole)
    return builder.build(["steel" if metal else name])


def _ear(width: float, root: tuple[float, float], reach: float, thick: float) -> shapes.Mesh:
    """Return a horizontal loop that stands out by `reach` along z from `root` (z, y) on a vessel's wall."""
    z, y = root
    angles = np.linspace(-np.pi / 2, np.pi / 2, 7)
    out = reach - np.sign(reach) * thick
    loop = np.c_[0.22 * width * np.sin(angles), np.full(7, y), z + out * np.cos(angles)]
    return shapes.tube(loop, thick, 6)


def pan(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a frying pan with one long handle."""
    builder = Builder("Pan", size)
    width, height, length = size
    kind = one_of(rng, ("black", "black", "steel", "coloured"))
    _, tint = colour(rng, "red", "green", "blue", "orange")
    body = {"black": "metal/black", "steel": "chrome"}.get(kind, f"ceramic/{tint}")
    inside = "metal/brushed" if kind == "steel" else "metal/black"
    across = float(np.clip(width, 0.5 * length, 0.84 * length))
    middle = -length / 2 + across / 2
    rim = min(0.85 * height, max(0.035, 0.6 * height))
    _vessel(builder, (body, inside), (width, across), (0.8, 0.1), middle, rim)
    start, end = middle + 0.47 * across, length / 2
    sides = ((start, 0.035), (start + 0.2 * (end - start), 0.03), (end - 0.15 * (end - start), 0.05), (end, 0.035))
    grip = strip([(z, share * width) for z, share in sides], 0.16 * height, 0.8 * rim)
    rise = height - 0.08 * height - 0.8 * rim
    span = max(end - start, 1e-3)
    builder.add(one_of(rng, GRIPS), bend(grip, lambda z: rise * np.clip((z - start) / span, 0, 1)))
    return builder.build([kind])


def _vessel(
    builder: Builder,
    looks: tuple[str, str],
    plan: tuple[float, float],
    shape: tuple[float, float],
    middle: float,
    height: float | None = None,
) -> None:
    """Add a round open vessel: `looks` outside and inside, `plan` x and z, `shape` foot radius and floor as shares."""
    height = height or builder.height
    (width, across), (foot, share) = plan, shape
    floor = share * height
    outer = [(0.0, 0.0), (foot * 0.96, 0.0), (foot, 0.04 * height), (0.98, 0.95 * height), (1.0, height)]
    inner = [(1.0, height), (0.95, 0.97 * height), (foot - 0.05, floor), (0.0, floor)]
    for material, profile in zip(looks, (outer, inner), strict=True):
        builder.add(material, shapes.translate(lathed_oval(profile, width, across), (0, 0, middle)))
    builder.surface("inside", (0, floor, middle), (0.66 * foot * width, 0.66 * foot * across), is_inside=True)
    hollow(builder, width, across, floor, z=middle)


def fork(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a fork whose tines are slimmer than the gaps between them, so that the gaps show from afar."""
    builder = Builder("Fork", size)
    half, height, length = size.x / 2, size.y, size.z
    name, metal, grip = one_of(rng, CUTLERY)
    thick = 0.18 * height
    start = 0.16 * length
    neck = [(-0.12 * length, 0.22), (0.02 * length, 0.22), (0.08 * length, 0.6), (0.12 * length, 0.94), (start, 1.0)]
    pieces = [strip([(z, share * half) for z, share in neck], thick)]
    for x in (-0.87, -0.29, 0.29, 0.87):
        sides = [(start - 0.004, 0.13 * half), (0.42 * length, 0.11 * half), (length / 2, 0.04 * half)]
        pieces.append(shapes.translate(strip(sides, thick), (x * half, 0, 0)))
    curve = _curve(length, height)
    builder.add(metal, *(bend(piece, curve) for piece in pieces))
    builder.add(grip, bend(_handle(half, length, thick, is_bare=grip == metal), curve))
    return builder.build([name])


def spoon(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a spoon."""
    builder = Builder("Spoon", size)
    half, height, length = size.x / 2, size.y, size.z
    name, metal, grip = one_of(rng, CUTLERY)
    thick = 0.14 * height
    neck = [(-0.12 * length, 0.2 * half), (0.1 * length, 0.16 * half), (0.175 * length, 0.26 * half)]
    dish = _dish((0.33 * length, 0.17 * length), half, 0.35 * height)
    curve = _curve(length, height)
    builder.add(metal, bend(strip(neck, thick), curve), shapes.translate(dish, (0, 0.3 * height, 0)))
    builder.add(grip, bend(_handle(0.75 * half, length, thick, is_bare=grip == metal), curve))
    return builder.build([name])


def _handle(half: float, length: float, thick: float, *, is_bare: bool) -> shapes.Mesh:
    """Return the rear part of cutlery's handle; materials other than bare metal make it thicker."""
    outline = [(-length / 2, 0.35), (-0.47 * length, 0.55), (-0.3 * length, 0.42), (-0.115 * length, 0.28)]
    return strip([(z, share * half) for z, share in outline], thick if is_bare else 2.2 * thick)


def knife(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a kitchen knife with its blade to the front, in the plane in which the box is broader."""
    builder = Builder("Knife", size)
    broad, slim, length = max(size.x, size.y), min(size.x, size.y), size.z
    half = broad / 2
    split = float(rng.choice([-0.12, -0.06])) * length
    if rng.random() < 0.3:
        edge = [
            (split, 0.45 * half),
            (0.44 * length, 0.45 * half),
            (length / 2, -0.4 * half),
            (0.4 * length, -half),
            (split, -half),
        ]
    else:
        edge = [
            (split, 0.6 * half),
            (0.2 * length, 0.55 * half),
            (0.4 * length, 0.1 * half),
            (length / 2, -0.9 * half),
            (split, -half),
        ]
    blade = shapes.extrude([(x, z) for z, x in edge], -0.12 * slim, 0.12 * slim)
    grip = [
        (-length / 2, -0.5),
        (-length / 2, 0.7),
        (-0.4 * length, 1.0),
        (split, 0.7),
        (split, -0.3),
        (-0.3 * length, -0.2),
    ]
    handle = shapes.extrude([(x * half, z) for z, x in grip], -slim / 2, slim / 2)
    bolster = shapes.box((1.3 * half, 0.8 * slim, 0.02 * length), (-0.1 * half, 0, split))
    upright = size.y > size.x
    pieces = [shapes.rotate(piece, "z", -90) if upright else piece for piece in (blade, handle, bolster)]
    builder.add(STEEL, pieces[0], pieces[2])
    builder.add(one_of(rng, GRIPS), pieces[1])
    return builder.build(["kitchen"])


def butter_knife(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a table knife with a round tip."""
    builder = Builder("ButterKnife", size)
    broad, slim, length = max(size.x, size.y), min(size.x, size.y), size.z
    half = broad / 2
    blade = [(0.0, 0.55), (0.08 * length, 0.9), (0.36 * length, 1.0), (0.46 * length, 0.75), (length / 2, 0.2)]
    grip = [(-length / 2, 0.5), (-0.42 * length, 0.85), (-0.2 * length, 0.7), (0.0, 0.5)]
    pieces = [strip([(z, s * half) for z, s in blade], 0.25 * slim), strip([(z, s * half) for z, s in grip], slim)]
    if size.y > size.x:
        pieces = [shapes.rotate(piece, "z", -90) for piece in pieces]
    name, metal, grip = one_of(rng, CUTLERY)
    builder.add(metal, pieces[0])
    builder.add(grip, pieces[1])
    return builder.build([name])


_LADLES = (
    ("steel", STEEL, "plastic/#1f2022"),
    ("steel", STEEL, "plastic/#b4262b"),
    ("black", "plastic/#1f2022", "plastic/#d9722a"),
    ("wooden", "wood/walnut", "wood/walnut"),
    ("teal", "plastic/#2f8386", "wood/walnut"),
)
"""Colour word, and materials of the dish and the grip; grey or dark never appears alone against a grey counter."""


def ladle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a soup ladle: a deep round dish on a long neck, and a grip with a hooked end."""
    builder = Builder("Ladle", size)
    width, height, length = size
    across = min(width, 0.4 * length)
    middle = length / 2 - across / 2
    dish = shapes.lathe(
        [(0.0, 0.0), (0.6, 0.1), (0.92, 0.45), (1.0, 0.8), (0.93, 0.8), (0.84, 0.45), (0.5, 0.16), (0.0, 0.08)],
        segments=16,
    )
    dish = shapes.scale(dish, (width / 2, 0.8 * height, across / 2))
    name, look, grip = one_of(rng, _LADLES)
    builder.add(look, shapes.translate(dish, (0, 0, middle)))
    thick = 0.07 * width
    start = middle - 0.47 * across
    rise, end = start - 0.18 * length, -0.5 * length
    neck = [(0, 0.6 * height, start), (0, height - thick, rise), (0, height - thick, -0.12 * length)]
    hook = [neck[-1], (0, height - thick, end + 0.05 * length), (0, height - 2 * thick, end), (0, 0.45 * height, end)]
    builder.add(look, shapes.scale(shapes.tube(neck, thick, 6), (1.6, 1.0, 1.0)))
    builder.add(grip, shapes.scale(shapes.tube(hook, 1.15 * thick, 6), (1.6, 1.0, 1.0)))
    return builder.build([name])


def spatula(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a slotted turner or a flat spatula."""
    builder = Builder("Spatula", size)
    width, height, length = size
    half = width / 2
    name, tint = colour(rng, "black", "red", "teal", "orange")
    material = one_of(rng, (STEEL, f"plastic/{tint}"))
    start = 0.2 * length
    thick = 0.1 * height
    blade = [
        strip([(start, 0.5 * half), (start + 0.05 * length, 0.96 * half), (start + 0.09 * length, half)], thick),
        strip([(0.47 * length, half), (length / 2, half)], thick),
    ]
    for x in (-0.86, -0.29, 0.29, 0.86):
        bar = strip([(start + 0.085 * length, 0.16 * half), (0.475 * length, 0.16 * half)], thick)
        blade.append(shapes.translate(bar, (min(max(x, -0.84), 0.84) * half, 0, 0)))
    builder.add(material, *blade)
    rise = height - thick
    path = [(0, 0, start + 0.01 * length), (0, 0.8 * rise, 0.1 * length), (0, rise, 0.0)]
    builder.add(STEEL, shapes.tube(path, 0.08 * half, 6))
    grip = shapes.rounded_box(
        (0.36 * width, 0.5 * height, 0.46 * length), (0, 0.75 * height, -0.27 * length), 0.1 * height
    )
    builder.add(f"plastic/{tint}", grip)
    return builder.build([name if material.startswith("plastic") else "steel"])


def _dish(along: tuple[float, float], half: float, sink: float) -> shapes.Mesh:
    """Return a shallow oval dish: `along` is its middle and half length on z."""
    middle, reach = along
    dish = shapes.lathe([(0.0, -1.0), (0.6, -0.72), (1.0, 0.0), (0.94, 0.04), (0.55, -0.6), (0.0, -0.85)], segments=14)
    return shapes.translate(shapes.scale(dish, (half, sink, reach)), (0, 0, middle))


def _curve(length: float, height: float):
    """Return the height offset of cutlery along z: low in the neck, rising to both ends."""
    return lambda z: 0.75 * height * (1 - np.cos(2.4 * (z / length + 0.1))) / (1 - np.cos(2.4 * 0.6))


MAKERS: dict[str, Maker] = {
    "ButterKnife": along_longest(butter_knife),
    "Fork": along_longest(fork),
    "Knife": along_longest(knife),
    "Ladle": along_longest(ladle),
    "Pan": lengthwise(pan),
    "Pot": lengthwise(pot),
    "Spatula": along_longest(spatula),
    "Spoon": along_longest(spoon),
}
