"""Bottles, shakers, vases and cans."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, lathed_oval, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import COLOURS, colour, one_of
from vigil.base.geometry import Vec3


def bottle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a bottle of plastic or glass with a cap and a label."""
    builder = Builder("Bottle", size)
    name, tint = colour(rng, "blue", "green", "light blue", "orange", "red", "teal")
    body = one_of(rng, (f"plastic/{tint}", f"glass/{tint}", "glass/#cfe3e6"))
    cap = one_of(rng, ("plastic/#b4262b", "plastic/#ecebe6", "plastic/#1f2022", "metal/brushed"))
    wall = [(0.0, 0.0), (0.9, 0.0), (1.0, 0.04), (1.0, 0.6), (0.9, 0.7), (0.42, 0.84), (0.38, 0.92), (0.0, 0.92)]
    _turned(builder, PartStyle(body, is_glass=body.startswith("glass")), wall)
    _turned(builder, cap, [(0.0, 0.9), (0.46, 0.9), (0.46, 1.0), (0.0, 1.0)], 12)
    _turned(builder, f"paper/{one_of(rng, ('#ecebe6', '#e2b93b', tint))}", [(1.01, 0.2), (1.01, 0.5)])
    if body.startswith("glass"):
        _turned(builder, f"plastic/{tint}", [(0.0, 0.03), (0.9, 0.03), (0.93, 0.06), (0.93, 0.58), (0.0, 0.58)], 12)
    return builder.build([name])


def wine_bottle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a wine bottle: dark glass, a foil over the cork, a label."""
    builder = Builder("WineBottle", size)
    name, tint = one_of(rng, (("green", "#24402a"), ("dark", "#1d1a1c"), ("amber", "#5b3a1a"), ("clear", "#b9c7a5")))
    round_ = rng.random() < 0.6
    shoulder = (
        [(1.0, 0.6), (0.92, 0.66), (0.5, 0.74), (0.36, 0.8)] if round_ else [(1.0, 0.5), (0.75, 0.62), (0.36, 0.8)]
    )
    _turned(builder, f"ceramic/{tint}", [(0.0, 0.0), (0.95, 0.0), (1.0, 0.02), *shoulder, (0.34, 0.84)])
    _, foil = colour(rng, "red", "black", "yellow", "navy", "cream")
    _turned(builder, f"metal/{foil}", [(0.36, 0.83), (0.36, 0.97), (0.42, 0.97), (0.42, 1.0), (0.0, 1.0)], 14)
    paper = one_of(rng, ("#efe8d4", "#ecebe6", "#2b2622"))
    _turned(builder, f"paper/{paper}", [(1.012, 0.14), (1.012, 0.46)])
    _turned(builder, f"paper/{foil}", [(1.018, 0.3), (1.018, 0.36)])
    return builder.build([name])


def soap_bottle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a soap bottle with a pump or, in a flat box, a squeeze bottle with a cap."""
    builder = Builder("SoapBottle", size)
    width, height, depth = size
    name, tint = colour(rng, "white", "pink", "light blue", "green", "orange", "purple", "teal", "yellow", "cream")
    body = one_of(rng, (f"plastic/{tint}", f"ceramic/{tint}"))
    trim = one_of(rng, ("plastic/#ecebe6", "chrome", "plastic/#1f2022"))
    _, label = colour(rng, "white", "navy", "green", "red")
    if rng.random() < 0.75:
        square = rng.random() < 0.35
        if square:
            low = shapes.rounded_box((width, 0.66 * height, depth), (0, 0.33 * height, 0), 0.12 * width)
            builder.add(body, low)
            tag = (0.6 * width, 0.3 * height, (0, 0.3 * height, depth / 2 + 4e-4))
            builder.add(f"paper/{label}", shapes.panel(*tag))
        else:
            _turned(builder, body, [(0.0, 0.0), (0.94, 0.0), (1.0, 0.03), (1.0, 0.52), (0.8, 0.63), (0.0, 0.66)])
            _turned(builder, f"paper/{label}", [(1.012, 0.14), (1.012, 0.42)])
        _turned(builder, trim, [(0.34, 0.63), (0.34, 0.74), (0.13, 0.76), (0.13, 0.9), (0.0, 0.9)], 10)
        top = 0.945 * height
        nozzle = [(0, top, -0.2 * depth), (0, top, 0.3 * depth), (0, top - 0.04 * height, 0.46 * depth)]
        builder.add(trim, shapes.tube(nozzle, [0.05 * height, 0.045 * height, 0.03 * height], 8))
        return builder.build([name, "pump"])
    wall = [(0.0, 0.0), (0.8, 0.0), (0.95, 0.05), (1.0, 0.4), (0.9, 0.68), (0.45, 0.8), (0.0, 0.8)]
    _turned(builder, body, wall)
    _turned(builder, trim, [(0.36, 0.78), (0.36, 0.9), (0.2, 0.92), (0.14, 1.0), (0.0, 1.0)], 12)
    _turned(builder, f"paper/{label}", [(1.0, 0.22), (1.01, 0.5)])
    return builder.build([name, "squeeze"])


def spray_bottle(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a spray bottle whose nozzle looks along +z; a slim neck under a broad head marks it from all sides."""
    builder = Builder("SprayBottle", size)
    width, height, depth = size
    name, tint = colour(rng, "blue", "green", "white", "orange", "pink", "teal", "yellow")
    _, trigger = colour(rng, *(word for word in ("white", "red", "black", "blue", "yellow") if word != name))
    across = float(np.clip(1.6 * width, 0.62 * depth, 0.8 * depth))
    middle = -depth / 2 + across / 2
    wall = [(0.0, 0.0), (0.94, 0.0), (1.0, 0.04), (1.0, 0.34), (0.9, 0.42), (0.5, 0.52), (0.3, 0.6), (0.28, 0.72)]
    body = lathed_oval([(r, y * height) for r, y in wall], width, across)
    band = lathed_oval([(1.012, 0.1 * height), (1.012, 0.32 * height)], width, across)
    builder.add(f"plastic/{tint}", shapes.translate(body, (0, 0, middle)))
    builder.add("paper/#ecebe6" if name != "white" else "paper/#4a6fa5", shapes.translate(band, (0, 0, middle)))
    _spray_head(builder, trigger, across, middle)
    return builder.build([name])


def _spray_head(builder: Builder, tint: str, across: float, middle: float) -> None:
    """Add a head wider than the neck, the trigger below it and the nozzle."""
    width, height, depth = builder.width, builder.height, builder.depth
    look, half = f"plastic/{tint}", 0.3 * width
    back, front = -depth / 2, depth / 2 - 0.08 * depth
    head = [
        (back, 0.83),
        (back, 0.92),
        (back + 0.14 * depth, 1.0),
        (front - 0.14 * depth, 1.0),
        (front, 0.96),
        (front, 0.88),
        (middle + 0.24 * across, 0.83),
    ]
    collar = shapes.cylinder(0.2 * across, 0.14 * height, (0, 0.77 * height, middle), segments=12)
    builder.add(look, collar, shapes.extrude([(z, y * height) for z, y in head], -half, half, "x"))
    pull = [
        (middle + 0.28 * across, 0.84),
        (front - 0.08 * depth, 0.88),
        (front - 0.02 * depth, 0.72),
        (front - 0.1 * depth, 0.58),
        (front - 0.18 * depth, 0.56),
        (front - 0.14 * depth, 0.7),
    ]
    builder.add(look, shapes.extrude([(z, y * height) for z, y in pull], -0.6 * half, 0.6 * half, "x"))
    tip = shapes.cylinder(0.035 * height, 0.1 * depth, (0, 0.92 * height, front + 0.03 * depth), "z", 8)
    builder.add("plastic/#1f2022" if tint != COLOURS["black"] else "plastic/#ecebe6", tip)


def shaker(category: str, dark: bool) -> Maker:
    """Return the maker of salt or pepper (`dark`) shakers: a pot with a metal cap, or a mill (pepper mills are
    wooden)."""

    def make(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
        builder = Builder(category, size)
        grain = "plastic/#2b2622" if dark else "plastic/#f6f5f2"
        kind = one_of(rng, ("glass", "ceramic", "mill"))
        if kind == "mill" and dark:
            return _pepper_mill(builder)
        body = [(0.0, 0.0), (0.98, 0.0), (1.0, 0.05), (0.74, 0.74), (0.0, 0.74)]
        if kind != "ceramic":
            _turned(builder, grain, [(0.0, 0.02), (0.9, 0.02), (0.78, 0.5), (0.0, 0.5)], 12)
            _turned(builder, PartStyle("glass", is_glass=True), body, 14)
        else:
            _turned(builder, "ceramic/#2d2f33" if dark else "ceramic/#f2f1ee", body)
        cap = "wood/pale" if kind == "mill" else "chrome"
        _turned(builder, cap, [(0.78, 0.74), (0.8, 0.84), (0.6, 0.96), (0.3, 1.0), (0.0, 1.0)])
        width, height, depth = size
        for angle in np.arange(6) * np.pi / 3:
            spot = (0.12 * width * np.cos(angle), 1.0 * height, 0.12 * depth * np.sin(angle))
            builder.add("plastic/#1f2022", shapes.disc(0.03 * width, spot, segments=6))
        letter = _letter(dark, 0.4 * width, 0.26 * height)
        lean = np.degrees(np.arctan2(0.26 * depth / 2, 0.69 * height))
        place = (0, 0.36 * height, 0.445 * depth)
        builder.add(
            "plastic/#ecebe6" if dark else "plastic/#2b2622", shapes.translate(shapes.rotate(letter, "x", -lean), place)
        )
        return builder.build(["glass"] if kind != "ceramic" else ["black" if dark else "white"])

    return make


def _pepper_mill(builder: Builder) -> Asset:
    wood = "wood/walnut"
    wall = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.06), (0.62, 0.32), (0.6, 0.42), (0.92, 0.6), (0.92, 0.66), (0.0, 0.66)]
    _turned(builder, wood, wall)
    _turned(builder, wood, [(0.0, 0.67), (0.8, 0.67), (0.9, 0.78), (0.7, 0.92), (0.0, 0.94)])
    _turned(builder, "chrome", [(0.7, 0.655), (0.7, 0.68)], 12)
    _turned(builder, "chrome", [(0.2, 0.92), (0.24, 0.97), (0.12, 1.0), (0.0, 1.0)], 10)
    return builder.build(["wooden", "mill"])


def _letter(dark: bool, width: float, height: float) -> shapes.Mesh:
    """Return a block letter P (`dark`) or S that faces +z; the viewer has +x on the left."""
    strokes = {
        True: [(-0.4, 0.0, 0.2, 1.0), (0.05, 0.4, 0.9, 0.2), (0.05, 0.02, 0.9, 0.2), (0.4, 0.21, 0.2, 0.55)],
        False: [
            (0.0, 0.4, 1.0, 0.2),
            (0.0, 0.0, 1.0, 0.2),
            (0.0, -0.4, 1.0, 0.2),
            (-0.4, 0.2, 0.2, 0.5),
            (0.4, -0.2, 0.2, 0.5),
        ],
    }[dark]
    return shapes.merge([shapes.panel(w * width, h * height, (-x * width, y * height, 0.0)) for x, y, w, h in strokes])


VASE_FORMS = {
    "classic": [(0.0, 0.0), (0.5, 0.0), (0.6, 0.04), (0.95, 0.4), (1.0, 0.55), (0.85, 0.72), (0.45, 0.88), (0.5, 1.0)],
    "bottle": [(0.0, 0.0), (0.7, 0.0), (0.95, 0.12), (1.0, 0.28), (0.8, 0.46), (0.3, 0.62), (0.24, 0.9), (0.32, 1.0)],
    "flute": [(0.0, 0.0), (0.55, 0.0), (0.5, 0.1), (0.5, 0.5), (0.66, 0.8), (1.0, 1.0)],
    "barrel": [(0.0, 0.0), (0.75, 0.0), (0.95, 0.25), (1.0, 0.5), (0.92, 0.78), (0.72, 0.95), (0.75, 1.0)],
    "cone": [(0.0, 0.0), (1.0, 0.0), (0.95, 0.05), (0.55, 0.75), (0.45, 0.94), (0.5, 1.0)],
    "bowl": [(0.0, 0.0), (0.45, 0.0), (0.5, 0.06), (0.85, 0.3), (1.0, 0.6), (0.97, 0.8), (0.85, 1.0)],
}


def vase(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a vase in one of several forms, perhaps banded."""
    builder = Builder("Vase", size)
    forms = ("bowl", "barrel") if size.y < 0.8 * size.x else ("classic", "bottle", "flute", "barrel", "cone")
    form = one_of(rng, forms)
    names = ("white", "blue", "teal", "brown", "red", "black", "cream", "green", "yellow", "light blue")
    name, tint = colour(rng, *names)
    glass = rng.random() < 0.15
    material = "glass/" + tint if glass else one_of(rng, (f"ceramic/{tint}", f"ceramic/{tint}", f"stone/{tint}"))
    outer = VASE_FORMS[form]
    mouth = outer[-1][0]
    inner = [(0.85 * mouth, 1.0), (0.75 * mouth, 0.85), (0.5 * mouth, 0.3), (0.0, 0.3)]
    _turned(builder, PartStyle(material, is_glass=glass), [*outer, *inner])
    if rng.random() < 0.45 and not glass:
        _, other = colour(rng, *names)
        k = len(outer) // 2
        (r0, y0), (r1, y1) = outer[k], outer[k + 1]
        _turned(builder, f"ceramic/{other}", [(1.015 * r0, y0), (1.015 * r1, y1)])
    return builder.build([name, form])


def watering_can(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a watering can: its rose to +z, its handle over the top and the back."""
    builder = Builder("WateringCan", size)
    width, height, length = size
    name, tint = colour(rng, "green", "red", "grey", "teal", "yellow", "blue")
    paint = f"metal/{tint}" if name == "grey" else f"plastic/{tint}"
    across = min(width, 0.52 * length)
    middle = -length / 2 + 0.18 * length + across / 2
    top = 0.66 * height
    body = lathed_oval([(0.0, 0.0), (0.98, 0.0), (1.0, 0.04 * height), (0.9, top), (0.82, top)], width, across)
    inside = lathed_oval([(0.82, top), (0.8, 0.8 * top), (0.0, 0.8 * top)], width, across)
    builder.add(paint, shapes.translate(body, (0, 0, middle)))
    builder.add("plastic/#2b2d30", shapes.translate(inside, (0, 0, middle)))
    start = middle + 0.4 * across
    end = length / 2 - 0.07 * length
    spout = [(0, 0.16 * height, start), (0, 0.45 * height, (start + end) / 2), (0, 0.8 * height, end)]
    builder.add(paint, shapes.tube(spout, [0.1 * width, 0.075 * width, 0.06 * width]))
    rose = shapes.cylinder(0.08 * width, 0.1 * length, segments=12, top=0.2 * width)
    builder.add(paint, shapes.translate(shapes.rotate(rose, "x", 48), (0, 0.84 * height, end + 0.025 * length)))
    angles = np.linspace(-0.1 * np.pi, 0.95 * np.pi, 12)
    back = -length / 2 + 0.03 * length
    center, reach = (back + middle + 0.3 * across) / 2, (middle + 0.3 * across - back) / 2
    loop = np.c_[
        0 * angles, top * 0.75 + (0.97 * height - top * 0.75) * np.sin(angles), center + reach * np.cos(angles)
    ]
    loop = np.concatenate([loop[1:], [[0, 0.18 * height, middle - 0.46 * across]]])
    builder.add(paint, shapes.tube(loop, 0.03 * height, 6))
    return builder.build([name])


def _turned(builder: Builder, look: PartStyle | str, profile: list[tuple[float, float]], segments: int = 18) -> None:
    """Add a turned part: radii as shares of half the width, heights as shares of the height."""
    points = [(radius, y * builder.height) for radius, y in profile]
    builder.add(look, lathed_oval(points, builder.width, builder.depth, segments))


MAKERS: dict[str, Maker] = {
    "Bottle": bottle,
    "PepperShaker": shaker("PepperShaker", dark=True),
    "SaltShaker": shaker("SaltShaker", dark=False),
    "SoapBottle": soap_bottle,
    "SprayBottle": spray_bottle,
    "Vase": vase,
    "WateringCan": lengthwise(watering_can),
    "WineBottle": wine_bottle,
}
