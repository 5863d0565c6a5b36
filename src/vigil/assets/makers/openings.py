"""What fills holes in walls: doors, open door frames, windows and blinds. Leaves open to +z, and fronts face +z."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.furniture_parts import WOODS, Finish, paint
from vigil.assets.kernel.palette import one_of
from vigil.base.geometry import Vec3

_DOUBLE_FROM_M = 1.5
_LEAF_M = 0.04
_JAMB_M = 0.05
_GAP_M, _FLOOR_GAP_M = 0.004, 0.008
"""Gaps (m) around a door's leaf, and below it."""
_GLASS = "glass/#d3e4ea"


def doorway(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a door in its frame; a door wider than 1.5 m has two leaves. Leaves open to +z."""
    builder = Builder("Doorway", size)
    finish = _door_finish(rng)
    frame = finish if rng.random() < 0.5 else paint(rng, "white", "cream")
    grip = 0.35 * size.z
    _frame(builder, frame.material, (-size.z / 2 + 0.7 * grip, size.z / 2 - 0.7 * grip))
    style = one_of(rng, ("panels", "panels", "flush", "glazed", "planks"))
    metal = one_of(rng, ("metal/steel", "metal/brass", "metal/black"))
    low, high = -size.x / 2 + _JAMB_M + _GAP_M, size.x / 2 - _JAMB_M - _GAP_M
    if size.x > _DOUBLE_FROM_M:
        _leaf(builder, "left", (low, -_GAP_M / 2), -1, (style, finish.material, metal))
        _leaf(builder, "right", (_GAP_M / 2, high), 1, (style, finish.material, metal))
    else:
        side = -1 if rng.random() < 0.5 else 1
        _leaf(builder, "leaf", (low, high), side, (style, finish.material, metal))
    return builder.build((finish.word, style))


def _door_finish(rng: np.random.Generator) -> Finish:
    if rng.random() < 0.45:
        return paint(rng, "white", "white", "cream", "grey", "light blue", "green", "red", "navy")
    return one_of(rng, WOODS)


def _frame(builder: Builder, material: str, z: Range) -> None:
    """Add the two sides of a door frame and the top between them."""
    (x0, x1), height = builder.across, builder.height
    for a, b in ((x0, x0 + _JAMB_M), (x1 - _JAMB_M, x1)):
        builder.block(material, (a, b), (0, height), z, 0.006)
        builder.solid((a, 0, z[0]), (b, height, z[1]))
    builder.block(material, (x0 + _JAMB_M, x1 - _JAMB_M), (height - _JAMB_M, height), z, 0.004)
    builder.solid((x0, height - _JAMB_M, z[0]), (x1, height, z[1]))


def _leaf(builder: Builder, name: str, x: Range, hinge: int, looks: tuple[str, str, str]) -> None:
    """Add a door leaf over the range `x`, hinged at its lower (-1) or upper (1) end, with handles on both sides."""
    style, material, metal = looks
    y0, y1, z1 = _FLOOR_GAP_M, builder.height - _JAMB_M - _GAP_M, _LEAF_M / 2
    joint = builder.hinge(name, (0, 1, 0), (x[0] if hinge < 0 else x[1], 0, z1), hinge * 90.0)
    skin = PartStyle(material, joint)
    {"flush": _flush, "glazed": _glazed, "planks": _planked, "panels": _panelled}[style](builder, skin, x, (y0, y1))
    _seal(builder, skin, x, (y0, y1))
    at = x[1] - 0.07 if hinge < 0 else x[0] + 0.07
    reach = builder.depth / 2 - z1
    grips = []
    for side in (-1, 1):
        plate = shapes.box((0.045, 0.2, 0.008), (at, 1.0, side * (z1 + 0.004)), 0.002)
        stem = shapes.cylinder(0.01, reach - 0.008, (at, 1.03, side * (z1 + reach / 2 - 0.004)), "z", 8)
        lever = shapes.box((0.12, 0.018, 0.014), (at + hinge * 0.05, 1.03, side * (z1 + reach - 0.007)), 0.005)
        grips += [plate, stem, lever]
    builder.add(PartStyle(metal, joint), *grips)
    builder.solid((x[0], y0, -z1), (x[1], y1, z1), joint)


def _seal(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    """Add strips that fill the gaps around a shut leaf, so that the next room does not show through them.

    The strips have the leaf's colour; dark strips would look like a stripe on the edge of an open door.
    """
    z = (-0.1 * _LEAF_M, 0.1 * _LEAF_M)
    low, high = (x[0] - _GAP_M, y[0] - _FLOOR_GAP_M + 0.001), (x[1] + _GAP_M, y[1] + _GAP_M)
    for a, b in ((low[0], x[0]), (x[1], high[0])):
        builder.block(skin, (a, b), (low[1], high[1]), z)
    for a, b in ((low[1], y[0]), (y[1], high[1])):
        builder.block(skin, (low[0], high[0]), (a, b), z)


def _flush(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    builder.block(skin, x, y, (-_LEAF_M / 2, _LEAF_M / 2), 0.003)


def _rails(builder: Builder, skin: PartStyle, x: Range, y: Range, openings: Sequence[tuple[Range, Range]]) -> None:
    """Add a frame as thick as the door leaf. It has rectangular openings, one above another."""
    stile = openings[0][0][0] - x[0]
    z = (-_LEAF_M / 2, _LEAF_M / 2)
    builder.block(skin, (x[0], x[0] + stile), y, z, 0.003)
    builder.block(skin, (x[1] - stile, x[1]), y, z, 0.003)
    rows = sorted({opening[1] for opening in openings})
    ends = [y[0], *(edge for row in rows for edge in row), y[1]]
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        builder.block(skin, (x[0] + stile, x[1] - stile), (low, high), z)


def _panelled(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    """Add a frame with sunken panels; a broad door leaf has two columns of panels."""
    wide = x[1] - x[0]
    stile = min(0.11, 0.18 * wide)
    rows = ((y[0] + 0.2, 0.42 * y[1]), (0.42 * y[1] + 0.12, 0.8 * y[1]), (0.8 * y[1] + 0.09, y[1] - 0.11))
    openings = [((x[0] + stile, x[1] - stile), row) for row in rows]
    _rails(builder, skin, x, y, openings)
    middle, half = (x[0] + x[1]) / 2, 0.04 if wide > 0.65 else 0.0
    if half:
        builder.block(skin, (middle - half, middle + half), (rows[0][0], rows[-1][1]), (-_LEAF_M / 2, _LEAF_M / 2))
    for across, (low, high) in openings:
        builder.block(skin, across, (low, high), (-0.2 * _LEAF_M, 0.2 * _LEAF_M))
        for a, b in ((across[0], middle - half), (middle + half, across[1])) if half else (across,):
            _moulding(builder, skin, (a, b), (low, high))
            field = (low + 0.035, high - 0.035)
            builder.block(skin, (a + 0.035, b - 0.035), field, (-0.38 * _LEAF_M, 0.38 * _LEAF_M), 0.009)


def _moulding(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    """Add slopes between a frame and the sunken panel in it, on both sides of a door leaf.

    A step instead of a slope would be a dark line, which looks broken from far away.
    """
    profile = ((0.0, _LEAF_M / 2), (0.018, 0.2 * _LEAF_M), (0.018, -0.2 * _LEAF_M), (0.0, -_LEAF_M / 2))
    for edge, side in ((x[0], 1), (x[1], -1)):
        builder.add(skin, shapes.extrude([(edge + side * inward, z) for inward, z in profile], *y, "y"))
    for edge, side in ((y[0], 1), (y[1], -1)):
        builder.add(skin, shapes.extrude([(z, edge + side * inward) for inward, z in profile], *x, "x"))


def _glazed(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    """Add a frame with a panel below and a window above."""
    stile = min(0.11, 0.18 * (x[1] - x[0]))
    across = (x[0] + stile, x[1] - stile)
    rows = ((y[0] + 0.2, 0.42 * y[1]), (0.42 * y[1] + 0.12, y[1] - 0.12))
    _rails(builder, skin, x, y, [(across, row) for row in rows])
    builder.block(skin, across, rows[0], (-0.2 * _LEAF_M, 0.2 * _LEAF_M))
    _moulding(builder, skin, across, rows[0])
    pane = PartStyle(_GLASS, skin.joint)
    builder.block(pane, across, rows[1], (-0.004, 0.004))
    middle, half = sum(across) / 2, sum(rows[1]) / 2
    builder.block(skin, (middle - 0.012, middle + 0.012), rows[1], (-0.012, 0.012))
    builder.block(skin, across, (half - 0.012, half + 0.012), (-0.011, 0.011))


def _planked(builder: Builder, skin: PartStyle, x: Range, y: Range) -> None:
    """Add upright boards with two horizontal boards across them."""
    count = max(3, round((x[1] - x[0]) / 0.15))
    edges = np.linspace(*x, count + 1)
    for low, high in pairwise(edges):
        builder.block(skin, (low, high), y, (-_LEAF_M / 2, 0.2 * _LEAF_M), 0.004)
    for part in (0.14, 0.5, 0.86):
        height = y[0] + part * (y[1] - y[0])
        builder.block(
            skin, (x[0] + 0.01, x[1] - 0.01), (height - 0.06, height + 0.06), (0.2 * _LEAF_M, _LEAF_M / 2), 0.004
        )


def doorframe(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a door frame without a leaf; the opening is free to walk through."""
    builder = Builder("Doorframe", size)
    finish = _door_finish(rng)
    _frame(builder, finish.material, builder.through)
    return builder.build((finish.word,))


def window(size: Vec3, rng: np.random.Generator, levels: Sequence[float]) -> Asset:
    """Return a window: one pane, two sashes, a sliding pane or many small panes; a deep window is a bay window."""
    builder = Builder("Window", size)
    finish = paint(rng, "white", "white", "white", "cream", "grey", "black", "brown")
    (x0, x1), (z0, z1), height = builder.across, builder.through, builder.height
    if size.z > 0.3:
        _bay(builder, finish.material)
        return builder.build((finish.word, "bay"))
    rim = 0.055
    sill = 0.035
    flat = (z0, z1 - 0.25 * size.z)
    for x in ((x0, x0 + rim), (x1 - rim, x1)):
        builder.block(finish.material, x, (sill, height), flat, 0.004)
    builder.block(finish.material, (x0 + rim, x1 - rim), (height - rim, height), flat, 0.004)
    builder.block(finish.material, (x0, x1), (0, sill), (z0, z1), 0.006)
    style = one_of(rng, ("picture", "hung", "slider", "grid"))
    columns = {"picture": 1, "hung": 1, "slider": 2, "grid": max(2, round(size.x / 0.4))}[style]
    rows = {"picture": 1, "hung": 2, "slider": 1, "grid": max(2, round(height / 0.45))}[style]
    bar = 0.02 if style == "grid" else 0.04
    _panes(builder, finish.material, ((x0 + rim, x1 - rim), (sill, height - rim)), (columns, rows), bar)
    builder.solid((x0, 0, z0), (x1, height, z1))
    return builder.build((finish.word, style))


def _panes(builder: Builder, material: str, area: tuple[Range, Range], grid: tuple[int, int], bar: float) -> None:
    """Add a glass pane over an area, with bars that divide it into columns and rows."""
    (x0, x1), (y0, y1) = area
    z = sum(builder.through) / 2 - 0.1 * builder.depth
    builder.block(_GLASS, (x0, x1), (y0, y1), (z - 0.003, z + 0.003))
    thick = min(0.018, 0.3 * builder.depth)
    for x in np.linspace(x0, x1, grid[0] + 1)[1:-1]:
        builder.block(material, (x - bar / 2, x + bar / 2), (y0, y1), (z - thick, z + thick))
    for y in np.linspace(y0, y1, grid[1] + 1)[1:-1]:
        builder.block(material, (x0, x1), (y - bar / 2, y + bar / 2), (z - 0.9 * thick, z + 0.9 * thick))


def _bay(builder: Builder, material: str) -> None:
    """Add three windows that project to -z, away from the room, between a sill and a board above."""
    (x0, x1), (z1, z0), height = builder.across, builder.through, builder.height
    corner = 0.28 * builder.width
    floor = [(x0, z0), (x1, z0), (x1 - corner, z1), (x0 + corner, z1)]
    builder.add(material, shapes.extrude(floor, 0.0, 0.05), shapes.extrude(floor, height - 0.05, height))
    corners = ((x0, z0), (x0 + corner, z1), (x1 - corner, z1), (x1, z0))
    for (ax, az), (bx, bz) in pairwise(corners):
        length, angle = np.hypot(bx - ax, bz - az), -np.degrees(np.arctan2(bz - az, bx - ax))
        middle = ((ax + bx) / 2, 0.0, (az + bz) / 2)

        def place(part: shapes.Mesh, angle: float = angle, middle: tuple[float, float, float] = middle) -> shapes.Mesh:
            return shapes.translate(shapes.rotate(part, "y", angle), middle)

        pane = shapes.box((length, height - 0.1, 0.006), (0, height / 2, 0.02))
        builder.add(_GLASS, place(pane))
        for side in (-1, 1):
            post = shapes.box((0.05, height - 0.1, 0.04), (side * (length / 2 - 0.03), height / 2, 0.02))
            builder.add(material, place(post))
        builder.add(material, place(shapes.box((length - 0.06, 0.035, 0.03), (0, height / 2, 0.02))))
    builder.prism(floor, 0, height)


MAKERS = {"Doorframe": doorframe, "Doorway": doorway, "Window": window}
