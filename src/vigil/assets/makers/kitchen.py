"""Fridges, kitchen counters and trolleys."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.furniture_parts import (
    HANDLES,
    WOODS,
    Corner,
    Finish,
    add_case,
    add_shelves,
    front_board,
    handle,
    lining,
    paint,
    shelf_heights,
    wood,
)
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

SHELLS = (
    Finish("plastic/#f1f1ee", "white"),
    Finish("metal/steel", "stainless steel"),
    Finish("plastic/#26282b", "black"),
    Finish("metal/#8f9398", "grey"),
)
_RETRO = (Finish("plastic/#a8322d", "red"), Finish("plastic/#e9dfc3", "cream"), Finish("plastic/#9cc4bd", "mint green"))
_LINER = "plastic/#eef1f2"
_FRIDGE_WALL, _FRIDGE_BASE = 0.045, 0.05
_GLASS_SHELF = "glass/#6f9aa6"

_NOTES_M, _DISPENSER_TOP_M = 1.5, 1.42
"""Greatest heights (m) of the upper edges of a fridge's notes and of its water dispenser."""
_NOTES = (
    ("paper/#f2e27a", 0.09, 0.09, 0.0, 0.0),
    ("picture/4", 0.15, 0.12, 0.2, 0.06),
    ("paper/#b9dcef", 0.11, 0.15, -0.04, 0.16),
)
"""Row for each note: paper, width and height (m), offset to the side (as a share of the door's width) and distance (m)
below the top."""
_MAGNETS = ("plastic/#c8322e", "plastic/#2f5ba0")


@dataclass(frozen=True, slots=True)
class _Door:
    """A fridge's door: the name of its joint, its extent, and the side (-1 or 1 along x) of its hinge."""

    name: str
    x: Range
    y: Range
    hinge: int


def fridge(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a refrigerator: with the freezer above, with the freezer below, or with two doors side by side.

    Notes under magnets, a badge and often a water dispenser distinguish its front from the front of a wardrobe.
    """
    builder = Builder("Fridge", size)
    shell = one_of(rng, (*SHELLS[:2], *SHELLS, *SHELLS[:2], *_RETRO))
    width, height, depth = size
    is_wide = width > 0.88
    style = "double" if is_wide and rng.random() < 0.6 else one_of(rng, ("top", "bottom", "top"))
    wall, door, grip = _FRIDGE_WALL, 0.055, 0.045
    face = depth / 2 - grip
    body = face - door
    (x0, x1), z0 = builder.across, builder.through[0]
    base = _FRIDGE_BASE
    add_case(builder, shell.material, (x0, base, z0), (x1, height, body), wall)
    builder.block("plastic/#1d1e20", (x0 + 0.02, x1 - 0.02), (0, base), (z0 + 0.02, body - 0.006))
    slats = np.linspace(x0 + 0.05, x1 - 0.05, 16)
    for x in slats:
        builder.block(shell.material, (x - 0.004, x + 0.004), (0.01, base - 0.01), (body - 0.006, body))
    low: Corner = (x0 + wall + 0.001, base + wall + 0.001, z0 + wall + 0.001)
    high: Corner = (x1 - wall - 0.001, height - wall - 0.001, body)
    builder.add(_LINER, lining(low, high))
    heights = shelf_heights(levels, low[1], high[1], 4 if height > 1.5 else 3)
    add_shelves(builder, _GLASS_SHELF, low, (high[0], high[1], body - 0.11), heights, needs_opening=True)
    for y in heights:
        builder.block(_LINER, (low[0], high[0]), (y - 0.022, y + 0.004), (body - 0.125, body - 0.11))
    if not levels and heights[0] - 0.04 - low[1] > 0.08:  # a clear vegetable drawer
        crisper = shapes.span((low[0] + 0.01, low[1], body - 0.14), (high[0], heights[0] - 0.04, body - 0.13))
        builder.add(_GLASS_SHELF, crisper)
    builder.solid((x0, 0, z0), (x1, base, body))
    builder.surface("top", (0, height, (z0 + body) / 2), (width - 0.04, body - z0 - 0.04))
    doors = _fridge_doors(builder, shell, style, 1 if rng.random() < 0.5 else -1, (body, face))
    has_dispenser = style == "double" or (shell not in _RETRO and bool(rng.random() < 0.6))
    _fridge_front(builder, rng, doors, face, has_dispenser=has_dispenser)
    return builder.build((shell.word,))


def _fridge_doors(builder: Builder, shell: Finish, style: str, side: int, z: Range) -> list[_Door]:
    """Add two doors, side by side or one above the other; return the doors, the larger first."""
    (x0, x1), height, body = builder.across, builder.height, z[0]
    base, wall, gap = _FRIDGE_BASE, _FRIDGE_WALL, 0.006
    back = (body - 0.012, body)
    if style == "double":
        doors = [_Door("left", (gap, x1), (base, height), 1), _Door("right", (x0, -gap), (base, height), -1)]
        builder.block(PartStyle(shell.material, "left"), (-0.03, 0.03), (base + wall, height - wall), back)
    else:
        split = {"top": 0.68, "bottom": 0.36}[style] * height
        # The free edge swings out a little at first, and stays within the fridge's sides all the same.
        x = (x0 + gap, x1) if side > 0 else (x0, x1 - gap)
        lower = _Door("lower", x, (base, split - gap / 2), side)
        upper = _Door("upper", x, (split + gap / 2, height), side)
        doors = [upper, lower] if style == "bottom" else [lower, upper]
        builder.block(shell.material, (x0 + wall, x1 - wall), (split - 0.012, split + 0.012), back)
    for door in doors:
        _fridge_door(builder, shell, door, z)
    return doors


def _fridge_door(builder: Builder, shell: Finish, door: _Door, z: Range) -> None:
    """Add a thick door with a handle outside and racks inside.

    The door's hinge is at an edge of the fridge's box, so that neither the door nor its handle leaves the box's sides.
    """
    (x0, x1), (y0, y1), (z0, z1), hinge = door.x, door.y, z, door.hinge
    joint = builder.hinge(door.name, (0, 1, 0), (x1 if hinge > 0 else x0, 0, builder.through[1]), hinge * 90.0)
    skin = PartStyle(shell.material, joint)
    builder.block(skin, (x0, x1), (y0, y1), (z0 + 0.006, z1), 0.012)
    inner = PartStyle(_LINER, joint)
    builder.block(inner, (x0 + 0.05, x1 - 0.05), (y0 + 0.04, y1 - 0.04), (z0 - 0.012, z0 + 0.006))
    for y in np.arange(y0 + 0.1, y1 - 0.2, 0.3):
        builder.block(inner, (x0 + 0.06, x1 - 0.06), (y, y + 0.02), (z0 - 0.095, z0))
        builder.block(inner, (x0 + 0.06, x1 - 0.06), (y + 0.02, y + 0.07), (z0 - 0.095, z0 - 0.088))
    tall = y1 - y0
    length = float(np.clip(0.4 * tall, 0.16, 0.6))
    x = x0 + 0.06 if hinge > 0 else x1 - 0.06
    y = y0 + 0.05 + length / 2 if y0 > 0.5 else y1 - 0.06 - length / 2 if y1 < 1.35 else y0 + 0.55 * tall
    metal = PartStyle("chrome", joint)
    for end in (y - length / 2, y + length / 2):
        builder.block(metal, (x - 0.01, x + 0.01), (end - 0.012, end + 0.012), (z1 - 0.002, z1 + 0.04))
    up = (y - length / 2 - 0.02, y + length / 2 + 0.02)
    builder.block(metal, (x - 0.013, x + 0.013), up, (z1 + 0.022, z1 + 0.045), 0.005)
    builder.solid((x0, y0, z0 - 0.01), (x1, y1, z1), joint)


def _fridge_front(
    builder: Builder, rng: np.random.Generator, doors: Sequence[_Door], face: float, *, has_dispenser: bool
) -> None:
    """Add details to a fridge's two doors (the larger first): a badge, notes under magnets, perhaps a dispenser."""
    large, other = doors
    badge = PartStyle("chrome", other.name)
    middle, top = sum(other.x) / 2, other.y[1] - 0.07
    builder.block(badge, (middle - 0.05, middle + 0.05), (top, top + 0.022), (face - 0.002, face + 0.005))
    if has_dispenser:
        _dispenser(builder, large, face)
    noted = other if has_dispenser else large
    wide, high = noted.x[1] - noted.x[0], min(noted.y[1] - 0.12, _NOTES_M)
    for index, (paper, width, height, aside, drop) in enumerate(_NOTES):
        x = sum(noted.x) / 2 - (0.1 - aside) * noted.hinge * wide
        y = high - drop - height / 2 + float(rng.uniform(-0.02, 0.02))
        if y - height / 2 < noted.y[0] + 0.03:
            continue
        turn = float(rng.uniform(-7, 7))
        sheet = shapes.rotate(shapes.panel(width, height, (x, y, face + 0.0015)), "z", turn, (x, y, 0))
        builder.add(PartStyle(paper, noted.name), sheet)
        magnet = shapes.cylinder(0.017, 0.01, (x, y + 0.4 * height, face + 0.005), "z", 10)
        builder.add(PartStyle(_MAGNETS[index % 2], noted.name), magnet)


def _dispenser(builder: Builder, door: _Door, face: float) -> None:
    """Add a water dispenser: a dark alcove with a bright display above it, a spout and a tray."""
    x, wide = sum(door.x) / 2, min(0.24, 0.5 * (door.x[1] - door.x[0]))
    y1 = min(door.y[1] - 0.08, _DISPENSER_TOP_M)
    y0 = y1 - 1.5 * wide
    frame, dark, metal = (PartStyle(look, door.name) for look in ("plastic/#3a3d41", "plastic/#0f1011", "chrome"))
    builder.block(frame, (x - wide / 2, x + wide / 2), (y0, y1), (face - 0.002, face + 0.008), 0.003)
    builder.add(dark, shapes.panel(0.8 * wide, 0.9 * wide, (x, y0 + 0.55 * wide, face + 0.009)))
    display = shapes.panel(0.7 * wide, 0.2 * wide, (x, y1 - 0.22 * wide, face + 0.009))
    builder.add(PartStyle("plastic/#9fd8f4", door.name), display)
    spout = shapes.cylinder(0.06 * wide, 0.25 * wide, (x, y0 + 0.87 * wide, face + 0.018), segments=8)
    tray = shapes.span((x - 0.4 * wide, y0 + 0.08 * wide, face), (x + 0.4 * wide, y0 + 0.14 * wide, face + 0.03))
    builder.add(metal, spout, tray)


_RUN_M = 0.61
"""Depth (m) of each straight part of an L-shaped or U-shaped counter."""
_TOPS = (
    Finish("granite/#8d8a86", "grey"), Finish("granite/#4a4846", "dark"), Finish("marble/#eceae6", "white"),
    Finish("wood/beech", "wooden"), Finish("granite/#cdbfa8", "beige"),
)  # fmt: skip


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
    unit = _front_unit(length / count, height - thick, kick, is_framed)
    for index in range(count):
        middle = -length / 2 + (index + 0.5) * length / count
        for part, look in zip(unit, (cabinet, metal), strict=True):
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


def cart(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a trolley: trays with raised edges between four posts on large castors, with push bars at the top."""
    builder = Builder("Cart", size)
    finish = wood(rng)
    post = one_of(rng, ("metal/dark", "metal/black", "metal/brass", "metal/#2f8386"))
    width, height, depth = size
    half_x, half_z, wheel = width / 2, depth / 2, 0.09
    for sx in (-1, 1):
        for sz in (-1, 1):
            x, z = sx * (half_x - 0.03), sz * (half_z - 0.02)
            middle = (x, (height + wheel - 0.02) / 2, z)
            builder.add(post, shapes.cylinder(0.012, height - wheel - 0.02, middle, segments=10))
            builder.add("rubber/#1f2023", shapes.cylinder(wheel / 2, 0.024, (x, wheel / 2, z), "x", 16))
            builder.add("metal/steel", shapes.cylinder(0.24 * wheel, 0.03, (x, wheel / 2, z), "x", 10))
            builder.solid((x - 0.02, 0, z - 0.02), (x + 0.02, height, z + 0.02))
    for sx in (-1, 1):
        bar = shapes.cylinder(0.012, depth - 0.02, (sx * (half_x - 0.03), height - 0.014, 0), "z", 10)
        builder.add(post, bar)
    for x in (half_x - 0.014, -half_x + 0.014):
        builder.add(post, shapes.cylinder(0.014, depth, (x, height - 0.014, 0), "z", 10))
    inner = [level for level in levels if level < 0.92 * height]
    trays = shelf_heights(inner, 0.1, height - 0.05, 1 if height < 1.0 else 2)
    tiers = sorted({0.14, *trays, height - 0.13}) if not levels else sorted(trays)
    for index, top in enumerate(tiers):
        x, z = (-half_x + 0.03, half_x - 0.03), (-half_z + 0.012, half_z - 0.012)
        builder.block(finish.material, x, (top - 0.02, top), z, 0.003)
        for sz in (-1, 1):
            edge = shapes.box((width - 0.06, 0.05, 0.01), (0, top + 0.015, sz * (half_z - 0.013)), 0.002)
            builder.add(finish.material, edge)
        above = tiers[index + 1] - 0.02 if index + 1 < len(tiers) else top + 10.0
        builder.solid((-half_x + 0.03, top - 0.02, -half_z), (half_x - 0.03, top, half_z))
        builder.surface(f"tray{index}", (0, top, 0), (width - 0.12, depth - 0.07), above - top)
    return builder.build((finish.word,))


MAKERS = {"Cart": cart, "CounterTop": counter_top, "Fridge": fridge}
