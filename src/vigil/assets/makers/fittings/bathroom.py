"""Bathroom things: taps and showers (water runs while on), holders, rolls, brushes, soap."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, creased, drape, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

TAPS = ("chrome", "chrome", "metal/brushed", "metal/brass", "metal/black")
_SHOWERS = (("steel", "metal/#6a6f74"), ("dark", "metal/dark"), ("black", "metal/black"), ("brass", "metal/brass"))
"""Colour word and metal; bright chrome would not be seen on a light wall."""
WATER = PartStyle("water/#66bdf0", bears_toggle=True, shown="on")
WATER_DROP_M = 0.185
"""How far (m) below its own box a tap's water is drawn: to the floor of the deepest basin on whose rim a tap stands."""
SHOWER_DROP_M, _JET_M = 1.15, 0.006
"""How far (m) below its own box a shower's water is drawn, hidden by the floor or the bathtub; and a jet's radius."""
_SPREAD = 1.5
"""Ratio of the distance between jets at their ends to that at their beginnings."""


def faucet(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a tap whose spout looks along +z: one lever on top, or in a wide box two handles at its sides."""
    builder = Builder("Faucet", size)
    width, height, depth = size
    metal = one_of(rng, TAPS)
    thick = min(0.045 * height + 0.005, 0.16 * width)
    twin = width > 1.25 * height
    base = -depth / 2 + 0.16 * depth
    high = height - thick if twin or rng.random() < 0.5 else 0.72 * height
    tip_z, tip_y = depth / 2 - thick, 0.56 * high
    angles = np.linspace(np.pi, 0, 9)
    reach = (tip_z - base) / 2
    arc = np.c_[0 * angles, 0.62 * high + (high - 0.62 * high) * np.sin(angles), base + reach - reach * -np.cos(angles)]
    path = np.concatenate([[[0, 0, base], [0, 0.4 * high, base]], arc, [[0, tip_y, tip_z]]])
    deck = (0.14 * width if twin else width, 1.0, 2 * (base + depth / 2))
    plate = shapes.scale(shapes.cylinder(0.5, 0.04 * height, segments=14), deck)
    column = shapes.cylinder(1.7 * thick, 0.4 * high, (0, 0.2 * high, base), segments=14, top=1.35 * thick)
    builder.add(metal, shapes.tube(path, thick), shapes.translate(plate, (0, 0.02 * height, base)), column)
    mouth = shapes.cylinder(1.15 * thick, 0.08 * height, (0, tip_y, tip_z), segments=10)
    builder.add(PartStyle(metal, bears_toggle=True), mouth)
    fall = shapes.cylinder(0.95 * thick, tip_y + WATER_DROP_M, (0, (tip_y - WATER_DROP_M) / 2, tip_z), segments=8)
    builder.add(WATER, fall)
    levers = (-0.5 * width + 0.13 * width, 0.5 * width - 0.13 * width) if twin else (0.0,)
    for x in levers:
        _lever(builder, metal, (x, 0.5 * height if twin else 0.6 * high, base), twin)
    return builder.build(["twin" if twin else "single"])


def _lever(builder: Builder, metal: str, at: tuple[float, float, float], twin: bool) -> None:
    """Add a handle that turns while on: a cross at the side of the spout, or a lever over it."""
    x, y, z = at
    width, height, depth = builder.width, builder.height, builder.depth
    if twin:
        builder.add(metal, shapes.cylinder(0.05 * width, y, (x, y / 2, z), segments=10, top=0.035 * width))
    for shown, angle in (("off", 0.0), ("on", 45.0)):
        look = PartStyle(metal, bears_toggle=True, shown="on" if shown == "on" else "off")
        if twin:
            bars = [shapes.box((0.25 * width, 0.08 * height, 0.06 * width), (x, y, z), 0.015 * width)]
            bars.append(shapes.rotate(bars[0], "y", 90, (x, y, z)))
            builder.add(look, *(shapes.rotate(bar, "y", angle, (x, y, z)) for bar in bars))
            continue
        top = height - 0.05 * height
        stem = shapes.cylinder(0.12 * width, max(top - y, 0.02), (0, (top + y) / 2, z), segments=10)
        lever = shapes.rounded_box((0.22 * width, 0.07 * height, 0.4 * depth), (0, top, z + 0.1 * depth), 0.03 * height)
        builder.add(look, stem, shapes.rotate(lever, "x", -0.6 * angle, (0, top, z)))


def shower_head(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a shower: a rail on the wall (-z) with a head at the top front, a mixer below, and a hose."""
    builder = Builder("ShowerHead", size)
    width, height, depth = size
    name, metal = one_of(rng, _SHOWERS)
    wall = -depth / 2
    radius = min(0.5 * width, 0.34 * depth)
    rod = min(0.015, 0.06 * width)
    rail = wall + 0.16 * depth
    top = height - 0.03 * height
    builder.add(metal, shapes.tube([(0, 0.06 * height, rail), (0, top, rail)], rod, 8))
    for y in (0.12 * height, 0.9 * height):
        builder.add(metal, shapes.tube([(0, y, wall), (0, y, rail)], 1.3 * rod, 6))
    head_z = depth / 2 - radius
    builder.add(
        metal, shapes.tube([(0, top, rail), (0, height - rod, (rail + head_z) / 2), (0, top - 0.03, head_z)], rod, 8)
    )
    dish = shapes.lathe([(0.0, 0.0), (0.95, 0.0), (1.0, 0.25), (0.3, 0.8), (0.0, 1.0)], segments=18)
    plate = shapes.scale(dish, (radius, min(0.05, 0.08 * height), radius))
    drop = top - 0.03 - min(0.05, 0.08 * height)
    builder.add(PartStyle(metal, bears_toggle=True), shapes.translate(plate, (0, drop, head_z)))
    nozzles = shapes.rotate(shapes.disc(0.86 * radius, segments=18), "x", 180)
    builder.add("rubber/#e8e8e4" if name != "steel" else "rubber", shapes.translate(nozzles, (0, drop - 1e-3, head_z)))
    mixer = shapes.rounded_box(
        (width, 0.055 * height, 0.14 * depth), (0, 0.09 * height, wall + 0.1 * depth), 0.02 * height
    )
    builder.add(metal, mixer)
    for shown, angle in (("off", 0.0), ("on", 60.0)):
        knob = shapes.box(
            (0.08 * width, 0.03 * height, 0.16 * depth), (0.36 * width, 0.13 * height, wall + 0.14 * depth)
        )
        look = PartStyle("chrome", bears_toggle=True, shown="on" if shown == "on" else "off")
        builder.add(look, shapes.rotate(knob, "z", angle, (0.36 * width, 0.09 * height, 0)))
    hose = [
        (-0.3 * width, 0.08 * height, wall + 0.14 * depth),
        (-0.42 * width, rod, rail),
        (-0.3 * width, 0.3 * height, rail),
        (0, 0.55 * height, rail + 0.02),
    ]
    builder.add("metal/brushed", creased(shapes.tube(hose, 0.7 * rod, 6)))
    _jets(builder, radius, drop, head_z)
    return builder.build([name], takes_room=False)


def _jets(builder: Builder, radius: float, drop: float, head_z: float) -> None:
    """Add the water that runs out of a shower head, in two rings of jets."""
    for ring, count in ((0.25, 4), (0.75, 9)):
        for k in range(count):
            angle = 2 * np.pi * k / count
            start = np.array([ring * radius * np.sin(angle), drop, head_z + ring * radius * np.cos(angle)])
            apart = (_SPREAD - 1) * ring * radius * np.cos(angle)
            end = start * [_SPREAD, 0, 1] + [0, -SHOWER_DROP_M, apart]
            builder.add(WATER, shapes.tube([start, end], _JET_M, 4))


def towel_holder(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a rail for towels, on two arms from the wall (-z)."""
    builder = Builder("TowelHolder", size)
    width, height, depth = size
    metal = one_of(rng, TAPS)
    thick = min(0.22 * height, 0.016)
    bar_z = depth / 2 - thick
    rods = [(height / 2, bar_z)] if depth < 0.14 else [(height / 2, bar_z), (height / 2, 0.0)]
    for y, z in rods:
        builder.add(metal, shapes.tube([(-0.48 * width, y, z), (0.48 * width, y, z)], thick, 8))
    for x in (-0.46 * width, 0.46 * width):
        builder.add(metal, shapes.tube([(x, height / 2, -depth / 2), (x, height / 2, bar_z + thick)], 1.2 * thick, 8))
        builder.add(metal, shapes.cylinder(height / 2, 0.1 * depth, (x, height / 2, -0.45 * depth), "z", 14))
    return builder.build([metal.split("/")[-1]], takes_room=False)


def hand_towel_holder(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a ring for a hand towel, hanging from a plate on the wall (-z)."""
    builder = Builder("HandTowelHolder", size)
    width, height, depth = size
    metal = one_of(rng, TAPS)
    thick = min(0.04 * width, 0.008)
    plate_y = 0.86 * height
    builder.add(metal, shapes.cylinder(0.14 * height, 0.2 * depth, (0, plate_y, -0.4 * depth), "z", 14))
    builder.add(metal, shapes.tube([(0, plate_y, -0.4 * depth), (0, plate_y, 0.5 * depth - thick)], 1.4 * thick, 8))
    angles = np.linspace(0, 2 * np.pi, 25)
    radius_y = plate_y / 2 - thick / 2
    ring = np.c_[(width / 2 - thick) * np.sin(angles), thick + radius_y * (1 + np.cos(angles)), 0 * angles]
    builder.add(metal, shapes.tube(ring + np.array([0, 0, depth / 2 - thick]), thick, 6))
    return builder.build([metal.split("/")[-1]], takes_room=False)


_TOILET_PAPERS = (
    ("beige", "paper/#d2bd9a"),
    ("beige", "paper/#d9c2a6"),
    ("pink", "paper/#e3b4bb"),
    ("light blue", "paper/#b2cadd"),
)
"""Colour word and paper; white paper would not be seen on a white cistern."""


def toilet_paper(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a roll of toilet paper; in a very slim box, its empty core."""
    builder = Builder("ToiletPaper", size)
    width, height, depth = size
    if max(width, depth) < 0.6 * height:
        core = shapes.lathe([(0.86, 0.0), (1.0, 0.0), (1.0, 1.0), (0.86, 1.0), (0.86, 0.0)], segments=16)
        builder.add("cardboard", shapes.scale(core, (width / 2, height, depth / 2)))
        return builder.build(["empty"])
    name, paper = one_of(rng, _TOILET_PAPERS)
    _roll(builder, (0, 0, 0), (width, height, depth), paper)
    sheet = shapes.box((0.02 * width, 0.98 * height, 0.3 * depth), (0.49 * width, 0.49 * height, 0.16 * depth))
    builder.add("paper/#f3ede2", sheet)
    return builder.build([name])


def _roll(builder: Builder, foot: tuple[float, float, float], size: tuple[float, float, float], paper: str) -> None:
    """Add an upright roll of paper with its cardboard core."""
    width, height, depth = size
    tube = shapes.lathe([(0.36, 0.0), (1.0, 0.0), (1.0, 1.0), (0.36, 1.0)], segments=20)
    core = shapes.lathe([(0.36, 1.0), (0.36, 0.0)], segments=14)
    for look, part in ((paper, tube), ("cardboard", core)):
        builder.add(look, shapes.translate(shapes.scale(part, (width / 2, height, depth / 2)), foot))


def toilet_paper_hanger(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a holder on the wall (-z): a plate and two arms with a bar, and on it a roll that is nearly used up."""
    builder = Builder("ToiletPaperHanger", size)
    width, height, depth = size
    metal = one_of(rng, TAPS)
    axis_y, axis_z = 0.55 * height, 0.16 * depth
    plate = shapes.rounded_box((width, 0.34 * height, 0.1 * depth), (0, 0.83 * height, -0.45 * depth), 0.04 * height)
    builder.add(metal, plate)
    for x in (-0.465 * width, 0.465 * width):
        reach = (axis_z + 0.5 * depth, 0.3 * height)
        arm = shapes.rounded_box((0.07 * width, reach[1], reach[0]), (x, 0.7 * height, axis_z - reach[0] / 2), 0.01)
        cheek = shapes.cylinder(0.24 * height, 0.07 * width, (x, axis_y, axis_z), "x", 16)
        builder.add(metal, arm, cheek)
    builder.add(metal, shapes.cylinder(0.07 * height, 0.9 * width, (0, axis_y, axis_z), "x", 10))
    radius = min(0.26 * depth, 0.24 * height)
    builder.add("paper/#f6f4ef", shapes.cylinder(radius, 0.56 * width, (0, axis_y, axis_z), "x", 18))
    for x in (-0.283, 0.283):
        builder.add("cardboard", shapes.cylinder(0.5 * radius, 0.004, (x * width, axis_y, axis_z), "x", 10))
    flap = shapes.span((-0.28 * width, 0.0, axis_z + radius - 0.003), (0.28 * width, axis_y, axis_z + radius))
    builder.add("paper/#fbfaf7", flap)
    return builder.build([metal.split("/")[-1]], takes_room=False)


def soap_bar(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a bar of soap with a stamped oval."""
    builder = Builder("SoapBar", size)
    width, height, length = size
    name, tint = colour(rng, "pink", "light green", "beige", "light blue", "yellow")
    builder.add(
        f"wax/{tint}", shapes.rounded_box((width, height, length), (0, height / 2, 0), 0.42 * height, 0.1 * height)
    )
    stamp = shapes.scale(shapes.cylinder(0.5, 1, segments=14), (0.5 * width, 0.06 * height, 0.55 * length))
    builder.add("wax/#ffffff", shapes.translate(stamp, (0, 0.965 * height, 0)))
    return builder.build([name])


def plunger(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a plunger: a rubber cup and a long handle."""
    builder = Builder("Plunger", size)
    width, height, depth = size
    name, tint = one_of(rng, (("red", "#a23325"), ("black", "#2b2b2d"), ("brown", "#7a3f28"), ("blue", "#2f5ba0")))
    cup_top = 0.26 * height
    cup = [(0.9, 0.0), (1.0, 0.02), (0.95, 0.35), (0.65, 0.65), (0.3, 0.8), (0.26, 1.0), (0.0, 1.0)]
    cup = shapes.lathe([(0.0, 0.08), (0.84, 0.0), *[(r, y) for r, y in cup]], segments=18)
    builder.add(f"rubber/{tint}", shapes.scale(cup, (width / 2, cup_top, depth / 2)))
    wood = one_of(rng, ("wood/pale", "wood/oak", "plastic/#ecebe6"))
    builder.add(wood, shapes.cylinder(0.085 * width, 0.74 * height, (0, 0.61 * height, 0), segments=10))
    builder.add(wood, shapes.ellipsoid((0.2 * width, 0.06 * height, 0.2 * width), (0, 0.97 * height, 0), 10, 6))
    return builder.build([name])


def scrub_brush(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a toilet brush in its holder."""
    builder = Builder("ScrubBrush", size)
    width, height, depth = size
    name, tint = colour(rng, "white", "grey", "light blue", "black", "teal")
    pot = [(0.0, 0.0), (0.96, 0.0), (1.0, 0.04), (0.86, 0.9), (0.86, 1.0), (0.72, 1.0), (0.72, 0.5), (0.0, 0.5)]
    pot_top = 0.34 * height
    builder.add(f"plastic/{tint}", shapes.scale(shapes.lathe(pot, segments=18), (width / 2, pot_top, depth / 2)))
    head = [(0.0, 0.2), (0.6, 0.2), (0.66, 0.3), (0.66, 0.46), (0.5, 0.52), (0.14, 0.55), (0.0, 0.55)]
    bristles = shapes.scale(shapes.lathe(head, segments=12), (width / 2, height, depth / 2))
    builder.add("carpet/#f2f1ee" if name != "white" else "carpet/#8db5d6", bristles)
    grip = shapes.lathe(
        [(0.0, 0.45), (0.5, 0.45), (0.5, 0.72), (0.85, 0.8), (0.85, 0.94), (0.5, 1.0), (0.0, 1.0)], segments=12
    )
    builder.add(f"plastic/{tint}", shapes.scale(grip, (0.13 * width, height, 0.13 * depth)))
    return builder.build([name])


def hanging_towel(category: str) -> Maker:
    """Return the maker of a towel: hung in soft folds in an upright box, otherwise folded to a pile."""

    def make(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
        builder = Builder(category, size)
        width, height, depth = size
        name, tint = colour(rng, "white", "light blue", "teal", "pink", "yellow", "navy", "grey", "light green", "red")
        _, stripe = colour(rng, "white", "navy", "cream", "teal", "red")
        cloth, trim = f"carpet/{tint}", f"fabric/{stripe}"
        if height < 0.6 * max(width, depth):
            layers = 4
            for k in range(layers):
                low = k * height / layers
                shrink = 1 - 0.012 * k
                piece = (shrink * width, 0.97 * height / layers, shrink * depth)
                builder.add(cloth, shapes.rounded_box(piece, (0, low + height / layers / 2, 0), 0.4 * height / layers))
            band = shapes.panel(0.12 * width, 0.9 * depth, (0.3 * width, height + 5e-4, 0), "+y")
            builder.add(trim, band)
            return builder.build([name, "folded"])
        fold = min(0.45 * depth, 0.02)
        for z, low in ((depth / 2 - fold / 2, 0.0), (-depth / 2 + fold / 2, 0.08 * height)):
            sheet = drape(width, height - low - 0.3 * depth, 2.5, fold, thickness=0.4 * fold)
            builder.add(cloth, shapes.translate(sheet, (0, low, z)))
        angles = np.linspace(0, np.pi, 7)
        over = [(depth / 2 * np.cos(a), height - depth * 0.32 + depth * 0.32 * np.sin(a)) for a in angles]
        builder.add(cloth, shapes.extrude(over, -width / 2, width / 2, "x"))
        for y in (0.1, 0.15):
            band = drape(1.002 * width, 0.025 * height, 2.5, fold, thickness=0.5 * fold)
            builder.add(trim, shapes.translate(band, (0, y * height, depth / 2 - 0.46 * fold)))
        return builder.build([name, "hanging"])

    return make


MAKERS: dict[str, Maker] = {
    "Faucet": faucet,
    "HandTowel": hanging_towel("HandTowel"),
    "HandTowelHolder": hand_towel_holder,
    "Plunger": plunger,
    "ScrubBrush": scrub_brush,
    "ShowerHead": shower_head,
    "SoapBar": lengthwise(soap_bar),
    "ToiletPaper": toilet_paper,
    "ToiletPaperHanger": toilet_paper_hanger,
    "Towel": hanging_towel("Towel"),
    "TowelHolder": towel_holder,
}
