"""Actions that move the held object relative to the agent, or push an object, which then slides without physics."""

from functools import partial
from typing import Any

import numpy as np

from vigil.base.geometry import Vec3, floor_distance, heading, rotate_floor
from vigil.scene.geometry import bounding_box, euler_angles, rotation_matrix
from vigil.scene.things import Thing
from vigil.thor.actions.action import Action
from vigil.thor.actions.handling import AT, WHICH, drop, target_of
from vigil.thor.actions.placing import put_at, support_of
from vigil.thor.base.errors import ActionFailed, invalid_operation
from vigil.thor.base.properties import is_loose, mass_of
from vigil.thor.base.targets import cast_ray, first_met
from vigil.thor.base.world import World

M_PER_FORCE = 0.01
"""Distance (m) by which a push of 1 N slides an object of 1 kg."""
MOST_M = 1.0
"""Greatest distance (m) that a push slides an object."""
SLIDE_M = 0.05
"""Length (m) of the steps in which a slide is computed."""


def _held(world: World) -> Thing:
    if world.held is None:
        raise invalid_operation("Agent's hand is empty, there is no object to move")
    return world.thing(world.held)


def _move(world: World, ahead: float = 0.0, right: float = 0.0, up: float = 0.0, **_: object) -> None:
    held = _held(world)
    pose, usual = world.agent, held.position
    x, z = rotate_floor(right, ahead, pose.rotation)
    place, eye = Vec3(usual.x + x, usual.y + up, usual.z + z), world.eye_of(pose)
    if floor_distance(place, eye) > world.settings.visibility_distance:
        raise ActionFailed("The target position is out of range: it is beyond the visibility distance.")
    world.editor.move_hand(Vec3(right, up, ahead), held.rotation)


def _move_along(way: Vec3, world: World, moveMagnitude: float = 0.1, **_: object) -> None:
    right, up, ahead = (moveMagnitude * share for share in way)
    _move(world, ahead, right, up)


def _move_delta(world: World, x: float = 0.0, y: float = 0.0, z: float = 0.0, **_: object) -> None:
    _move(world, z, x, y)


def _turn(
    world: World, pitch: float = 0.0, yaw: float = 0.0, roll: float = 0.0, rotation: Vec3 | None = None, **_: object
) -> None:
    held, old, agent_yaw = _held(world), world.hand_turn, Vec3(0.0, world.agent.rotation, 0.0)
    wanted = rotation_matrix(rotation or Vec3(old.x + pitch, old.y + yaw, old.z - roll))
    frame = rotation_matrix(agent_yaw)
    turned = frame @ wanted @ rotation_matrix(old).T @ frame.T @ rotation_matrix(held.rotation)
    world.hand_turn = euler_angles(wanted)
    world.editor.move_hand(Vec3(0.0, 0.0, 0.0), euler_angles(turned))


def _turn_hand(world: World, x: float = 0.0, y: float = 0.0, z: float = 0.0, **_: object) -> None:
    _turn(world, rotation=Vec3(x, y, z))


def _push(world: World, yaw: float, force: float, **asked: Any) -> None:
    thing, _, _ = target_of(world, **asked)
    if not is_loose(thing):
        raise ActionFailed("Target Sim Object cannot be moved. Target must have the property Pickupable or Moveable")
    if force <= 0.0:
        raise invalid_operation("moveMagnitude must be above 0")
    _slide(world, thing, yaw, force)


def _slide(world: World, thing: Thing, yaw: float, force: float) -> None:
    """Slide a thing on its support as far as a force (N) does; an obstacle or the support's edge stops it earlier."""
    length = min(MOST_M, M_PER_FORCE * force / max(mass_of(thing), 1e-3))
    (x, z), box = heading(yaw), bounding_box(thing)
    across = np.array([-z, 0.0, x]) * min(box.size.x, box.size.z) / 2
    front = np.array(thing.position) + np.array([x, 0.0, z]) * max(box.size.x, box.size.z) / 2
    for start in (front - across, front, front + across):
        _, met = first_met(world, Vec3(*start.tolist()), np.array([[x, 0.0, z]]))
        if met is not None:
            length = min(length, float(np.linalg.norm(np.subtract(met, start))))
    below, reached = thing.parent, thing.position
    for gone in np.arange(SLIDE_M, length + 1e-9, SLIDE_M).tolist():
        place = Vec3(thing.position.x + gone * x, thing.position.y, thing.position.z + gone * z)
        bottom = place._replace(y=place.y - box.size.y / 2)
        if support_of(world, thing.id, bottom) != below or world.editor.room_at(place) is None:
            break
        reached = place
    if reached != thing.position:
        put_at(world, thing.id, reached, thing.rotation)


def _push_from(world: World, moveMagnitude: float = 100.0, pushAngle: float = 0.0, **asked: Any) -> None:
    _push(world, world.agent.rotation + pushAngle, moveMagnitude, **asked)


def _throw(world: World, moveMagnitude: float, **asked: Any) -> None:
    thrown = world.held
    drop(world, **asked)
    _slide(world, world.thing(thrown or ""), world.agent.rotation, moveMagnitude)


def _touch(
    world: World,
    x: float,
    y: float,
    direction: Vec3 | None = None,
    moveMagnitude: float = 0.0,
    handDistance: float | None = None,
    **_: object,
) -> dict[str, Any]:
    thing, point = cast_ray(world, x, y)
    reach = world.settings.visibility_distance if handDistance is None else handDistance
    away = float("inf") if point is None else float(np.linalg.norm(np.subtract(point, world.view().eye)))
    if thing is None or away > reach:
        return {"didHandTouchSomething": False, "objectId": "None", "armsLength": min(away, reach)}
    way = direction or Vec3(0.0, 0.0, 1.0)
    if is_loose(thing) and moveMagnitude > 0.0 and (way.x or way.z):
        yaw = world.agent.rotation + float(np.degrees(np.arctan2(way.x, way.z)))
        _push(world, yaw, moveMagnitude, objectId=thing.id, forceAction=True)
    return {"didHandTouchSomething": True, "objectId": thing.id, "armsLength": away}


_MOVE = "float moveMagnitude, bool forceVisible"
_BY = "float ahead, float right, float up, bool forceVisible"
_XYZ = "float x, float y, float z, bool autoSimulation"
_PASSES_THROUGH = "the held object never collides, and is drawn at its usual place in the image"
_SLIDES = "the object slides up to 1 m (0.01 m for 1 N on 1 kg) and stops at obstacles and edges; nothing falls or tips"
_WAYS = {
    "Ahead": Vec3(0.0, 0.0, 1.0),
    "Back": Vec3(0.0, 0.0, -1.0),
    "Left": Vec3(-1.0, 0.0, 0.0),
    "Right": Vec3(1.0, 0.0, 0.0),
    "Up": Vec3(0.0, 1.0, 0.0),
    "Down": Vec3(0.0, -1.0, 0.0),
}
_PUSH, _PUSHED = f"{AT}, float moveMagnitude", "objectId moveMagnitude | x y moveMagnitude"
_THROW = "float moveMagnitude, bool forceAction, bool autoSimulation"
_TOUCH = "float x, float y, Vector3 direction, float moveMagnitude, float handDistance, bool autoSimulation"
_THROWN = f"the object is dropped, and then pushed: {_SLIDES}"

ACTIONS = (
    Action("MoveHeldObject", _move, _BY, lacks=_PASSES_THROUGH),
    *(
        Action(f"{start}{name}", partial(_move_along, way), _MOVE, lacks=_PASSES_THROUGH)
        for start in ("MoveHeldObject", "MoveHand")
        for name, way in _WAYS.items()
    ),
    Action("MoveHandDelta", _move_delta, _XYZ, lacks=_PASSES_THROUGH),
    Action("RotateHeldObject", _turn, "float pitch, float yaw, float roll, Vector3 rotation", lacks=_PASSES_THROUGH),
    Action("RotateHand", _turn_hand, _XYZ, lacks=_PASSES_THROUGH),
    Action("DirectionalPush", _push_from, f"{_PUSH}, float pushAngle", _PUSHED, lacks=_SLIDES),
    Action("ThrowObject", _throw, _THROW, "moveMagnitude", lacks=_THROWN),
    Action("PushObject", _push_from, _PUSH, WHICH, lacks=_SLIDES),
    Action("PullObject", partial(_push_from, pushAngle=180.0), _PUSH, WHICH, lacks=_SLIDES),
    Action("TouchThenApplyForce", _touch, _TOUCH, "x y", lacks=_SLIDES),
)
