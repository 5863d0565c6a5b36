"""Bottles, shakers, vases and cans."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, lathed_oval, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import colour, one_of
from vigil.base.geometry import Vec3

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
    "Vase": vase,
    "WateringCan": lengthwise(watering_can),
}
