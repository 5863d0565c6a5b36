"""Which solids of a house share room: those of its things as they stand, and those of leaves on their way."""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import MultiPoint, Polygon, STRtree

from vigil.housegen.solids import Body, Prism

OVERLAP_M = 0.005
SWEEP = tuple(step / 16 for step in range(17))
"""Openness at which leaves and drawers are looked at."""
POLYGON = shapely.GeometryType.POLYGON.value


class Pairs:
    """Finds solids that share room."""

    def __init__(self, bodies: list[Body]) -> None:
        self.prisms: list[Prism] = []
        self.owners: list[Body] = []
        for body in bodies:
            if body.is_tilted:
                continue
            for prism in body.prisms():
                self.prisms.append(prism)
                self.owners.append(body)
        self.shapes = _shrunk(self.prisms)
        self.tree = STRtree(self.shapes)

    def overlaps(self) -> Iterator[tuple[Body, Body, float]]:
        """Yields each pair of things that share more than 5 mm of room, with how high (m) that is."""
        seen: set[tuple[str, str]] = set()
        first, second = self.tree.query(self.shapes, predicate="intersects")
        for a, b in zip(first.tolist(), second.tolist(), strict=True):
            one, two = self.owners[a], self.owners[b]
            key = (one.id, two.id)
            depth = _depth(self.prisms[a], self.prisms[b])
            if a >= b or key in seen or depth <= OVERLAP_M or _may_share(one, two) or _is_on_or_in(one, two):
                continue
            seen.add(key)
            yield one, two, depth

    def struck_by(self, body: Body) -> Body | None:
        """Returns the first other thing that the body's leaves hit between shut and open; None when they hit none."""
        moving = [prism for openness in SWEEP for prism in body.leaves(openness)]
        others = self._near(moving, body)
        if not others:
            return None
        for prism, shape in zip(moving, _shrunk(moving), strict=True):
            for index in others:
                if _depth(prism, self.prisms[index]) > OVERLAP_M and shape.intersects(self.shapes[index]):
                    return self.owners[index]
        return None

    def _near(self, moving: list[Prism], body: Body) -> list[int]:
        """Returns the solids near the leaves that may stop them; of what carries the body, those that it is not in."""
        if not moving:
            return []
        near = self.tree.query(MultiPoint(np.concatenate([prism.corners for prism in moving])).envelope)
        others = [index for index in near.tolist() if not _may_meet_leaf(body, self.owners[index])]
        around = [index for index in others if self.owners[index] in body.ancestors()]
        if around:
            at_rest = body.leaves(body.openness)
            shapes = _shrunk(at_rest)
            held = {
                index
                for index in around
                for prism, shape in zip(at_rest, shapes, strict=True)
                if _depth(prism, self.prisms[index]) > OVERLAP_M and shape.intersects(self.shapes[index])
            }
            others = [index for index in others if index not in held]
        return others


def _may_share(one: Body, two: Body) -> bool:
    """Whether two things may share room: a thing with itself, legs and a rug, a spout over its basin."""
    if one is two or (one.is_opening and two.is_opening):
        return True
    pair = {one.category, two.category}
    return "Rug" in pair or pair == {"Sink", "Faucet"}


def _is_on_or_in(one: Body, two: Body) -> bool:
    return one in two.ancestors() or two in one.ancestors()


def _may_meet_leaf(body: Body, other: Body) -> bool:
    """Whether a thing cannot stop the body's leaves: it lies inside the body, or goes along with its drawer."""
    if body not in other.ancestors():
        return _may_share(body, other)
    child = next(each for each in [other, *other.ancestors()] if each.parent is body)
    if child.surface is None or child.surface.needs_opening:
        return True
    slides = {joint.name for joint in body.asset.joints if joint.kind == "slide"}
    return child.surface.joint in slides


def _shrunk(prisms: list[Prism]) -> np.ndarray:
    """Returns the prisms' footprints, smaller all round by half of what may overlap."""
    polygons = np.array([prism.polygon for prism in prisms], dtype=object)
    inner = shapely.buffer(polygons, -OVERLAP_M / 2, join_style="mitre")
    for index in np.flatnonzero(shapely.is_empty(inner) | (shapely.get_type_id(inner) != POLYGON)):
        inner[index] = Polygon([polygons[index].centroid.coords[0]] * 4)
    return inner


def _depth(one: Prism, two: Prism) -> float:
    return min(one.top, two.top) - max(one.bottom, two.bottom)
