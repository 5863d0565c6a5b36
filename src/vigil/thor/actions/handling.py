"""Actions on objects: opening, switching, picking up and putting down."""

from functools import partial
from typing import Any

import numpy as np

from vigil.base.geometry import Vec3, floor_distance, heading
from vigil.protocol.world import ObjectSetup, RefusalCode
from vigil.scene.supports import is_shut, level_surfaces
from vigil.scene.things import Thing
from vigil.sim.core.state import HAND_AHEAD_M, HAND_DROP_M
from vigil.thor.actions.action import Action
from vigil.thor.actions.placing import place_at_point
from vigil.thor.base.errors import ActionFailed, invalid_operation
from vigil.thor.base.targets import first_met, target
from vigil.thor.base.world import World

REFUSALS: dict[RefusalCode, str] = {
    "not_openable": "{thing} is not an Openable object",
    "not_toggleable": "object is not toggleable.",
    "not_pickupable": "{thing} must have the property CanPickup to be picked up!",
    "blocked_by_object": "Openable object collided with {blocker}",
    "blocked_by_agent": "Openable object collided with the agent",
    "hand_full": "Agent hand has something in it already! Can't pick up anything else",
    "object_occupied": "{thing} carries something, and cannot be picked up",
    "no_room": "No valid positions to place object found",
    "not_a_receptacle": "{held} cannot be placed in {thing}",
    "receptacle_closed": "Target openable Receptacle is CLOSED, can't place if target is not open!",
    "hand_empty": "Can't place an object if Agent isn't holding anything!",
}
"""VIGIL's refusal code -> AI2-THOR's message. Messages that depend on the action are in the handler of the action."""
MUST_BE_OPEN = frozenset(
    {"Box", "Cabinet", "ClothesDryer", "Drawer", "Fridge", "LaundryHamper", "Microwave", "Safe", "WashingMachine"}
)
"""Categories of receptacles that take objects only inside them, never on top."""
_SPOTS = np.stack(np.meshgrid(*[[0.0, -0.3, 0.3, -0.45, 0.45]] * 2), axis=-1).reshape(-1, 2)
"""Points (25, 2) at which an object is tried on a surface, as offsets from the middle in shares of the sides."""


def target_of(
    world: World,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
    **_: object,
) -> tuple[Thing, Vec3, bool]:
    """Return the thing that an action's arguments name or point at, the point on it, and `forceAction`."""
    return *target(world, objectId, x, y, forced=forceAction), forceAction


def _set_open(world: World, openness: float, **asked: Any) -> None:
    thing, _, forced = target_of(world, **asked)
    if not thing.is_openable:
        raise ActionFailed(_error_text(world, "not_openable", thing))
    if forced:
        world.apply_changes({thing.id: ObjectSetup(openness=openness)})
        return
    effect = world.editor.open_to(thing.id, openness)
    if effect.refusal == "interlock":
        raise ActionFailed("Target must be OFF to open!")
    if effect.refusal not in (None, "already_so"):
        raise ActionFailed(_error_text(world, effect.refusal, thing, effect.blocked_by))


def _open(world: World, openness: float = 1.0, moveMagnitude: float | None = None, **asked: Any) -> None:
    if moveMagnitude is not None:  # the old name of `openness`; there, 0 means fully open
        openness = moveMagnitude or 1.0
    if not 0.0 <= openness <= 1.0:
        raise invalid_operation("openness must be in [0:1]")
    _set_open(world, openness, **asked)


def _close(world: World, openness: float = 0.0, **asked: Any) -> None:
    del openness  # AI2-THOR takes it, and closes the object nevertheless
    _set_open(world, 0.0, **asked)


def _toggle(world: World, *, on: bool, **asked: Any) -> None:
    thing, _, forced = target_of(world, **asked)
    word = "on" if on else "off"
    if not thing.is_toggleable:
        raise ActionFailed(_error_text(world, "not_toggleable", thing))
    if on and world.flags.get(thing.id, {}).get("isBroken"):
        raise ActionFailed("Target is broken and cannot be Toggled On!")
    if thing.is_toggled == on:
        raise ActionFailed(f"can't toggle object {word} if it's already {word}!")
    if forced:
        world.apply_changes({thing.id: ObjectSetup(is_toggled=on)})
    elif world.editor.apply_intent("activate" if on else "deactivate", thing.id, thing.position).refusal:
        raise ActionFailed("Target must be closed to Toggle On!")


def _pick_up(world: World, **asked: Any) -> str:
    if world.held is not None:
        raise ActionFailed(_error_text(world, "hand_full", world.thing(world.held)))
    thing, point, forced = target_of(world, **asked)
    if not thing.is_pickupable:
        raise ActionFailed(_error_text(world, "not_pickupable", thing))
    world.hand_turn = Vec3(0.0, 0.0, 0.0)
    if forced:
        world.apply_changes({}, held=thing.id)
        return thing.id
    effect = world.editor.apply_intent("pick", thing.id, point)
    if effect.refusal is not None:
        raise ActionFailed(_error_text(world, effect.refusal, thing, effect.blocked_by))
    return thing.id


def _put(world: World, **asked: Any) -> None:
    if world.held is None:
        raise ActionFailed(REFUSALS["hand_empty"])
    receptacle, point, _ = target_of(world, **asked)
    if receptacle.id in world.floors:
        drop(world)
        return
    if not receptacle.is_receptacle:
        raise ActionFailed("This target object is NOT a receptacle!")
    if receptacle.category in MUST_BE_OPEN and is_shut(receptacle):
        raise ActionFailed(REFUSALS["receptacle_closed"])
    points = [point] if asked.get("objectId") is None else points_on(world, receptacle)
    refusals: list[RefusalCode] = []
    for place in points:
        refusal = world.editor.apply_intent("place", receptacle.id, place).refusal
        if refusal is None:
            return
        refusals.append(refusal)
    other: list[RefusalCode] = [refusal for refusal in refusals if refusal != "no_room"]
    raise ActionFailed(_error_text(world, other[0] if other else "no_room", receptacle))


def points_on(world: World, receptacle: Thing) -> list[Vec3]:
    """Return points on the receptacle's surfaces, the nearest to the agent first.

    If the receptacle has no surfaces, return only the receptacle's position.
    """
    points = []
    for surface, frame in level_surfaces(receptacle):
        local = np.column_stack(
            [_SPOTS[:, 0] * surface.size_x, np.full(len(_SPOTS), 0.001), _SPOTS[:, 1] * surface.size_z]
        )
        points += [Vec3(*point) for point in frame(local).tolist()]
    x, _, z = world.agent.position
    return sorted(points, key=lambda point: (round(np.hypot(point.x - x, point.z - z), 6), point)) or [
        receptacle.position
    ]


def drop(world: World, forceAction: bool = False, **_: object) -> None:
    """Lay the held object below the hand. Raises ActionFailed."""
    if world.held is None:
        raise ActionFailed("Nothing is in the agent's hand to drop!")
    held = world.thing(world.held)
    if world.editor.apply_intent("drop", held.id, held.position).refusal is None:
        return
    if not forceAction:
        raise ActionFailed(f"{held.id} can't be dropped. It must be clear of all other collision first")
    place_at_point(world, held.id, _below_hand(world))


def _below_hand(world: World) -> Vec3:
    """Return the point straight below the hand. An obstacle in front of the body keeps the hand nearer to the body."""
    pose = world.agent
    ahead_x, ahead_z = heading(pose.rotation)
    axis = pose.position._replace(y=world.eye_of(pose).y - HAND_DROP_M)
    _, ahead = first_met(world, axis, np.array([[ahead_x, 0.0, ahead_z]]))
    reach = HAND_AHEAD_M if ahead is None else min(HAND_AHEAD_M, floor_distance(axis, ahead))
    hand = Vec3(axis.x + reach * ahead_x, axis.y, axis.z + reach * ahead_z)
    return first_met(world, hand, np.array([[0.0, -1.0, 0.0]]))[1] or hand._replace(y=0.0)


def _error_text(world: World, refusal: RefusalCode, thing: Thing, blocker: str | None = None) -> str:
    held = world.thing(world.held).category if world.held else ""
    return REFUSALS[refusal].format(thing=thing.id, blocker=blocker, held=held)


AT = "string objectId, float x, float y, bool forceAction"
WHICH = "objectId | x y"
_OPEN = f"{AT}, float openness, bool simplifyPhysics, float moveMagnitude"
_PUT = f"{AT}, bool placeStationary, int randomSeed, bool putNearXY, float maxDistance"
_DROP = "bool forceAction, bool autoSimulation, float randomMagnitude"
_AT_ONCE = "the object is open or shut at once, and pushes nothing"
_NO_BURNERS = "stove knobs control no burners"
_NO_STACKS = "an object that carries something and is not a receptacle is refused"
_NEAREST = (
    "the place is the nearest free one; randomSeed does nothing, and forceAction does not put an object on a "
    "receptacle that is not for it"
)
_LIES_AT_ONCE = "the object is at rest at once; with forceAction it lies below the hand, even where it does not fit"

ACTIONS = (
    Action("OpenObject", _open, _OPEN, WHICH, lacks=_AT_ONCE),
    Action("CloseObject", _close, _OPEN, WHICH, lacks=_AT_ONCE),
    Action("ToggleObjectOn", partial(_toggle, on=True), AT, WHICH, lacks=_NO_BURNERS),
    Action("ToggleObjectOff", partial(_toggle, on=False), AT, WHICH, lacks=_NO_BURNERS),
    Action("PickupObject", _pick_up, f"{AT}, bool manualInteract, bool stationary", WHICH, lacks=_NO_STACKS),
    Action("PutObject", _put, _PUT, WHICH, lacks=_NEAREST),
    *(
        Action(name, drop, _DROP, lacks=_LIES_AT_ONCE)
        for name in ("DropHandObject", "DropHeldObject", "DropHeldObjectAhead")
    ),
)
