"""Furniture on the floor: what each kind of room gets, in which order, and where it stands."""

from collections.abc import Callable
from typing import Any

import numpy as np

from vigil.base.geometry import Vec3
from vigil.housegen.base.models import PlacedObject, draw_model
from vigil.housegen.base.randomness import chance, pick, shuffled
from vigil.housegen.base.tables import TABLES
from vigil.housegen.furnishing import groups
from vigil.housegen.furnishing.floor import Floor
from vigil.housegen.furnishing.group_placement import (
    Anchor,
    FurnitureGroup,
    free_anchors,
    place_group,
    single_group,
    wall_anchors,
)
from vigil.housegen.furnishing.inventory import Inventory
from vigil.housegen.furnishing.occupancy import are_apart

FULL_SHARE = {"Kitchen": 0.36, "LivingRoom": 0.36, "Bedroom": 0.38, "Bathroom": 0.48}
"""A room is full when more than this share of its floor is covered; then it gets no further furniture."""

ESSENTIAL: dict[str, list[str]] = TABLES["essential"]
"""Furniture that each kind of room must have; if it does not fit, another floor plan is made."""

EXTRAS: dict[str, list[list[Any]]] = TABLES["extras"]
"""Further furniture for each kind of room, in this order: (category, probability)."""

PROBABILITIES: dict[str, float] = TABLES["probabilities"]
"""Name of a piece or group of furniture -> probability that a room with enough space gets it."""
MIN_ROOM_M2: dict[str, float] = TABLES["min_room"]
"""Name of a piece or group of furniture -> area (m2) that a room must exceed to get it."""
LONG_RUNS, SHORT_RUNS = ((10,), (8,)), ((6,), (3, 3), (5,), (4,))
"""Widths (ft) of the counters in a kitchen run (a row of counters). The long runs are tried first, then the short runs
in this order."""
WALL_PREFERENCES: dict[str, list[float]] = TABLES["wall_preferences"]
"""Name of a group -> (score of a place in a corner, score of a place in the middle of a wall); NOISE is added."""
NOISE = 0.5
"""Upper limit of the random number that is added to each place's score."""
FACING, ASIDE_PER_M, TOO_NEAR_PENALTY, AHEAD_PER_M = 3.0, 1.5, 5.0, 0.15
"""Score of a place opposite a piece of furniture. A place gains the first number if it faces the piece. It loses the
second for each metre to the side, the third if it is too near, and the fourth for each metre of distance."""
NEAR_M = 1.2
"""A place opposite a piece of furniture is too near if its distance (m) is below this."""
FACING_DEG = 1.0
"""Two pieces face each other if their yaws are opposite to within this angle (deg)."""
VIEW_ASIDE_M = 0.4
"""Half the width (m) of the strip of floor that is kept free between a sofa and its television."""
SMALL_M = 0.6
"""Furniture that does not open and is smaller than this (m) can do without free floor in front."""
SQUARE_M = 0.02
"""Furniture may be turned by 90 degrees if its width and depth differ by at most this (m)."""

FULLNESS_RANGE = (0.35, 1.25)
"""Range of a random factor for each room; each probability in `EXTRAS` is multiplied by the factor."""

PREFERS_CORNERS = frozenset(TABLES["places"]["corner"])
"""Categories that are preferably placed in a corner."""
TURNABLE = frozenset({"HousePlant", "RoomDecor", "BasketBall", "GarbageBag", "Stool"})
"""Categories without a front. Their objects may be turned by 90, 180 or 270 degrees if the sides are about equal."""


class Furnisher:
    """Chooses and places the furniture of one room."""

    def __init__(self, floor: Floor, inventory: Inventory, rng: np.random.Generator) -> None:
        self.floor = floor
        self.inventory = inventory
        self.rng = rng
        self.pieces: list[PlacedObject] = []

    def furnish(self) -> list[PlacedObject]:
        """Place the room's furniture and return it; objects that stand on furniture are children of it."""
        kind = self.floor.room.kind
        {
            "Kitchen": self._kitchen,
            "LivingRoom": self._living_room,
            "Bedroom": self._bedroom,
            "Bathroom": self._bathroom,
        }[kind]()
        fullness = float(self.rng.uniform(*FULLNESS_RANGE))
        for category, probability in EXTRAS[kind]:
            covered = sum((x1 - x0) * (z1 - z0) for x0, z0, x1, z1 in self.floor.taken) / self.floor.area
            if covered <= FULL_SHARE[kind] and chance(self.rng, probability * fullness):
                self._put_single(category)
        return self.pieces

    def has(self, category: str) -> bool:
        """Return whether the room already has an object of the category."""
        return any(found.category == category for piece in self.pieces for found in piece.with_contents())

    def _is_large_enough(self, name: str) -> bool:
        return self.floor.area > MIN_ROOM_M2[name]

    def _is_drawn(self, name: str) -> bool:
        return chance(self.rng, PROBABILITIES[name])

    def _may_have(self, name: str) -> bool:
        return self._is_large_enough(name) and self._is_drawn(name)

    def _kitchen(self) -> None:
        with_fridge = self._is_drawn("fridge in the run")
        at_corner = [6, 8] if self._may_have("corner run") else []
        corner = (groups.corner_run(self.rng, with_fridge, feet) for feet in shuffled(self.rng, at_corner))
        has_corner = any(self._put(group, _along_walls("corner run")) for group in corner)
        for feet in () if has_corner else [*shuffled(self.rng, LONG_RUNS), *SHORT_RUNS]:
            runs = (groups.kitchen_run(self.rng, fridge, feet) for fridge in (with_fridge, False))
            if any(self._put(run, _along_walls("kitchen run")) for run in runs):
                break
        if not self.has("Fridge"):
            self._put_single("Fridge")
        counter = next((piece for piece in self.pieces if piece.category == "CounterTop"), None)
        if counter is not None and self._may_have("island"):
            self._put_free(groups.island_group(self.rng, pick(self.rng, (1, 2, 2)), counter.model))
        elif self._is_drawn("kitchen table"):
            self._dining()

    def _living_room(self) -> None:
        choices = [
            (True, self._may_have("armchair"), self._is_drawn("rug")),
            (True, False, False),
            (False, False, False),
        ]
        for with_table, with_chair, with_rug in choices:
            group = groups.sofa_group(self.rng, with_table, with_chair, with_rug)
            if self._put(group, _along_walls("sofa")):
                break
        sofa = next((piece for piece in self.pieces if piece.category == "Sofa"), None)
        for _ in range(3):
            if self._put(groups.media_group(self.rng), _opposite(sofa) if sofa else _along_walls("television")):
                break
        self._keep_view_free(sofa)
        if self.inventory["DiningTable"] == 0 and self._may_have("living room table"):
            self._dining()
        if self.inventory["Desk"] == 0 and self._may_have("living room desk"):
            self._put(groups.desk_group(self.rng), _along_walls("living room desk"))

    def _keep_view_free(self, sofa: PlacedObject | None) -> None:
        """Keep furniture out of the space between a sofa and the television, if these face each other."""
        stand = next((piece for piece in self.pieces if piece.category == "TVStand"), None)
        if sofa is None or stand is None or abs((stand.yaw - sofa.yaw) % 360.0 - 180.0) > FACING_DEG:
            return
        ends = [
            piece.to_floor_point(side, piece.model.size.z / 2)
            for piece in (sofa, stand)
            for side in (-VIEW_ASIDE_M, VIEW_ASIDE_M)
        ]
        xs, zs = [x for x, _ in ends], [z for _, z in ends]
        self.floor.sweeps.append((min(xs), min(zs), max(xs), max(zs)))

    def _bedroom(self) -> None:
        for tables in (pick(self.rng, (1, 2, 2)), 1, 0, 0):
            if self._put(groups.bed_group(self.rng, tables), _along_walls("bed")):
                break
        if self._is_drawn("bedroom desk"):
            self._put(groups.desk_group(self.rng), _along_walls("bedroom desk"))
        self._put_single("Dresser")
        if self.inventory.may_have("Television") and self._may_have("bedroom television"):
            bed = next((piece for piece in self.pieces if piece.category == "Bed"), None)
            self._put(groups.media_group(self.rng), _opposite(bed) if bed else _along_walls("television"))

    def _bathroom(self) -> None:
        self._put(groups.bathtub_group(self.rng), _along_walls("bathtub"))
        self._put(groups.vanity_group(self.rng), _along_walls("vanity"))
        self._put_single("Toilet")

    def _dining(self) -> None:
        if self._may_have("table in the open"):
            for chairs in (4, 4, 3, 2) if self._is_large_enough("table for four") else (3, 2):
                if self._put_free(groups.dining_group(self.rng, chairs, False)):
                    if self.floor.room.kind == "LivingRoom" and self._is_drawn("rug under table"):
                        self._lay_rug(next(piece for piece in self.pieces if piece.category == "DiningTable"))
                    return
        for chairs in (3, 3, 2, 2, 1):
            if self._put(groups.dining_group(self.rng, chairs, True), _along_walls("table")):
                return

    def _lay_rug(self, table: PlacedObject) -> None:
        """Lay a rug under a table if the rug fits in the room and is clear of doors."""
        model = draw_model("Rug", self.rng)
        place = Vec3(table.position.x, model.size.y / 2, table.position.z)
        rug = PlacedObject(model, place, table.yaw, self.floor.room.number)
        kept_free = [*self.floor.outside, *self.floor.clear]
        if self.inventory.may_have("Rug") and all(are_apart(rug.footprint(), rect, 0.0) for rect in kept_free):
            self.pieces.append(rug)
            self.inventory["Rug"] += 1

    def _put_single(self, category: str) -> bool:
        if not self.inventory.may_have(category) or (category != "SideTable" and self.has(category)):
            return False
        model = draw_model(category, self.rng)
        preference = _along_walls("prefers corners" if category in PREFERS_CORNERS else "other")
        small = max(model.size.x, model.size.z) < SMALL_M and not model.asset.can_open
        placed = self._put(single_group(model, 0.0 if small else None), preference)
        if placed and category in TURNABLE and abs(model.size.x - model.size.z) < SQUARE_M:
            self.pieces[-1].yaw = pick(self.rng, (0.0, 90.0, 180.0, 270.0))
        return placed

    def _put(self, group: FurnitureGroup, score: Callable[[Anchor], float]) -> bool:
        return self._place_group(group, wall_anchors(self.floor, group, self.rng), score)

    def _put_free(self, group: FurnitureGroup) -> bool:
        return self._place_group(
            group, shuffled(self.rng, free_anchors(self.floor, self.rng)), lambda anchor: anchor.centre
        )

    def _place_group(self, group: FurnitureGroup, anchors: list[Anchor], score: Callable[[Anchor], float]) -> bool:
        if any(not self.inventory.may_have(member.model.category) for member in group.members):
            return False
        noise = NOISE * self.rng.random(len(anchors))
        scores = np.array([score(anchor) for anchor in anchors]) + noise
        placed = place_group(self.floor, group, anchors, scores)
        if placed is None:
            return False
        self.pieces += placed
        self.inventory.update(found.category for piece in placed for found in piece.with_contents())
        return True


def _along_walls(name: str) -> Callable[[Anchor], float]:
    """Return a function that scores places along walls by the row `name` of `WALL_PREFERENCES`."""
    corner, centre = WALL_PREFERENCES[name]
    return lambda anchor: corner * anchor.corner + centre * anchor.centre


def _opposite(piece: PlacedObject) -> Callable[[Anchor], float]:
    """Return a function that scores places: those across the room that face `piece` get the highest scores."""

    def score(anchor: Anchor) -> float:
        sin, cos = np.sin(np.radians(piece.yaw)), np.cos(np.radians(piece.yaw))
        dx, dz = anchor.x - piece.position.x, anchor.z - piece.position.z
        ahead, aside = dx * sin + dz * cos, abs(dx * cos - dz * sin)
        faces = abs((anchor.yaw - piece.yaw) % 360.0 - 180.0) < FACING_DEG
        return (
            FACING * faces - ASIDE_PER_M * aside - (TOO_NEAR_PENALTY if ahead < NEAR_M else 0.0) - AHEAD_PER_M * ahead
        )

    return score
