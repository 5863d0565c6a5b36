"""Actions that arrange a scene: placing, removing and restoring objects."""

from typing import Any

import numpy as np

from vigil.base.geometry import Vec3
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement
from vigil.scene.geometry import bounding_box, upright_box
from vigil.scene.supports import contents, level_surfaces, offset_from
from vigil.scene.things import Thing
from vigil.sim.thor.units import from_thor
from vigil.thor.actions.action import Action
from vigil.thor.base.errors import ActionFailed, bad_argument
from vigil.thor.base.properties import is_loose
from vigil.thor.base.world import World

RESTS_WITHIN_M = 0.05
"""A thing rests on a surface if the thing's bottom is at most this far (m) from the surface."""


def place_at_point(world: World, objectId: str, position: Vec3, rotation: Vec3 | None = None, **_: object) -> None:
    """Put an object so that its bottom is at a point. Raises ActionFailed."""
    thing = _loose(world, objectId)
    turned = rotation or thing.rotation
    height = _height(thing, turned)
    put_at(world, thing.id, Vec3(position.x, position.y + height / 2, position.z), turned)


def _teleport_object(
    world: World,
    objectId: str,
    position: Vec3 | None = None,
    positions: list[Any] | None = None,
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    rotation: Vec3 | None = None,
    allowTeleportOutOfHand: bool = True,
    makeUnbreakable: bool = False,
    **_: object,
) -> None:
    thing = _loose(world, objectId)
    if thing.is_held and not allowTeleportOutOfHand:
        raise ActionFailed("Object is currently held; allowTeleportOutOfHand is needed to teleport it")
    try:
        place = from_thor(positions[0]) if positions else position or Vec3(x, y, z)
    except (KeyError, TypeError, ValueError):
        raise bad_argument("positions must be a list of dicts, each with the keys x, y and z") from None
    put_at(world, thing.id, place, rotation or thing.rotation)
    if makeUnbreakable:
        world.unbreakable.add(thing.id)


def _set_poses(world: World, objectPoses: list[Any], skipMoveable: bool = False, **_: object) -> None:
    wanted: dict[str, tuple[Vec3, Vec3]] = {}
    for number, pose in enumerate(objectPoses):
        try:
            place, turned = from_thor(pose["position"]), from_thor(pose["rotation"])
            name = str(pose["objectName"])
        except (KeyError, TypeError, ValueError):
            raise bad_argument(
                f"objectPoses[{number}] needs objectName, position and rotation (each with x, y and z)"
            ) from None
        wanted[_loose(world, name).id] = place, turned
    others = [
        thing.id
        for thing in world.things()
        if is_loose(thing) and thing.id not in wanted and (thing.is_pickupable or not skipMoveable)
    ]
    world.apply_changes({name: ObjectSetup(is_absent=True) for name in others})
    placed = [world.editor.scene().things[name] for name in wanted]
    placed.sort(key=lambda thing: (thing.is_pickupable, not thing.is_receptacle))  # carriers come first
    for name in (thing.id for thing in placed):
        world.editor.restore_object(name)  # it may have been removed together with what carried it
        put_at(world, name, *wanted[name])


def _remove(world: World, objectId: str | None = None, objectIds: list[str] | None = None) -> None:
    names = [objectId] if objectId is not None else objectIds or []
    world.apply_changes({world.thing(name).id: ObjectSetup(is_absent=True) for name in names})


def _enable(world: World, objectId: str) -> None:
    world.need_house()
    try:
        world.editor.restore_object(objectId)
    except EpisodeError:
        raise bad_argument(f"objectId: {objectId} is not the objectId on any object in the scene!") from None


def _loose(world: World, object_id: str) -> Thing:
    thing = world.thing(object_id)
    if not is_loose(thing):
        raise ActionFailed(f"{object_id} must be pickupable or moveable to be placed elsewhere")
    return thing


def _height(thing: Thing, rotation: Vec3) -> float:
    turned = Thing(thing.id, thing.category, thing.asset, thing.position, rotation)
    half = np.array(thing.asset.size) / 2
    return upright_box(turned, -half, half).size.y


def put_at(world: World, name: str, place: Vec3, turned: Vec3) -> None:
    """Put an object at a place. What is right below this place becomes the object's support. Raises ActionFailed."""
    bottom = place.y - _height(world.thing(name), turned) / 2
    below = support_of(world, name, Vec3(place.x, bottom, place.z))
    placement = Placement(position=place, rotation=turned, parent=below)
    world.apply_changes({name: ObjectSetup(placement=placement)})


def support_of(world: World, name: str, point: Vec3) -> str | None:
    """Return the id of the thing whose surface or top is right below a point; None for the floor or nothing."""
    above = {name, *(thing.id for thing in contents(world.editor.scene(), name))}
    found: list[tuple[float, str]] = []
    for thing in world.things():
        if thing.id in above or thing.is_held or not thing.is_receptacle:
            continue
        for surface, frame in level_surfaces(thing):
            local = offset_from(frame, point)
            is_over = abs(local.x) <= surface.size_x / 2 and abs(local.z) <= surface.size_z / 2
            if is_over and abs(local.y) <= RESTS_WITHIN_M:
                found.append((abs(local.y), thing.id))
    return min([*found, *_tops(world, above, point)], default=(0.0, None))[1]


def _tops(world: World, above: set[str], point: Vec3) -> list[tuple[float, str]]:
    """Return (gap in metres, id) of the things, except receptacles, whose top (as of a book) is right below a point."""
    others = [thing for thing in world.things() if not (thing.id in above or thing.is_held or thing.is_receptacle)]
    boxes = [(bounding_box(thing), thing.id) for thing in others if not thing.is_structure]
    gaps = [(abs(point.y - box.top), name) for box, name in boxes if box.floor_distance(point) == 0.0]
    return [(gap, name) for gap, name in gaps if gap <= RESTS_WITHIN_M]


_NO_CHECK = "whether the place is free is not checked"
_NO_COPIES = "one pose for each object, because copies are not made; nothing falls"
_PLACE = "string objectId, Vector3 position, Vector3 rotation, bool forceKinematic"
_POSES = "list objectPoses, bool placeStationary, bool enablePhysicsJitter, bool forceRigidbodySleep, bool skipMoveable"
_TELEPORT = (
    "string objectId, Vector3 position, list positions, Vector3 rotation, float x, float y, float z, bool forceAction, "
    "bool forceKinematic, bool allowTeleportOutOfHand, bool makeUnbreakable"
)
_TELEPORTED = "objectId position | objectId positions | objectId x y z"

ACTIONS = (
    Action("PlaceObjectAtPoint", place_at_point, _PLACE, "objectId position", lacks=_NO_CHECK),
    Action("TeleportObject", _teleport_object, _TELEPORT, _TELEPORTED, lacks=_NO_CHECK),
    Action("SetObjectPoses", _set_poses, _POSES, "objectPoses", lacks=_NO_COPIES),
    Action("RemoveFromScene", _remove, "string objectId, list objectIds", "objectId | objectIds"),
    Action("DisableObject", _remove, "string objectId", "objectId"),
    Action("EnableObject", _enable, "string objectId", "objectId"),
)
