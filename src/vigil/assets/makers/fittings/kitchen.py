"""Kitchen fittings: counters, sinks and stoves."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset, Glow
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.furniture_parts import (
    HANDLES,
    WOODS,
    Corner,
    Finish,
    add_case,
    front_board,
    handle,
    hollow,
    lining,
    paint,
)
from vigil.assets.kernel.palette import HOT, one_of
from vigil.base.geometry import Vec3

_RUN_M = 0.61
"""Depth (m) of a counter's run in an L or a U."""
_TOPS = (
    Finish("granite/#8d8a86", "grey"), Finish("granite/#4a4846", "dark"), Finish("marble/#eceae6", "white"),
    Finish("wood/beech", "wooden"), Finish("granite/#cdbfa8", "beige"),
)  # fmt: skip
_BASINS = (
    Finish("ceramic", "white"), Finish("ceramic", "white"), Finish("ceramic/#e9e4d6", "cream"),
    Finish("granite/#55585b", "dark grey"),
)  # fmt: skip

_BOWL = ((0.02, 0.06), (0.6, 0.08), (0.84, 0.25), (0.96, 0.62), (1.0, 1.0))
"""Profile of an oval bowl from its drain to its edge, as shares of its half width and of its depth."""
_COIL_TURNS = 4
_KNOBS = (
    ("plastic/#232528", "plastic/#f4f4f0"),
    ("metal/steel", "plastic/#232528"),
    ("plastic/#ecebe6", "plastic/#5c5f63"),
)
"""Materials of a stove knob's grip and pointer; neither has a colour that could be taken for heat."""


def counter_top(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return base cabinets under a worktop: straight, L-shaped (long side at -z, leg at +x) or U-shaped."""
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
    """Return a counter's rectangles ((x range), (z range)), each with the side that it faces."""
    x, z = (-size.x / 2, size.x / 2), (-size.z / 2, size.z / 2)
    if min(size.x, size.z) < 1.9 * _RUN_M:
        return [((x, z), "+z")]
    back = (x, (z[0], z[0] + _RUN_M))
    right = ((x[1] - _RUN_M, x[1]), (z[0] + _RUN_M, z[1]))
    left = ((x[0], x[0] + _RUN_M), (z[0] + _RUN_M, z[1]))
    runs = [(back, "+z"), (right, "-x")]
    return [*runs, (left, "+x")] if _is_u_shaped(size) else runs


def _is_u_shaped(size: Vec3) -> bool:
    """Return whether a deep counter has two legs: AI2-THOR's U counters are two centimetres deeper than whole
    modules."""
    return size.x > 2.3 and 0.012 < size.z % 0.3048 < 0.06


def _counter_run(
    builder: Builder, run: tuple[Range, Range], facing: str, looks: tuple[str, str, str], is_framed: bool
) -> None:
    """Add one straight run of cabinets with its worktop."""
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
    """Return a drawer front over a door front, and their handles; their backs are at z = 0."""
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
    """Return a basin set into a counter; a tall one stands on a pedestal or in a vanity cabinet."""
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
    """Add a drain in the floor of a basin `bowl` deep and an overflow in its rear wall, both dark in rings of
    chrome."""
    collar = shapes.lathe([(0.022, 0.0), (0.034, 0.0), (0.034, 0.004), (0.024, 0.006), (0.022, 0.0)])
    hole = shapes.disc(0.023, (0, 0.002, 0), segments=14)
    for place, degrees, size in ((drain, 0.0, 1.0), (overflow, 90.0, min(0.75, 5.0 * bowl))):
        for look, part in (("chrome", collar), ("plastic/#17181a", hole)):
            turned = shapes.rotate(shapes.scale(part, (size, size, size)), "x", degrees)
            builder.add(look, shapes.translate(turned, place))


def _square_basin(builder: Builder, material: str, inner: tuple[Range, Range], y: Range) -> None:
    """Add a trough with a broad rim."""
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
    """Add a block of glaze with an oval bowl in its top; the broad ledge tells it from a mixing bowl."""
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
    """Add the support of a washbasin: a pedestal or a small cabinet."""
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


def stove(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a cooker: four plates that glow, knobs in front, an oven behind a glass door that folds down."""
    builder = Builder("Stove", size)
    shell = one_of(
        rng, (Finish("plastic/#f1f1ee", "white"), Finish("metal/steel", "steel"), Finish("plastic/#2a2c2f", "black"))
    )
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    face = z1 - 0.05
    low, high = 0.12, height - 0.14
    oven_front = face - 0.03
    add_case(builder, shell.material, (x0, low, z0), (x1, high, oven_front), 0.05)
    builder.block(shell.material, (x0, x1), (0.0, low), (z0, face - 0.02))
    builder.block("plastic/#1b1c1e", (x0 + 0.02, x1 - 0.02), (0.01, 0.02), (z0, face - 0.01))
    builder.block(shell.material, (x0, x1), (high, height - 0.022), (z0, face), 0.004)
    builder.block("plastic/#17181a", (x0, x1), (height - 0.022, height - 0.004), (z0, face), 0.003)
    inner_low, inner_high = (x0 + 0.051, low + 0.051, z0 + 0.051), (x1 - 0.051, high - 0.051, oven_front)
    builder.add("metal/#3d4044", lining(inner_low, inner_high))
    rack = low + 0.4 * (high - low)
    wires = np.linspace(inner_low[0] + 0.02, inner_high[0] - 0.02, 9)
    wire, middle = (0.005, 0.005, oven_front - z0 - 0.12), (z0 + oven_front) / 2
    builder.add("chrome", *(shapes.box(wire, (x, rack - 0.0025, middle)) for x in wires))
    room = (x1 - x0 - 0.14, oven_front - z0 - 0.14)
    builder.surface("rack", (0, rack, middle), room, high - rack - 0.06, needs_opening=True)
    _plates(builder, face)
    _oven_door(builder, shell, (low + 0.01, high - 0.004), (oven_front, face))
    for index in range(5):
        x = x0 + (index + 0.5) * (x1 - x0) / 5
        builder.add("plastic/#2b2d30", shapes.cylinder(0.022, 0.026, (x, height - 0.08, face + 0.013), "z", 14))
        builder.block(
            "plastic/#e6e6e2", (x - 0.003, x + 0.003), (height - 0.08, height - 0.06), (face + 0.02, face + 0.028)
        )
    lamp = shapes.cylinder(0.007, 0.008, (x0 + 0.02, height - 0.05, face + 0.002), "z", 10)
    builder.add(PartStyle("plastic/#5a2320", on="glow/#ff3b20", bears_toggle=True), lamp)
    builder.solid((x0, 0, z0), (x1, low, face - 0.02))
    builder.solid((x0, high, z0), (x1, height, face))
    builder.surface("hob", (0, height, (z0 + face) / 2), (x1 - x0 - 0.06, face - z0 - 0.06))
    builder.glow = Glow(Vec3(0, height + 0.05, 0), (1.0, 0.45, 0.2), 0.08)
    return builder.build((shell.word,))


def _plates(builder: Builder, face: float) -> None:
    """Add four hot plates on the hob, two large and two small."""
    (x0, x1), z0, height = builder.across, builder.through[0], builder.height
    plates, rings = [], []
    for index, (part_x, part_z) in enumerate(((0.27, 0.27), (0.73, 0.27), (0.27, 0.74), (0.73, 0.74))):
        radius = 0.1 if index in (1, 2) else 0.08
        at = (x0 + part_x * (x1 - x0), height - 0.004, z0 + part_z * (face - z0))
        plates.append(shapes.lathe([(0, 0), (radius, 0), (radius, 0.003), (0, 0.003)], at, 20))
        rings.append(shapes.lathe([(radius, 0), (radius + 0.008, 0), (radius + 0.008, 0.004), (radius, 0.004)], at, 20))
    builder.add(PartStyle("metal/#4d5053", on=HOT, bears_toggle=True), *plates)
    builder.add("metal/#8d9195", *rings)


def _oven_door(builder: Builder, shell: Finish, y: Range, z: Range) -> None:
    """Add the oven's door, hinged at its foot."""
    (x0, x1), (y0, y1), (z0, z1) = builder.across, y, z
    joint = builder.hinge("oven", (1, 0, 0), (0, y0, z0), 88.0)
    frame = PartStyle(shell.material, joint, bears_open=True)
    rim = 0.16 * (y1 - y0)
    builder.block(frame, (x0 + 0.006, x1 - 0.006), (y0, y0 + rim), z)
    builder.block(frame, (x0 + 0.006, x1 - 0.006), (y1 - 1.6 * rim, y1), z)
    builder.block(frame, (x0 + 0.006, x0 + 0.08), (y0 + rim, y1 - 1.6 * rim), z)
    builder.block(frame, (x1 - 0.08, x1 - 0.006), (y0 + rim, y1 - 1.6 * rim), z)
    pane = PartStyle("glass/#101214", joint, bears_open=True, is_glass=True)
    builder.block(pane, (x0 + 0.08, x1 - 0.08), (y0 + rim, y1 - 1.6 * rim), (z1 - 0.014, z1 - 0.004))
    bar = PartStyle("chrome", joint, bears_open=True)
    builder.add(bar, shapes.cylinder(0.011, 0.78 * (x1 - x0), (0, y1 - 0.7 * rim, z1 + 0.036), "x", 10))
    for side in (-1, 1):
        builder.add(bar, shapes.box((0.014, 0.014, 0.04), (side * 0.36 * (x1 - x0), y1 - 0.7 * rim, z1 + 0.018)))
    builder.solid((x0, y0, z0), (x1, y1, z1), joint)


def stove_burner(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return one hot plate: a coil in a dish, or a solid plate; it glows while on."""
    builder = Builder("StoveBurner", size)
    height, radius = size.y, 0.5
    dish = shapes.lathe(
        [(0, 0), (0.98 * radius, 0), (radius, 0.35 * height), (0.9 * radius, 0.4 * height), (0, 0.3 * height)],
        segments=24,
    )
    builder.add("chrome", shapes.scale(dish, (size.x, 1, size.z)))
    hot = PartStyle("metal/#3a3c3f", on=HOT, bears_toggle=True)
    if rng.random() < 0.6:
        turns = np.linspace(0, 2 * np.pi * _COIL_TURNS, 16 * _COIL_TURNS + 1)
        reach = np.minimum(0.16 + 0.88 * turns / turns[-1], 0.82)  # the last turn is a ring
        thick = min(0.3 * height, 0.032 * size.x)
        level = np.full(len(turns), height - thick)
        coil = np.c_[reach * size.x / 2 * np.cos(turns), level, reach * size.z / 2 * np.sin(turns)]
        builder.add(hot, shapes.tube(coil, thick, 4))
        builder.add("metal/#6f7377", shapes.cylinder(0.06 * size.x, 0.5 * height, (0, 0.55 * height, 0), segments=12))
    else:
        plate = [(0, 0.3 * height), (0.42, 0.3 * height), (0.42, 0.9 * height), (0.4, height), (0.3, height),
                 (0.29, 0.9 * height), (0.27, 0.9 * height), (0.26, height), (0.13, height), (0.11, 0.85 * height),
                 (0, 0.85 * height)]  # fmt: skip
        builder.add(hot, shapes.scale(shapes.lathe(plate, segments=24), (size.x, 1, size.z)))
    builder.surface("plate", (0, height, 0), (0.7 * size.x, 0.7 * size.z))
    builder.glow = Glow(Vec3(0, height, 0), (1.0, 0.45, 0.2), 0.05)
    return builder.build()


def stove_knob(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a round knob with a ridge for the fingers: upright while off; while on it lies across a glowing dial."""
    builder = Builder("StoveKnob", size)
    width, height, depth = size
    grip, mark = one_of(rng, _KNOBS)
    dial = shapes.cylinder(0.5, 0.15 * depth, (0, 0, 0.075 * depth), "z", 24)
    builder.add(PartStyle("metal/#777b80", on=HOT, bears_toggle=True), _oval(dial, width, height))
    cap = shapes.cylinder(0.4, 0.6 * depth, (0, 0, 0.45 * depth), "z", 24, top=0.36)
    builder.add(grip, _oval(cap, width, height))
    ridge = shapes.rounded_box((0.24, 0.74, 0.4 * depth), (0, 0, 0.8 * depth), 0.06)
    line = shapes.box((0.12, 0.34, 0.02 * depth), (0, 0.17, 0.995 * depth))
    for shown, degrees in (("off", 0.0), ("on", 90.0)):
        for look, part in ((grip, ridge), (mark, line)):
            style = PartStyle(look, bears_toggle=True, shown="on" if shown == "on" else "off")
            builder.add(style, _oval(shapes.rotate(part, "z", degrees), width, height))
    return builder.build()


def _oval(part: shapes.Mesh, width: float, height: float) -> shapes.Mesh:
    return shapes.translate(shapes.scale(part, (width, height, 1)), (0, height / 2, 0))


MAKERS = {
    "CounterTop": counter_top,
    "Sink": sink,
    "Stove": stove,
    "StoveBurner": stove_burner,
    "StoveKnob": stove_knob,
}
