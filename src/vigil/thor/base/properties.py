"""What can be done to objects of each of THOR's categories, and what was done to the objects of the house so far."""

from typing import Any

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset
from vigil.base.caches import cached_while_alive
from vigil.scene.supports import ancestors, containers_of
from vigil.scene.things import Scene, Thing

_CATEGORIES = {
    "isSliced sliceable": "Apple Bread Egg Lettuce Potato Tomato",
    "isCooked cookable": "Potato",
    "isUsedUp canBeUsedUp": "PaperTowelRoll SoapBottle TissueBox ToiletPaper",
    "isDirty dirtyable": "Bed Bowl Cloth Cup Mirror Mug Pan Plate Pot",
    "isFilledWithLiquid canFillWithLiquid": "Bottle Bowl Cup HousePlant Kettle Mug Pot WateringCan WineBottle",
    "isBroken breakable": "Bottle Bowl CellPhone Cup Egg Laptop Mirror Mug Plate Statue Television Vase Window "
    "WineBottle",
}
PROPERTIES: dict[str, tuple[str, frozenset[str]]] = {
    names.split()[0]: (names.split()[1], frozenset(categories.split())) for names, categories in _CATEGORIES.items()
}
"""Metadata flag (e.g. isSliced) -> the flag that says whether it can be set (e.g. sliceable), and the THOR categories
of the objects for which it can be set."""
HEAT_SOURCES, COLD_SOURCES = frozenset({"Microwave", "StoveBurner", "Toaster"}), frozenset({"Fridge"})
DENSITY = 250.0
"""Mass (kg) for each cubic metre of an object's box."""
_MATERIALS = {
    "Metal": "metal chrome",
    "Wood": "wood planks parquet wicker",
    "Plastic": "plastic paint foam gleam glow",
    "Glass": "glass smoked_glass mirror screen",
    "Ceramic": "ceramic",
    "Stone": "marble granite stone concrete brick",
    "Fabric": "fabric velvet knit stripes plaid dots carpet",
    "Rubber": "rubber",
    "Leather": "leather",
    "Paper": "paper cardboard print cover picture",
    "Wax": "wax",
    "Food": "skin streaks",
    "Organic": "leaf grass",
}
_SALIENT = {kind: name for name, kinds in _MATERIALS.items() for kind in kinds.split()}
"""Kind of one of this project's materials -> THOR's name of the material."""


def properties(thing: Thing, scene: Scene, flags: dict[str, Any]) -> dict[str, Any]:
    """Return the metadata of a thing's properties. `flags` has the flags that were set since the house was created."""
    found: dict[str, Any] = {"fillLiquid": flags.get("fillLiquid")}
    for flag, (ability, categories) in PROPERTIES.items():
        found |= {ability: thing.category in categories, flag: bool(flags.get(flag))}
    heat = _temperature(thing, scene)
    found |= {"temperature": heat, "ObjectTemperature": heat}
    return found | {"isHeatSource": thing.category in HEAT_SOURCES, "isColdSource": thing.category in COLD_SOURCES}


def _temperature(thing: Thing, scene: Scene) -> str:
    """Return the temperature of a thing: "Hot" on a running heat source, "Cold" in a cold source, else "RoomTemp"."""
    if any(below.category in HEAT_SOURCES and below.is_toggled for below in ancestors(scene, thing)):
        return "Hot"
    return "Cold" if any(each.category in COLD_SOURCES for each in containers_of(scene, thing)) else "RoomTemp"


def is_moveable(thing: Thing) -> bool:
    """Return whether a thing can be pushed but not carried."""
    return thing.category in CATALOG and CATALOG[thing.category].is_moveable and not thing.is_pickupable


def is_loose(thing: Thing) -> bool:
    """Return whether a thing can be carried or pushed; False for floors."""
    return not thing.is_structure and (thing.is_pickupable or is_moveable(thing))


def mass_of(thing: Thing) -> float:
    """Return the mass (kg) of a thing, computed from the volume of its box."""
    return round(float(np.prod(thing.asset.size)) * DENSITY, 3)


@cached_while_alive
def materials_of(asset: Asset) -> tuple[str, ...]:
    """Return THOR's names of the materials of which an asset consists, sorted."""
    kinds = (part.material.partition("/")[0] for part in asset.parts)
    return tuple(sorted({_SALIENT[kind] for kind in kinds if kind in _SALIENT}))
