"""Tables: dining, coffee and side tables and desks. Tops and legs are separate solids."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.furniture_parts import (
    Finish,
    Fronts,
    add_case,
    add_drawers,
    add_legs,
    handle_room,
    leg,
    random_fronts,
    shelf_heights,
    wood,
)
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3


def dining_table(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a dining table: on four legs, on trestles, or round on one foot."""
    builder = Builder("DiningTable", size)
    finish = wood(rng)
    width, height, depth = size
    lower = _below(levels, height)
    if abs(width - depth) < 0.15 * width and rng.random() < 0.7 and not lower:
        _pedestal(builder, finish, wood(rng) if rng.random() < 0.3 else finish)
        return builder.build((finish.word, "round"))
    thick = rng.uniform(0.028, 0.045)
    legs = wood(rng) if rng.random() < 0.3 else finish
    _top(builder, finish.material, thick, 0.06 if rng.random() < 0.4 else 0.0)
    under = height - thick
    if rng.random() < 0.25 and not lower:
        _trestles(builder, legs.material, under)
    else:
        style = one_of(rng, ("square", "tapered", "turned", "splayed"))
        inset = 0.02 if style == "square" else 0.08
        add_legs(builder, legs.material, (width - inset, depth - inset), under, rng.uniform(0.055, 0.085), style)
        x, z = (width - inset - 0.06) / 2, (depth - inset - 0.06) / 2
        for side in (-1, 1):  # four boards below the top
            builder.block(legs.material, (-x, x), (under - 0.08, under), (side * z - 0.01, side * z + 0.01))
            builder.block(legs.material, (side * x - 0.01, side * x + 0.01), (under - 0.08, under), (-z, z))
        _low_shelves(builder, legs.material, lower, under)
    return builder.build((finish.word,))


def _below(levels: Sequence[float], height: float) -> list[float]:
    """Return those `levels` (heights of shelves) that are well below a table's top and at least 6 cm apart."""
    found: list[float] = []
    for level in levels:
        if 0.025 < level < 0.9 * height and (not found or level > found[-1] + 0.06):
            found.append(level)
    return found


def _low_shelves(builder: Builder, material: str, tops: Sequence[float], under: float) -> None:
    """Add shelves between a table's legs."""
    for index, (top, above) in enumerate(pairwise([*tops, under])):
        half_x, half_z = builder.width / 2 - 0.05, builder.depth / 2 - 0.05
        builder.block(material, (-half_x, half_x), (top - 0.02, top), (-half_z, half_z), 0.003)
        builder.solid((-half_x, top - 0.02, -half_z), (half_x, top, half_z))
        builder.surface(f"shelf{index or ''}", (0, top, 0), (2 * half_x - 0.06, 2 * half_z - 0.02), above - top)


def _top(builder: Builder, material: str, thick: float, radius: float = 0.0) -> None:
    """Add a table's top, its solid and its surface."""
    top = builder.height
    size, center = (builder.width, thick, builder.depth), (0.0, top - thick / 2, 0.0)
    builder.add(material, shapes.slab(size, center, radius) if radius else shapes.box(size, center, 0.006))
    builder.solid((builder.across[0], top - thick, builder.through[0]), (builder.across[1], top, builder.through[1]))
    builder.surface("top", (0, top, 0), (builder.width - 0.03, builder.depth - 0.03))


def _trestles(builder: Builder, material: str, under: float) -> None:
    """Add a frame at each end, and a beam between the two."""
    half_x, half_z = 0.38 * builder.width, 0.4 * builder.depth
    for side in (-1, 1):
        x = side * half_x
        builder.block(material, (x - 0.04, x + 0.04), (0, 0.06), (-half_z, half_z), 0.006)
        builder.block(material, (x - 0.04, x + 0.04), (under - 0.05, under), (-half_z, half_z), 0.006)
        builder.block(material, (x - 0.035, x + 0.035), (0.06, under - 0.05), (-0.09, 0.09), 0.006)
        builder.solid((x - 0.04, 0, -half_z), (x + 0.04, under, half_z))
    builder.block(material, (-half_x, half_x), (0.4 * under, 0.4 * under + 0.07), (-0.02, 0.02))
    builder.solid((-half_x, 0.4 * under, -0.02), (half_x, 0.4 * under + 0.07, 0.02))


def _pedestal(builder: Builder, finish: Finish, foot: Finish) -> None:
    """Add a round (or oval) top on one round foot."""
    width, height, depth = builder.width, builder.height, builder.depth
    r, ratio = width / 2, (1.0, 1.0, depth / width)
    rim = [(0, height - 0.035), (r - 0.012, height - 0.035), (r, height - 0.02), (r - 0.004, height), (0, height)]
    builder.add(finish.material, shapes.scale(shapes.lathe(rim, segments=28), ratio))
    post = [
        (0, 0), (0.55 * r, 0), (0.55 * r, 0.025), (0.2 * r, 0.07), (0.09 * r + 0.02, 0.16),
        (0.07 * r + 0.02, 0.4 * height), (0.09 * r + 0.025, 0.75 * height),
        (0.3 * r, height - 0.035), (0, height - 0.035),
    ]  # fmt: skip
    builder.add(foot.material, shapes.scale(shapes.lathe(post, segments=20), ratio))
    builder.column(0.52 * min(width, depth) / 2, 0, 0.05)
    builder.column(0.09 * r + 0.03, 0.05, height - 0.035)
    angles = np.arange(12) * np.pi / 6
    builder.prism(np.c_[r * np.cos(angles), depth / 2 * np.sin(angles)], height - 0.035, height)
    builder.surface("top", (0, height, 0), (1.42 * r, 0.71 * depth))


def coffee_table(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a coffee table: a wooden or glass top on four legs, perhaps with a shelf; a round table; or a block."""
    builder = Builder("CoffeeTable", size)
    finish = wood(rng)
    width, height, depth = size
    lower = _below(levels, height)
    if abs(width - depth) < 0.15 * width and rng.random() < 0.6 and not lower:
        _pedestal(builder, finish, finish)
        return builder.build((finish.word, "round"))
    thick = min(0.035, 0.3 * height)
    under = height - thick
    if rng.random() < 0.25:
        rim = 0.05
        inner = (-depth / 2 + rim, depth / 2 - rim)
        builder.block("glass", (-width / 2 + rim, width / 2 - rim), (height - 0.012, height), inner)
        for side in (-1, 1):
            x, z = side * (width - rim) / 2, side * (depth - rim) / 2
            builder.block(finish.material, builder.across, (under, height), (z - rim / 2, z + rim / 2), 0.004)
            builder.block(finish.material, (x - rim / 2, x + rim / 2), (under, height), inner)
        builder.solid((-width / 2, under, -depth / 2), (width / 2, height, depth / 2))
        builder.surface("top", (0, height, 0), (width - 0.03, depth - 0.03))
    else:
        _top(builder, finish.material, thick, 0.05 if rng.random() < 0.4 else 0.0)
    style = one_of(rng, ("square", "tapered", "splayed"))
    add_legs(builder, finish.material, (width - 0.06, depth - 0.06), under, 0.05, style)
    if not lower and style == "square" and height > 0.3 and rng.random() < 0.7:
        lower = [0.3 * height]
    _low_shelves(builder, finish.material, lower, under)
    return builder.build((finish.word,))


def side_table(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a bedside table or end table: with drawers, with a shelf, or round."""
    builder = Builder("SideTable", size)
    finish = wood(rng)
    width, height, depth = size
    style = rng.random()
    lower = _below(levels, height)
    if abs(width - depth) < 0.12 * width and style < 0.3 and not lower:
        _pedestal(builder, finish, finish)
        return builder.build((finish.word, "round"))
    if lower or style < 0.5:
        thick, spread = 0.028, (width - 0.02, depth - 0.02)
        _top(builder, finish.material, thick)
        add_legs(builder, finish.material, spread, height - thick, 0.036, one_of(rng, ("square", "tapered")))
        _low_shelves(builder, finish.material, lower or [0.45 * height], height - thick)
        return builder.build((finish.word,))
    _nightstand(builder, rng, finish)
    return builder.build((finish.word, "with drawers"))


def _nightstand(builder: Builder, rng: np.random.Generator, finish: Finish) -> None:
    """Add a small chest with one or two drawers on short legs."""
    width, height, depth = builder.width, builder.height, builder.depth
    fronts = random_fronts(rng, finish.material, "paint/#f1eee4", 0.3)
    front = depth / 2 - handle_room(fronts.knob)
    foot = rng.uniform(0.1, 0.4) * height
    middle = (0.0, (front - depth / 2) / 2)
    add_legs(builder, finish.material, (width - 0.03, front + depth / 2 - 0.03), foot, 0.038, "tapered", middle)
    low, high = (-width / 2 + 0.006, foot, -depth / 2), (width / 2 - 0.006, height - 0.02, front - 0.004)
    add_case(builder, finish.material, low, high, 0.016)
    builder.block(finish.material, builder.across, (height - 0.022, height), (-depth / 2, front), 0.004)
    builder.surface("top", (0, height, middle[1]), (width - 0.02, depth - 0.05))
    rows = 2 if height - foot > 0.34 else 1
    tall = (height - 0.026 - foot - 0.02) / rows
    x0, x1 = -width / 2 + 0.024, width / 2 - 0.024
    up = [
        ((foot + 0.022 + row * tall, foot + 0.016 + (row + 1) * tall), (0.65 - 0.25 * row) * depth)
        for row in range(rows)
    ]
    box = (x0 - 0.002, foot + 0.016, -depth / 2 + 0.03), (x1 + 0.002, height - 0.022, front)
    add_drawers(builder, fronts, box, ([(x0, x1)], up))


def desk(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a desk: plain, or with a block of drawers at -x; a tall desk has shelves above its back."""
    builder = Builder("Desk", size)
    finish = wood(rng)
    width, height, depth = size
    tops = [level for level in levels if 0.6 < level < 1.05]
    top = (tops[0] if tops else 0.75) if height > 0.95 else height
    lower = _below(levels, top)
    front = depth / 2
    has_drawers = rng.random() < 0.6 and top > 0.55 and width > 0.9 and not lower
    fronts = random_fronts(rng, finish.material, "paint/#f1eee4", 0.3)
    if has_drawers:
        front -= handle_room(fronts.knob)
    thick = 0.03
    z0 = -depth / 2
    builder.block(finish.material, builder.across, (top - thick, top), (z0, front), 0.005)
    builder.solid((-width / 2, top - thick, z0), (width / 2, top, front))
    legs = one_of(rng, (finish.material, "metal/black", "metal/white"))
    reach = min(0.42, 0.34 * width) if has_drawers else 0.0
    if has_drawers:
        _drawer_block(builder, fronts, reach, (top - thick, front))
    style = one_of(rng, ("square", "square", "tapered"))
    for x in (-width / 2 + 0.03, width / 2 - 0.03)[int(has_drawers) :]:
        for z in (z0 + 0.04, front - 0.04):
            builder.add(legs, leg(style, (x, z), top - thick, 0.045))
            builder.solid((x - 0.0225, 0, z - 0.0225), (x + 0.0225, top - thick, z + 0.0225))
    across, up = (-width / 2 + reach, width / 2 - 0.03), (top - thick - 0.12, top - thick)
    builder.block(legs, across, up, (z0 + 0.02, z0 + 0.036))
    _low_shelves(builder, finish.material, lower, top - thick)
    middle = (z0 + front) / 2
    if top < height:
        _hutch(builder, finish.material, top, levels)
        builder.surface("desk", (0, top, middle + 0.13), (width - 0.04, front - z0 - 0.32))
    else:
        builder.surface("top", (0, top, middle), (width - 0.03, front - z0 - 0.03))
    return builder.build((finish.word,))


def _drawer_block(builder: Builder, fronts: Fronts, reach: float, face: tuple[float, float]) -> None:
    """Add a block of three drawers, `reach` metres wide, below a desk's top at -x; `face` is (top y, front z)."""
    x0, z0, (top, front) = builder.across[0] + 0.01, builder.through[0] + 0.02, face
    add_case(builder, fronts.front, (x0, 0.04, z0), (x0 + reach, top, front - 0.004), 0.016)
    builder.block(fronts.front, (x0 + 0.02, x0 + reach - 0.02), (0, 0.04), (z0 + 0.02, front - 0.05))
    tall = (top - 0.08) / 3
    up = [
        ((0.063 + row * tall, 0.057 + (row + 1) * tall), share * (front - z0))
        for row, share in enumerate((0.6, 0.45, 0.3))
    ]
    box = (x0 + 0.016, 0.056, z0 + 0.03), (x0 + reach - 0.016, top - 0.016, front)
    add_drawers(builder, fronts, box, ([(x0 + 0.02, x0 + reach - 0.02)], up))


def _hutch(builder: Builder, material: str, desk_top: float, levels: Sequence[float]) -> None:
    """Add shelves above the back of a desk."""
    (x0, x1), z0, height = builder.across, builder.through[0], builder.height
    z1 = z0 + min(0.28, 0.45 * builder.depth)
    add_case(builder, material, (x0, desk_top, z0), (x1, height, z1), 0.02)
    above = [level for level in levels if level > desk_top + 0.1]
    count = max(1, round((height - desk_top) / 0.4) - 1)
    shelves = shelf_heights(above, desk_top, height - 0.02, count)
    floor = (0, desk_top + 0.02, (z0 + z1) / 2)
    builder.surface("back", floor, (x1 - x0 - 0.06, z1 - z0 - 0.03), shelves[0] - 0.04 - desk_top)
    for index, shelf in enumerate(shelves):
        builder.block(material, (x0 + 0.02, x1 - 0.02), (shelf - 0.018, shelf), (z0 + 0.02, z1))
        top = shelves[index + 1] - 0.018 if index + 1 < len(shelves) else height - 0.02
        builder.surface(f"shelf{index}", (0, shelf, (z0 + z1) / 2), (x1 - x0 - 0.06, z1 - z0 - 0.03), top - shelf)
    builder.surface("top", (0, height, (z0 + z1) / 2), (x1 - x0 - 0.02, z1 - z0 - 0.02))


MAKERS = {
    "CoffeeTable": coffee_table,
    "Desk": desk,
    "DiningTable": dining_table,
    "SideTable": side_table,
}
