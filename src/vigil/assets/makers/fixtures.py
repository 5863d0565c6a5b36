"""What is built into kitchens and bathrooms: counters, sinks and toilets."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker, closed
from vigil.assets.kernel.asset import Asset, Mesh
from vigil.assets.kernel.builder import Builder, PartStyle, Range
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
"""Materials of a stove knob's grip and pointer; neither has a colour that could be taken for heat."""


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


_GLAZE = "ceramic/#fffefc"
_LID_GAP_M = 0.004
"""Gap (m) between a toilet's seat and its lid."""


def toilet(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a toilet: a cistern at the back, a bowl, a seat, and a lid that opens upward."""
    builder = Builder("Toilet", size)
    width, height, depth = size
    (x0, x1), (z0, z1) = builder.across, builder.through
    rim = min(0.42, 0.54 * height)
    tank = min(0.2, 0.28 * depth)
    wide = min(0.37, 0.95 * width)
    seat = one_of(rng, ("plastic/#8d7b5a", "plastic/#6c7883", "wood/oak", "plastic/#2d2e31"))
    long = depth - tank - 0.03
    middle = z1 - long / 2
    _bowl(builder, wide, long, rim - 0.03, middle)
    oval = _oval(wide, long, middle)
    builder.add(seat, _ring(oval, 0.72, rim - 0.028, rim - 0.01))
    back = z0 + tank + 0.03
    joint = builder.hinge("lid", (1, 0, 0), (0, rim - 0.006, back + 0.015), -90.0)
    lid = PartStyle(seat, joint)
    low, high = rim - 0.01 + _LID_GAP_M, rim + 0.012
    tiers = ((0.97, low), (1.0, low + 0.004), (1.0, low + 0.009), (0.96, high - 0.003), (0.86, high))
    builder.add(lid, shapes.loft(np.stack([closed(_shrunk(oval, share), y) for share, y in tiers])))
    buffers = [(x, rim - 0.01 + _LID_GAP_M / 2, z1 - 0.2 * long) for x in (-0.3 * wide, 0.3 * wide)]
    builder.add(seat, *(shapes.cylinder(0.012, _LID_GAP_M, at, segments=8) for at in buffers))
    for x in (-0.2 * wide, 0.2 * wide):
        hinge = shapes.cylinder(0.013, 0.04, (x, rim - 0.008, back + 0.012), "x", 10)
        builder.add("chrome", hinge)
    _cistern(builder, rim, tank)
    builder.block(_GLAZE, (-0.1, 0.1), (0.1, rim - 0.01), (z0 + 0.02, back + 0.025), 0.012)
    if rng.random() < 0.5:
        builder.add("chrome", shapes.cylinder(0.022, 0.012, (0, height - 0.004, z0 + tank / 2), segments=14))
    else:
        lever = shapes.box((0.07, 0.014, 0.014), (0.38 * width, height - 0.08, z0 + tank + 0.022), 0.004)
        builder.add("chrome", lever)
    builder.solid((x0, rim - 0.05, z0), (x1, height, z0 + tank + 0.02))
    builder.solid((-0.12, 0, z0 + 0.02), (0.12, rim, back + 0.05))
    builder.prism(_oval(wide, long, middle, 8), 0, rim)
    builder.prism(_oval(wide, long, middle, 8), rim - 0.01, rim + 0.012, joint)
    builder.surface("cistern", (0, height, z0 + tank / 2 + 0.01), (width - 0.06, tank - 0.03))
    return builder.build(("white",))


def _cistern(builder: Builder, rim: float, tank: float) -> None:
    """Add the water tank at the back of a toilet, with the tank's lid."""
    width, height, z = builder.width, builder.height, builder.through[0] + tank / 2 + 0.01
    body = shapes.rounded_box((min(0.42, width), height - rim - 0.01, tank), (0, (height + rim) / 2 - 0.02, z), 0.025)
    builder.add(_GLAZE, body)
    builder.add(_GLAZE, shapes.rounded_box((width, 0.035, tank + 0.02), (0, height - 0.0175, z), 0.014))


def _oval(width: float, length: float, middle: float, count: int = 20) -> np.ndarray:
    """Return an egg-shaped outline (n, 2) of x, z; its back is blunter than its front."""
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x = width / 2 * np.cos(angles) * np.where(np.sin(angles) < 0, 1.0, 1 - 0.12 * np.sin(angles))
    return np.stack([x / np.abs(x).max() * width / 2, middle + length / 2 * np.sin(angles)], 1)


def _shrunk(outline: np.ndarray, share: float) -> np.ndarray:
    middle = outline.mean(0)
    return (outline - middle) * share + middle


def _ring(outline: np.ndarray, inner: float, low: float, high: float) -> Mesh:
    """Return a flat ring between an outline and the same outline made smaller by the factor `inner`."""
    hole = _shrunk(outline, inner)
    loops = [closed(hole, low), closed(hole, high), closed(outline, high), closed(outline, low), closed(hole, low)]
    return shapes.merge(shapes.loft(np.stack(loops[i : i + 2]), cap=False) for i in range(4))


def _bowl(builder: Builder, wide: float, long: float, rim: float, middle: float) -> None:
    """Add a toilet's bowl: a foot that widens to an oval rim, hollow, with water at the bottom."""
    outline = _oval(wide, long, middle)

    def at(height: float, share: float) -> np.ndarray:
        shift = np.array([0.0, -0.12 * long * (1 - share)])
        return closed(_shrunk(outline, share) + shift, height)

    outer = [at(rim, 1.0), at(0.82 * rim, 0.98), at(0.45 * rim, 0.68), at(0.12 * rim, 0.6), at(0.0, 0.64)]
    inner = [at(0.5 * rim, 0.3), at(0.7 * rim, 0.66), at(rim, 0.8)]
    builder.add(
        _GLAZE,
        shapes.loft(np.stack(outer), cap=False),
        shapes.loft(np.stack(inner), cap=False),
        shapes.loft(np.stack([at(rim, 0.8), at(rim, 1.0)]), cap=False),
    )
    water = at(0.52 * rim, 0.34)[:-1]
    builder.add("water", shapes.extrude(water[:, [0, 2]], 0.5 * rim, 0.52 * rim))


MAKERS: dict[str, Maker] = {
    "CounterTop": counter_top,
    "Sink": sink,
    "Toilet": toilet,
}
