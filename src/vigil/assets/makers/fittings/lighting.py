"""Lamps and candles: their bright parts glow while on, and they give a light."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, lathed_oval
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

WARM = (1.0, 0.84, 0.6)
LIT = "glow/#ffc861"
_CANDLESTICK = (
    (0.0, 0.0), (1.0, 0.0), (1.0, 0.03), (0.3, 0.08), (0.16, 0.2), (0.3, 0.5), (0.16, 0.8), (0.5, 0.95), (0.5, 1.0),
    (0.0, 1.0),
)  # fmt: skip
_DISH = ((0.0, 0.0), (0.7, 0.0), (1.0, 0.07), (0.95, 0.08), (0.68, 0.03), (0.0, 0.03))
_DRIPS = ((0.4, 0.34), (1.5, 0.2), (2.5, 0.42), (3.9, 0.26), (5.2, 0.37))
"""Streaks of wax on a pillar: the angle about it, and the length as a share of the height."""
_FLAME = ((0.0, 0.0), (0.7, 0.12), (1.0, 0.3), (0.75, 0.55), (0.3, 0.85), (0.0, 1.0))
"""Profiles of radius and height, as shares of the largest."""
METALS = ("metal/brushed", "metal/black", "metal/brass", "metal/white", "chrome")


def shade(rng: np.random.Generator) -> tuple[str, PartStyle]:
    """Return the colour word and look of a lamp shade that glows while on."""
    name, tint = colour(rng, "white", "cream", "beige", "red", "teal", "grey", "yellow", "light green")
    lit = {"red": "glow/#ff8a5c", "teal": "glow/#86e6cf", "light green": "glow/#d2f08a"}.get(name, LIT)
    return name, PartStyle(f"fabric/{tint}", on=lit, bears_toggle=True)


def bulb(builder: Builder, at: shapes.Point3, radius: float, strength: float = 0.8) -> None:
    """Add a bulb that shines while on, and the light it gives."""
    look = PartStyle("ceramic/#dedacd", on="glow/#ffd88c", bears_toggle=True)
    builder.add(look, shapes.ellipsoid((2 * radius,) * 3, at, 8, 6))
    x, y, z = at
    builder.glow = Glow(Vec3(float(x), float(y), float(z)), WARM, strength)


def drum(radii: tuple[float, float], bottom: float, top: float, depth_share: float, segments: int = 20) -> shapes.Mesh:
    """Return an open lamp shade with inside and outside; `radii` are those at the bottom and the top."""
    wide, narrow = radii
    wall = 0.04 * wide
    part = shapes.lathe(
        [(wide - wall, bottom), (wide, bottom), (narrow, top), (narrow - wall, top), (wide - wall, bottom)],
        segments=segments,
    )
    return shapes.scale(part, (1.0, 1.0, depth_share))


def floor_lamp(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a floor lamp: a shade on a pole, on three legs, or an uplighter dish."""
    builder = Builder("FloorLamp", size)
    width, height, depth = size
    kind = one_of(rng, ("pole", "pole", "tripod", "dish", "arc" if width > 0.5 * height else "pole"))
    if kind == "arc":
        return _arc_lamp(builder, rng)
    ratio = depth / width
    metal = one_of(rng, METALS)
    name, cloth = shade(rng)
    tall = {"pole": 0.2, "tripod": 0.24, "dish": 0.09}[kind] * height
    low = height - tall
    radius = width / 2
    if kind == "dish":
        bowl = [
            (0.0, low),
            (0.35 * radius, low + 0.05 * tall),
            (radius, height),
            (0.9 * radius, height),
            (0.0, low + 0.3 * tall),
        ]
        glass = PartStyle("ceramic/#dedacd", on=LIT, bears_toggle=True)
        builder.add(glass, shapes.scale(shapes.lathe(bowl, segments=20), (1, 1, ratio)))
        builder.glow = Glow(Vec3(0.0, height, 0.0), WARM, 0.9)
    else:
        radii = (radius, float(rng.choice([0.6, 0.8, 0.97])) * radius)
        builder.add(cloth, drum(radii, low, height, ratio))
        bulb(builder, (0, low + 0.45 * tall, 0), 0.035)
    top = low + (0.05 if kind == "dish" else 0.55) * tall
    if kind == "tripod":
        _three_legs(builder, one_of(rng, ("wood/oak", "wood/walnut", "metal/black")), low)
        builder.add(metal, shapes.cylinder(0.02, top - 0.85 * low, (0, (top + 0.85 * low) / 2, 0), segments=8))
    else:
        builder.add(metal, shapes.cylinder(0.014, top, (0, top / 2, 0), segments=8))
        plate = shapes.lathe([(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.2, 1.0), (0.0, 1.0)], segments=18)
        builder.add(metal, shapes.scale(plate, (0.34 * width, 0.03, 0.34 * depth)))
    builder.column(0.12, 0.0, low)
    builder.octagon(width, depth, low, height)
    return builder.build([kind] if kind == "dish" else [name, kind])


def _three_legs(builder: Builder, wood: str, low: float) -> None:
    """Add the legs of a tripod, which meet near `low`."""
    for k in range(3):
        angle = 2 * np.pi * k / 3 + np.pi / 6
        foot = (0.9 * (builder.width / 2) * np.cos(angle), 0.012, 0.9 * builder.depth / 2 * np.sin(angle))
        builder.add(wood, shapes.tube([foot, (0.03 * np.cos(angle), 0.9 * low, 0.03 * np.sin(angle))], 0.014, 6))


def _arc_lamp(builder: Builder, rng: np.random.Generator) -> Asset:
    width, height, depth = builder.width, builder.height, builder.depth
    metal = one_of(rng, METALS)
    name, cloth = shade(rng)
    radius = min(0.24 * width, depth / 2)
    foot, end = -0.5 * width + radius, 0.5 * width - radius
    plate = shapes.cylinder(radius, 0.04, (foot, 0.02, 0), segments=18)
    builder.add(metal, plate)
    angles = np.linspace(0, np.pi, 12)
    rise = height - 0.62 * height
    reach = (end - foot) / 2
    arc = np.c_[(foot + end) / 2 - reach * np.cos(angles), 0.62 * height + rise * np.sin(angles) - 0.013, 0 * angles]
    builder.add(metal, shapes.tube(np.concatenate([[[foot, 0.03, 0]], arc]), 0.013, 6))
    builder.add(cloth, shapes.translate(drum((radius, 0.6 * radius), 0.47 * height, 0.62 * height, 1.0), (end, 0, 0)))
    bulb(builder, (end, 0.53 * height, 0), 0.04)
    builder.solid((foot - radius, 0, -radius), (foot + radius, 0.62 * height, radius))
    builder.solid((end - radius, 0.47 * height, -radius), (end + radius, 0.62 * height, radius))
    return builder.build([name, "arc"])


def desk_lamp(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a table lamp: a ceramic or turned foot with a shade, or a jointed arm with a metal cone."""
    builder = Builder("DeskLamp", size)
    width, height, depth = size
    if rng.random() < 0.45:
        return _arm_lamp(builder, rng)
    ratio = depth / width
    name, cloth = shade(rng)
    tone, tint = colour(rng, "white", "navy", "teal", "brown", "grey", "yellow")
    low, radius = 0.52 * height, width / 2
    builder.add(cloth, drum((radius, float(rng.choice([0.55, 0.75, 0.95])) * radius), low, height, ratio))
    form = one_of(rng, ("gourd", "column", "ball"))
    foot = {
        "gourd": [(0.0, 0.0), (0.45, 0.0), (0.5, 0.04), (0.72, 0.3), (0.55, 0.6), (0.22, 0.9), (0.18, 1.0), (0.0, 1.0)],
        "column": [(0.0, 0.0), (0.62, 0.0), (0.62, 0.06), (0.22, 0.1), (0.16, 0.2), (0.16, 1.0), (0.0, 1.0)],
        "ball": [
            (0.0, 0.0),
            (0.4, 0.0),
            (0.42, 0.05),
            (0.68, 0.25),
            (0.74, 0.45),
            (0.6, 0.68),
            (0.2, 0.85),
            (0.15, 1.0),
            (0.0, 1.0),
        ],
    }[form]
    stem = shapes.lathe([(r * radius, y * low) for r, y in foot], segments=18)
    material = one_of(rng, METALS) if form == "column" else f"ceramic/{tint}"
    builder.add(material, shapes.scale(stem, (1, 1, ratio)))
    builder.add("metal/brushed", shapes.cylinder(0.04 * radius, 0.4 * height, (0, 0.68 * height, 0), segments=6))
    bulb(builder, (0, low + 0.2 * height, 0), 0.11 * radius, 0.5)
    return builder.build([name] if material.startswith("metal") else [name, f"{tone} foot"])


def _arm_lamp(builder: Builder, rng: np.random.Generator) -> Asset:
    width, height, depth = builder.width, builder.height, builder.depth
    name, tint = colour(rng, "black", "red", "white", "teal", "yellow", "grey", "blue")
    paint = f"metal/{tint}"
    radius = 0.34 * min(width, depth)
    foot = -depth / 2 + radius
    builder.add(paint, shapes.cylinder(radius, 0.05 * height, (0, 0.025 * height, foot), segments=16, top=0.9 * radius))
    head = 0.5 * width
    elbow, wrist = (0, 0.62 * height, -depth / 2 + 0.02), (0, 0.93 * height, depth / 2 - 1.15 * head)
    for start, end in (((0, 0.04 * height, foot), elbow), (elbow, wrist)):
        builder.add("metal/brushed", shapes.tube([start, end], 0.014 * height + 0.002, 6))
    for joint in (elbow, wrist):
        builder.add(paint, shapes.cylinder(0.03 * height, 0.1 * width, joint, "x", 10))
    cone = shapes.lathe(
        [(0.92, 0.0), (1.0, 0.0), (0.45, 0.95), (0.2, 1.2), (0.0, 1.2), (0.0, 0.9), (0.4, 0.85), (0.92, 0.0)],
        segments=16,
    )
    cone = shapes.rotate(shapes.scale(cone, (head, 0.8 * head, head)), "x", -25)
    lift = 0.93 * height - 0.75 * head
    builder.add(paint, shapes.translate(cone, (0, lift, depth / 2 - 0.92 * head)))
    face = shapes.rotate(shapes.rotate(shapes.disc(0.86 * head, segments=16), "x", 180), "x", -25)
    mouth = PartStyle("ceramic/#d9d6cc", on="glow/#ffd88c", bears_toggle=True)
    builder.add(mouth, shapes.translate(face, (0, lift + 0.08 * head, depth / 2 - 0.92 * head)))
    bulb(builder, (0, lift + 0.02 * head, depth / 2 - 0.95 * head), 0.35 * head, 0.5)
    return builder.build([name, "jointed"])


def ceiling_lamp(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a ceiling lamp: a pendant shade, a glass ball, three arms with balls, or in a flat box a dome."""
    builder = Builder("CeilingLamp", size)
    width, height, depth = size
    ratio, radius = depth / width, width / 2
    metal = one_of(rng, METALS)
    glass = PartStyle("ceramic/#dcd8cc", on="glow/#ffd88c", bears_toggle=True)
    kind = "dome" if height < 0.45 * width else one_of(rng, ("pendant", "ball", "arms", "pendant"))
    if kind == "dome":
        dome = [(0.0, 0.0), (0.5, 0.06), (0.85, 0.35), (0.98, 0.8), (0.0, 0.8)]
        builder.add(
            glass, shapes.scale(shapes.lathe([(r * radius, y * height) for r, y in dome], segments=20), (1, 1, ratio))
        )
        rim = shapes.cylinder(radius, 0.22 * height, (0, 0.89 * height, 0), segments=20)
        builder.add(metal, shapes.scale(rim, (1, 1, ratio)))
        builder.glow = Glow(Vec3(0.0, 0.2 * height, 0.0), WARM, 1.0)
        return builder.build([kind], takes_room=False)
    builder.add(metal, shapes.cylinder(0.22 * radius, 0.06 * height, (0, 0.97 * height, 0), segments=14))
    if kind == "arms":
        builder.add(metal, shapes.cylinder(0.03 * width, 0.7 * height, (0, 0.62 * height, 0), segments=8))
        _three_arms(builder, metal, glass)
        builder.glow = Glow(Vec3(0.0, 0.2 * height, 0.0), WARM, 1.0)
        return builder.build([kind], takes_room=False)
    low = 0.55 * height
    builder.add(metal, shapes.cylinder(0.012 * width, height - low, (0, (height + low) / 2, 0), segments=6))
    if kind == "ball":
        builder.add(glass, shapes.ellipsoid((width, 0.62 * height, depth), (0, 0.31 * height, 0), 18, 10))
        builder.glow = Glow(Vec3(0.0, 0.3 * height, 0.0), WARM, 1.0)
    else:
        _, cloth = shade(rng)
        builder.add(cloth, drum((radius, float(rng.choice([0.3, 0.6, 0.98])) * radius), 0.0, 0.6 * height, ratio))
        bulb(builder, (0, 0.25 * height, 0), 0.13 * radius, 1.0)
    return builder.build([kind], takes_room=False)


def _three_arms(builder: Builder, metal: str, glass: PartStyle) -> None:
    """Add three arms with a glass ball on each."""
    width, height, depth = builder.width, builder.height, builder.depth
    radius = width / 2
    ball = 0.3 * radius
    for k in range(3):
        angle = 2 * np.pi * k / 3 + np.pi / 2
        tip = np.array([np.cos(angle) * (radius - ball), 0.0, np.sin(angle) * (depth / 2 - ball)])
        path = [(0, 0.3 * height, 0), 0.6 * tip + np.array([0, 0.22 * height, 0]), tip + np.array([0, 0.3 * height, 0])]
        builder.add(metal, shapes.tube(path, 0.02 * width, 6))
        middle = tip + np.array([0, 0.8 * ball, 0])
        builder.add(glass, shapes.ellipsoid((2 * ball, 1.6 * ball, 2 * ball), middle, 12, 7))


def candle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a candle: a dripping pillar on a dish, one in a glass, or in a slim box one on a candlestick.

    The candle burns while on.
    """
    builder = Builder("Candle", size)
    width, height, depth = size
    name, tint = colour(rng, "white", "cream", "red", "green", "purple", "yellow", "blue")
    ratio = depth / width
    base, radius = 0.0, 0.5 * width
    top = 0.9 * height
    kind = "stick" if height > 2.6 * width else one_of(rng, ("pillar", "jar", "pillar"))
    if kind == "stick":
        base, radius = 0.42 * height, 0.2 * width
        part = shapes.lathe([(r * width / 2, y * base) for r, y in _CANDLESTICK], segments=16)
        builder.add(one_of(rng, ("metal/brass", "chrome", "metal/black")), shapes.scale(part, (1, 1, ratio)))
    elif kind == "pillar":
        base, radius, top = 0.06 * height, 0.34 * width, 0.82 * height
        dish = shapes.lathe([(r * width / 2, y * height) for r, y in _DISH], segments=18)
        builder.add(one_of(rng, ("metal/brass", "metal/black", "metal/copper")), shapes.scale(dish, (1, 1, ratio)))
    elif kind == "jar":
        top, radius = 0.62 * height, 0.44 * width
        jar = shapes.lathe([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.92, 1.0), (0.92, 0.06), (0.0, 0.06)], segments=16)
        builder.add(PartStyle("glass", is_glass=True), shapes.scale(jar, (width / 2, height, depth / 2)))
        builder.add("metal/brass", lathed_oval([(1.0, 0.96 * height), (1.0, height), (0.9, height)], width, depth, 16))
        builder.add("paper/#efe6cf", lathed_oval([(1.01, 0.14 * height), (1.01, 0.44 * height)], width, depth, 16))
        base = 0.06 * height
    split = base + 0.62 * (top - base)
    body = [(radius, base), (radius, split)]
    tip = [(radius, split), (radius, top - 0.04 * radius), (0.9 * radius, top), (0.3 * radius, top - 0.1 * radius)]
    builder.add(f"wax/{tint}", shapes.scale(shapes.lathe([(0.0, base), *body], segments=16), (1, 1, ratio)))
    warm = PartStyle(f"wax/{tint}", on="glow/#ffb648", bears_toggle=True)
    builder.add(warm, shapes.scale(shapes.lathe([*tip, (0.0, top - 0.1 * radius)], segments=16), (1, 1, ratio)))
    for angle, reach in _DRIPS if kind == "pillar" else ():
        x, z, tall = radius * np.cos(angle), ratio * radius * np.sin(angle), reach * height
        builder.add(warm, shapes.ellipsoid((0.3 * radius, tall, 0.3 * radius), (x, top - tall / 2, z), 6, 4))
    end = height if kind != "jar" else 0.78 * height
    wick = [(0, top - 0.12 * radius, 0), (0.01 * height, end, 0)]
    builder.add("plastic/#2b2622", shapes.tube(wick, max(0.016 * height, 0.0008), 5))
    _burn(builder, end)
    return builder.build([name, kind])


def _burn(builder: Builder, end: float) -> None:
    """Add the flame at a wick's end, and its light."""
    height = builder.height
    tall, wide = max(0.32 * height, 0.03), max(0.1 * height, 0.011)
    fire = shapes.lathe([(r * wide / 2, end - 0.02 * height + y * tall) for r, y in _FLAME], segments=10)
    builder.add(PartStyle("flame", bears_toggle=True, shown="on"), fire)
    core = shapes.lathe([(0.5 * r * wide / 2, end + y * tall * 0.6) for r, y in _FLAME], segments=8)
    builder.add(PartStyle("glow/#fff6d8", bears_toggle=True, shown="on"), shapes.translate(core, (0, 0, 0.3 * wide)))
    builder.glow = Glow(Vec3(0.0, end + tall / 2, 0.0), (1.0, 0.7, 0.35), 0.25)


MAKERS: dict[str, Maker] = {
    "Candle": candle,
    "CeilingLamp": ceiling_lamp,
    "DeskLamp": desk_lamp,
    "FloorLamp": floor_lamp,
}
