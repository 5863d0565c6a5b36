"""Actions that open houses: resets, named scenes, and `CreateHouse` with the check of its document."""

import itertools
import sys
from typing import Any

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.errors import VigilError
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.scene.outlines import GRID_M, floor_of
from vigil.sim.scene_editor import SceneEditor
from vigil.thor.actions.action import Action
from vigil.thor.base.agents import place_agents
from vigil.thor.base.errors import ActionFailed, bad_argument
from vigil.thor.base.floors import floors_of
from vigil.thor.base.scene_names import VARIABLE, house_for, scene_names
from vigil.thor.base.world import PROCEDURAL, World

SHARED_FLOOR_M2 = 0.05
"""Greatest area (m2) that the floors of two rooms may share."""
OWN_ASSETS = ("vigil_", "Countertop_")
"""Prefixes of the ids of assets whose sizes the engine knows."""
NAMED_ASSETS = 5
"""Greatest number of unknown assets that a note names."""


def _reset(world: World, sceneName: str = PROCEDURAL, **_: object) -> None:
    world.editor.close()
    world.has_house, world.cameras, world.shown, world.floors = False, [], None, {}
    world.emphasized, world.active, world.waiting = None, 0, {}
    world.house, world.scene_name, world.notes = None, PROCEDURAL, []
    if sceneName == PROCEDURAL:
        return
    try:
        house = house_for(sceneName)
    except VigilError as error:
        raise ActionFailed(f"Scene {sceneName!r}: {error}") from None
    if house is None:
        raise bad_argument(
            f"Scene {sceneName!r} does not exist in this engine. The engine's scenes are FloorPlan1 to 430, "
            "FloorPlan_Train... and FloorPlan_Val..."
        )
    open_house(world, house)
    world.scene_name = sceneName
    world.notes.insert(0, f"scene {sceneName} is house {house.name}, with other ids and another layout ({VARIABLE})")


def _create_house(world: World, house: dict[str, Any]) -> None:
    world.has_house, world.shown, world.emphasized, world.active, world.waiting = False, None, None, 0, {}
    try:
        open_house(world, House("house", house))
    except VigilError as error:
        raise ActionFailed(f"Exception creating house: {error}") from None


def open_house(world: World, house: House) -> None:
    """Load a house, with everything at its place in the document. Raises ActionFailed and HouseError."""
    _check(house)
    world.editor.load(house)
    world.editor.reset(_start(house, world.editor), Setup())
    world.has_house, world.scene_name = True, PROCEDURAL
    world.house = world.first_house = house
    world.floors = floors_of(world.editor.scene().rooms)
    place_agents(world)
    nodes = [node for node, _ in house.objects()]
    world.unbreakable, world.flags = set(), {node.id: {"isDirty": True} for node in nodes if node.is_dirty}
    openings = [*house.document.doors, *house.document.windows]
    world.assets = {each.id: each.asset_id for each in [*openings, *nodes]}
    world.notes = list(world.editor.scene().notes)
    foreign = sorted({node.asset_id for node in nodes if not node.asset_id.startswith(OWN_ASSETS)})
    if foreign and not world.knows_sizes:
        named = ", ".join(foreign[:NAMED_ASSETS]) + (", ..." if len(foreign) > NAMED_ASSETS else "")
        world.notes.append(f"without --assets, sizes are guessed; unknown assets ({len(foreign)}): {named}")
    for note in world.notes:
        print(f"house {house.name}: {note}", file=sys.stderr, flush=True)


def _check(house: House) -> None:
    """Raise ActionFailed if a document has impossible values, even if a scene could be built from it."""
    schema = str(house.document.metadata.get("schema", "1"))
    if schema.partition(".")[0] != "1":
        raise ActionFailed(f"Exception creating house: its schema is {schema}, and this engine reads schema 1")
    for each in [*house.document.doors, *(node for node, _ in house.objects())]:
        if not 0.0 <= (each.openness or 0.0) <= 1.0:
            raise ActionFailed(f"Exception creating house: {each.id}: openness {each.openness:g} is not in [0:1]")
    floors = [(room.id, floor_of(room).buffer(0)) for room in house.document.rooms]
    for (one, floor), (other, other_floor) in itertools.combinations(floors, 2):
        if floor.intersection(other_floor).area > SHARED_FLOOR_M2:
            raise ActionFailed(f"Exception creating house: the floors of {one} and {other} overlap")


def _start(house: House, editor: SceneEditor) -> Pose:
    """Return the house's start; if it is missing or blocked, return the first free place. Raises ActionFailed."""
    own = house.start
    if own is not None and editor.can_stand(own.position):
        return own
    for room in editor.scene().rooms:
        low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
        for x, z in itertools.product(*(np.arange(a, b, GRID_M).tolist() for a, b in zip(low, high, strict=True))):
            if editor.can_stand(Vec3(x, 0.0, z)):
                return Pose(position=Vec3(x, 0.0, z), rotation=0.0)
    raise ActionFailed(f"Exception creating house: {house.name!r} has no free place for the agent")


_OWN_LOOKS = "shapes and materials are this project's; the agent is at the house's start at once"
_OTHER_HOUSES = "scenes of iTHOR and RoboTHOR are other houses with rooms of the same kind"

ACTIONS = (
    Action("Reset", _reset, "string sceneName", takes_anything=True, lacks=_OTHER_HOUSES),
    Action("CreateHouse", _create_house, "object house", "house", lacks=_OWN_LOOKS),
    Action("DestroyHouse", _reset),
    Action("GetScenesInBuild", lambda world: [PROCEDURAL, *scene_names()], only_reads=True, lacks=_OTHER_HOUSES),
)
