"""Parts that the makers of furniture and appliances share: finishes, boards, legs, handles, drawers, leaves, shelves.

Coordinates are the builder's: y = 0 is the bottom, +z is the front.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from vigil.assets.kernel import shapes
from vigil.assets.kernel.asset import Mesh
from vigil.assets.kernel.builder import Builder, PartStyle, Range
from vigil.assets.kernel.materials import material
from vigil.assets.kernel.palette import COLOURS, TABLES, one_of

Corner = tuple[float, float, float]
BOARD_M = 0.018
_SEAM = 0.62
"""Factor by which the colour of fronts is multiplied for the seams between them."""


@dataclass(frozen=True, slots=True)
class Finish:
    """A material, and the word that people would use for it."""

    material: str
    word: str


WOODS = [Finish(material, word) for material, word in TABLES["woods"]]
PAINTS = ("white", "cream", "grey", "dark grey", "black", "teal", "navy", "green", "light blue", "red")
HANDLES = (Finish("metal/steel", "steel"), Finish("metal/black", "black"), Finish("metal/brass", "brass"))
CLOTHS = list(TABLES["cloths"].items())
HIDES = (("black", "#2b2829"), ("brown", "#6b452e"), ("tan", "#ad7f4f"), ("white", "#e8e4db"), ("red", "#7e2c2a"))


def wood(rng: np.random.Generator) -> Finish:
    """Return a random finish of wood or painted wood."""
    return one_of(rng, WOODS)


def paint(rng: np.random.Generator, *names: str) -> Finish:
    """Return a painted finish in one of the named colours, or in any colour if none is named."""
    name = one_of(rng, names or PAINTS)
    return Finish(f"paint/{COLOURS[name]}", name)


def cloth(rng: np.random.Generator) -> Finish:
    """Return a random upholstery: fabric, velvet or leather."""
    kind = one_of(rng, ("fabric", "fabric", "velvet", "leather"))
    word, code = one_of(rng, HIDES if kind == "leather" else CLOTHS)
    return Finish(f"{kind}/{code}", word)


def seam_material(front: str) -> str:
    """Return the material of a plate behind fronts; it is darker than the fronts, so that their seams show."""
    red, green, blue = (round(255 * _SEAM * part) for part in material(front).rgba[:3])
    return f"paint/#{red:02x}{green:02x}{blue:02x}"


def boards(low: Corner, high: Corner, wall: float, missing: str) -> list[tuple[Corner, Corner]]:
    """Return the corners of five boards around a space; the side `missing` ("+z", "+y", ...) is open."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    top = y1 if missing == "+y" else y1 - wall
    found: dict[str, tuple[Corner, Corner]] = {
        "-x": ((x0, y0, z0), (x0 + wall, y1, z1)),
        "+x": ((x1 - wall, y0, z0), (x1, y1, z1)),
        "-y": ((x0 + wall, y0, z0), (x1 - wall, y0 + wall, z1)),
        "+y": ((x0 + wall, y1 - wall, z0), (x1 - wall, y1, z1)),
        "-z": ((x0 + wall, y0 + wall, z0), (x1 - wall, top, z0 + wall)),
        "+z": ((x0 + wall, y0 + wall, z1 - wall), (x1 - wall, top, z1)),
    }
    return [corners for side, corners in found.items() if side != missing]


def hollow(low: Corner, high: Corner, wall: float, missing: str = "+z") -> Mesh:
    """Return the mesh of five boards around a space that is open on one side."""
    return shapes.merge(shapes.span(*corners) for corners in boards(low, high, wall, missing))


def add_case(
    builder: Builder, look: PartStyle | str, low: Corner, high: Corner, wall: float, *, missing: str = "+z"
) -> None:
    """Add five boards around a space that is open on one side. Each board is a solid, so that things can be inside."""
    builder.add(look, hollow(low, high, wall, missing))
    for corners in boards(low, high, wall, missing):
        builder.solid(*corners)


def lining(low: Corner, high: Corner, missing: str = "+z") -> Mesh:
    """Return panels that face into a space on all sides except one, as the inner skin of an appliance.

    Each side has four panels, because light is computed at vertices and some vertices must be away from the corners.
    """
    size, middle = np.subtract(high, low), np.add(high, low) / 2
    panels = []
    for axis, (wide, tall) in enumerate(((2, 1), (0, 2), (0, 1))):
        for side, outward in ((-1, "+"), (1, "-")):
            name = f"{'+' if side > 0 else '-'}{'xyz'[axis]}"
            if name == missing:
                continue
            for right, up in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
                center = middle.copy()
                center[axis] += side * size[axis] / 2
                center[wide] += right * size[wide] / 4
                center[tall] += up * size[tall] / 4
                panels.append(
                    shapes.panel(size[wide] / 2, size[tall] / 2, center, f"{outward}{'xyz'[axis]}", fit=False)
                )
    return shapes.merge(panels)


def shelf_heights(levels: Sequence[float], low: float, high: float, count: int) -> list[float]:
    """Return heights of shelves between `low` and `high`: the `levels` or, if none fits, `count` evenly spaced ones."""
    heights: list[float] = []
    for level in levels:
        if low + 0.03 < level < high - 0.05 and (not heights or level - heights[-1] >= 0.06):
            heights.append(level)
    if not heights:
        return [low + (high - low) * (i + 1) / (count + 1) for i in range(count)]
    step = (high - low) / (count + 1)
    ends = [low, *heights, high]
    for lower, upper in pairwise(ends):
        extra = round((upper - lower) / step) - 1
        heights += [lower + (upper - lower) * (i + 1) / (extra + 1) for i in range(extra)]
    return sorted(heights)


def add_shelves(
    builder: Builder,
    look: PartStyle | str,
    low: Corner,
    high: Corner,
    heights: Sequence[float],
    *,
    is_inside: bool = False,
    needs_opening: bool = False,
) -> None:
    """Add boards with their tops at `heights` across a space, and surfaces on these boards and on the space's floor.

    The space reaches from corner `low` to corner `high`. It is behind a door if `needs_opening`, in a case if
    `is_inside`, and else open.
    """
    (x0, y0, z0), (x1, y1, z1) = low, high
    for height in heights:
        builder.block(look, (x0, x1), (height - BOARD_M, height), (z0, z1))
        builder.solid((x0, height - BOARD_M, z0), (x1, height, z1))
    tops = [y0, *heights]
    for index, (top, above) in enumerate(zip(tops, [*heights, y1], strict=True)):
        clearance = above - top - (BOARD_M if index < len(heights) else 0.0)
        name = "floor" if index == 0 else f"shelf{index}"
        center = ((x0 + x1) / 2, top, (z0 + z1) / 2)
        room = (x1 - x0 - 0.01, z1 - z0 - 0.01)
        builder.surface(name, center, room, clearance, is_inside=is_inside, needs_opening=needs_opening)


LegStyle = Literal["square", "tapered", "round", "splayed", "turned"]


def leg(style: LegStyle, foot: tuple[float, float], height: float, thickness: float, lean: float = 0.0) -> Mesh:
    """Return a leg that stands at `foot` (x, z). The top of a splayed leg is `lean` metres nearer to the middle."""
    x, z = foot
    if style == "square":
        return shapes.box((thickness, height, thickness), (x, height / 2, z), 0.08 * thickness)
    if style == "tapered":
        return shapes.cylinder(0.3 * thickness, height, (x, height / 2, z), segments=10, top=0.55 * thickness)
    if style == "round":
        return shapes.cylinder(thickness / 2, height, (x, height / 2, z), segments=12)
    if style == "splayed":
        top = (x - np.sign(x) * lean, height, z - np.sign(z) * lean)
        return shapes.tube([(x, 0, z), top], (0.3 * thickness, 0.5 * thickness), 10)
    r = thickness / 2
    profile = [
        (0.0, 0.0), (0.6 * r, 0.0), (0.7 * r, 0.06 * height), (0.45 * r, 0.12 * height), (0.7 * r, 0.4 * height),
        (0.95 * r, 0.6 * height), (0.5 * r, 0.74 * height), (r, 0.78 * height), (r, height), (0.0, height),
    ]  # fmt: skip
    return shapes.lathe(profile, (x, 0, z), 12)


def add_legs(
    builder: Builder,
    look: PartStyle | str,
    spread: tuple[float, float],
    height: float,
    thickness: float,
    style: LegStyle,
    middle: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Add four legs and their solids; `spread` (x, z) is the size of the area within their outer corners."""
    for sx in (-1, 1):
        for sz in (-1, 1):
            x = middle[0] + sx * (spread[0] - thickness) / 2
            z = middle[1] + sz * (spread[1] - thickness) / 2
            builder.add(look, leg(style, (x, z), height, thickness, min(0.12 * height, 0.08)))
            half = thickness / 2
            builder.solid((x - half, 0, z - half), (x + half, height, z + half))


HandleKind = Literal["knob", "bar", "cup"]


def handle(kind: HandleKind, at: Corner, length: float, *, upright: bool = False) -> Mesh:
    """Return a handle that starts at the point `at` on a face and sticks out about 3 cm to the front."""
    x, y, z = at
    if kind == "knob":
        return shapes.cylinder(0.009, 0.028, (x, y, z + 0.014), "z", 9, top=0.016)
    if kind == "cup":
        return shapes.rounded_box((length, 0.022, 0.026), (x, y, z + 0.013), 0.01)
    half_x, half_y = (0.0, length / 2) if upright else (length / 2, 0.0)
    ends = ((x - half_x, y - half_y), (x + half_x, y + half_y))
    posts = [shapes.span((px - 0.006, py - 0.006, z), (px + 0.006, py + 0.006, z + 0.028)) for px, py in ends]
    bar = (0.012, length + 0.012, 0.012) if upright else (length + 0.012, 0.012, 0.012)
    return shapes.merge([*posts, shapes.box(bar, (x, y, z + 0.026))])


@dataclass(frozen=True, slots=True)
class Fronts:
    """The look of drawer fronts and door leaves."""

    front: str
    inner: str
    metal: str
    knob: HandleKind = "knob"
    is_framed: bool = False
    """Whether each front has a raised frame around a sunken panel."""


def random_fronts(rng: np.random.Generator, front: str, inner: str, framed_share: float) -> Fronts:
    """Return fronts with random handles; they are framed with the probability `framed_share`."""
    kinds: tuple[HandleKind, ...] = ("knob", "bar", "cup")
    return Fronts(front, inner, one_of(rng, HANDLES).material, one_of(rng, kinds), bool(rng.random() < framed_share))


def front_board(low: Corner, high: Corner, *, is_framed: bool) -> Mesh:
    """Return one front: a bevelled board or, if `is_framed`, a frame around a thinner panel."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    rim = min(0.06, 0.22 * min(x1 - x0, y1 - y0))
    if not is_framed or min(x1 - x0, y1 - y0) < 0.12:
        return shapes.span(low, high, 0.003)
    sunk = z1 - 0.4 * (z1 - z0)
    return shapes.merge([
        shapes.span((x0 + rim, y0 + rim, z0), (x1 - rim, y1 - rim, sunk)),
        shapes.span((x0, y0, z0), (x0 + rim, y1, z1)),
        shapes.span((x1 - rim, y0, z0), (x1, y1, z1)),
        shapes.span((x0 + rim, y0, z0), (x1 - rim, y0 + rim, z1)),
        shapes.span((x0 + rim, y1 - rim, z0), (x1 - rim, y1, z1)),
    ])  # fmt: skip


def add_drawer(
    builder: Builder, name: str, low: Corner, high: Corner, fronts: Fronts, travel: float, *, overlay: float = 0.0
) -> None:
    """Add a drawer that fills the box from `low` to `high`; its front faces +z and carries the handle.

    The front is larger than the drawer behind it by `overlay` (m) on the left, right, top and bottom.
    """
    joint = builder.slide(name, (0, 0, 1), travel)
    board = (low[0], low[1], high[2] - BOARD_M)
    builder.add(PartStyle(fronts.front, joint), front_board(board, high, is_framed=fronts.is_framed))
    x0, y0, z0 = low[0] + overlay, low[1] + overlay, low[2]
    x1, y1, z1 = high[0] - overlay, high[1] - overlay, high[2]
    rim = _rim(y0, y1)
    inner_low, inner_high = (x0 + 0.012, y0 + rim, z0), (x1 - 0.012, y1 - 0.12 * (y1 - y0) - rim, z1 - BOARD_M)
    builder.add(PartStyle(fronts.inner, joint), hollow(inner_low, inner_high, 0.01, "+y"))
    builder.add(PartStyle(fronts.metal, joint), *_drawer_handles(low, high, fronts.knob))
    builder.surface(
        name,
        ((x0 + x1) / 2, y0 + rim + 0.01, (z0 + z1) / 2 - BOARD_M / 2),
        (x1 - x0 - 0.05, z1 - z0 - BOARD_M - 0.03),
        max(y1 - y0 - rim - 0.02, 0.01),
        needs_opening=True,
        joint=joint,
    )
    builder.solid((x0, y0, z0), (x1, y1, z1), joint)
    if overlay:
        builder.solid(board, high, joint)


def add_drawers(
    builder: Builder,
    fronts: Fronts,
    box: tuple[Corner, Corner],
    grid: tuple[Sequence[Range], Sequence[tuple[Range, float]]],
    first: int = 0,
) -> None:
    """Add drawers, numbered row by row from `first`, and a plate behind the seams between their fronts.

    `grid` has two lists: the extent of each column along x; and for each row, its extent along y and how far (m) its
    drawers open. The `box` reaches from the backs of the drawers to their front faces. The plate fills the box's
    cross-section, except for openings for the drawers, so that seams do not show the dark inside.
    """
    (x0, y0, back), (x1, y1, front), columns = *box, grid[0]
    look, z = seam_material(fronts.front), (front - BOARD_M - 0.004, front - BOARD_M - 0.001)
    posts = [x0, *(edge for left, right in columns for edge in (left + 0.011, right - 0.011)), x1]
    rails = [y0, *(edge for (low, high), _ in grid[1] for edge in (low + _rim(low, high) - 0.001, high - 0.004)), y1]
    for x in zip(posts[::2], posts[1::2], strict=True):
        builder.block(look, x, (y0, y1), z)
    for x in zip(posts[1:-1:2], posts[2:-1:2], strict=True):
        for y in zip(rails[::2], rails[1::2], strict=True):
            builder.block(look, x, y, z)
    for row, ((low, high), travel) in enumerate(grid[1]):
        for column, (left, right) in enumerate(columns):
            name = f"drawer{first + row * len(columns) + column}"
            add_drawer(builder, name, (left, low, back), (right, high, front), fronts, travel)


def _rim(bottom: float, top: float) -> float:
    """Return how far (m) a drawer's front, which is from `bottom` to `top` (m), reaches below the drawer's box."""
    return min(0.012, 0.1 * (top - bottom))


def _drawer_handles(low: Corner, high: Corner, kind: HandleKind) -> list[Mesh]:
    width, y = high[0] - low[0], low[1] + 0.55 * (high[1] - low[1])
    middle, z = (low[0] + high[0]) / 2, high[2]
    if kind == "knob" and width > 0.55:
        return [handle(kind, (middle + side * 0.28 * width, y, z), 0.0) for side in (-1, 1)]
    return [handle(kind, (middle, y, z), min(0.14, 0.5 * width))]


def add_leaf(builder: Builder, name: str, low: Corner, high: Corner, fronts: Fronts, *, hinge: int) -> None:
    """Add a door leaf that fills the box from `low` to `high`.

    The hinge is at the -x edge if `hinge` is -1, and at the +x edge if it is 1. The hinge's axis is in front of the
    leaf by as much as the handle sticks out. So the handle stays within the furniture's sides when the leaf is open.
    """
    (x0, y0, _), (x1, y1, z1) = low, high
    origin = (x0 if hinge < 0 else x1, 0.0, z1 + handle_room(fronts.knob))
    joint = builder.hinge(name, (0, 1, 0), origin, hinge * 90.0)
    builder.add(PartStyle(fronts.front, joint), front_board(low, high, is_framed=fronts.is_framed))
    inset = min(0.05, 0.2 * (x1 - x0))
    at = (x1 - inset if hinge < 0 else x0 + inset, y0 + 0.55 * (y1 - y0), z1)
    builder.add(PartStyle(fronts.metal, joint), handle(fronts.knob, at, min(0.16, 0.4 * (y1 - y0)), upright=True))
    builder.solid(low, high, joint)


def handle_room(kind: HandleKind) -> float:
    """Return how far (m) handles of a kind stick out."""
    return {"knob": 0.028, "bar": 0.032, "cup": 0.026}[kind]
