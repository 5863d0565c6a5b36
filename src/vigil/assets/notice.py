"""The notice on a machine that is out of order: a sheet of paper on its front, drawn only while it is broken.

Engines add the notice to an asset after its maker has built it, so that shapes and their fingerprints do not change.
"""

import re
from collections.abc import Iterable

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset, Mesh, Part
from vigil.assets.kernel.shapes import box, boxes
from vigil.base.caches import cached_while_alive
from vigil.base.geometry import Vec3

WIDTH_M, HEIGHT_M, THICK_M = 0.297, 0.21, 0.002
"""Width, height and thickness (m) of the sheet, which is A4 paper."""
LINES = ("OUT OF", "ORDER")
MACHINES = frozenset(
    {
        *("Television", "FloorLamp", "DeskLamp", "Microwave", "CoffeeMachine", "Toaster"),
        *("WashingMachine", "ClothesDryer", "Desktop"),
    }
)
"""Categories that can be broken: they can be switched on and have a front to which a sheet can be fixed."""
PAPER, INK = "paper/#f7f5ee", "paper/#b01218"
_GLYPHS = {
    "D": ("####.", "#...#", "#...#", "#...#", "#...#", "#...#", "####."),
    "E": ("#####", "#....", "#....", "####.", "#....", "#....", "#####"),
    "F": ("#####", "#....", "#....", "####.", "#....", "#....", "#...."),
    "O": (".###.", "#...#", "#...#", "#...#", "#...#", "#...#", ".###."),
    "R": ("####.", "#...#", "#...#", "####.", "#.#..", "#..#.", "#...#"),
    "T": ("#####", "..#..", "..#..", "..#..", "..#..", "..#..", "..#.."),
    "U": ("#...#", "#...#", "#...#", "#...#", "#...#", "#...#", ".###."),
    " ": (".....",) * 7,
}
_COLUMNS, _ROWS = 6, 7
"""Width of a letter (with the gap after it) and height of a letter, in dots."""
_BORDER_M, _RAISED_M, _LINE_SHARE, _TEXT_SHARE = 0.008, 0.0006, 0.36, 0.88
"""Width (m) of the sheet's frame; height (m) of ink above the paper; height of a line as a share of the sheet's height;
width of the text as a share of the sheet's width."""
_LINES_AT = (0.21, -0.21)
"""How far the middle of each line is above the sheet's middle, as a share of the sheet's height."""
_HEIGHTS = 9
"""Number of heights at which the sheet's place is tried."""
_GRID = 9
"""Number of points along each side of the sheet at which the depth of the front behind the sheet is measured."""
_SLACK_M = 0.001
"""Triangles farther than this (m) from the sheet are not measured. This distance is far more than a rounding error."""


@cached_while_alive
def notice_parts(asset: Asset) -> tuple[Part, ...]:
    """Return the parts of the sheet, placed on an asset; empty if the asset cannot have a sheet."""
    if asset.category not in MACHINES or not CATALOG[asset.category].is_toggleable:
        return ()
    height, depth, joint = _place(asset)
    if not np.isfinite(depth):
        return ()
    return tuple(
        Part(name, mesh, material, joint=joint, shown="broken")
        for name, mesh, material in _sheet(height, depth + THICK_M)
    )


def notice_centre(asset: Asset) -> Vec3 | None:
    """Return the middle of the sheet in the asset's frame; None if the asset cannot have a sheet."""
    if not notice_parts(asset):
        return None
    height, depth, _ = _place(asset)
    return Vec3(0.0, float(height), float(depth + THICK_M))


@cached_while_alive
def _place(asset: Asset) -> tuple[float, float, str | None]:
    """Return the height of the sheet's middle, the z of the front behind it, and the joint that carries the sheet.

    z is -inf if nothing can carry the sheet. The best height has the most of the front behind the sheet. Of equally
    good heights, the one with the flattest front is chosen; of these, the highest.
    """
    half = asset.size.y / 2
    low, high = min(-half + HEIGHT_M / 2, half - HEIGHT_M / 2), max(-half + HEIGHT_M / 2, half - HEIGHT_M / 2)
    shown = [part for part in asset.parts if part.shown in ("always", "off")]
    fronts = [_front_triangles(part) for part in shown]
    corners = np.concatenate(fronts) if fronts else np.empty((0, 3, 3))
    joints = [part.joint for part, front in zip(shown, fronts, strict=True) for _ in front]
    found: list[tuple[int, float, float, float, str | None]] = []
    for height in np.linspace(low, high, _HEIGHTS):
        near = np.flatnonzero(_reaches(corners[..., 1], height, HEIGHT_M))
        if not len(near):
            continue
        depths = _depths(corners[near], float(height))
        front, owner = depths.max(axis=1), near[depths.argmax(axis=1)]
        is_met = np.isfinite(front)
        if is_met.any():
            nearest = int(np.where(is_met, front, -np.inf).argmax())
            flat = round(-float(np.ptp(front[is_met])), 3)
            found.append((int(is_met.sum()), flat, float(height), float(front[nearest]), joints[owner[nearest]]))
    if not found:
        return 0.0, -np.inf, None
    _, _, height, depth, joint = max(found, key=lambda each: each[:3])
    return height, depth, joint


def _front_triangles(part: Part) -> np.ndarray:
    """Return the corners (n, 3, 3) of those triangles of a part that face the front and may be behind a sheet."""
    corners = part.mesh.vertices.astype(float)[part.mesh.faces]
    corners = corners[_reaches(corners[..., 0], 0.0, WIDTH_M)]
    sides = corners[:, 1:] - corners[:, :1]
    ahead = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    return corners[ahead > 0]


def _reaches(places: np.ndarray, middle: float, length: float) -> np.ndarray:
    """Return a mask (n,) of the triangles that reach into an interval of this length around `middle`, along one axis.

    `places` (n, 3) are the coordinates of the triangles' corners along this axis.
    """
    half = length / 2 + _SLACK_M
    return (places.max(axis=1) >= middle - half) & (places.min(axis=1) <= middle + half)


def _depths(corners: np.ndarray, height: float) -> np.ndarray:
    """Return each triangle's z (points, n) at the points of a sheet; -inf where a point is outside the triangle."""
    across, up = np.linspace(-0.5, 0.5, _GRID) * WIDTH_M, height + np.linspace(-0.5, 0.5, _GRID) * HEIGHT_M
    x, y = (axis.ravel() for axis in np.meshgrid(across, up))
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    dx, dy = x[:, None] - a[:, 0], y[:, None] - a[:, 1]
    of_b = (dx * (c[:, 1] - a[:, 1]) - dy * (c[:, 0] - a[:, 0])) / area
    of_c = (dy * (b[:, 0] - a[:, 0]) - dx * (b[:, 1] - a[:, 1])) / area
    is_in = (of_b >= 0) & (of_c >= 0) & (of_b + of_c <= 1)
    depth = a[:, 2] + of_b * (b[:, 2] - a[:, 2]) + of_c * (c[:, 2] - a[:, 2])
    return np.where(is_in, depth, -np.inf)


def _sheet(height: float, depth: float) -> Iterable[tuple[str, Mesh, str]]:
    """Yield (name, mesh, material) of the sheet's parts; the front of the paper is at z = `depth`."""
    yield "notice", box((WIDTH_M, HEIGHT_M, THICK_M), (0.0, height, depth - THICK_M / 2)), PAPER
    front = depth + _RAISED_M / 2
    across, up = WIDTH_M / 2 - _BORDER_M / 2, HEIGHT_M / 2 - _BORDER_M / 2
    frame = [((WIDTH_M, _BORDER_M, _RAISED_M), (0.0, height + sign * up, front)) for sign in (1, -1)]
    frame += [((_BORDER_M, HEIGHT_M, _RAISED_M), (sign * across, height, front)) for sign in (1, -1)]
    letters = [
        ((run * width, tall, _RAISED_M), (x, height + y, front))
        for number, line in enumerate(LINES)
        for x, y, run, width, tall in _strokes(line, number)
    ]
    sizes, centers = zip(*frame, *letters, strict=True)
    yield "notice text", boxes(sizes, centers), INK


def _strokes(line: str, number: int) -> Iterable[tuple[float, float, int, float, float]]:
    """Yield the horizontal strokes of a line of text: x and y of the middle, number of dots, width and height of a dot.

    A reader looks along -z, and so has +x on the left.
    """
    width = WIDTH_M * _TEXT_SHARE / (_COLUMNS * max(map(len, LINES)) - 1)
    tall = HEIGHT_M * _LINE_SHARE / _ROWS
    left = -width * (_COLUMNS * len(line) - 1) / 2
    top = HEIGHT_M * _LINES_AT[number] + tall * _ROWS / 2
    for place, letter in enumerate(line):
        for row, dots in enumerate(_GLYPHS[letter]):
            for found in re.finditer("#+", dots):
                start, run = found.start(), len(found[0])
                x = left + (_COLUMNS * place + start + run / 2) * width
                yield -x, top - (row + 0.5) * tall, run, width, tall
