"""Inventory: how many objects of each category a house has, with limits for the house and for each room.

Most categories may occur only once in a house, so that an instruction can name an object by its category alone.
"""

from collections import Counter

from vigil.assets.catalog import CATALOG
from vigil.housegen.base.tables import TABLES

LIMITS: dict[str, int] = TABLES["limits"]
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


class Inventory(Counter[str]):
    """Counts of the objects that a house already has, by category."""

    def may_have(self, category: str) -> bool:
        """Return whether the house may have one more object of the category."""
        return self[category] < limit_of(category)
