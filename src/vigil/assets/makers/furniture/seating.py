"""Seats other than upholstered suites (`vigil.assets.makers.furniture.sofas`): chairs, stools, footstools, ottomans."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.furniture_parts import Finish, add_legs, cloth, leg, wood
from vigil.assets.kernel.palette import COLOURS, one_of
from vigil.base.geometry import Vec3


def seat_height(levels: Sequence[float], height: float, usual: float) -> float:
    """Return the height of the seat: the lowest level that can be a seat, otherwise the usual height if that fits."""
    fitting = [level for level in levels if 0.3 * height < level < 0.75 * height]
    return fitting[0] if fitting else min(usual, 0.55 * height)


def chair(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a wooden, padded, plastic or office chair; its back is at -z."""
    builder = Builder("Chair", size)
    seat = seat_height(levels, size.y, 0.46)
    if size.x > 0.56 and size.z > 0.56:
        finish = _office_chair(builder, rng, seat)
    else:
        style = one_of(rng, (_slat_chair, _slat_chair, _padded_chair, _shell_chair))
        finish = style(builder, rng, seat)
    builder.surface("seat", (0, seat, 0.03 * size.z), (0.82 * size.x, 0.78 * size.z))
    return builder.build((finish.word,))


def _back_solids(builder: Builder, seat: float, thickness: float, inset: float = 0.0) -> None:
    x0, x1 = builder.across
    z0, z1 = builder.through
    builder.solid((x0 + inset, seat - 0.05, z0 + inset), (x1 - inset, seat, z1 - inset))
    builder.solid((x0 + inset, seat, z0), (x1 - inset, builder.height, z0 + thickness))


def _slat_chair(builder: Builder, rng: np.random.Generator, seat: float) -> Finish:
    """Add a wooden chair with a ladder or slatted back and perhaps a seat pad."""
    finish = wood(rng)
    x1, z0, z1, height = builder.across[1], *builder.through, builder.height
    post = 0.036
    for side in (-1, 1):
        x = side * (x1 - post / 2)
        builder.block(finish.material, (x - post / 2, x + post / 2), (0, height), (z0, z0 + post), 0.003)
        front = side * (x1 - post / 2)
        builder.add(finish.material, leg("square", (front, z1 - post / 2), seat - 0.03, post))
        builder.block(finish.material, (x - 0.01, x + 0.01), (0.3 * seat, 0.3 * seat + 0.025), (z0 + post, z1 - post))
        for z in (z0, z1 - post):
            builder.solid((x - post / 2, 0, z), (x + post / 2, seat, z + post))
    builder.add(finish.material, shapes.slab((2 * x1, 0.03, z1 - z0 - 0.01), (0, seat - 0.015, 0.005), 0.03))
    inner = (-x1 + post, x1 - post)
    if rng.random() < 0.5:
        for part in (0.3, 0.6, 0.9):
            y = seat + part * (height - seat) - 0.03
            builder.block(finish.material, inner, (y - 0.03, y + 0.03), (z0 + 0.008, z0 + 0.026))
    else:
        builder.block(finish.material, inner, (height - 0.07, height - 0.005), (z0 + 0.006, z0 + 0.028))
        builder.block(finish.material, inner, (seat + 0.08, seat + 0.11), (z0 + 0.006, z0 + 0.028))
        for x in np.linspace(*inner, 6)[1:-1]:
            builder.block(finish.material, (x - 0.012, x + 0.012), (seat + 0.1, height - 0.06), (z0 + 0.01, z0 + 0.024))
    _back_solids(builder, seat, post)
    if rng.random() < 0.4:
        pad = cloth(rng)
        size = (2 * x1 - 0.05, 0.025, z1 - z0 - 0.07)
        builder.add(pad.material, shapes.rounded_box(size, (0, seat + 0.006, 0.02), 0.012))
    return finish


def _padded_chair(builder: Builder, rng: np.random.Generator, seat: float) -> Finish:
    """Add an upholstered dining chair."""
    finish, pad = wood(rng), cloth(rng)
    x1, z0, z1, height = builder.across[1], *builder.through, builder.height
    style = one_of(rng, ("tapered", "square", "splayed"))
    add_legs(builder, finish.material, (2 * x1 - 0.02, z1 - z0 - 0.02), seat - 0.08, 0.042, style)
    builder.add(pad.material, shapes.rounded_box((2 * x1, 0.09, z1 - z0), (0, seat - 0.045, 0), 0.035))
    back = shapes.rounded_box(
        (2 * x1 - 0.02, height - seat - 0.06, 0.07), (0, (height + seat + 0.06) / 2, z0 + 0.035), 0.03
    )
    builder.add(pad.material, back)
    for side in (-1, 1):
        x = side * 0.7 * x1
        builder.block(finish.material, (x - 0.015, x + 0.015), (seat - 0.05, seat + 0.1), (z0 + 0.01, z0 + 0.04))
    _back_solids(builder, seat, 0.07)
    return pad


def _shell_chair(builder: Builder, rng: np.random.Generator, seat: float) -> Finish:
    """Add a moulded plastic shell on splayed wooden or metal legs."""
    name = one_of(rng, ("white", "grey", "black", "red", "teal", "yellow", "light blue"))
    shell = f"plastic/{COLOURS[name]}"
    x1, z0, z1, height = builder.across[1], *builder.through, builder.height
    upper = [(z1, seat - 0.02), (z1 - 0.04, seat + 0.005), (z0 + 0.3 * (z1 - z0), seat), (z0 + 0.13, seat + 0.02),
             (z0 + 0.07, seat + 0.09), (z0 + 0.03, (seat + height) / 2), (z0 + 0.012, height)]  # fmt: skip
    lower = [(z - 0.012 if y > seat + 0.05 else z, y - (0.0 if y > seat + 0.05 else 0.016)) for z, y in reversed(upper)]
    builder.add(shell, shapes.extrude([*upper, *lower], -x1, x1, "x"))
    for side in (-1, 1):
        wing = [(z1 - 0.05, seat), (z0 + 0.1, seat + 0.02), (z0 + 0.05, seat + 0.15), (z0 + 0.16, seat + 0.1)]
        builder.add(shell, shapes.extrude(wing, side * x1 - 0.006, side * x1 + 0.006, "x"))
    legs = one_of(rng, ("wood/beech", "metal/black", "chrome"))
    add_legs(builder, legs, (1.7 * x1, 0.85 * (z1 - z0)), seat - 0.016, 0.034, "splayed")
    _back_solids(builder, seat, 0.1)
    return Finish(shell, name)


def _office_chair(builder: Builder, rng: np.random.Generator, seat: float) -> Finish:
    """Add a swivel chair on five castors."""
    pad = cloth(rng)
    x1, z0, z1, height = builder.across[1], *builder.through, builder.height
    metal = one_of(rng, ("plastic/#222326", "chrome"))
    reach = min(x1, z1)
    for angle in np.radians(90 + 72 * np.arange(5)):
        end = (reach * 0.9 * np.cos(angle), 0.07, reach * 0.9 * np.sin(angle))
        builder.add(metal, shapes.tube([(0, 0.11, 0), end], (0.025, 0.016), 6))
        builder.add("plastic/#1c1c1e", shapes.cylinder(0.03, 0.03, (end[0], 0.03, end[2]), "x", 10))
    builder.add(metal, shapes.cylinder(0.03, seat - 0.18, (0, (seat + 0.02) / 2, 0), segments=10))
    wide = 2 * x1 - 0.1
    builder.add(
        pad.material, shapes.rounded_box((wide, 0.1, 0.8 * (z1 - z0)), (0, seat - 0.05, 0.05 * (z1 - z0)), 0.045)
    )
    back = shapes.rounded_box((0.9 * wide, height - seat - 0.1, 0.09), (0, (height + seat + 0.1) / 2, z0 + 0.06), 0.04)
    builder.add(pad.material, shapes.rotate(back, "x", -6, (0, seat, z0)))
    builder.block(metal, (-0.03, 0.03), (seat - 0.08, seat + 0.2), (z0 + 0.02, z0 + 0.045))
    for side in (-1, 1):
        x = side * (x1 - 0.025)
        builder.block("plastic/#222326", (x - 0.025, x + 0.025), (seat + 0.2, seat + 0.23), (-0.14, 0.14), 0.008)
        builder.block("plastic/#222326", (x - 0.015, x + 0.015), (seat - 0.06, seat + 0.2), (-0.03, 0.03))
        builder.solid((x - 0.025, seat + 0.2, -0.14), (x + 0.025, seat + 0.23, 0.14))
    builder.column(0.9 * reach, 0.0, 0.1)
    builder.column(0.05, 0.1, seat - 0.1)
    _back_solids(builder, seat, 0.12, 0.05)
    return pad


MAKERS = {"Chair": chair}
