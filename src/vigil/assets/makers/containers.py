"""Trolleys."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.furniture_parts import shelf_heights, wood
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3


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
}
