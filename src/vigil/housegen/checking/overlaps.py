"""Overlaps of solids in a house: those of things in their present state, and those of leaves while they move."""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import MultiPoint, Polygon, STRtree

from vigil.scene.geometry import Prism, is_upright, moving_prisms_of, prisms_of
from vigil.scene.outlines import polygon_of
from vigil.scene.supports import ancestors, moves_with
from vigil.scene.things import Scene, Thing

OVERLAP_M = 0.005
"""Allowed overlap (m) of two solids."""
OPENNESS_SAMPLES = tuple(step / 16 for step in range(17))
"""Values of openness at which leaves and drawers are tested."""
POLYGON = shapely.GeometryType.POLYGON.value


class SolidOverlaps:
    """Overlaps between the solids of upright things.

    Tilted things are left out, because their solids are larger than the things.
    """

    def __init__(self, scene: Scene) -> None:
        self.prisms: list[Prism] = []
        self.owners: list[Thing] = []
        self._carriers = {thing.id: ancestors(scene, thing) for thing in scene.things.values()}
        for thing in filter(is_upright, scene.things.values()):
            prisms = prisms_of(thing)
            self.prisms += prisms
            self.owners += [thing] * len(prisms)
        self.shapes = _shrunk(self.prisms)
        self.tree = STRtree(self.shapes)

    def overlaps(self) -> Iterator[tuple[Thing, Thing, float]]:
        """Yield (thing, other thing, overlap's height in m) for each pair of things that overlap by more than 5 mm."""
        seen: set[tuple[str, str]] = set()
        for a, shape in enumerate(self.shapes):  # one by one: all pairs at once may not fit into memory
            for b in self.tree.query(shape, predicate="intersects").tolist():
                one, two = self.owners[a], self.owners[b]
                key = (one.id, two.id)
                if a >= b or key in seen:
                    continue
                depth = _depth(self.prisms[a], self.prisms[b])
                is_apart = depth <= OVERLAP_M or _may_overlap(one, two)
                if is_apart or one in self._carriers[two.id] or two in self._carriers[one.id]:
                    continue
                seen.add(key)
                yield one, two, depth

    def first_obstacle(self, thing: Thing) -> Thing | None:
        """Return the first other thing that the thing's leaves hit between shut and open; None if they hit nothing."""
        moving = [prism for openness in OPENNESS_SAMPLES for prism in moving_prisms_of(thing, openness)]
        return next((self.owners[index] for index in self._hit(moving, self._nearby_solids(moving, thing))), None)

    def _hit(self, prisms: list[Prism], solids: list[int]) -> Iterator[int]:
        """Yield the indices of those of the `solids` (indices) that a prism overlaps, prism by prism."""
        for prism, shape in zip(prisms, _shrunk(prisms), strict=True) if solids else ():
            for index in solids:
                if _depth(prism, self.prisms[index]) > OVERLAP_M and shape.intersects(self.shapes[index]):
                    yield index

    def _nearby_solids(self, moving: list[Prism], thing: Thing) -> list[int]:
        """Return the indices of the solids that are near a thing's leaves and may stop them.

        A thing may stand in a carrier, e.g. in a cabinet. So solids of carriers that the leaves overlap from the start
        are left out.
        """
        if not moving:
            return []
        near = self.tree.query(MultiPoint(np.concatenate([prism.polygon for prism in moving])).envelope).tolist()
        owners = {index: self.owners[index] for index in near}
        others = [
            index
            for index, owner in owners.items()
            if not (_may_overlap(thing, owner) or moves_with(thing, owner, self._carriers[owner.id]))
        ]
        around = [index for index in others if owners[index] in self._carriers[thing.id]]
        held = set(self._hit(moving_prisms_of(thing), around))
        return [index for index in others if index not in held]


def _may_overlap(one: Thing, two: Thing) -> bool:
    """Return whether an overlap of two things is allowed.

    It is allowed if both are the same thing or both are openings, if one is a rug, or if one is a sink and the other a
    faucet.
    """
    if one is two or (one.is_structure and two.is_structure):
        return True
    pair = {one.category, two.category}
    return "Rug" in pair or pair == {"Sink", "Faucet"}


def _shrunk(prisms: list[Prism]) -> np.ndarray:
    """Return the footprints of prisms, each shrunk on all sides by half of the allowed overlap."""
    polygons = np.array([polygon_of(prism) for prism in prisms], dtype=object)
    inner = shapely.buffer(polygons, -OVERLAP_M / 2, join_style="mitre")
    for index in np.flatnonzero(shapely.is_empty(inner) | (shapely.get_type_id(inner) != POLYGON)):
        inner[index] = Polygon([polygons[index].centroid.coords[0]] * 4)
    return inner


def _depth(one: Prism, two: Prism) -> float:
    return min(one.top, two.top) - max(one.bottom, two.bottom)
