"""Small objects on and in furniture. They lie on surfaces of the furniture's assets and do not touch each other."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Surface
from vigil.base.geometry import Vec3, rotate_floor
from vigil.housegen.base.models import AssetModel, PlacedObject, Rect, draw_model, swept_rect, swing_of, turned_rect
from vigil.housegen.base.randomness import chance, pick, pick_weighted, shuffled
from vigil.housegen.base.tables import TABLES, names_in
from vigil.housegen.furnishing.floor import Floor
from vigil.housegen.furnishing.inventory import ROOM_LIMITS, Inventory
from vigil.housegen.furnishing.occupancy import Occupancy, are_apart

GAP = 0.03
"""Distance (m) between objects on a surface, so that each of them can be clicked."""
EDGE = 0.012
"""Distance (m) of objects from the edge of their surface."""
FULL_SHARE = 0.5
"""When this share of a surface is covered, nothing more is added, because agents need free places later."""
BASIN_SHARE = 0.75
"""Value of FULL_SHARE for a counter with a basin, because the basin covers much of the surface itself."""
MIN_SMALL_OBJECTS, ROUNDS = 6, 3
"""A room with fewer small objects than the first number gets more of them, in at most the second number of rounds."""
UNTIDINESS_SPREAD, UNTIDINESS_RANGE = 0.3, (0.5, 1.6)
"""Standard deviation of the logarithm, and range, of a random factor for each room. The room's number of small objects
is multiplied by this factor."""
TRIES = 2
"""Number of objects that are tried for each object that a surface should get, because not every object fits."""
REPEAT_SHARE = 0.25
"""Factor by which a category's probability is multiplied if the room already has an object of the category."""
COUNTER_M = 2.4
"""Width (m) of a counter that gets the number of objects in ON_TOP; the number grows with the width."""
MIN_VISIBLE_SHARE = 0.5
"""Least share of an object's width that must not be hidden by taller objects in front of it."""
SIGHT_SLOPE = 1.5
"""A taller object hides the objects behind it that are nearer to it than its height multiplied by this number.

Objects farther behind it are visible, because agents look down on furniture steeply.
"""
HIGHEST_M = 1.75
"""Surfaces above this height (m) cannot be seen."""
SURFACE_TOLERANCE = 0.03
"""An object lies on a surface if their heights differ by at most this (m)."""

ON_TOP: dict[str, float] = TABLES["on_top"]
"""Category of furniture -> average number of small objects on it, if they fit."""

INSIDE: dict[str, list[Any]] = TABLES["inside"]
"""Category of furniture -> its contents: the average number of objects, and their categories."""

ALSO_ON = {kind: names_in(rows) for kind, rows in TABLES["also_on"].items()}
"""Kind of room -> category of a support -> further categories of objects that may lie there; the catalogue does not
list this support for them."""

ALSO_WEIGHT = 0.5
"""Weight of categories in ALSO_ON. In the catalogue, a category has the weight 0.67 on the first of its supports."""

USUAL_OBJECTS: dict[str, list[list[Any]]] = TABLES["usual_objects"]
"""Kind of room -> objects that it should have: (category, supports with the preferred first, probability)."""

AT_THE_BACK = frozenset(TABLES["places"]["back"])
"""Categories that are placed at the back of their support."""
SOFT, TALLEST_ON_SOFT_M = frozenset({"Bed", "Sofa", "ArmChair"}), 0.6
"""Categories of soft furniture, and the greatest height (m) of an object on it (a bat does not stand on a bed)."""
ALIGNED = AT_THE_BACK | {"Laptop", "Pillow", "Box", "AlarmClock", "Safe"}
"""Categories that face the same way as their support."""


class SmallObjectPlacer:
    """Chooses and places the small objects of one room."""

    def __init__(
        self, floor: Floor, furniture: list[PlacedObject], inventory: Inventory, rng: np.random.Generator
    ) -> None:
        self.kind = floor.room.kind
        self.occupancy = Occupancy(floor, furniture)
        self.furniture = furniture
        self.inventory = inventory
        self.rng = rng
        self.room_counts = Counter(found.category for found in self._everything())

    def fill(self, clutter: float) -> None:
        """Add the room's usual objects and then others, as children of the furniture; their number grows with
        `clutter`."""
        untidiness = float(np.clip(np.exp(UNTIDINESS_SPREAD * self.rng.standard_normal()), *UNTIDINESS_RANGE))
        least = MIN_SMALL_OBJECTS * min(1.0, clutter)
        clutter *= untidiness
        for category, supports, probability in USUAL_OBJECTS[self.kind]:
            if chance(self.rng, probability * min(1.0, untidiness**0.5)):
                self._put_on_one_of(category, supports)
        for piece in shuffled(self.rng, self._everything()):
            self._fill_inside(piece, clutter)
        for piece in shuffled(self.rng, self._everything()):
            self._fill_top(piece, clutter)
        for _ in range(ROUNDS):
            if sum(CATALOG[found.category].is_pickupable for found in self._everything()) >= least:
                break
            for piece in shuffled(self.rng, self._everything()):
                self._fill_top(piece, clutter)

    def _everything(self) -> list[PlacedObject]:
        return [found for top in self.furniture for found in top.with_contents()]

    def _put_on_one_of(self, category: str, supports: Sequence[str]) -> None:
        for support in supports:
            for piece in shuffled(self.rng, [piece for piece in self.furniture if piece.category == support]):
                if self._put(category, piece, support == "Fridge"):
                    return

    def _fill_inside(self, piece: PlacedObject, clutter: float) -> None:
        if piece.category not in INSIDE or not any(surface.needs_opening for surface in piece.model.asset.surfaces):
            return
        mean, contents = INSIDE[piece.category]
        for category in shuffled(self.rng, contents)[: int(self.rng.poisson(mean * clutter))]:
            self._put(category, piece, True)

    def _fill_top(self, piece: PlacedObject, clutter: float) -> None:
        """Put objects on a piece of furniture until it has as many as were drawn at random."""
        mean = ON_TOP.get(piece.category, 0.0) * clutter
        if piece.category == "CounterTop":
            mean *= piece.model.size.x / COUNTER_M
        if mean <= 0:
            return
        on_top = [child for child in piece.children if child.surface is None or not child.surface.needs_opening]
        lying = sum(CATALOG[child.category].is_pickupable for child in on_top)
        missing = int(self.rng.poisson(mean)) - lying
        for _ in range(TRIES * missing):
            candidates = self._candidates(piece.category)
            if missing <= 0 or not candidates:
                return
            names, weights = zip(*candidates, strict=True)
            missing -= self._put(pick_weighted(self.rng, names, weights), piece, False)

    def _candidates(self, support: str) -> list[tuple[str, float]]:
        also = ALSO_ON[self.kind].get(support, ())
        found = [(name, ALSO_WEIGHT) for name in also if self._may_have(name)]
        for name, kind in CATALOG.items():
            if (
                name in also
                or (support in SOFT and kind.typical_size.y > TALLEST_ON_SOFT_M)
                or support not in kind.rests_on
                or self.kind not in kind.rooms
                or not self._may_have(name)
            ):
                continue
            if kind.is_pickupable or name in AT_THE_BACK:
                weight = 1.0 / (1.5 + kind.rests_on.index(support))
                found.append((name, weight if kind.is_pickupable else 0.3 * weight))
        return [(name, weight * (REPEAT_SHARE if self.room_counts[name] else 1.0)) for name, weight in found]

    def _may_have(self, category: str) -> bool:
        """Return whether the house and the room may have one more object of the category."""
        return self.inventory.may_have(category) and self.room_counts[category] < ROOM_LIMITS.get(category, 1)

    def _put(self, category: str, piece: PlacedObject, inside: bool) -> bool:
        if not self._may_have(category) or category == piece.category:
            return False
        accepts = CATALOG[piece.category].accepts
        if not CATALOG[piece.category].is_receptacle or (accepts is not None and category not in accepts):
            return False
        surfaces = [surface for surface in piece.model.asset.surfaces if surface.needs_opening == inside]
        model = draw_model(category, self.rng)
        for surface in shuffled(self.rng, surfaces):
            child = _place(piece, surface, model, self.rng, self.occupancy)
            if child is not None:
                piece.children.append(child)
                self.occupancy.add(child)
                self.inventory[category] += 1
                self.room_counts[category] += 1
                return True
        return False


def _place(
    piece: PlacedObject, surface: Surface, model: AssetModel, rng: np.random.Generator, occupancy: Occupancy
) -> PlacedObject | None:
    """Return the model placed at a free spot of the surface; None if no free spot is found."""
    height = piece.position.y + surface.center.y
    if model.size.y > surface.clearance - 0.01 or height > HIGHEST_M:
        return None
    taken = _objects_on(piece, surface)
    covered = sum((x1 - x0) * (z1 - z0) for x0, z0, x1, z1 in (other.reach for other in taken))
    is_basin = any(child.category == "Sink" for child in piece.children)
    share = BASIN_SHARE if is_basin else FULL_SHARE
    if covered + model.size.x * model.size.z > share * surface.size_x * surface.size_z and taken:
        return None
    is_pillow = model.category == "Pillow" and piece.category in ("Bed", "Sofa", "ArmChair")
    at_back = is_pillow or model.category in AT_THE_BACK
    for _ in range(16):
        turn = 0.0 if model.category in ALIGNED else pick(rng, (0.0, 90.0, 180.0, 270.0)) + float(rng.uniform(-14, 14))
        x0, z0, x1, z1 = turned_rect(model.rect, 0.0, 0.0, turn)
        free_x, free_z = surface.size_x / 2 - EDGE - x1, surface.size_z / 2 - EDGE - z1
        if free_x < 0 or free_z < 0:
            continue
        x = float(rng.uniform(-free_x, free_x))
        z = -free_z if at_back else float(rng.uniform(-free_z, free_z))
        new = _SupportedObject(
            (x + x0, z + z0, x + x1, z + z1), turned_rect(_reach_rect(model), x, z, turn), _height(model)
        )
        is_clear = all(
            are_apart(new.base, other.reach, GAP) and are_apart(new.reach, other.reach, GAP) for other in taken
        )
        things = [*taken, new]
        if is_clear and all(_hidden_share(each, things) <= 1.0 - MIN_VISIBLE_SHARE for each in things):
            dx, dz = rotate_floor(x + surface.center.x, z + surface.center.z, piece.yaw)
            place = Vec3(piece.position.x + dx, height + model.size.y / 2, piece.position.z + dz)
            yaw = round((piece.yaw + turn) % 360.0, 2)
            child = PlacedObject(model, place, yaw, piece.room, surface=surface)
            if occupancy.has_room_for(child, piece):
                return child
    return None


@dataclass(frozen=True, slots=True)
class _SupportedObject:
    """An object on a surface, in the surface's frame."""

    base: Rect
    """Rectangle that the object's bounding box covers in the plan."""
    reach: Rect
    """Rectangle of the object's box and of the space that its lid or door needs."""
    height: float
    """Height (m) of the object when its lid or screen is up."""


def _hidden_share(thing: _SupportedObject, others: list[_SupportedObject]) -> float:
    """Return the share of an object's width that taller objects in front of it hide."""
    left, _, right, front = thing.base
    hidden, reached = 0.0, left
    for other in sorted(others, key=lambda each: each.base[0]):
        low, back, high, _ = other.base
        if other.height > thing.height and 0.0 <= back - front < SIGHT_SLOPE * other.height:
            low, high = max(low, reached), min(high, right)
            if high > low:
                hidden, reached = hidden + high - low, high
    return hidden / (right - left)


def _height(model: AssetModel) -> float:
    """Return the height (m) of an object when its lid or screen is up."""
    swing = swing_of(model)
    return model.size.y / 2 + max(model.size.y / 2, swing[2] if swing else 0.0)


def _reach_rect(model: AssetModel) -> Rect:
    """Return the rectangle of the model's box and of the space that its lid or door needs."""
    swept = swept_rect(model)
    if swept is None:
        return model.rect
    (x0, z0, x1, z1), (left, back, right, front) = swept, model.rect
    return min(left, x0), min(back, z0), max(right, x1), max(front, z1)


def _objects_on(piece: PlacedObject, surface: Surface) -> list[_SupportedObject]:
    """Return the objects on a surface, and the objects next to the surface at the same height."""
    height = piece.position.y + surface.center.y
    top = (-surface.size_x / 2, -surface.size_z / 2, surface.size_x / 2, surface.size_z / 2)
    found: list[_SupportedObject] = []
    for child in piece.children:
        if abs(child.bottom - height) > SURFACE_TOLERANCE:
            continue
        x, z = rotate_floor(child.position.x - piece.position.x, child.position.z - piece.position.z, -piece.yaw)
        place = x - surface.center.x, z - surface.center.z, child.yaw - piece.yaw
        base, reach = (turned_rect(rect, *place) for rect in (child.model.rect, _reach_rect(child.model)))
        if not are_apart(reach, top, GAP):
            found.append(_SupportedObject(base, reach, _height(child.model)))
    return found
