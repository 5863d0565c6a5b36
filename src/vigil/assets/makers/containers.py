"""Containers: boxes, hampers, garbage cans, safes and trolleys."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle
from vigil.assets.kernel.furniture_parts import CLOTHS, Finish, shelf_heights, wood
from vigil.assets.kernel.palette import COLOURS, one_of
from vigil.base.geometry import Vec3

_HAMPER_FOOT = 0.94
"""Width of a hamper at its bottom, as a share of its width at the top."""
_SHIRT = (
    (-0.28, -0.2), (0.28, -0.2), (0.28, 0.06), (0.42, 0.0), (0.5, 0.08), (0.2, 0.2), (0.12, 0.15), (-0.12, 0.15),
    (-0.2, 0.2), (-0.5, 0.08), (-0.42, 0.0), (-0.28, 0.06),
)  # fmt: skip
"""Outline of a shirt (the symbol for laundry) as shares of the shirt's width and the hamper's height."""
_SOCK, _LINEN = "fabric/#3c4048", "fabric/#efe9dc"
_SLEEVES = tuple(f"fabric/{COLOURS[name]}" for name in ("red", "blue", "teal", "yellow", "pink"))


def laundry_hamper(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a hamper of wicker, cloth or plastic, with a lid hinged at the back and laundry hanging out of it."""
    builder = Builder("LaundryHamper", size)
    word, code = one_of(rng, CLOTHS)
    baskets = (Finish("wicker", "wicker"), Finish("wicker/#8a6a45", "brown wicker"), Finish("plastic/#e6e4de", "white"))
    kind = one_of(rng, (*baskets, Finish(f"fabric/{code}", word)))
    width, height, depth = size
    lid = height - 0.03
    outline = shapes.rounded_rectangle(width, depth, 0.16 * min(width, depth))
    builder.add(kind.material, _bin(outline, (0.006, lid), _HAMPER_FOOT, 0.014))
    z0 = builder.through[0]
    inner = 0.8
    builder.surface(
        "bottom", (0, 0.02, 0), (inner * width - 0.06, inner * depth - 0.06), lid - 0.03, needs_opening=True
    )
    joint = builder.hinge("lid", (1, 0, 0), (0, lid, z0 + 0.01), -100.0)
    look = PartStyle(kind.material, joint)
    builder.add(look, shapes.extrude(outline, lid + 0.004, height - 0.008), shapes.extrude(0.9 * outline, lid, height))
    if kind.material.startswith("plastic"):
        builder.add("plastic/#4b4f53", *_slots(builder, lid))
    else:
        builder.add(_LINEN, _bin(1.012 * outline, (0.8 * lid, lid + 0.002), 0.995, 0.018, has_floor=False))
        shirt = [(x * 0.5 * width, (0.36 + y) * lid) for x, y in _SHIRT]
        face = depth / 2 * (_HAMPER_FOOT + (1 - _HAMPER_FOOT) * 0.5)
        builder.add(_LINEN, shapes.extrude(shirt, face - 0.01, face + 0.002, "z"))
    _washing(builder, rng, lid)
    builder.add("plastic/#2a2c2f", shapes.extrude(0.84 * outline, 0.0, 0.012))
    builder.prism(shapes.rounded_rectangle(width, depth, 0.16 * min(width, depth), 1), 0, lid)
    builder.prism(shapes.rounded_rectangle(width, depth, 0.16 * min(width, depth), 1), lid, height, joint)
    return builder.build((kind.word,))


def _slots(builder: Builder, lid: float) -> list[shapes.Mesh]:
    """Return rows of upright slots for the four sides of a hamper."""
    found = []
    for (reach, away), names in (
        ((builder.width, builder.depth), ("+z", "-z")),
        ((builder.depth, builder.width), ("+x", "-x")),
    ):
        count = max(3, round(reach / 0.06))
        for y in (0.2 * lid, 0.38 * lid):
            share = _HAMPER_FOOT + (1 - _HAMPER_FOOT) * (y / lid + 0.1)
            for name, side in zip(names, (1, -1), strict=True):
                for index in range(count):
                    along = ((index + 0.5) / count - 0.5) * 0.72 * reach
                    face = side * (share * away / 2 + 0.0015)
                    at = (along, y, face) if name[1] == "z" else (face, y, along)
                    found.append(shapes.panel(0.02, 0.13 * lid, at, name))
    return found


def _washing(builder: Builder, rng: np.random.Generator, lid: float) -> None:
    """Add a sleeve and a sock that hang out over a hamper's front."""
    width, height, face = builder.width, builder.height, builder.through[1] + 0.006
    cloth = one_of(rng, _SLEEVES)
    sleeve = [(-0.03, 0.0), (0.2, 0.0), (0.25, -0.29), (0.04, -0.31)]
    cuff = [(0.03, -0.31), (0.26, -0.29), (0.265, -0.35), (0.035, -0.37)]
    sock = [(-0.29, 0.0), (-0.15, 0.0), (-0.15, -0.27), (-0.31, -0.33), (-0.35, -0.25), (-0.29, -0.19)]
    toe = [(-0.23, -0.3), (-0.31, -0.33), (-0.35, -0.25), (-0.28, -0.23)]
    for look, outline, out in (
        (cloth, sleeve, 0.0),
        (_LINEN, cuff, 0.0),
        (_SOCK, sock, 0.0),
        (cloth, toe, 0.001),
    ):
        flat = [(x * width, lid + 0.003 + y * height) for x, y in outline]
        builder.add(look, shapes.extrude(flat, face - 0.004, face + 0.004 + out, "z"))
    over = 0.034
    for look, x0, x1 in ((cloth, -0.03, 0.2), (_SOCK, -0.29, -0.15)):
        builder.block(look, (x0 * width, x1 * width), (lid - 0.002, lid + 0.004), (face - over, face + 0.004))
        builder.block(look, (x0 * width, x1 * width), (lid - 0.16 * height, lid), (face - over, face - over + 0.006))


def _bin(
    outline: np.ndarray, y: tuple[float, float], foot: float, wall: float, *, has_floor: bool = True
) -> shapes.Mesh:
    """Return a bin, or only its rim. `outline` (n, 2) is the top's outline; the bottom is `foot` times as large."""
    ring = np.concatenate([outline, outline[:1]])
    reach = np.abs(outline).max(0)
    inner = (reach - wall) / reach

    def at(height: float, scale: float, thin: bool = False) -> np.ndarray:
        flat = ring * scale * (inner if thin else 1.0)
        return np.stack([flat[:, 0], np.full(len(flat), height), flat[:, 1]], 1)

    low, high = y
    bottom = low + wall if has_floor else low
    parts = [
        shapes.loft(np.stack([at(bottom, foot, True), at(high, 1.0, True)]), cap=False),
        shapes.loft(np.stack([at(high, 1.0, True), at(high, 1.0)]), cap=False),
        shapes.loft(np.stack([at(high, 1.0), at(low, foot)]), cap=False),
        shapes.extrude(foot * outline * 0.99, low, low + wall)
        if has_floor
        else shapes.loft(np.stack([at(low, foot), at(low, foot, True)]), cap=False),
    ]
    return shapes.merge(parts)


def _lining(outline: np.ndarray, height: float, foot: float) -> shapes.Mesh:
    """Return the inner skin of a bin, slightly inside its walls."""
    ring = np.concatenate([outline, outline[:1]])
    reach = np.abs(outline).max(0)
    inner = (reach - 0.0135) / reach
    low, high = (
        np.insert(ring * inner * scale, 1, level, axis=1) for scale, level in ((foot, 0.013), (1.0, height - 0.01))
    )
    floor = shapes.extrude(outline * inner * foot * 0.99, 0.013, 0.015)
    return shapes.merge([shapes.loft(np.stack([low, high]), cap=False), floor])


def garbage_can(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return an open bin, round or rectangular, of plastic, metal or wire, perhaps with a bag over its rim."""
    builder = Builder("GarbageCan", size)
    name = one_of(rng, ("black", "grey", "white", "green", "blue", "red"))
    kind = one_of(
        rng,
        (
            Finish(f"plastic/{COLOURS[name]}", name),
            Finish("metal/brushed", "metal"),
            Finish("wicker/#a9835a", "wicker"),
        ),
    )
    width, height, depth = size
    is_round = abs(width - depth) < 0.15 * width and rng.random() < 0.7
    radius = 0.5 * min(width, depth) if is_round else 0.15 * min(width, depth)
    outline = shapes.rounded_rectangle(width, depth, radius, 6)
    foot = rng.uniform(0.74, 0.9)
    builder.add(kind.material, _bin(outline, (0.0, height - 0.004), foot, 0.012))
    if rng.random() < 0.45:
        bag = "plastic/#2b2d30" if kind.word in ("white", "metal") else "plastic/#e4e4e2"
        builder.add(bag, _bin(1.0 * outline, (height - 0.09, height), 0.985, 0.016, has_floor=False))
        inside = "plastic/#1b1c1e" if bag.endswith("d30") else "plastic/#8b8c8a"
    else:
        inside = "plastic/#1b1c1e"
        builder.add(kind.material, _bin(outline, (height - 0.03, height), 0.99, 0.014, has_floor=False))
    builder.add(inside, _lining(outline, height, foot))
    builder.surface("bottom", (0, 0.016, 0), (0.62 * foot * width, 0.62 * foot * depth), is_inside=True)
    corners = shapes.rounded_rectangle(width, depth, radius, 2)
    builder.prism(corners, 0, height)
    return builder.build((kind.word,))


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
            builder.add(
                post, shapes.cylinder(0.012, height - wheel - 0.02, (x, (height + wheel - 0.02) / 2, z), segments=10)
            )
            builder.add("rubber/#1f2023", shapes.cylinder(wheel / 2, 0.024, (x, wheel / 2, z), "x", 16))
            builder.add("metal/steel", shapes.cylinder(0.24 * wheel, 0.03, (x, wheel / 2, z), "x", 10))
            builder.solid((x - 0.02, 0, z - 0.02), (x + 0.02, height, z + 0.02))
    for sx in (-1, 1):
        bar = shapes.cylinder(0.012, depth - 0.02, (sx * (half_x - 0.03), height - 0.014, 0), "z", 10)
        builder.add(post, bar)
    builder.add(post, shapes.cylinder(0.014, depth, (half_x - 0.014, height - 0.014, 0), "z", 10))
    builder.add(post, shapes.cylinder(0.014, depth, (-half_x + 0.014, height - 0.014, 0), "z", 10))
    trays = shelf_heights(
        [level for level in levels if level < 0.92 * height], 0.1, height - 0.05, 1 if height < 1.0 else 2
    )
    tiers = sorted({0.14, *trays, height - 0.13}) if not levels else sorted(trays)
    for index, top in enumerate(tiers):
        builder.block(
            finish.material,
            (-half_x + 0.03, half_x - 0.03),
            (top - 0.02, top),
            (-half_z + 0.012, half_z - 0.012),
            0.003,
        )
        for sz in (-1, 1):
            edge = shapes.box((width - 0.06, 0.05, 0.01), (0, top + 0.015, sz * (half_z - 0.013)), 0.002)
            builder.add(finish.material, edge)
        above = tiers[index + 1] - 0.02 if index + 1 < len(tiers) else top + 10.0
        builder.solid((-half_x + 0.03, top - 0.02, -half_z), (half_x - 0.03, top, half_z))
        builder.surface(f"tray{index}", (0, top, 0), (width - 0.12, depth - 0.07), above - top)
    return builder.build((finish.word,))


MAKERS = {
    "Cart": cart,
    "GarbageCan": garbage_can,
    "LaundryHamper": laundry_hamper,
}
