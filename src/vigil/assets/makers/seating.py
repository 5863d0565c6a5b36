"""Upholstered seats: armchairs, and sofas, straight or with a chaise longue."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.furniture_parts import Finish, add_legs, cloth, wood
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3


def seat_height(levels: Sequence[float], height: float, usual: float) -> float:
    """Return the height (m) of a seat: the lowest of `levels` that suits a seat, else the usual height if it fits."""
    fitting = [level for level in levels if 0.3 * height < level < 0.75 * height]
    return fitting[0] if fitting else min(usual, 0.55 * height)


@dataclass(frozen=True, slots=True)
class _Suite:
    """The sizes (m) and the upholstery of an armchair or sofa."""

    seat: float
    """Height (m) of the top of the seat."""
    foot: float
    arm: float
    """Width (m) of an armrest."""
    arm_top: float
    back: float
    """Thickness (m) of the back."""
    is_rounded: bool
    pad: Finish
    """Upholstery of the frame."""
    cushion: Finish


def arm_chair(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return an armchair, either upholstered or with cushions in a wooden frame."""
    builder = Builder("ArmChair", size)
    suite = _suite(builder, rng, levels)
    if rng.random() < 0.25:
        _framed(builder, rng, suite)
    else:
        _upholstered(builder, rng, suite, builder.depth, 1)
    return builder.build((suite.cushion.word, suite.pad.word))


def sofa(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a sofa with two to four seats; a very deep sofa is L-shaped, with a chaise longue at -x."""
    builder = Builder("Sofa", size)
    suite = _suite(builder, rng, levels)
    is_corner = size.z > 1.3 and size.x > 1.9
    run = min(size.z, 1.0) if is_corner else size.z
    seats = int(np.clip(round((size.x - 2 * suite.arm) / 0.68), 2, 4))
    _upholstered(builder, rng, suite, run, seats)
    if is_corner:
        _chaise(builder, suite, run)
    return builder.build((suite.cushion.word, suite.pad.word))


def _suite(builder: Builder, rng: np.random.Generator, levels: Sequence[float]) -> _Suite:
    seat = seat_height(levels, builder.height, 0.44)
    pad = cloth(rng)
    arm = float(np.clip(0.16 * builder.width, 0.08, 0.22)) * rng.uniform(0.7, 1.0)
    return _Suite(
        seat=seat,
        foot=min(0.12, 0.3 * seat) if rng.random() < 0.65 else 0.02,
        arm=float(arm),
        arm_top=float(min(seat + rng.uniform(0.14, 0.24), 0.92 * builder.height)),
        back=float(np.clip(0.24 * min(builder.depth, 1.0), 0.14, 0.26)),
        is_rounded=bool(rng.random() < 0.5),
        pad=pad,
        cushion=cloth(rng) if rng.random() < 0.2 else pad,
    )


def _upholstered(builder: Builder, rng: np.random.Generator, suite: _Suite, run: float, seats: int) -> None:
    """Add a base, a back, arms and cushions in the rear part of the box, which is `run` metres deep."""
    (x0, x1), (z0, _) = builder.across, builder.through
    z1, height, foot = z0 + run, builder.height, suite.foot
    soft = 0.05 if suite.is_rounded else 0.02
    base_top = suite.seat - 0.14
    builder.add(suite.pad.material, _soft((x0 + 0.02, x1 - 0.02), (foot, base_top), (z0, z1 - 0.01), soft))
    builder.add(suite.pad.material, _soft((x0 + 0.5 * suite.arm, x1 - 0.5 * suite.arm), (foot, height - 0.04),
                                          (z0, z0 + suite.back), 2 * soft))  # fmt: skip
    for side in (-1, 1):
        x = side * (x1 - suite.arm / 2)
        builder.add(
            suite.pad.material, _soft((x - suite.arm / 2, x + suite.arm / 2), (foot, suite.arm_top), (z0, z1), soft)
        )
        if suite.is_rounded:
            roll = shapes.cylinder(
                0.55 * suite.arm, run - 0.06, (x, suite.arm_top - 0.02, (z0 + z1) / 2 + 0.01), "z", 14
            )
            builder.add(suite.pad.material, roll)
        builder.solid((x - suite.arm / 2, 0, z0), (x + suite.arm / 2, suite.arm_top, z1))
    inner0, inner1 = x0 + suite.arm, x1 - suite.arm
    wide = (inner1 - inner0) / seats
    for index in range(seats):
        left = inner0 + index * wide
        span = (left + 0.004, left + wide - 0.004)
        seat = _soft(span, (suite.seat - 0.15, suite.seat), (z0 + suite.back - 0.02, z1), 0.045, 0.012)
        builder.add(suite.cushion.material, seat)
        back = _soft(span, (suite.seat - 0.02, height), (z0 + 0.45 * suite.back, z0 + suite.back + 0.06), 0.07)
        builder.add(suite.cushion.material, shapes.rotate(back, "x", -5, (0, suite.seat, z0 + suite.back)))
    if foot > 0.03:
        style = one_of(rng, ("tapered", "square"))
        add_legs(
            builder, wood(rng).material, (x1 - x0 - 0.06, run - 0.06), foot + 0.01, 0.05, style, (0, (z0 + z1) / 2)
        )
    builder.solid((x0, foot, z0), (x1, suite.seat, z1))
    builder.solid((x0, suite.seat, z0), (x1, height, z0 + suite.back))
    depth = run - suite.back - 0.08
    builder.surface("seat", (0, suite.seat - 0.006, z1 - depth / 2), (inner1 - inner0 - 0.04, depth - 0.04))


def _chaise(builder: Builder, suite: _Suite, run: float) -> None:
    """Add the chaise longue of an L-shaped sofa, in front of the other seats at -x."""
    (x0, x1), (z0, z1) = builder.across, builder.through
    wide = 0.8 * (x1 - x0)
    high, front = x0 + wide, z0 + run - 0.05
    builder.add(suite.pad.material, _soft((x0, high), (suite.foot, suite.seat - 0.14), (front - 0.2, z1), 0.03))
    builder.add(
        suite.cushion.material, _soft((x0 + 0.01, high), (suite.seat - 0.15, suite.seat), (front, z1), 0.045, 0.012)
    )
    for z in (front + 0.1, z1 - 0.06):
        for x in (x0 + 0.05, high - 0.05):
            builder.add(
                "wood/walnut", shapes.cylinder(0.02, suite.foot + 0.01, (x, (suite.foot + 0.01) / 2, z), segments=8)
            )
    builder.solid((x0, suite.foot, front), (high, suite.seat, z1))
    builder.surface("chaise", ((x0 + high) / 2, suite.seat - 0.006, (front + z1) / 2), (wide - 0.1, z1 - front - 0.06))


def _framed(builder: Builder, rng: np.random.Generator, suite: _Suite) -> None:
    """Add a wooden frame with one cushion as the seat and one as the back."""
    finish = wood(rng)
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    for side in (-1, 1):
        x = side * (x1 - 0.025)
        for z in (z0 + 0.04, z1 - 0.03):
            builder.block(finish.material, (x - 0.02, x + 0.02), (0, suite.arm_top - 0.02), (z - 0.022, z + 0.022))
            builder.solid((x - 0.02, 0, z - 0.022), (x + 0.02, suite.arm_top, z + 0.022))
        builder.block(finish.material, (x - 0.025, x + 0.025), (suite.arm_top - 0.025, suite.arm_top), (z0, z1), 0.006)
        builder.solid((x - 0.025, suite.arm_top - 0.025, z0), (x + 0.025, suite.arm_top, z1))
        builder.block(
            finish.material, (x - 0.015, x + 0.015), (suite.seat - 0.2, suite.seat - 0.14), (z0 + 0.04, z1 - 0.03)
        )
    inner = (x0 + 0.05, x1 - 0.05)
    builder.block(finish.material, inner, (suite.seat - 0.17, suite.seat - 0.15), (z0 + 0.05, z1 - 0.02))
    builder.add(suite.cushion.material, _soft(inner, (suite.seat - 0.15, suite.seat), (z0 + 0.1, z1), 0.05, 0.012))
    back = _soft(inner, (suite.seat - 0.03, height - 0.01), (z0 + 0.06, z0 + 0.2), 0.06)
    builder.add(suite.cushion.material, shapes.rotate(back, "x", -7, (0, suite.seat, z0 + 0.15)))
    for x in np.linspace(*inner, 5)[1:-1]:
        builder.block(
            finish.material, (x - 0.015, x + 0.015), (suite.seat - 0.15, height - 0.03), (z0 + 0.01, z0 + 0.03)
        )
    builder.block(finish.material, inner, (height - 0.07, height - 0.02), (z0, z0 + 0.035))
    builder.solid((x0 + 0.05, suite.seat - 0.17, z0), (x1 - 0.05, suite.seat, z1))
    builder.solid((x0 + 0.05, suite.seat, z0), (x1 - 0.05, height, z0 + 0.2))
    builder.surface("seat", (0, suite.seat, (z0 + 0.2 + z1) / 2), (inner[1] - inner[0] - 0.06, z1 - z0 - 0.26))


def _soft(
    x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], radius: float, puff: float = 0.0
) -> shapes.Mesh:
    """Return a box with round edges, given by its range along each axis."""
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    return shapes.rounded_box(size, ((x[0] + x[1]) / 2, (y[0] + y[1]) / 2, (z[0] + z[1]) / 2), radius, puff)


MAKERS: dict[str, Maker] = {
    "ArmChair": arm_chair,
    "Sofa": sofa,
}
