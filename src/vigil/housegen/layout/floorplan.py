"""Floor plan: rooms of given kinds and areas inside one outline; rooms are rectangular, L-shaped or T-shaped.

First the outline is cut into rectangles with the rooms' areas. Then neighbouring rooms exchange blocks at their
corners, which gives L- and T-shaped rooms. A plan is accepted only if doors between suitable kinds of rooms connect all
rooms. All coordinates are whole decimetres, so that the walls of neighbours coincide exactly.
"""

import math
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from vigil.errors import SettingError
from vigil.housegen.base.randomness import chance, pick, shuffled
from vigil.housegen.base.spec import AREA_M2, SINGLE_ROOM_SCALE, HouseSpec
from vigil.housegen.base.tables import TABLES

UNIT_M = 0.1
"""Length (m) of the unit of this module, a decimetre."""
NARROWEST = {"Kitchen": 26, "LivingRoom": 30, "Bedroom": 28, "Bathroom": 20}
"""Kind of room -> least width (dm) of such a room."""
DOOR_WALL = 15
"""Least length (dm) of the wall that two rooms share if there is a door between them."""
MAX_ASPECT = 2.1
"""Greatest ratio of a room's long side to its short side."""
LAMP_ROOM_M = 0.3
"""A lamp hangs at a floor's centre only if everything within this radius (m) of the centre is in the room."""
ATTEMPTS = 400
"""Greatest number of random plans that are tried for a house."""

LINK_COST = {
    pair: cost for first, second, cost in TABLES["layout"]["link_cost"] for pair in ((first, second), (second, first))
}
"""Cost of a door between two kinds of rooms; unusual doors have a higher cost."""
PASSAGE_COST = {"Kitchen": 0.1, "LivingRoom": 0.0, "Bedroom": 0.9, "Bathroom": 4.0}
"""Cost of having to walk through a room of this kind to another room; unusual ways have a higher cost."""

Corner = tuple[float, float]
"""Floor point (x, z) in metres."""


@dataclass(frozen=True, slots=True)
class RoomPlan:
    """A room of a plan."""

    number: int
    """Number of the room in the house."""
    kind: str
    corners: tuple[Corner, ...]
    """Corners of the floor, clockwise as seen from above."""

    @property
    def id(self) -> str:
        """Id of the room in the document."""
        return f"room|{self.number}"

    @property
    def polygon(self) -> Polygon:
        """Floor of the room as a polygon (m)."""
        return Polygon(self.corners)

    @property
    def middle(self) -> Point:
        """Place of the room's lamp: the floor's centre, or a point well inside the floor if the centre is not in it."""
        floor = self.polygon
        is_inside = floor.contains(floor.centroid.buffer(LAMP_ROOM_M))
        return floor.centroid if is_inside else floor.representative_point()


@dataclass(frozen=True, slots=True)
class RoomLayout:
    """The rooms of a house and the doors between them."""

    rooms: tuple[RoomPlan, ...]
    links: tuple[tuple[int, int], ...]
    """Pairs of room numbers; a door connects the rooms of each pair."""
    height_m: float
    """Height (m) of the ceiling."""

    def room(self, number: int) -> RoomPlan:
        """Return the room with this number."""
        return next(room for room in self.rooms if room.number == number)


def plan_rooms(spec: HouseSpec, rng: np.random.Generator) -> RoomLayout:
    """Return a plan for `spec`. Raises SettingError if no plan is found."""
    kinds = pick(rng, spec.choices)
    height = round(float(rng.uniform(*spec.ceiling_m)), 2)
    best: tuple[float, list[Polygon], list[tuple[int, int]]] | None = None
    found = 0
    for _ in range(ATTEMPTS):
        shapes = _shapes(spec, kinds, rng)
        links = None if shapes is None else _links(kinds, shapes, rng)
        if shapes is None or links is None:
            continue
        cost = _tree_cost(kinds, links)
        if best is None or cost < best[0]:
            best = (cost, shapes, links)
        found += 1
        if found >= 4 or best[0] <= 0.7 * (len(kinds) - 1):
            break
    if best is None:
        raise SettingError(
            f"House spec {spec.name!r}: no floor plan was found for {', '.join(kinds)}; ask for more area."
        )
    _, shapes, links = best
    return _in_metres(kinds, shapes, links, height)


def _shapes(spec: HouseSpec, kinds: tuple[str, ...], rng: np.random.Generator) -> list[Polygon] | None:
    areas = _areas(spec, kinds, rng)
    total = sum(areas) / UNIT_M**2
    aspect = float(rng.uniform(1.0, 1.5))
    width = round(math.sqrt(total * aspect))
    depth = round(total / width)
    if chance(rng, 0.5):
        width, depth = depth, width
    order = shuffled(rng, range(len(kinds)))
    rects = _slice((0, 0, width, depth), order, areas, rng)
    shapes = [box(*rects[index]) for index in range(len(kinds))]
    if not all(_is_wide_enough(kind, shape) for kind, shape in zip(kinds, shapes, strict=True)):
        return None
    for _ in range(len(kinds)):
        _trade_block(kinds, shapes, rng)
    for index in shuffled(rng, range(len(kinds)))[:2]:
        if chance(rng, 0.42 if len(kinds) == 1 else 0.2):
            _cut_corner(kinds, shapes, index, rng)
    return shapes


def _areas(spec: HouseSpec, kinds: tuple[str, ...], rng: np.random.Generator) -> list[float]:
    scale, spread = (SINGLE_ROOM_SCALE[kinds[0]], 0.38) if len(kinds) == 1 else (1.0, 0.28)
    areas = []
    for kind in kinds:
        low, middle, high = AREA_M2[kind]
        areas.append(float(np.clip(middle * scale * math.exp(spread * rng.standard_normal()), low, high * scale)))
    if spec.area_m2 is not None:
        areas = [area * spec.area_m2 / sum(areas) for area in areas]
    return areas


def _slice(
    rect: tuple[int, int, int, int], order: list[int], areas: list[float], rng: np.random.Generator
) -> dict[int, tuple[int, int, int, int]]:
    """Return the parts of `rect` for the rooms in `order`, in proportion to their `areas`.

    Each cut goes across the longer side.
    """
    if len(order) == 1:
        return {order[0]: rect}
    x0, z0, x1, z1 = rect
    cuts = range(1, len(order))
    whole = sum(areas[index] for index in order)
    shares = [sum(areas[index] for index in order[:cut]) / whole for cut in cuts]
    middling = [cut for cut, share in zip(cuts, shares, strict=True) if 0.25 <= share <= 0.75] or list(cuts)
    cut = pick(rng, middling)
    share = shares[cut - 1]
    if x1 - x0 >= z1 - z0:
        at = x0 + round((x1 - x0) * share)
        first, second = (x0, z0, at, z1), (at, z0, x1, z1)
    else:
        at = z0 + round((z1 - z0) * share)
        first, second = (x0, z0, x1, at), (x0, at, x1, z1)
    return _slice(first, order[:cut], areas, rng) | _slice(second, order[cut:], areas, rng)


def _is_wide_enough(kind: str, shape: BaseGeometry) -> bool:
    """Return whether a shape is one piece without holes, wide enough for this kind of room, and not too long."""
    if not isinstance(shape, Polygon) or shape.interiors or not shape.is_valid:
        return False
    x0, z0, x1, z1 = shape.bounds
    long, short = max(x1 - x0, z1 - z0), min(x1 - x0, z1 - z0)
    if short < NARROWEST[kind] or long > MAX_ASPECT * short or shape.area * UNIT_M**2 < AREA_M2[kind][0] * 0.8:
        return False
    if shape.area == (x1 - x0) * (z1 - z0):
        return True  # a rectangle has the same width everywhere
    core = shape.buffer(-NARROWEST[kind] / 2 + 3.1, join_style="mitre")
    opened = core.buffer(NARROWEST[kind] / 2 - 3.1, join_style="mitre")
    return isinstance(core, Polygon) and not core.is_empty and opened.area > 0.99 * shape.area


def _trade_block(kinds: tuple[str, ...], shapes: list[Polygon], rng: np.random.Generator) -> None:
    """Move a block at a corner from one room to its neighbour, if both are still wide enough afterwards."""
    pairs = [pair for pair, length in _shared_lengths(shapes).items() if length > DOOR_WALL]
    if not pairs or chance(rng, 0.4):
        return
    giver, taker = shuffled(rng, pick(rng, pairs))
    block = _corner_block(shapes[giver], rng)
    given = shapes[giver].difference(block)
    taken = shapes[taker].union(block.intersection(shapes[giver]))
    if _is_fit(kinds[giver], given) and _is_fit(kinds[taker], taken):
        shapes[giver], shapes[taker] = _simplified(given), _simplified(taken)


def _corner_block(shape: Polygon, rng: np.random.Generator) -> Polygon:
    x0, z0, x1, z1 = (round(value) for value in shape.bounds)
    width = round((x1 - x0) * float(rng.uniform(0.2, 0.5)))
    depth = round((z1 - z0) * float(rng.uniform(0.2, 0.5)))
    left = x0 if chance(rng, 0.5) else x1 - width
    low = z0 if chance(rng, 0.5) else z1 - depth
    return box(left, low, left + width, low + depth)


def _cut_corner(kinds: tuple[str, ...], shapes: list[Polygon], index: int, rng: np.random.Generator) -> None:
    """Cut off a corner of a room at the house's outline, if the room is still wide enough afterwards."""
    block = _corner_block(shapes[index], rng)
    left = shapes[index].difference(block)
    others = [shape for other, shape in enumerate(shapes) if other != index]
    touches = any(block.boundary.intersection(shape.boundary).length > 0 for shape in others)
    if not touches and _is_fit(kinds[index], left):
        shapes[index] = _simplified(left)


def _is_fit(kind: str, shape: BaseGeometry) -> bool:
    """Return whether a room can have this shape: at most eight corners, no short edges, and wide enough."""
    if not isinstance(shape, Polygon) or shape.is_empty or shape.interiors:
        return False
    corners = _simplified(shape).exterior.coords[:-1]
    steps = [math.dist(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return len(corners) <= 8 and min(steps) >= 7 and _is_wide_enough(kind, shape)


def _simplified(shape: Polygon | BaseGeometry) -> Polygon:
    """Return the polygon without those corners at which its edge goes straight on."""
    assert isinstance(shape, Polygon)
    points = [(round(x), round(z)) for x, z in shape.exterior.coords[:-1]]
    kept = [
        point
        for before, point, after in zip([points[-1], *points[:-1]], points, [*points[1:], points[0]], strict=True)
        if (point[0] - before[0]) * (after[1] - point[1]) != (point[1] - before[1]) * (after[0] - point[0])
    ]
    return Polygon(kept)


def _shared_lengths(shapes: list[Polygon]) -> dict[tuple[int, int], float]:
    """Return, for each pair of shape indices, the length (dm) of the wall that the two shapes share."""
    pairs = list(combinations(range(len(shapes)), 2))
    if not pairs:
        return {}
    edges = shapely.boundary(np.array(shapes, dtype=object))
    first, second = np.array(pairs).T
    lengths = shapely.length(shapely.intersection(edges[first], edges[second]))
    return dict(zip(pairs, lengths.tolist(), strict=True))


def longest_shared(a: BaseGeometry, b: BaseGeometry) -> float:
    """Return the length of the longest straight wall that two shapes share; 0 when they do not share a wall."""
    common = a.boundary.intersection(b.boundary)
    best = 0.0
    for line in getattr(common, "geoms", [common]):
        points = list(line.coords)
        runs: dict[tuple[bool, float], float] = {}
        for (ax, az), (bx, bz) in pairwise(points):
            key = (ax == bx, ax if ax == bx else az)
            runs[key] = runs.get(key, 0.0) + math.dist((ax, az), (bx, bz))
        best = max([best, *runs.values()])
    return best


def _links(kinds: tuple[str, ...], shapes: list[Polygon], rng: np.random.Generator) -> list[tuple[int, int]] | None:
    """Return the doors as pairs of room indices; None if some room cannot be reached.

    The doors form a spanning tree of the most usual doors; sometimes one more door is added.
    """
    costs: dict[tuple[int, int], float] = {}
    for a, b in combinations(range(len(kinds)), 2):
        if longest_shared(shapes[a], shapes[b]) >= DOOR_WALL:
            costs[a, b] = LINK_COST[kinds[a], kinds[b]] + 0.3 * float(rng.random())
    tree: list[tuple[int, int]] = []
    group = list(range(len(kinds)))
    for a, b in sorted(costs, key=lambda pair: costs[pair]):
        if group[a] != group[b]:
            old, new = group[b], group[a]
            group = [new if member == old else member for member in group]
            tree.append((a, b))
    if len(tree) != len(kinds) - 1:
        return None
    spare = [pair for pair in costs if pair not in tree and costs[pair] < 0.9]
    if spare and chance(rng, 0.35):
        tree.append(pick(rng, spare))
    return tree


def _tree_cost(kinds: tuple[str, ...], links: list[tuple[int, int]]) -> float:
    degree = [0] * len(kinds)
    cost = 0.0
    for a, b in links:
        degree[a] += 1
        degree[b] += 1
        cost += LINK_COST[kinds[a], kinds[b]]
    return cost + sum(PASSAGE_COST[kind] * max(0, count - 1) for kind, count in zip(kinds, degree, strict=True))


def _in_metres(
    kinds: tuple[str, ...], shapes: list[Polygon], links: list[tuple[int, int]], height: float
) -> RoomLayout:
    assert not any(isinstance(shape, MultiPolygon) for shape in shapes)
    left = min(shape.bounds[0] for shape in shapes)
    low = min(shape.bounds[1] for shape in shapes)
    rooms = []
    for index, (kind, shape) in enumerate(zip(kinds, shapes, strict=True)):
        corners = [(round((x - left) * UNIT_M, 3), round((z - low) * UNIT_M, 3)) for x, z in shape.exterior.coords[:-1]]
        if shape.exterior.is_ccw:
            corners.reverse()
        rooms.append(RoomPlan(index + 2, kind, tuple(corners)))
    numbered = tuple((a + 2, b + 2) for a, b in sorted(links))
    return RoomLayout(tuple(rooms), numbered, height)
