"""Beds: a mattress with bedding on a frame, with a headboard at -z. Pillows are separate assets."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.furniture_parts import CLOTHS, Finish, add_legs, cloth, wood
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

_CANOPY_FROM_M = 1.5
_HIGHEST_M = 0.85
"""Greatest height (m) of a mattress's top. Things that rest higher lie on something else, such as a pillow."""


def bed(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a bed with a wooden, slatted or upholstered headboard; a tall bed has four posts."""
    builder = Builder("Bed", size)
    finish = wood(rng)
    width, height, depth = size
    fitting = [level for level in levels if level > 0.25 * height]
    usual = min(0.54, 0.62 * height if height > 0.5 else height)
    lying = min(fitting[0], height) if fitting and fitting[0] <= _HIGHEST_M else usual
    has_head = height > lying + 0.08
    frame = rng.uniform(0.45, 0.6) * lying
    (x0, x1), (z0, z1) = builder.across, builder.through
    head = 0.06 if has_head else 0.0
    foot = 0.05 if has_head and rng.random() < 0.5 else 0.0
    leg = min(0.16, 0.5 * frame)
    add_legs(builder, finish.material, (width - 0.02, depth - 0.02), leg + 0.01, 0.07, "square")
    builder.block(finish.material, builder.across, (leg, frame), (z0 + 0.5 * head, z1), 0.008)
    if height > _CANOPY_FROM_M:
        _posts(builder, finish.material)
    elif has_head:
        _headboard(builder, rng, finish, head)
    if foot:
        builder.block(finish.material, builder.across, (leg, min(lying + 0.12, height)), (z1 - foot, z1), 0.01)
        builder.solid((x0, 0, z1 - foot), (x1, min(lying + 0.12, height), z1))
    inner = (z0 + head, z1 - foot - 0.01)
    word = _bedding(builder, rng, (frame - 0.04, lying), inner)
    builder.solid((x0, 0.02, z0), (x1, lying, z1))
    builder.surface("mattress", (0, lying, sum(inner) / 2), (width - 0.14, inner[1] - inner[0] - 0.1))
    return builder.build((word, finish.word))


def _headboard(builder: Builder, rng: np.random.Generator, finish: Finish, thick: float) -> None:
    """Add a headboard behind the pillows: plain, framed, slatted or padded."""
    (x0, x1), z0, height = builder.across, builder.through[0], builder.height
    style = one_of(rng, ("board", "slats", "padded"))
    builder.solid((x0, 0, z0), (x1, height, z0 + thick))
    if style == "padded":
        pad = cloth(rng).material
        count = max(2, round(builder.width / 0.45))
        wide = builder.width / count
        builder.block(pad, builder.across, (0.1, height - 0.02), (z0, z0 + 0.03))
        for index in range(count):
            x = x0 + (index + 0.5) * wide
            size = (wide - 0.004, 0.68 * height, thick - 0.01)
            builder.add(pad, shapes.rounded_box(size, (x, height - 0.34 * height, z0 + 0.01 + size[2] / 2), 0.02))
    elif style == "slats":
        for x in (x0 + 0.03, x1 - 0.03):
            builder.block(finish.material, (x - 0.03, x + 0.03), (0, height), (z0, z0 + thick), 0.006)
        for low, high in ((height - 0.1, height - 0.02), (0.5 * height, 0.5 * height + 0.06)):
            builder.block(finish.material, (x0 + 0.05, x1 - 0.05), (low, high), (z0 + 0.012, z0 + thick - 0.012))
        for x in np.linspace(x0 + 0.06, x1 - 0.06, round(builder.width / 0.14) + 1)[1:-1]:
            builder.block(
                finish.material, (x - 0.018, x + 0.018), (0.5 * height, height - 0.06), (z0 + 0.02, z0 + 0.036)
            )
    else:
        builder.block(finish.material, builder.across, (0, height), (z0, z0 + thick - 0.015), 0.01)
        for x in (x0 + 0.25 * builder.width, x1 - 0.25 * builder.width):
            panel = (0.42 * builder.width, 0.3 * height, 0.015)
            builder.add(finish.material, shapes.box(panel, (x, 0.8 * height, z0 + thick - 0.0125), 0.006))


def _posts(builder: Builder, material: str) -> None:
    """Add four posts at the corners, and the frame of a canopy."""
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    for x in (x0 + 0.035, x1 - 0.035):
        for z in (z0 + 0.035, z1 - 0.035):
            builder.block(material, (x - 0.035, x + 0.035), (0, height), (z - 0.035, z + 0.035), 0.008)
            builder.solid((x - 0.035, 0, z - 0.035), (x + 0.035, height, z + 0.035))
        builder.block(material, (x - 0.025, x + 0.025), (height - 0.06, height - 0.01), (z0, z1))
    for z in (z0 + 0.035, z1 - 0.035):
        builder.block(material, (x0, x1), (height - 0.06, height - 0.01), (z - 0.025, z + 0.025))
    builder.block(material, (x0, x1), (0.2, min(1.1, 0.6 * height)), (z0, z0 + 0.04), 0.006)


def _bedding(builder: Builder, rng: np.random.Generator, heights: tuple[float, float], z: tuple[float, float]) -> str:
    """Add a mattress, a sheet and a blanket between two heights; return the blanket's colour."""
    (low, top), (z0, z1) = heights, z
    wide = builder.width - 0.06
    builder.add(
        "fabric/#eeeae2",
        shapes.rounded_box((wide, top - 0.012 - low, z1 - z0), (0, (top - 0.012 + low) / 2, (z0 + z1) / 2), 0.05),
    )
    word, code = one_of(rng, CLOTHS)
    kind = one_of(rng, ("fabric", "fabric", "knit", "plaid", "stripes", "dots"))
    fold = z0 + rng.uniform(0.26, 0.4) * (z1 - z0)
    drop = min(0.3, 0.62 * (top - 0.05))
    cover = shapes.rounded_box(
        (builder.width + 0.0, drop, z1 - fold + 0.015), (0, top - drop / 2, (fold + z1 + 0.015) / 2), 0.045
    )
    builder.add(f"{kind}/{code}", cover)
    turned = shapes.rounded_box((builder.width - 0.004, drop * 0.9, 0.2), (0, top - drop * 0.45 + 0.006, fold), 0.04)
    builder.add("fabric/#f4f1ea" if rng.random() < 0.6 else f"fabric/{code}", turned)
    return word


MAKERS = {"Bed": bed}
