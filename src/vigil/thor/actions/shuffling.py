"""Actions that change a scene at random: the places of objects, and the materials and lights of rooms."""

import colorsys
import copy
from collections.abc import Callable
from random import Random
from typing import Any

from vigil.assets.catalog import CATALOG
from vigil.protocol.house import House
from vigil.scene.supports import contents
from vigil.scene.things import Thing
from vigil.thor.actions.action import Action
from vigil.thor.actions.handling import points_on
from vigil.thor.actions.placing import put_at
from vigil.thor.base.errors import bad_argument, invalid_operation
from vigil.thor.base.world import World

WALLS = ("plaster/white", "plaster/#d9cfc0", "plaster/#b9c4c9", "plaster/#c9b8a8", "brick/red", "subway", "concrete")
FLOORS = ("wood/oak", "wood/walnut", "planks/pine", "parquet/cherry", "tiles", "marble_tiles", "carpet")
"""Materials from which the material of a floor is chosen."""
SPLITS = ("useTrainMaterials", "useValMaterials", "useTestMaterials", "useExternalMaterials")
"""Parameters that choose among AI2-THOR's materials. This engine has one set of materials for all of them."""


def _spawn(
    world: World,
    randomSeed: int = 0,
    forceVisible: bool = False,
    numPlacementAttempts: int = 5,
    excludedObjectIds: list[str] | None = None,
    excludedReceptacles: list[str] | None = None,
    **_: object,
) -> None:
    world.need_house()
    if world.held is not None:
        raise invalid_operation("Cannot have any held object when calling InitialRandomSpawn")
    scene, rng = world.editor.scene(), Random(randomSeed)
    out = set(excludedObjectIds or ())
    loose = [each for each in world.things() if each.is_pickupable and each.id not in out]
    loose = [each for each in loose if not contents(scene, each.id)]
    rng.shuffle(loose)
    receptacles = [each for each in world.things() if each.category not in (excludedReceptacles or ())]
    if forceVisible:  # as in AI2-THOR, nothing may be hidden in what can be shut
        receptacles = [each for each in receptacles if not each.is_openable]
    for thing in loose:
        _put_elsewhere(world, thing, receptacles, rng, numPlacementAttempts)


def _put_elsewhere(world: World, thing: Thing, receptacles: list[Thing], rng: Random, attempts: int) -> None:
    """Put a thing at a random free place on a receptacle that may hold it; if no place is found, put it back."""
    kind, home = CATALOG[thing.category], (thing.position, thing.rotation)
    places = [(each, points_on(world, each)) for each in receptacles if CATALOG[each.category].can_hold(kind)]
    world.apply_changes({}, held=thing.id)
    for _ in range(attempts if places else 0):
        receptacle, points = rng.choice(places)
        if world.editor.apply_intent("place", receptacle.id, rng.choice(points)).refusal is None:
            return
    put_at(world, thing.id, *home)


def _redecorate(world: World, change: Callable[[dict[str, Any]], None]) -> None:
    world.need_house()
    assert world.house is not None
    data = copy.deepcopy(world.house.data)
    change(data)
    _show(world, House(world.house.name, data))


def _show(world: World, house: House) -> None:
    world.editor.redecorate(house)
    world.house = house


def _reset_looks(world: World) -> None:
    world.need_house()
    assert world.first_house is not None
    _show(world, world.first_house)


def _materials(world: World, inRoomTypes: list[str] | None = None, **splits: bool) -> dict[str, Any]:
    uses = {name: splits.get(name, name in _usual_splits(world.scene_name)) for name in SPLITS}
    uses[SPLITS[3]] &= uses[SPLITS[0]]  # external materials come with those for training
    rooms = {"RoboTHOR"} if world.has_house and world.scene_name.startswith("FloorPlan_") else _room_types(world)
    if not any(uses.values()):
        raise bad_argument(f"at least one of {', '.join(SPLITS)} must be true")
    if inRoomTypes is not None and not rooms & set(inRoomTypes):
        raise bad_argument(f"no room is of a type in {inRoomTypes}; the house has {sorted(rooms)}")

    def change(data: dict[str, Any]) -> None:
        for room in data["rooms"]:
            if inRoomTypes is not None and not {"RoboTHOR", room.get("roomType")} & rooms & set(inRoomTypes):
                continue
            room["floorMaterial"] = {"name": world.random.choice(FLOORS)}
            walls = {"name": world.random.choice(WALLS)}
            for wall in data["walls"]:
                if wall.get("roomId") == room["id"]:
                    wall["material"] = dict(walls)

    _redecorate(world, change)
    return {
        **uses,
        "chosenRoomTypes": sorted(rooms if inRoomTypes is None else rooms & set(inRoomTypes)),
        "totalMaterialsConsidered": len(WALLS) + len(FLOORS),
    }


def _room_types(world: World) -> set[str]:
    world.need_house()
    assert world.house is not None
    return {str(room.get("roomType")) for room in world.house.data["rooms"]}


def _usual_splits(scene: str) -> tuple[str, ...]:
    """Return the splits of materials that AI2-THOR uses in a scene if the program names none."""
    digits = scene.removesuffix("_physics").removeprefix("FloorPlan")
    number = int(digits) % 100 if digits.isdigit() else 0
    if scene.startswith("FloorPlan_Val") or 20 < number <= 25:
        return SPLITS[1:2]
    return SPLITS[2:3] if number > 25 else (SPLITS[0], SPLITS[3])


def _colours(world: World, **_: object) -> None:
    def change(data: dict[str, Any]) -> None:
        tints = {room["id"]: _tint(world.random, (0.0, 1.0), (0.0, 0.5)) for room in data["rooms"]}
        for wall in data["walls"]:
            if wall.get("roomId") in tints:
                wall["material"] = {**wall.get("material", {}), "color": tints[wall["roomId"]]}

    _redecorate(world, change)


def _lighting(
    world: World,
    brightness: list[float] | None = None,
    hue: list[float] | None = None,
    saturation: list[float] | None = None,
    randomizeColor: bool = True,
    synchronized: bool = False,
) -> None:
    bright = _range(brightness, (0.5, 1.5), 10.0)
    hues, saturations = _range(hue, (0.0, 1.0), 1.0), _range(saturation, (0.5, 1.0), 1.0)

    def change(data: dict[str, Any]) -> None:
        draw: list[tuple[float, dict[str, float]]] = []
        for light in data.get("proceduralParameters", {}).get("lights", ()):
            if not draw or not synchronized:
                draw = [(world.random.uniform(*bright), _tint(world.random, hues, saturations))]
            light["intensity"] = light.get("intensity", 1.0) * draw[0][0]
            if randomizeColor:
                light["rgb"] = draw[0][1]

    _redecorate(world, change)


def _range(given: list[float] | None, usual: tuple[float, float], most: float) -> tuple[float, float]:
    low, high = given if given is not None and len(given) == 2 else usual
    if not 0.0 <= low <= high <= most:
        raise bad_argument(
            f"the range from {low} to {high} is not valid: both must be in [0:{most:g}], the smaller first"
        )
    return low, high


def _tint(rng: Random, hues: tuple[float, float], saturations: tuple[float, float]) -> dict[str, float]:
    red, green, blue = colorsys.hsv_to_rgb(rng.uniform(*hues), rng.uniform(*saturations), 1.0)
    return {"r": red, "g": green, "b": blue}


def _seed(world: World, seed: int) -> None:
    world.random = Random(seed)


_TRAIN = "bool useTrainMaterials, bool useValMaterials, bool useTestMaterials, bool useExternalMaterials"
_SPAWN = (
    "int randomSeed, bool forceVisible, int numPlacementAttempts, bool placeStationary, list excludedObjectIds, "
    "list excludedReceptacles, list numDuplicatesOfType, bool allowFloor, bool allowMoveable"
)
_SPAWNED = (
    "objects stay where no place is found; no copies are made, and nothing is put on the floor; with forceVisible, "
    "nothing is put into objects that open"
)
_LIGHT = "list brightness, list hue, list saturation, bool randomizeColor, bool synchronized"
_ROOMS_ONLY = "only walls and floors change; objects stay as they are; all splits have the same materials"

ACTIONS = (
    Action("InitialRandomSpawn", _spawn, _SPAWN, lacks=_SPAWNED),
    Action("RandomizeMaterials", _materials, f"{_TRAIN}, list inRoomTypes", lacks=_ROOMS_ONLY),
    Action("RandomizeColors", _colours, takes_anything=True, lacks="only walls change; objects stay as they are"),
    Action("RandomizeLighting", _lighting, _LIGHT, lacks="only the lights of rooms change, not lamps"),
    Action("ResetMaterials", _reset_looks),
    Action("ResetColors", _reset_looks),
    Action("ResetLighting", _reset_looks, lacks="materials and colours are reset, too"),
    Action("SetRandomSeed", _seed, "int seed", "seed"),
)
