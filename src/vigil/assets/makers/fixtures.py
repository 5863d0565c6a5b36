"""What is built into kitchens and bathrooms: counters and sinks."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, Range
from vigil.assets.kernel.furniture_parts import (
    HANDLES,
    WOODS,
    Corner,
    Finish,
    front_board,
    handle,
    hollow,
    paint,
)
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

_RUN_M = 0.61
"""Depth (m) of each straight part of an L-shaped or U-shaped counter."""
_TOPS = (
    Finish("granite/#8d8a86", "grey"), Finish("granite/#4a4846", "dark"), Finish("marble/#eceae6", "white"),
    Finish("wood/beech", "wooden"), Finish("granite/#cdbfa8", "beige"),
)  # fmt: skip
_BASINS = (
    Finish("ceramic", "white"), Finish("ceramic", "white"), Finish("ceramic/#e9e4d6", "cream"),
    Finish("granite/#55585b", "dark grey"),
)  # fmt: skip

_BOWL = ((0.02, 0.06), (0.6, 0.08), (0.84, 0.25), (0.96, 0.62), (1.0, 1.0))
"""Profile of an oval bowl from its drain to its edge: (share of its half width, share of its depth)."""


def counter_top(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return cabinets under a worktop: straight, L-shaped (long side at -z, short side at +x) or U-shaped."""
    builder = Builder("CounterTop", size)
    top = one_of(rng, _TOPS)
    cabinet = (
        one_of(rng, WOODS) if rng.random() < 0.5 else paint(rng, "white", "cream", "grey", "navy", "green", "teal")
    )
    metal = one_of(rng, HANDLES).material
    is_framed = bool(rng.random() < 0.5)
    for run, facing in _runs(size):
        _counter_run(builder, run, facing, (top.material, cabinet.material, metal), is_framed)
    return builder.build((cabinet.word, f"{top.word} top"))


def _runs(size: Vec3) -> list[tuple[tuple[Range, Range], str]]:
    """Return ((x range, z range), direction that the part faces) for each straight part of a counter."""
    x, z = (-size.x / 2, size.x / 2), (-size.z / 2, size.z / 2)
    if min(size.x, size.z) < 1.9 * _RUN_M:
        return [((x, z), "+z")]
    back = (x, (z[0], z[0] + _RUN_M))
    right = ((x[1] - _RUN_M, x[1]), (z[0] + _RUN_M, z[1]))
    left = ((x[0], x[0] + _RUN_M), (z[0] + _RUN_M, z[1]))
    runs = [(back, "+z"), (right, "-x")]
    # AI2-THOR's U-shaped counters are two centimetres deeper than whole modules.
    return [*runs, (left, "+x")] if size.x > 2.3 and 0.012 < size.z % 0.3048 < 0.06 else runs


def _counter_run(
    builder: Builder, run: tuple[Range, Range], facing: str, looks: tuple[str, str, str], is_framed: bool
) -> None:
    """Add one straight part of a counter: cabinets and the worktop on them."""
    (x0, x1), (z0, z1) = run
    (top, cabinet, metal), height, thick = looks, builder.height, 0.04
    builder.block(top, (x0, x1), (height - thick, height), (z0, z1), 0.004 if x1 - x0 < 2 else 0.0)
    builder.solid((x0, 0, z0), (x1, height, z1))
    name = f"top{facing}"
    builder.surface(name, ((x0 + x1) / 2, height, (z0 + z1) / 2), (x1 - x0 - 0.02, z1 - z0 - 0.02))
    over, kick = 0.02, 0.09
    along = "x" if facing == "+z" else "z"
    low, high = [x0, 0.0, z0], [x1, height - thick, z1]
    axis, sign = (2, 1) if facing == "+z" else (0, 1 if facing == "+x" else -1)
    if sign > 0:
        high[axis] -= over
    else:
        low[axis] += over
    builder.add(cabinet, shapes.span((low[0], kick, low[2]), tuple(high)))
    kick_low, kick_high = list(low), list(high)
    (kick_high if sign > 0 else kick_low)[axis] -= sign * 0.05
    builder.add("plastic/#232427", shapes.span(tuple(kick_low), (kick_high[0], kick, kick_high[2])))
    length = (x1 - x0) if along == "x" else (z1 - z0)
    count = max(1, round(length / 0.5))
    face = high[axis] if sign > 0 else low[axis]
    for index in range(count):
        middle = -length / 2 + (index + 0.5) * length / count
        for part, look in zip(
            _front_unit(length / count, height - thick, kick, is_framed), (cabinet, metal), strict=True
        ):
            moved = shapes.translate(part, (middle, 0, 0))
            if facing != "+z":
                moved = shapes.rotate(moved, "y", 90 if facing == "+x" else -90)
                builder.add(look, shapes.translate(moved, (face, 0, (z0 + z1) / 2)))
            else:
                builder.add(look, shapes.translate(moved, ((x0 + x1) / 2, 0, face)))


def _front_unit(width: float, top: float, kick: float, is_framed: bool) -> tuple[shapes.Mesh, shapes.Mesh]:
    """Return two meshes: a drawer front above a door front, and their handles. The backs of the fronts are at z = 0."""
    half, gap, split = width / 2, 0.004, top - 0.17
    fronts = [
        front_board((-half + gap, kick + gap, 0.0), (half - gap, split - gap, 0.018), is_framed=is_framed),
        front_board((-half + gap, split + gap, 0.0), (half - gap, top - gap, 0.018), is_framed=False),
    ]
    grips = [
        handle("bar", (half - 0.06, split - 0.13, 0.018), 0.12, upright=True),
        handle("bar", (0.0, split + 0.09, 0.018), 0.14),
    ]
    return shapes.merge(fronts), shapes.merge(grips)


def sink(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a basin that is set into a counter; a tall sink stands on a pedestal or a cabinet."""
    builder = Builder("Sink", size)
    is_steel = size.y < 0.4 and rng.random() < 0.5
    finish = Finish("metal/steel", "steel") if is_steel else one_of(rng, _BASINS)
    material = finish.material
    width, height, depth = size
    bowl = min(0.17, 0.92 * height)
    floor = height - bowl
    shelf = 0.09 if height < 0.5 else min(0.3 * depth, 0.2)
    inner_x, inner_z = (-width / 2 + 0.035, width / 2 - 0.035), (-depth / 2 + shelf, depth / 2 - 0.035)
    if rng.random() < 0.4 and height < 0.4 and not is_steel:
        _oval_basin(builder, material, (inner_x, inner_z), (floor, height))
    else:
        _square_basin(builder, material, (inner_x, inner_z), (floor, height))
    middle = (inner_z[0] + inner_z[1]) / 2
    _drain(builder, bowl, (0.0, floor + 0.012, middle), (0.0, height - 0.25 * bowl, inner_z[0]))
    room = (0.75 * (inner_x[1] - inner_x[0]), 0.75 * (inner_z[1] - inner_z[0]))
    builder.surface("basin", (0, floor + 0.016, middle), room, is_inside=True)
    builder.surface("rim", (0, height, -depth / 2 + shelf / 2), (0.8 * width, shelf - 0.02))
    if height > 0.5:
        _sink_stand(builder, rng, floor)
    else:
        builder.solid((-width / 2, 0, -depth / 2), (width / 2, height, depth / 2))
    return builder.build((finish.word,))


def _drain(builder: Builder, bowl: float, drain: Corner, overflow: Corner) -> None:
    """Add a drain in the floor of a basin of depth `bowl` and an overflow in its back wall, with chrome rings."""
    collar = shapes.lathe([(0.022, 0.0), (0.034, 0.0), (0.034, 0.004), (0.024, 0.006), (0.022, 0.0)])
    hole = shapes.disc(0.023, (0, 0.002, 0), segments=14)
    for place, degrees, size in ((drain, 0.0, 1.0), (overflow, 90.0, min(0.75, 5.0 * bowl))):
        for look, part in (("chrome", collar), ("plastic/#17181a", hole)):
            turned = shapes.rotate(shapes.scale(part, (size, size, size)), "x", degrees)
            builder.add(look, shapes.translate(turned, place))


def _square_basin(builder: Builder, material: str, inner: tuple[Range, Range], y: Range) -> None:
    """Add a rectangular basin with a broad rim."""
    (ix0, ix1), (iz0, iz1) = inner
    (x0, x1), (z0, z1), (floor, top) = builder.across, builder.through, y
    rim = min(0.03, 0.3 * (top - floor))
    builder.add(
        material, hollow((ix0 - 0.015, floor, iz0 - 0.015), (ix1 + 0.015, top - 0.002, iz1 + 0.015), 0.014, "+y")
    )
    builder.block(material, (x0, x1), (top - rim, top), (z0, iz0), 0.006)
    builder.block(material, (x0, x1), (top - rim, top), (iz1, z1), 0.006)
    builder.block(material, (x0, ix0), (top - rim, top), (iz0 - 0.006, iz1 + 0.006))
    builder.block(material, (ix1, x1), (top - rim, top), (iz0 - 0.006, iz1 + 0.006))


def _oval_basin(builder: Builder, material: str, inner: tuple[Range, Range], y: Range) -> None:
    """Add a glazed block with an oval bowl in its top; its broad rim distinguishes it from a mixing bowl."""
    (ix0, ix1), (iz0, iz1) = inner
    floor, top = y
    outline = shapes.rounded_rectangle(builder.width, builder.depth, 0.2 * builder.depth, 5)
    outline = np.concatenate([outline, outline[:1]])
    angles = np.arctan2(outline[:, 1] / builder.depth, outline[:, 0] / builder.width)
    oval = np.c_[np.cos(angles) * (ix1 - ix0) / 2, np.sin(angles) * (iz1 - iz0) / 2]
    middle = np.array([(ix0 + ix1) / 2, (iz0 + iz1) / 2])

    def ring(flat: np.ndarray, level: float) -> np.ndarray:
        return np.insert(flat, 1, level, axis=1)

    bowl = [ring(middle + share * oval, floor + rise * (top - floor)) for share, rise in _BOWL]
    walls = [ring(share * outline, level) for share, level in ((1.0, top), (1.0, (top + floor) / 2), (0.94, floor))]
    for rings in (bowl, [bowl[-1], walls[0]], walls):
        builder.add(material, shapes.loft(np.stack(rings), cap=False))


def _sink_stand(builder: Builder, rng: np.random.Generator, floor: float) -> None:
    """Add what a washbasin stands on: a pedestal or a small cabinet."""
    width, depth = builder.width, builder.depth
    (x0, x1), (z0, z1) = builder.across, builder.through
    builder.solid((x0, floor, z0), (x1, builder.height, z1))
    if rng.random() < 0.5:
        foot = shapes.lathe(
            [(0, 0), (0.13, 0), (0.1, 0.06), (0.07, 0.4 * floor), (0.09, floor), (0, floor)], (0, 0, -0.1 * depth)
        )
        builder.add("ceramic", foot)
        builder.column(0.12, 0, floor, (0.0, -0.1 * depth))
        return
    finish = paint(rng, "white", "grey", "navy", "teal")
    builder.block(finish.material, (x0 + 0.02, x1 - 0.02), (0.06, floor), (z0, z1 - 0.04))
    for side in (-1, 1):
        ends = sorted((side * 0.004, side * (width / 2 - 0.03)))
        builder.add(
            finish.material, front_board((ends[0], 0.08, z1 - 0.04), (ends[1], floor - 0.02, z1 - 0.02), is_framed=True)
        )
        builder.add("metal/steel", handle("knob", (side * 0.05, 0.6 * floor, z1 - 0.02), 0.0))
    builder.solid((x0 + 0.02, 0, z0), (x1 - 0.02, floor, z1 - 0.02))


MAKERS: dict[str, Maker] = {
    "CounterTop": counter_top,
    "Sink": sink,
}
