"""Crockery: bowls, plates, cups and mugs, hollow, with a place inside."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, Silhouette, lathed_oval, lengthwise
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.palette import COLOURS, colour, one_of
from vigil.base.geometry import Vec3


def hollow(builder: Builder, width: float, depth: float, floor: float, x: float = 0.0, z: float = 0.0) -> None:
    """Add the solids of a round open vessel at (x, z): its bottom up to `floor`, and four walls around."""
    height = builder.height
    left, right, back, front = x - width / 2, x + width / 2, z - depth / 2, z + depth / 2
    wall = 0.08 * min(width, depth)
    builder.solid((left, 0, back), (right, floor, front))
    builder.solid((left, floor, back), (left + wall, height, front))
    builder.solid((right - wall, floor, back), (right, height, front))
    builder.solid((left, floor, back), (right, height, back + wall))
    builder.solid((left, floor, front - wall), (right, height, front))


def bowl(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a bowl: ceramic in two colours, banded, wooden, copper, or of tinted glass with a solid rim and foot."""
    builder = Builder("Bowl", size)
    width, height, depth = size
    kind = one_of(rng, ("ceramic", "ceramic", "banded", "wooden", "metal", "glass"))
    power = float(rng.choice([0.45, 0.6, 0.85]))
    rise = np.linspace(0.0, 1.0, 7)
    outer = [(0.48 + 0.52 * t**power, 0.05 * height + 0.95 * height * t) for t in rise]
    inner = [(0.38 + 0.56 * t**power, 0.13 * height + 0.87 * height * t) for t in rise]
    shell: Silhouette = [(0.0, 0.0), (0.46, 0.0), *outer]
    inside: Silhouette = [outer[-1], *reversed(inner), (0.0, 0.13 * height)]
    name, tint = colour(rng, "navy", "blue", "teal", "red", "yellow", "green", "orange", "purple", "light blue")
    looks = {
        "ceramic": (f"ceramic/{tint}", f"ceramic/{one_of(rng, (COLOURS['white'], tint))}"),
        "banded": (f"ceramic/{COLOURS['white']}", f"ceramic/{COLOURS['white']}"),
        "wooden": ("wood/walnut", "wood/teak"),
        "metal": ("metal/copper", "metal/brass"),
        "glass": (f"glass/{tint}", f"glass/{tint}"),
    }[kind]
    for material, profile in zip(looks, (shell, inside), strict=True):
        builder.add(PartStyle(material, is_glass=kind == "glass"), lathed_oval(profile, width, depth))
    if kind == "banded":
        band = [(outer[k][0] * 1.015, outer[k][1]) for k in (3, 4)]
        builder.add(f"ceramic/{tint}", lathed_oval(band, width * 0.999, depth * 0.999))
    if kind in ("banded", "glass"):
        lip, hollow_edge = 1.012 * outer[-1][0], 0.985 * inner[-1][0]
        top = 1.015 * height
        rim = [(lip, 0.93 * height), (lip, top), (hollow_edge, top), (hollow_edge, 0.95 * height)]
        builder.add(f"ceramic/{tint}", lathed_oval(rim, width, depth))
    if kind == "glass":
        foot = [(0.0, 0.0), (0.46, 0.0), (0.48, 0.05 * height), (0.4, 0.1 * height), (0.0, 0.1 * height)]
        builder.add(f"ceramic/{tint}", lathed_oval(foot, width, depth))
    builder.surface("inside", (0, 0.16 * height, 0), (0.56 * width, 0.56 * depth), is_inside=True)
    hollow(builder, width, depth, 0.13 * height)
    is_plain = kind == "ceramic" and tint in looks[1]
    return builder.build([name] if is_plain else [kind])


def plate(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a plate with a sunk middle and a rim: coloured with a white edge, or white with lines or a broad rim.

    The edge always differs in colour from the middle, so that a plate shows on a counter of its own colour.
    """
    builder = Builder("Plate", size)
    width, height, depth = size
    name, tint = colour(rng, "blue", "red", "green", "teal", "navy", "purple", "brown", "orange")
    kind = one_of(rng, ("white", "coloured", "rim", "ring"))
    base = tint if kind == "coloured" else COLOURS["white"]
    rim = tint if kind in ("coloured", "rim") else base
    edge = COLOURS["white"] if kind == "coloured" else tint
    sunk = 0.42 * height
    builder.add(
        f"ceramic/{base}",
        lathed_oval([(0.0, 0.0), (0.62, 0.0), (0.96, 0.76 * height)], width, depth, 24),
        lathed_oval([(0.69, 0.55 * height), (0.62, sunk), (0.0, sunk)], width, depth, 24),
    )
    lip = [(0.96, 0.76 * height), (0.99, 0.82 * height), (1.0, 0.93 * height), (0.985, height), (0.93, 0.92 * height)]
    builder.add(f"ceramic/{edge}", lathed_oval(lip, width, depth, 24))
    builder.add(f"ceramic/{rim}", lathed_oval([(0.93, 0.92 * height), (0.69, 0.55 * height)], width, depth, 24))
    if kind != "rim":
        far, near = (0.86, 0.78) if kind == "ring" else (0.73, 0.69)
        slope = (0.92 - 0.55) / (0.93 - 0.69)
        ring = [(radius, (0.57 + (radius - 0.69) * slope) * height) for radius in (far, near)]
        builder.add(f"ceramic/{edge}", lathed_oval(ring, width, depth, 24))
    builder.surface("top", (0, sunk, 0), (0.72 * width, 0.72 * depth))
    builder.octagon(width, depth, 0.0, sunk)
    return builder.build([name] if kind == "coloured" else [kind])


def mug(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a mug with its handle along the longer floor axis."""
    builder = Builder("Mug", size)
    length, height, width = size.z, size.y, size.x
    across = min(width, 0.76 * length)
    middle = -length / 2 + across / 2
    name, tint = colour(rng, "white", "red", "blue", "yellow", "green", "navy", "black", "teal", "orange", "cream")
    inside = one_of(rng, (tint, COLOURS["white"]))
    taper = float(rng.choice([1.0, 0.9, 0.82]))
    outer = [(0.0, 0.0), (0.94 * taper, 0.0), (taper, 0.05 * height), (1.0, height)]
    inner = [(1.0, height), (0.9, height), (0.9 * taper, 0.08 * height), (0.0, 0.08 * height)]
    builder.add(f"ceramic/{tint}", shapes.translate(lathed_oval(outer, width, across), (0, 0, middle)))
    builder.add(f"ceramic/{inside}", shapes.translate(lathed_oval(inner, width, across), (0, 0, middle)))
    if rng.random() < 0.4:
        _, other = colour(rng, "white", "red", "yellow", "black", "light blue")
        low, high = sorted(rng.uniform(0.25, 0.8, 2) * height)
        high = max(high, low + 0.12 * height)
        radius = [1.012 * (taper + (1 - taper) * y / height) for y in (low, high)]
        band = lathed_oval([(radius[0], low), (radius[1], high)], width, across)
        builder.add(f"ceramic/{other}", shapes.translate(band, (0, 0, middle)))
    angles = np.linspace(-np.pi / 2, np.pi / 2, 8)
    thick = min(0.075 * height, 0.3 * (length - across))
    start = middle + 0.46 * across * taper
    reach = length / 2 - thick - start
    loop = np.c_[np.zeros(8), 0.52 * height + 0.3 * height * np.sin(angles), start + reach * np.cos(angles)]
    builder.add(f"ceramic/{tint}", shapes.tube(loop, thick))
    builder.surface("inside", (0, 0.08 * height, middle), (0.55 * width, 0.55 * across), is_inside=True)
    hollow(builder, width, across, 0.08 * height, z=middle)
    return builder.build([name])


def cup(size: Vec3, rng: np.random.Generator, _levels: Sequence[float]) -> Asset:
    """Return a cup without a handle: tumbler of glass, plastic, ceramic or steel, or a paper cup."""
    builder = Builder("Cup", size)
    width, height, depth = size
    kind = one_of(rng, ("glass", "plastic", "ceramic", "paper", "metal"))
    name, tint = colour(rng, "red", "blue", "green", "yellow", "orange", "teal", "purple", "pink")
    foot = {"paper": 0.68, "glass": 0.8, "metal": 0.92}.get(kind, 0.85)
    wall = 0.05 if kind == "paper" else 0.09
    floor = 0.06 * height
    material = {
        "glass": one_of(rng, ("glass", f"glass/{tint}")),
        "paper": f"paper/{COLOURS['white']}",
        "metal": "metal/brushed",
    }.get(kind, f"{kind}/{tint}")
    profile: Silhouette = [
        (0.0, 0.0),
        (foot, 0.0),
        (1.0, height),
        (1.0 - wall, height),
        (foot - wall, floor),
        (0.0, floor),
    ]
    builder.add(PartStyle(material, is_glass=kind == "glass"), lathed_oval(profile, width, depth))
    if kind in ("paper", "ceramic"):
        band = COLOURS["brown"] if kind == "paper" else COLOURS["white"]
        low, high = (0.25, 0.7) if kind == "paper" else (0.78, 0.9)
        sides = [(1.015 * (foot + (1 - foot) * share), share * height) for share in (low, high)]
        builder.add(f"paper/{band}" if kind == "paper" else f"ceramic/{band}", lathed_oval(sides, width, depth))
    builder.surface("inside", (0, floor, 0), (1.2 * foot * width / 2, 1.2 * foot * depth / 2), is_inside=True)
    hollow(builder, width, depth, floor)
    return builder.build([kind] if kind in ("glass", "metal", "paper") else [name])


MAKERS: dict[str, Maker] = {
    "Bowl": bowl,
    "Cup": cup,
    "Mug": lengthwise(mug),
    "Plate": plate,
}
