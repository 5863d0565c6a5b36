"""Relations between things that do not depend on the viewer: "next to", "closest to", "under".

A relation is used only if it clearly holds for one thing and clearly does not hold for the other things that the name
could mean, so that careful listeners agree. Left and right are not used because they depend on the viewer.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from shapely import Polygon

from vigil.base.geometry import Box, Vec3
from vigil.scene.outlines import footprint

NEXT_TO_M, LOOSELY_NEXT_TO_M = 0.35, 1.2
"""Maximum gaps (m) between two things that everybody, and that only some people, would call next to each other."""
LEVEL_M = 0.25
"""Maximum difference (m) between the heights of the undersides of two things that are next to each other."""
CLOSEST_M, FARTHER_BY_M, FARTHER_BY = 2.0, 0.8, 2.0
"""Maximum gap (m) of the closest thing. All other gaps must exceed it by `FARTHER_BY_M` or more, and be
at least `FARTHER_BY` times as large."""
COVERED, PARTLY_COVERED = 0.75, 0.1
"""Minimum share of a thing that must be below another thing for everybody, and for some people, to say "under"."""


@dataclass(frozen=True, slots=True)
class LocatedThing:
    """The facts about a thing's position that relations need."""

    id: str
    room_id: str | None
    box: Box


RelationReferents = Callable[[Sequence[LocatedThing], LocatedThing], list[str]]
"""Function that takes things and an anchor and returns the ids of the things that may be meant. It returns a single id
only if the relation clearly holds."""


def _meant(could: Sequence[LocatedThing], is_clear: Callable[[LocatedThing], bool]) -> list[str]:
    """Return the ids of the things that could be meant. A single one is returned only if the relation is clear."""
    return [thing.id for thing in could if len(could) != 1 or is_clear(thing)]


def _next_to(things: Sequence[LocatedThing], anchor: LocatedThing) -> list[str]:
    gaps = {thing.id: gap_m(thing.box, anchor.box) for thing in things}
    could = [thing for thing in things if gaps[thing.id] <= LOOSELY_NEXT_TO_M and thing.room_id == anchor.room_id]
    return _meant(
        could,
        lambda only: 0.0 < gaps[only.id] <= NEXT_TO_M and abs(only.box.bottom - anchor.box.bottom) <= LEVEL_M,
    )


def _closest_to(things: Sequence[LocatedThing], anchor: LocatedThing) -> list[str]:
    gaps = {thing.id: gap_m(thing.box, anchor.box) for thing in things}
    least = min(gaps.values(), default=0.0)
    could = [thing for thing in things if gaps[thing.id] < max(FARTHER_BY * least, least + FARTHER_BY_M)]
    return _meant(could, lambda only: least <= CLOSEST_M and only.room_id == anchor.room_id)


def _under(things: Sequence[LocatedThing], anchor: LocatedThing) -> list[str]:
    above = _floor(anchor.box)
    shares: dict[str, float] = {}
    for thing in things:
        shape = _floor(thing.box)
        is_lower = thing.box.top < anchor.box.top
        shares[thing.id] = shape.intersection(above).area / shape.area if is_lower and shape.area else 0.0
    could = [thing for thing in things if shares[thing.id] >= PARTLY_COVERED]
    return _meant(could, lambda only: shares[only.id] >= COVERED)


RELATIONS: dict[str, RelationReferents] = {
    "next to": _next_to,
    "beside": _next_to,
    "closest to": _closest_to,
    "nearest to": _closest_to,
    "under": _under,
}
"""Words of a relation -> the function that finds the things that they may mean."""


def gap_m(one: Box, other: Box) -> float:
    """Return the distance (m) between the outlines of two boxes on the floor; 0 if the outlines overlap."""
    return float(_floor(one).distance(_floor(other)))


def _floor(box: Box) -> Polygon:
    return _floor_shape(box.center, box.size, box.yaw)


@lru_cache(maxsize=8192)
def _floor_shape(center: Vec3, size: Vec3, yaw: float) -> Polygon:
    return footprint(Box(center=center, size=size, yaw=yaw))
