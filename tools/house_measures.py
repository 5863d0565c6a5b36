"""Statistics of rooms: areas, objects, categories, covered floor, objects on supports, and states.

The same functions measure generated and real houses. `only` restricts the count to given categories, for instance those
that both sides can have.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import Polygon

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Box
from vigil.errors import HouseError
from vigil.housegen.document import with_merged_drawers
from vigil.protocol.house import House, HouseObject
from vigil.scene.outlines import floor_of, footprint

MIN_COVER_HEIGHT_M = 0.03
"""Height below which an object (a rug) does not cover floor."""
MIN_HANGING_HEIGHT_M = 0.35
"""Height of its bottom above which an object does not cover floor."""


@dataclass(slots=True)
class RoomStatistics:
    """Numbers about one room."""

    kind: str
    area_m2: float
    objects: int = 0
    """Number of objects."""
    types: set[str] = field(default_factory=set)
    """Categories of the objects."""
    covered: float = 0.0
    """Share of the floor that furniture of any category covers."""
    loose: int = 0
    """Number of objects that can be picked up."""
    on_support: list[tuple[str, int]] = field(default_factory=list)
    """Category of each piece of furniture that holds objects, with the number of loose objects on and in it."""
    is_on: list[tuple[str, bool]] = field(default_factory=list)
    """Category and state of each object that can be switched on."""
    is_dirty: list[tuple[str, bool]] = field(default_factory=list)
    """Category and state of each object that can be dirty."""


@dataclass(frozen=True, slots=True)
class DistributionComparison:
    """Distributions of one number in real and in generated houses."""

    name: str
    """Name of the number."""
    real: np.ndarray
    """Values (n,) in real houses."""
    own: np.ndarray
    """Values (m,) in generated houses."""

    @property
    def ks(self) -> float:
        """Kolmogorov-Smirnov distance: the largest gap between the two cumulative shares."""
        values = np.concatenate((self.real, self.own))
        shares = [np.searchsorted(np.sort(side), values, side="right") / len(side) for side in (self.real, self.own)]
        return float(np.abs(shares[0] - shares[1]).max())

    @property
    def median_ratio(self) -> float:
        """Median of generated houses divided by that of real ones; 1 when both are 0."""
        real, own = float(np.median(self.real)), float(np.median(self.own))
        return own / real if real else (1.0 if own == 0 else float("inf"))

    @property
    def is_close(self) -> bool:
        """Whether the medians differ by at most 25 % and the distance is under 0.25."""
        return 0.75 <= self.median_ratio <= 1.25 and self.ks < 0.25


def measure(house: House, assets: AssetDatabase, only: Collection[str] | None = None) -> list[RoomStatistics]:
    """Return the statistics of a house's rooms; drawers count with their furniture, `only` limits the categories."""
    house = with_merged_drawers(house)
    floors = {room.id: floor_of(room) for room in house.document.rooms}
    rooms = {
        room.id: RoomStatistics(room.kind, floors[room.id].area)
        for room in house.document.rooms
        if floors[room.id].is_valid
    }
    footprints: dict[str, list[Polygon]] = defaultdict(list)
    for node in house.document.objects:
        place = next((key for key in rooms if shapely.contains_xy(floors[key], node.position.x, node.position.z)), None)
        if place is not None:
            _count(node, assets, only, rooms[place], footprints[place])
    for key, shapes in footprints.items():
        rooms[key].covered = shapely.union_all(shapes).intersection(floors[key]).area / rooms[key].area_m2
    return list(rooms.values())


def _count(
    node: HouseObject, assets: AssetDatabase, only: Collection[str] | None, room: RoomStatistics, shapes: list[Polygon]
) -> None:
    """Count an object that stands on the floor or hangs, and all that is on it."""
    category = _category(node, assets)
    if category is None:
        return
    size = assets.look_up(node.asset_id, node.name_in_house).size
    if size.y > MIN_COVER_HEIGHT_M and node.position.y - size.y / 2 < MIN_HANGING_HEIGHT_M:
        shapes.append(footprint(Box(center=node.position.vec, size=size, yaw=node.rotation.y)))
    _count_alone(node, category, assets, only, room)


def _count_alone(
    node: HouseObject, category: str, assets: AssetDatabase, only: Collection[str] | None, room: RoomStatistics
) -> None:
    children = [(child, found) for child in node.children if (found := _category(child, assets)) is not None]
    if only is None or category in only:
        room.objects += 1
        room.types.add(category)
        room.loose += CATALOG[category].is_pickupable
        if node.is_on is not None:
            room.is_on.append((category, node.is_on))
        if node.is_dirty is not None:
            room.is_dirty.append((category, node.is_dirty))
        if CATALOG[category].is_receptacle and not CATALOG[category].is_pickupable:
            counted = [found for _, found in children if only is None or found in only]
            room.on_support.append((category, sum(CATALOG[found].is_pickupable for found in counted)))
    for child, found in children:
        _count_alone(child, found, assets, only, room)


def _category(node: HouseObject, assets: AssetDatabase) -> str | None:
    try:
        return assets.look_up(node.asset_id, node.name_in_house).category
    except HouseError:
        return None


def compare(
    real: Iterable[RoomStatistics], own: Iterable[RoomStatistics], supports: Iterable[str]
) -> list[DistributionComparison]:
    """Return the distributions of real and generated rooms, by kind of room, then of objects on each of `supports`."""
    real, own = list(real), list(own)
    found: list[DistributionComparison] = []
    for kind in sorted({room.kind for room in real} & {room.kind for room in own}):
        sides = [[room for room in side if room.kind == kind] for side in (real, own)]
        found += [
            DistributionComparison(
                f"{kind}: {name}", *(np.array([read(room) for room in side], dtype=float) for side in sides)
            )
            for name, read in MEASURES.items()
        ]
    for support in supports:
        sides = [
            np.array([count for room in side for name, count in room.on_support if name == support], dtype=float)
            for side in (real, own)
        ]
        if all(len(side) for side in sides):
            found.append(DistributionComparison(f"things on: {CATALOG[support].display_name}", *sides))
    return found


MEASURES = {
    "floor area (m2)": lambda room: room.area_m2,
    "objects": lambda room: room.objects,
    "types of objects": lambda room: len(room.types),
    "share of floor covered": lambda room: room.covered,
    "small things": lambda room: room.loose,
}
"""Function of a room's statistics that gives each number to compare, by the name in tables and figures."""
