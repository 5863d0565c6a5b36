"""Inventory: how many objects of each category a house has, with limits for the house and for each room.

Most categories may occur only once in a house, so that an instruction can name an object by its category alone.
"""

from collections import Counter

from vigil.assets.catalog import CATALOG

LIMITS = {
    "Chair": 8,
    "Painting": 12,
    "LightSwitch": 10,
    "CeilingLamp": 10,
    "CounterTop": 6,
    "Cabinet": 3,
    "Stool": 3,
    "Bed": 4,
    "SideTable": 5,
    "HousePlant": 2,
    "GarbageCan": 2,
    "FloorLamp": 2,
    "DeskLamp": 2,
    "Rug": 6,
    "Curtains": 3,
    "Blinds": 3,
    "Mirror": 2,
    "Sink": 4,
    "Faucet": 4,
    "Toilet": 3,
    "Bathtub": 3,
    "ToiletPaper": 2,
    "ToiletPaperHanger": 3,
    "Towel": 3,
    "TowelHolder": 3,
    "HandTowel": 3,
    "HandTowelHolder": 3,
    "ShowerHead": 3,
    "Shelf": 3,
    "Desk": 2,
    "Dresser": 4,
    "Sofa": 2,
    "ArmChair": 2,
    "Television": 2,
    "TVStand": 2,
    "DiningTable": 2,
    "Fridge": 2,
    "Stove": 2,
    "CoffeeTable": 2,
    "ShelvingUnit": 2,
    "Window": 99,
}
"""Category -> greatest number of its objects in one house. The default is LOOSE_LIMIT for objects that can be picked
up, and 1 for others."""
LOOSE_LIMIT = 3
"""Greatest number of objects in one house for categories that can be picked up and are not in LIMITS."""
_DISHES_AND_FOOD = ("Plate", "Bowl", "Cup", "Mug", "Bottle", "Apple", "Tomato", "Potato", "Fork", "Spoon")
_ODDS_AND_ENDS = ("Book", "Pen", "Pencil", "CD", "Candle", "Vase", "Cloth", "ToiletPaper")
ROOM_LIMITS = {"Pillow": 3, "Egg": 3} | dict.fromkeys((*_DISHES_AND_FOOD, *_ODDS_AND_ENDS), 2)
"""Category that can be picked up -> greatest number of its objects in one room. The default is 1."""


def limit_of(category: str) -> int:
    """Return the greatest number of objects of a category in one house."""
    return LIMITS.get(category, LOOSE_LIMIT if CATALOG[category].is_pickupable else 1)


class Inventory:
    """Counts of the objects that a house already has."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def may_have(self, category: str) -> bool:
        """Return whether the house may have one more object of the category."""
        return self._counts[category] < limit_of(category)

    def count(self, category: str) -> int:
        """Return the number of objects of the category."""
        return self._counts[category]

    def copy(self) -> "Inventory":
        """Return an independent copy."""
        other = Inventory()
        other._counts = self._counts.copy()
        return other

    def add(self, category: str) -> None:
        """Count one more object of the category."""
        self._counts[category] += 1
