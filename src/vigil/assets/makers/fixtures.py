"""What is built into kitchens: counters."""

from collections.abc import Sequence

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, Range
from vigil.assets.kernel.furniture_parts import (
    HANDLES,
    WOODS,
    Finish,
    front_board,
    handle,
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


MAKERS: dict[str, Maker] = {
    "CounterTop": counter_top,
}
