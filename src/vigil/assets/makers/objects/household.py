"""Household and sports things: rolls, sponges, bags, boots, balls, rackets, the vacuum cleaner."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, along_longest, creased, lathed_oval, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

DARK = "plastic/#1f2022"


def paper_towel_roll(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a paper towel roll with a printed border, usually on a stand with a knob."""
    builder = Builder("PaperTowelRoll", size)
    width, height, depth = size
    stands = rng.random() < 0.65
    low, high = (0.06, 0.86) if stands else (0.0, 1.0)
    share = 0.86 if stands else 1.0
    roll = [(0.3, low), (1.0, low), (1.0, high), (0.3, high)]
    core = [(0.3, high), (0.3, low)]
    for look, profile in (("dots/#f6f4ef" if rng.random() < 0.3 else "paper/#f6f4ef", roll), ("cardboard", core)):
        part = shapes.lathe([(r * share, y * height) for r, y in profile], segments=20)
        builder.add(look, shapes.scale(part, (width / 2, 1, depth / 2)))
    _, ink = colour(rng, "light blue", "light green", "pink", "teal")
    tall = high - low
    for edge in (low + 0.02 * tall, high - 0.09 * tall):
        border = lathed_oval(
            [(1.004 * share, edge * height), (1.004 * share, (edge + 0.07 * tall) * height)], width, depth, 20
        )
        builder.add(f"paper/{ink}", border)
    sheet = (0.02 * width, (high - low) * height, 0.3 * depth)
    builder.add("paper/#ffffff", shapes.box(sheet, (0.49 * share * width, (low + high) / 2 * height, 0.17 * depth)))
    if stands:
        wood = one_of(rng, ("wood/oak", "wood/walnut", "metal/black", "chrome"))
        foot = shapes.lathe([(0.0, 0.0), (1.0, 0.0), (1.0, 0.04), (0.0, 0.06)], segments=20)
        builder.add(wood, shapes.scale(foot, (width / 2, height, depth / 2)))
        builder.add(wood, shapes.cylinder(0.05 * width, 0.92 * height, (0, 0.46 * height, 0), segments=8))
        builder.add(wood, shapes.ellipsoid((0.2 * width, 0.1 * height, 0.2 * depth), (0, 0.95 * height, 0), 10, 6))
    return builder.build(["white"])


_FOIL = "metal/#a4aab0"
_GLEAMS = (
    ("plastic/#f6f8fa", 62.0, 82.0),
    ("metal/#62686e", 84.0, 100.0),
    ("plastic/#f6f8fa", 104.0, 112.0),
    ("metal/#62686e", 136.0, 154.0),
    ("metal/#62686e", 26.0, 44.0),
)
"""Reflections on a roll of bare metal, bright and dark, with the angles (degrees) about it between which each lies."""


def aluminum_foil(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a roll of aluminum foil in an open carton with a printed name, a sheet hanging over its edge."""
    builder = Builder("AluminumFoil", size)
    width, height, length = size
    name, tint = colour(rng, "blue", "red", "orange", "teal")
    tall = 0.62 * height
    carton = f"cardboard/{tint}"
    for x in (-0.47 * width, 0.47 * width):
        builder.add(carton, shapes.box((0.06 * width, tall, length), (x, tall / 2, 0)))
    for z in (-0.49 * length, 0.49 * length):
        builder.add(carton, shapes.box((0.9 * width, tall, 0.02 * length), (0, tall / 2, z)))
    builder.add(carton, shapes.box((0.9 * width, 0.05 * height, length), (0, 0.025 * height, 0)))
    for side, facing in ((-1, "-x"), (1, "+x")):
        words = shapes.panel(0.36 * length, 0.5 * height, facing=facing)
        builder.add("print/foil", shapes.translate(words, (side * (width / 2 + 4e-4), 0.32 * height, 0.26 * length)))
    radius = 0.42 * width
    middle = (0.0, height - radius, 0.0)
    builder.add(_FOIL, shapes.cylinder(radius, 0.94 * length, middle, "z", 18))
    for look, start, end in _GLEAMS:
        angles = np.radians(np.linspace(start, end, 4))
        arc = np.c_[np.cos(angles), np.sin(angles)] * radius
        strip = np.concatenate([1.006 * arc, 0.99 * arc[::-1]]) + np.array(middle[:2])
        builder.add(look, shapes.extrude(strip, -0.47 * length, 0.47 * length, "z"))
    for side in (-1, 1):
        core = shapes.cylinder(0.45 * radius, 0.01 * length, (0, middle[1], side * 0.47 * length), "z", 10)
        builder.add("cardboard", core)
    fall = [(-radius, middle[1]), (-0.5 * width, tall), (-0.5 * width - 1e-3, 0.25 * height)]
    outline = [*fall, *[(x - 0.02 * width, y) for x, y in reversed(fall)]]
    builder.add(_FOIL, shapes.extrude(outline, -0.46 * length, 0.04 * length, "z"))
    return builder.build([name])


def dish_sponge(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a sponge with a waist for the fingers and a scouring layer on top."""
    builder = Builder("DishSponge", size)
    width, height, length = size
    name, tint = colour(rng, "yellow", "yellow", "blue", "pink", "orange")
    sides = np.linspace(-0.5, 0.5, 11)
    reach = width * (0.5 - 0.075 * (1 + np.cos(2 * np.pi * sides)))
    right = np.c_[reach, sides * length]
    outline = np.concatenate([right, right[::-1] * [-1, 1]])
    builder.add(f"foam/{tint}", shapes.extrude(outline, 0, 0.72 * height))
    builder.add("carpet/#4a9a55", shapes.extrude(outline, 0.72 * height, height))
    return builder.build([f"{name} and green"])


def garbage_bag(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a full garbage bag, knotted at the top."""
    builder = Builder("GarbageBag", size)
    name, tint = colour(rng, "black", "black", "white", "blue", "grey")
    angles = np.linspace(0, 2 * np.pi, 23)
    phase = rng.uniform(0, 6, 3)
    rings = []
    profile = (
        (0.78, 0.0),
        (0.95, 0.08),
        (1.0, 0.3),
        (0.92, 0.5),
        (0.66, 0.66),
        (0.22, 0.78),
        (0.1, 0.83),
        (0.2, 0.93),
        (0.3, 1.0),
    )
    for radius, y in profile:
        fold = 1 + 0.07 * np.sin(5 * angles + phase[0] + 3 * y) + 0.05 * np.sin(8 * angles + phase[1] - 5 * y)
        r = radius * fold / 2
        rings.append(
            np.c_[r * np.sin(angles), y + 0.015 * np.sin(4 * angles + phase[2]) * (y > 0.05), r * np.cos(angles)]
        )
    skin = shapes.loft(np.array(rings))
    builder.add(f"plastic/{tint}", shapes.scale(skin, size))
    tie = shapes.cylinder(0.07, 0.03, (0, 0.83, 0), segments=10)
    builder.add("plastic/#d9722a" if name != "black" else "plastic/#b4262b", shapes.scale(tie, size))
    return builder.build([name])


def boots(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a pair of boots, toes to +z."""
    builder = Builder("Boots", size)
    width, height, depth = size
    name, tint = one_of(
        rng,
        (("black", "#232325"), ("brown", "#6b4628"), ("yellow", "#d9ae2e"), ("green", "#3d5a40"), ("tan", "#b08850")),
    )
    skin = f"rubber/{tint}" if name in ("yellow", "green") else f"leather/{tint}"
    half = 0.2 * width
    for side in (-1, 1):
        x = side * (width / 2 - half)
        rings = []
        for y, back, front, wide in (
            (0.07, -0.48, 0.5, 0.95),
            (0.16, -0.5, 0.48, 1.0),
            (0.26, -0.48, 0.34, 0.95),
            (0.36, -0.46, 0.1, 0.82),
            (0.6, -0.44, 0.04, 0.78),
            (1.0, -0.48, 0.08, 0.86),
        ):
            rings.append(_oval_ring(x, y * height, (back * depth, front * depth), wide * half))
        builder.add(skin, shapes.loft(np.array(rings)))
        sole = [_oval_ring(x, y * height, (-0.5 * depth, 0.5 * depth), half) for y in (0.0, 0.075)]
        builder.add("rubber/#3a2a20" if name != "brown" else "rubber/#1f1f20", shapes.loft(np.array(sole)))
        mouth = _oval_ring(x, 1.002 * height, (-0.45 * depth, 0.05 * depth), 0.72 * half)
        builder.add(DARK, shapes.loft(np.array([mouth, mouth * [1, 0.999, 1]])))
        if skin.startswith("leather"):
            for y in (0.42, 0.52, 0.62, 0.72, 0.82):
                spot = (x, y * height, 0.055 * depth)
                builder.add("fabric/#cbb594", shapes.box((0.8 * half, 0.02 * height, 0.05 * depth), spot))
    return builder.build([name])


def _oval_ring(x: float, y: float, ends: tuple[float, float], half: float) -> np.ndarray:
    angles = np.linspace(0, 2 * np.pi, 15)
    middle, reach = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
    return np.c_[x + half * np.sin(angles), np.full(15, y), middle + reach * np.cos(angles)]


def baseball_bat(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a baseball bat, its thick end to +z."""
    builder = Builder("BaseballBat", size)
    width, height, length = size
    name, look = one_of(
        rng,
        (
            ("wooden", "wood/oak"),
            ("dark", "wood/walnut"),
            ("silver", "metal/brushed"),
            ("red", "metal/#a8242a"),
            ("black", "metal/#232427"),
            ("blue", "metal/#2f5ba0"),
        ),
    )
    grip_end = -0.5 + 0.3
    profile = (
        (-0.5, 0.6),
        (-0.49, 0.8),
        (-0.47, 0.75),
        (-0.455, 0.4),
        (grip_end, 0.42),
        (0.0, 0.62),
        (0.2, 0.92),
        (0.35, 1.0),
        (0.46, 0.98),
        (0.49, 0.8),
        (0.5, 0.4),
    )
    for material, part in (("leather/#2b2b2d", profile[:5]), (look, profile[4:])):
        path = [(0, 0, z * length) for z, _ in part]
        rod = shapes.tube(path, [r / 2 for _, r in part], 12)
        builder.add(material, shapes.translate(shapes.scale(rod, (width, height, 1)), (0, height / 2, 0)))
    return builder.build([name])


def basketball(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a basketball with its black seams."""
    builder = Builder("BasketBall", size)
    tint = one_of(rng, ("#d2691e", "#c4632c", "#b8541f"))
    angles = np.linspace(0, 2 * np.pi, 19)
    tilt = ((1.0, 0.3, 0.5), 35.0)
    ball = shapes.ellipsoid((0.985, 0.985, 0.985), segments=18, rings=9)
    builder.add(f"leather/{tint}", shapes.rotate(ball, *tilt))
    ring = np.c_[0.497 * np.sin(angles), 0.497 * np.cos(angles), 0 * angles]
    curve = np.c_[np.sin(angles), 0.75 * np.cos(angles), 0.62 * np.cos(2 * angles)]
    curve *= 0.497 / np.linalg.norm(curve, axis=1, keepdims=True)
    for line in (ring, ring[:, [2, 1, 0]], curve):
        builder.add("rubber/#1a1a1b", shapes.rotate(shapes.tube(line, 0.011, 3), *tilt))
    return builder.build(["orange"])


def tennis_racket(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a tennis racket lying flat, its head to +z."""
    builder = Builder("TennisRacket", size)
    width, height, length = size
    name, tint = colour(rng, "red", "blue", "green", "black", "yellow", "white", "orange")
    thick = height / 2
    middle, reach = 0.24 * length, 0.26 * length - thick
    half = width / 2 - thick
    angles = np.linspace(0, 2 * np.pi, 29)
    hoop = np.c_[half * np.sin(angles), np.full(29, thick), middle + reach * np.cos(angles)]
    frame = f"plastic/{tint}"
    builder.add(frame, shapes.tube(hoop, 0.8 * thick, 6))
    for side in (-1, 1):
        arm = [(0.62 * half * side, thick, middle - 0.78 * reach), (0.12 * half * side, thick, -0.13 * length)]
        builder.add(frame, shapes.tube(arm, 0.7 * thick, 6))
    for share in np.linspace(-0.8, 0.8, 9):
        across = np.sqrt(1 - share**2)
        wide, long = 2 * half * across, 2 * reach * across
        builder.add("plastic/#ecebe6", shapes.box((wide, 0.08 * height, 0.003), (0, thick, middle + share * reach)))
        builder.add("plastic/#ecebe6", shapes.box((0.003, 0.08 * height, long), (share * half, thick, middle)))
    builder.add(frame, shapes.tube([(0, thick, -0.12 * length), (0, thick, -0.2 * length)], 0.75 * thick, 8))
    grip = shapes.tube(
        [(0, thick, -0.19 * length), (0, thick, -0.48 * length), (0, thick, -0.5 * length)],
        [0.9 * thick, 0.95 * thick, thick],
        8,
    )
    builder.add("leather/#2b2b2d" if name != "black" else "leather/#ecebe6", grip)
    return builder.build([name])


def dumbbell(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a dumbbell along z: six-sided rubber heads or round plates, a steel bar."""
    builder = Builder("Dumbbell", size)
    width, height, length = size
    name, tint = colour(rng, "black", "black", "blue", "pink", "green", "grey")
    builder.add("chrome", shapes.cylinder(0.13 * width, 0.94 * length, (0, height / 2, 0), "z", 10))
    sides = one_of(rng, (6, 18))
    for side in (-1, 1):
        plates = ((0.34, 0.3, 1.0),) if sides == 6 else ((0.26, 0.09, 0.8), (0.36, 0.12, 1.0), (0.455, 0.07, 0.7))
        for middle, thick, radius in plates:
            disc = shapes.cylinder(radius / 2, thick * length, axis="z", segments=sides)
            disc = shapes.scale(disc, (width, height, 1))
            builder.add(f"rubber/{tint}", shapes.translate(disc, (0, height / 2, side * middle * length)))
        builder.add(
            "chrome", shapes.cylinder(0.17 * width, 0.02 * length, (0, height / 2, side * 0.49 * length), "z", 10)
        )
    return builder.build([name])


def vacuum_cleaner(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return an upright vacuum cleaner, its head to +z."""
    builder = Builder("VacuumCleaner", size)
    width, height, depth = size
    name, tint = colour(rng, "red", "blue", "purple", "yellow", "green", "teal")
    paint = f"plastic/{tint}"
    head = 0.1 * height
    builder.add(
        paint, shapes.rounded_box((width, 0.8 * head, 0.55 * depth), (0, 0.5 * head, 0.225 * depth), 0.3 * head)
    )
    builder.add(DARK, shapes.box((0.94 * width, 0.3 * head, 0.1 * depth), (0, 0.2 * head, 0.44 * depth)))
    for x in (-0.42, 0.42):
        wheel = shapes.cylinder(0.6 * head, 0.1 * width, (x * width, 0.6 * head, -0.2 * depth), "x", 14)
        builder.add(DARK, wheel)
    back = -0.5 * depth + 0.2 * width
    body = [(0, 0.4 * head, -0.05 * depth), (0, 0.3 * height, -0.12 * depth), (0, 0.62 * height, back)]
    builder.add(paint, shapes.tube(body, [0.2 * width, 0.24 * width, 0.15 * width], 12))
    bin_ = shapes.cylinder(0.17 * width, 0.26 * height, (0, 0.3 * height, 0.05 * depth), segments=14)
    builder.add("plastic/#5b6067", bin_)
    builder.add(paint, shapes.cylinder(0.18 * width, 0.03 * height, (0, 0.44 * height, 0.05 * depth), segments=14))
    pole = [(0, 0.6 * height, back), (0, 0.88 * height, back - 0.08 * width)]
    builder.add("metal/brushed", shapes.tube(pole, 0.05 * width, 8))
    grip = [
        (0, 0.86 * height, back - 0.08 * width),
        (0, 0.985 * height, back - 0.06 * width),
        (0, 0.98 * height, back + 0.26 * width),
        (0, 0.9 * height, back + 0.22 * width),
    ]
    builder.add(DARK, creased(shapes.tube(grip, 0.055 * width, 8)))
    hose = [
        (0.18 * width, 0.16 * height, -0.1 * depth),
        (0.3 * width, 0.4 * height, -0.2 * depth),
        (0.12 * width, 0.66 * height, back),
    ]
    builder.add("rubber/#3a3a3c", shapes.tube(hose, 0.05 * width, 7))
    builder.solid((-width / 2, 0, -depth / 2), (width / 2, 0.62 * height, depth / 2))
    builder.solid((-0.2 * width, 0.62 * height, -depth / 2), (0.2 * width, height, 0.1 * depth))
    return builder.build([name])


MAKERS: dict[str, Maker] = {
    "AluminumFoil": lengthwise(aluminum_foil),
    "BaseballBat": along_longest(baseball_bat),
    "BasketBall": basketball,
    "Boots": boots,
    "DishSponge": lengthwise(dish_sponge),
    "Dumbbell": lengthwise(dumbbell),
    "GarbageBag": garbage_bag,
    "PaperTowelRoll": paper_towel_roll,
    "TennisRacket": along_longest(tennis_racket),
    "VacuumCleaner": vacuum_cleaner,
}
