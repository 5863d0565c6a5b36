"""Furniture that stores things: dressers, cabinets, drawers, shelves, TV stands."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.furniture_parts import (
    BOARD_M,
    HANDLES,
    WOODS,
    Fronts,
    add_case,
    add_drawer,
    add_drawers,
    add_leaf,
    add_legs,
    add_shelves,
    handle_room,
    lining,
    random_fronts,
    seam_material,
    shelf_heights,
    wood,
)
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

_DRAWER_FLOOR_M = 0.026
"""Height (m) of a drawer's floor above the lower edge of the drawer's row."""


def _fronts(rng: np.random.Generator, front: str) -> Fronts:
    inner = one_of(rng, ("paint/#efeade", "paint/#f4f2ec", "paint/#e6e8ea"))
    return random_fronts(rng, front, inner, 0.4)


def _plinth(builder: Builder, rng: np.random.Generator, material: str, front: float, lowest: float = 1.0) -> float:
    """Add legs or a base below furniture whose front is at z = `front`; return the height (m) of their top.

    The top is below `lowest`, the height of the lowest thing inside.
    """
    rise = max(min(0.12, 0.12 * builder.height, lowest - 0.03), 0.005)
    back = -builder.depth / 2
    depth, middle = front - back, (front + back) / 2
    if rng.random() < 0.5 and rise > 0.04:
        style = one_of(rng, ("tapered", "square", "splayed"))
        add_legs(builder, material, (builder.width - 0.04, depth - 0.04), rise, 0.045, style, (0.0, middle))
        return rise
    rise = min(0.05, rise)
    builder.block(material, (-builder.width / 2 + 0.01, builder.width / 2 - 0.01), (0, rise), (back, front - 0.03))
    return rise


def dresser(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a chest of drawers. Things that rest at `levels` (heights) below its top are in the drawers."""
    builder = Builder("Dresser", size)
    finish = wood(rng)
    fronts = _fronts(rng, wood(rng).material if rng.random() < 0.25 else finish.material)
    width, height, depth = size
    front = depth / 2 - handle_room(fronts.knob)
    inner = [level for level in levels if level < 0.92 * height]
    base = _plinth(builder, rng, finish.material, front, min(inner, default=1.0))
    top = 0.03
    low, high = (-width / 2 + 0.008, base, -depth / 2), (width / 2 - 0.008, height - top, front - 0.004)
    add_case(builder, finish.material, low, high, BOARD_M)
    builder.block(finish.material, (-width / 2, width / 2), (height - top, height), (-depth / 2, front), 0.006)
    builder.surface("top", (0, height, (front - depth / 2) / 2), (width - 0.02, depth - 0.05))
    builder.solid((-width / 2, height - top, -depth / 2), (width / 2, height, front))
    columns = 1 if width < 0.7 else 2 if width < 1.7 else 3
    rows = int(np.clip(round((height - base) / 0.22), 2, 6))
    low, high = (-width / 2 + 0.028, base + 0.024, -depth / 2 + 0.03), (width / 2 - 0.028, height - top - 0.006, front)
    floors = shelf_heights([level - _DRAWER_FLOOR_M for level in inner], low[1], high[1], rows - 1)
    wide = (high[0] - low[0]) / columns
    across = [(low[0] + k * wide + 0.004, low[0] + (k + 1) * wide - 0.004) for k in range(columns)]
    last = len(floors)
    up = [  # lower drawers come out farther, so that the inside of each can be seen
        ((bottom + 0.004, top - 0.004), (0.32 + 0.38 * (last - row) / max(last, 1)) * (high[2] - low[2]))
        for row, (bottom, top) in enumerate(pairwise([low[1], *floors, high[1]]))
    ]
    add_drawers(builder, fronts, ((low[0] - 0.002, low[1] - 0.006, low[2]), high), (across, up))
    return builder.build((finish.word,))


def drawer(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a single drawer in a case; the front is larger than the case, has another finish and a broad handle."""
    builder = Builder("Drawer", size)
    finish = wood(rng)
    fronts = _fronts(rng, one_of(rng, [other.material for other in WOODS if other != finish]))
    fronts = replace(fronts, knob="bar" if fronts.knob == "knob" else fronts.knob, is_framed=True)
    width, height, depth = size
    front = depth / 2 - handle_room(fronts.knob)
    back, margin, wall = front - BOARD_M, 0.01, 0.014
    low, high = (-width / 2 + margin, 0, -depth / 2), (width / 2 - margin, height - margin, back - 0.004)
    add_case(builder, finish.material, low, high, wall)
    builder.surface("top", (0, height - margin, (back - depth / 2) / 2), (width - 0.04, depth - 0.06 - BOARD_M))
    low, high = (-width / 2, 0.002, -depth / 2 + 0.02), (width / 2, height, front)
    add_drawer(builder, "drawer0", low, high, fronts, 0.65 * depth, overlay=margin + wall + 0.002)
    return builder.build((finish.word,))


def cabinet(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a cabinet with one or two hinged doors and shelves behind them."""
    builder = Builder("Cabinet", size)
    finish = wood(rng)
    fronts = _fronts(rng, finish.material)
    width, height, depth = size
    front = depth / 2 - handle_room(fronts.knob)
    leaf = front - 0.02
    add_case(builder, finish.material, (-width / 2, 0, -depth / 2), (width / 2, height, leaf - 0.002), BOARD_M)
    skin = 0.001
    low = (-width / 2 + BOARD_M + skin, BOARD_M + skin, -depth / 2 + BOARD_M + skin)
    high = (width / 2 - BOARD_M - skin, height - BOARD_M - skin, leaf - 0.012)
    builder.add(fronts.inner, lining(low, high))
    count = max(1, round(height / 0.35) - 1)
    add_shelves(builder, fronts.inner, low, high, shelf_heights(levels, low[1], high[1], count), needs_opening=True)
    builder.surface("top", (0, height, (leaf - depth / 2) / 2), (width - 0.02, depth - 0.06))
    if width > 0.55:
        add_leaf(builder, "leaf0", (-width / 2, 0.004, leaf), (-0.003, height - 0.004, front), fronts, hinge=-1)
        add_leaf(builder, "leaf1", (0.003, 0.004, leaf), (width / 2, height - 0.004, front), fronts, hinge=1)
        plate = PartStyle(seam_material(finish.material), "leaf0")
        builder.block(plate, (-0.012, 0.01), (BOARD_M, height - BOARD_M), (leaf - 0.008, leaf))
    else:
        side = 1 if rng.random() < 0.5 else -1
        # The free edge swings out a little at first.
        x0, x1 = -width / 2 + 0.005 * (side > 0), width / 2 - 0.005 * (side < 0)
        add_leaf(builder, "leaf0", (x0, 0.004, leaf), (x1, height - 0.004, front), fronts, hinge=side)
    return builder.build((finish.word,))


def tv_stand(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a low TV stand: open shelves in the middle; a wide stand has drawers or doors at its ends."""
    builder = Builder("TVStand", size)
    finish = wood(rng)
    fronts = _fronts(rng, finish.material)
    width, height, depth = size
    front = depth / 2 - handle_room(fronts.knob)
    inner = [level for level in levels if level < 0.92 * height]
    base = _plinth(builder, rng, finish.material, front, min(inner, default=1.0))
    add_case(builder, finish.material, (-width / 2, base, -depth / 2), (width / 2, height, front - 0.002), 0.024)
    builder.surface("top", (0, height, (front - depth / 2) / 2), (width - 0.02, depth - 0.05))
    low = (-width / 2 + 0.024, base + 0.024, -depth / 2 + 0.024)
    high = (width / 2 - 0.024, height - 0.024, front - 0.006)
    end = 0.0 if width < 0.95 or inner else 0.28 * (high[0] - low[0])
    if end:
        for x in (low[0] + end, high[0] - end):
            builder.block(finish.material, (x - 0.009, x + 0.009), (low[1], high[1]), (low[2], high[2]))
        for index, (x0, x1) in enumerate(((low[0], low[0] + end - 0.009), (high[0] - end + 0.009, high[0]))):
            rows = 2 if high[1] - low[1] > 0.3 else 1
            tall = (high[1] - low[1]) / rows
            up = [
                ((low[1] + row * tall + 0.003, low[1] + (row + 1) * tall - 0.003), (0.6 - 0.25 * row) * depth)
                for row in range(rows)
            ]
            box = (x0, low[1], low[2]), (x1, high[1], front)
            add_drawers(builder, fronts, box, ([(x0 + 0.003, x1 - 0.003)], up), index * rows)
    middle_low, middle_high = (low[0] + end + 0.009, low[1], low[2]), (high[0] - end - 0.009, high[1], high[2])
    count = 1 if height - base > 0.3 else 0
    shelves = shelf_heights(inner, low[1], high[1], count)
    add_shelves(builder, finish.material, middle_low, middle_high, shelves, is_inside=True)
    return builder.build((finish.word,))


def shelving_unit(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a bookcase, a shelf of cubes or an open metal rack, with boards at the heights `levels`."""
    builder = Builder("ShelvingUnit", size)
    width, height, depth = size
    style = one_of(rng, ("case", "cubes", "rack", "ladder"))
    heights = shelf_heights(levels, 0.05, height - 0.02, max(1, round(height / 0.38) - 1))
    half_x, half_z = width / 2, depth / 2
    if style in ("case", "cubes"):
        finish = wood(rng)
        add_case(builder, finish.material, (-half_x, 0, -half_z), (half_x, height, half_z), 0.024)
        low, high = (-half_x + 0.024, 0.024, -half_z + 0.024), (half_x - 0.024, height - 0.024, half_z)
        add_shelves(builder, finish.material, low, high, [y for y in heights if 0.08 < y < height - 0.08])
        if style == "cubes" and width > 0.55:
            count = round(width / 0.4)
            y, z = (0.024, height - 0.024), (-half_z + 0.024, half_z - 0.006)
            for index in range(1, count):
                x = -half_x + index * width / count
                builder.block(finish.material, (x - 0.009, x + 0.009), y, z)
        builder.surface("top", (0, height, 0), (width - 0.02, depth - 0.02))
        return builder.build((finish.word,))
    return _rack(builder, rng, heights, style)


def _rack(builder: Builder, rng: np.random.Generator, heights: list[float], style: str) -> Asset:
    """Return an open rack: shelves between four posts."""
    width, height, depth = builder.width, builder.height, builder.depth
    post = one_of(rng, ("metal/black", "metal/brushed", "metal/white")) if style == "rack" else wood(rng).material
    board = wood(rng)
    thick = 0.025 if style == "rack" else 0.04
    half_x, half_z = width / 2, depth / 2
    for sx in (-1, 1):
        for sz in (-1, 1):
            x, z = sx * (half_x - thick / 2), sz * (half_z - thick / 2)
            builder.block(post, (x - thick / 2, x + thick / 2), (0, height), (z - thick / 2, z + thick / 2))
            builder.solid((x - thick / 2, 0, z - thick / 2), (x + thick / 2, height, z + thick / 2))
        for y in (0.08, height - 0.03):
            builder.add(post, shapes.box((thick * 0.8, 0.02, depth - thick), (sx * (half_x - thick / 2), y, 0)))
    shelves = sorted({0.12 if heights[0] > 0.3 else heights[0], *heights})
    x, z = (-half_x + 0.004, half_x - 0.004), (-half_z + 0.004, half_z - 0.004)
    for index, top in enumerate(shelves):
        builder.block(board.material, x, (top - 0.022, top), z)
        builder.solid((-half_x, top - 0.022, -half_z), (half_x, top, half_z))
        above = shelves[index + 1] - 0.022 if index + 1 < len(shelves) else height - 0.04
        builder.surface(f"shelf{index}", (0, top, 0), (width - 0.06, depth - 0.02), above - top)
    builder.block(board.material, (-half_x, half_x), (height - 0.022, height), (-half_z, half_z))
    builder.solid((-half_x, height - 0.022, -half_z), (half_x, height, half_z))
    builder.surface("top", (0, height, 0), (width - 0.02, depth - 0.02))
    return builder.build((board.word,))


def shelf(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a wall shelf: a board on brackets or, in a higher box, a case with boards at the heights `levels`."""
    builder = Builder("Shelf", size)
    finish = wood(rng)
    width, height, depth = size
    thick = min(0.025, 0.5 * height)
    if height > 0.16:
        add_case(builder, finish.material, (-width / 2, 0, -depth / 2), (width / 2, height, depth / 2), 0.02)
        low, high = (-width / 2 + 0.02, 0.02, -depth / 2 + 0.02), (width / 2 - 0.02, height - 0.02, depth / 2)
        add_shelves(builder, finish.material, low, high, shelf_heights(levels, 0.02, high[1], round(height / 0.35)))
    else:
        under = height - thick
        builder.block(finish.material, builder.across, (under, height), builder.through, 0.003)
        metal = one_of(rng, HANDLES).material
        for x in (-0.35 * width, 0.35 * width):
            builder.block(metal, (x - 0.01, x + 0.01), (0, under), (-depth / 2, -depth / 2 + 0.01))
            builder.block(metal, (x - 0.01, x + 0.01), (under - 0.008, under), (-depth / 2, 0.35 * depth))
    builder.surface("top", (0, height, 0), (width - 0.02, depth - 0.02))
    return builder.build((finish.word,))


MAKERS = {
    "Cabinet": cabinet,
    "Drawer": drawer,
    "Dresser": dresser,
    "Shelf": shelf,
    "ShelvingUnit": shelving_unit,
    "TVStand": tv_stand,
}
