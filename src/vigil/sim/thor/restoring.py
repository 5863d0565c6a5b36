"""Changes to a house in AI2-THOR that skip THOR's checks, for setups and to restore an earlier state.

This module is never used for an agent's action. It sends THOR's actions with `forceAction`, so THOR does not check
sight and reach.
"""

import copy
from collections.abc import Iterator
from typing import Any

from vigil.base.geometry import Pose, Vec3, distance, turn_between
from vigil.errors import EpisodeError, SimulatorError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.build import rest_on_surface
from vigil.scene.supports import ancestors, contents
from vigil.scene.things import Thing
from vigil.sim.core.setup import carrier_of, changed_states, check_can_be_held, things_named
from vigil.sim.thor.engine_session import EngineSession
from vigil.sim.thor.scene_sync import ThorSnapshot
from vigil.sim.thor.units import from_thor, teleport_arguments, to_thor

COARSE = 1e-3
"""Greatest difference (m, degrees, openness) of a restored thing from its earlier state; physics may move it."""
ROUNDS = 200
"""Greatest number of rounds of a restore. Each round puts things back, which may move other things."""

_PLACE = ("position", "rotation", "parentReceptacles", "isPickedUp")
Step = tuple[str, dict[str, Any]]
"""One of THOR's actions, with its arguments."""


def set_up(session: EngineSession, setup: Setup, house_name: str) -> None:
    """Change the house as a setup says. Raises EpisodeError when the house does not allow the changes."""
    wanted = things_named(setup, session.scene_sync.scene, house_name)
    for thing, change in wanted:
        _set_states(session, thing, change)
    placed = [(thing, change.placement) for thing, change in wanted if change.placement is not None]
    for thing, placement in sorted(placed, key=lambda pair: (_depth(setup, pair[0].id), pair[0].id)):
        _put(session, thing, placement, house_name)
    for thing, change in wanted:
        if change.is_absent:
            for gone in [*reversed(contents(session.scene_sync.scene, thing.id)), thing]:
                _force(session, "DisableObject", objectId=gone.id)
    for thing, _ in placed:
        if not thing.is_present:
            raise EpisodeError(
                f"Setup: {thing.id!r} is placed on something that is taken out of the scene. Place it elsewhere."
            )
    if setup.held is not None:
        check_can_be_held(session.scene_sync.scene.things[setup.held])
        _force(session, "PickupObject", objectId=setup.held, forceAction=True)
    if setup.objects:
        session.wait_until_at_rest()


def stand(session: EngineSession, pose: Pose) -> None:
    """Put the agent at a pose, even if its body does not fit there. Raises SimulatorError."""
    outcome = session.do("TeleportFull", **teleport_arguments(pose), forceAction=True)
    if not outcome.is_done:
        raise SimulatorError(f"AI2-THOR did not put the agent at {tuple(pose.position)}: {outcome.message}")


def restore_snapshot(session: EngineSession, snapshot: ThorSnapshot) -> bool:
    """Restore the objects and the hand to a snapshot; return whether that succeeded."""
    done: set[str] = set()
    for _ in range(ROUNDS):
        steps = next((steps for steps in _restore_steps(session, snapshot, done) if steps), None)
        if steps is None:
            return True
        for action, arguments in steps:
            session.do(action, **arguments)
            done.add(arguments["objectId"])
    return False


def _restore_steps(session: EngineSession, snapshot: ThorSnapshot, done: set[str]) -> Iterator[list[Step]]:
    """Yield lists of steps that restore a snapshot, one list for each kind of step; empty if there is nothing to
    restore.

    Things in `done` were restored before and may differ from the snapshot by `COARSE`, because physics may have moved
    them. All other things must be exactly equal to it.
    """
    now, before = session.scene_sync.objects, snapshot.objects
    scene = session.scene_sync.scene
    yield [("EnableObject", {"objectId": name}) for name in before if name not in now]
    gone = [scene.things[name] for name in now if name not in before]
    gone.sort(key=lambda thing: -len(ancestors(scene, thing)))  # what is carried comes before its carrier
    yield [("DisableObject", {"objectId": thing.id}) for thing in gone]
    both = [name for name in before if name in now]
    slack = {name: COARSE if name in done else 0.0 for name in both}
    yield [
        ("OpenObject", {"objectId": name, "openness": before[name]["openness"], "forceAction": True})
        for name in both
        if abs(now[name]["openness"] - before[name]["openness"]) > slack[name]
    ]
    yield [
        (f"ToggleObject{'On' if before[name]['isToggled'] else 'Off'}", {"objectId": name, "forceAction": True})
        for name in both
        if now[name]["isToggled"] != before[name]["isToggled"]
    ]
    stack = _stack(snapshot)
    astray = [name for name in both if name not in stack and _is_elsewhere(now[name], before[name], slack[name])]
    if astray:
        name = min(astray, key=lambda name: (_carriers(before, name), name))  # a carrier comes before what it carries
        yield [("TeleportObject", {**_pose_of(before[name]), "objectId": name, "forceAction": True})]
    if snapshot.held is not None and session.scene_sync.held != snapshot.held:
        turned = {**_pose_of(now[snapshot.held]), "rotation": dict(before[snapshot.held]["rotation"])}
        if _is_turned(now[snapshot.held], before[snapshot.held], slack[snapshot.held]):  # picking up keeps the yaw
            yield [("TeleportObject", {**turned, "objectId": snapshot.held, "forceAction": True})]
        yield [("PickupObject", {"objectId": snapshot.held, "forceAction": True})]


def _stack(snapshot: ThorSnapshot) -> set[str]:
    """Return the ids of the object in the hand and of everything that it carried, according to a snapshot."""
    stack = set() if snapshot.held is None else {snapshot.held}
    carriers = {name: entry["parentReceptacles"] or () for name, entry in snapshot.objects.items()}
    while more := {name for name, below in carriers.items() if not stack.isdisjoint(below)} - stack:
        stack |= more
    return stack


def _carriers(objects: dict[str, Any], name: str) -> int:
    """Return how many objects carry or contain an object, directly or through others."""
    found: set[str] = set()
    ahead = [name]
    while ahead:
        more = set(objects[ahead.pop()]["parentReceptacles"] or ()) & set(objects) - found
        found |= more
        ahead.extend(sorted(more))
    return len(found)


def _pose_of(entry: Any) -> dict[str, Any]:
    return {"position": dict(entry["position"]), "rotation": dict(entry["rotation"])}


def _is_elsewhere(now: Any, before: Any, tolerance: float) -> bool:
    if all(now[name] == before[name] for name in _PLACE):
        return False
    if now["isPickedUp"] or set(now["parentReceptacles"] or ()) != set(before["parentReceptacles"] or ()):
        return True
    if distance(from_thor(now["position"]), from_thor(before["position"])) > tolerance:
        return True
    return _is_turned(now, before, tolerance)


def _is_turned(now: Any, before: Any, tolerance: float) -> bool:
    turns = zip(from_thor(now["rotation"]), from_thor(before["rotation"]), strict=True)
    return any(abs(turn_between(a, b)) > tolerance for a, b in turns)


def _set_states(session: EngineSession, thing: Thing, change: ObjectSetup) -> None:
    if change.is_broken:
        raise EpisodeError(
            f"Setup: AI2-THOR cannot show the notice that {thing.id!r} ({thing.category}) is out of order. Play "
            "the episode in the embedded simulator, or leave out its `is_broken`."
        )
    openness, is_toggled = changed_states(thing, change, can_open=thing.is_openable)
    if openness is not None:
        _force(session, "OpenObject", objectId=thing.id, openness=openness, forceAction=True)
    if is_toggled is not None:
        _force(session, f"ToggleObject{'On' if is_toggled else 'Off'}", objectId=thing.id, forceAction=True)


def _depth(setup: Setup, object_id: str) -> int:
    """Return how many objects a setup places below an object in a stack, in which each object is placed on another."""
    change = setup.objects.get(object_id)
    parent = change.placement.parent if change is not None and change.placement is not None else None
    return 0 if parent is None else 1 + _depth(setup, parent)


def _put(session: EngineSession, thing: Thing, placement: Placement, house_name: str) -> None:
    """Put an object at the place that a setup names.

    If the placement names a parent, the object is put on the parent's surface that is nearest in height, unless this
    surface is too far away.
    """
    scene_sync = session.scene_sync
    parent = carrier_of(thing, placement, scene_sync.scene, house_name)
    if not scene_sync.is_movable(thing):
        raise EpisodeError(f"Setup: AI2-THOR does not move {thing.id!r} ({thing.category}). Leave it where it is.")
    goal = copy.copy(thing)
    goal.position, goal.rotation = placement.position, placement.rotation
    if parent is not None:
        rest_on_surface(goal, parent)
    before = Vec3(*thing.position)
    carried = [(each, Vec3(*each.position)) for each in contents(scene_sync.scene, thing.id)]
    _teleport(session, thing, goal.position, goal.rotation)
    shift = [b - a for a, b in zip(before, thing.position, strict=True)]
    for each, place in carried:  # THOR leaves behind what lay in or on the thing
        if distance(each.position, place) <= COARSE < sum(map(abs, shift)):
            _teleport(session, each, Vec3(*(a + b for a, b in zip(place, shift, strict=True))), each.rotation)


def _teleport(session: EngineSession, thing: Thing, position: Vec3, rotation: Vec3) -> None:
    pivot = session.scene_sync.pivot(thing, position, rotation)
    arguments = {"position": to_thor(pivot), "rotation": to_thor(rotation), "forceAction": True}
    _force(session, "TeleportObject", objectId=thing.id, **arguments)


def _force(session: EngineSession, action: str, **arguments: Any) -> None:
    outcome = session.do(action, **arguments)
    if not outcome.is_done:
        name = arguments["objectId"]
        raise EpisodeError(f"Setup: AI2-THOR's {action} of {name!r} failed: {outcome.message.partition('. trace')[0]}")
