"""Several agents in one world. The simulator has one agent; the others wait, each as a pose and what it holds."""

import numpy as np

from vigil.base.geometry import Pose, Vec3, floor_distance, rotate_floor
from vigil.protocol.world import ObjectSetup, Placement
from vigil.scene.outlines import BODY_RADIUS_M
from vigil.thor.base.errors import ActionFailed
from vigil.thor.base.world import Waiting, World


def act_as(world: World, number: int) -> None:
    """Let the simulator's agent be agent `number`. Raises ActionFailed if there is no such agent."""
    if number == world.active:
        return
    if number not in world.waiting:
        raise ActionFailed(f"agentId {number}: the scene has {1 + len(world.waiting)} agents (agentCount), from 0 on.")
    world.waiting[world.active] = _put_aside(world)
    coming = world.waiting.pop(number)
    world.active, world.hand_turn = number, coming.hand_turn
    world.editor.stand(coming.pose)
    if coming.held is not None and is_in_hand(world, coming):
        _take_again(world, coming)


def _put_aside(world: World) -> Waiting:
    """Leave what the simulator's agent holds in the air, where other agents see it, and return the agent."""
    name = world.held
    if name is None:
        return Waiting(world.agent, None, world.agent.position, world.agent.position, world.hand_turn)
    held = world.thing(name)
    leaving = Waiting(world.agent, name, held.position, held.rotation, world.hand_turn)
    world.apply_changes({name: ObjectSetup(placement=Placement(position=held.position, rotation=held.rotation))})
    return leaving


def _take_again(world: World, coming: Waiting) -> None:
    world.apply_changes({}, held=coming.held)
    usual = world.editor.scene().things[coming.held or ""].position
    x, up, z = np.subtract(coming.place, usual).tolist()
    right, ahead = rotate_floor(x, z, -coming.pose.rotation)
    world.editor.move_hand(Vec3(right, up, ahead), coming.rotation)


def is_in_hand(world: World, other: Waiting) -> bool:
    """Return whether a waiting agent still has what it held: nothing has moved or removed this object."""
    thing = world.editor.scene().things.get(other.held or "")
    return thing is not None and thing.is_present and not thing.is_held and thing.position == other.place


def agent_between(world: World, start: Vec3, end: Vec3) -> int | None:
    """Return the number of the waiting agent whose body stops a body on the straight way between two places.

    A body that overlaps another can walk away from it. Returns None if no agent is in the way.
    """
    way = np.array([end.x - start.x, end.z - start.z])
    for number, other in world.waiting.items():
        to_other = np.array([other.pose.position.x - start.x, other.pose.position.z - start.z])
        share = float(np.clip(way @ to_other / max(float(way @ way), 1e-12), 0.0, 1.0))
        gap = float(np.linalg.norm(to_other - share * way))
        if gap < 2 * BODY_RADIUS_M and (share > 0.0 or not way.any()):
            return number
    return None


def place_agents(world: World) -> None:
    """Have as many agents as the settings say. New ones stand near agent 0. Raises ActionFailed without a place."""
    for number in [each for each in (world.active, *world.waiting) if each >= world.settings.agent_count]:
        act_as(world, number)
        if world.held is not None:
            world.editor.apply_intent("drop", world.held, world.agent.position)
        act_as(world, 0)
        del world.waiting[number]
    act_as(world, 0)
    for number in range(1 + len(world.waiting), world.settings.agent_count):
        world.waiting[number] = Waiting(_free_pose(world, number))


def _free_pose(world: World, number: int) -> Pose:
    here = world.agent.position
    places = [Vec3(x, here.y, z) for x, z in world.editor.reachable(here, world.settings.grid_size).tolist()]
    for place in sorted(places, key=lambda each: (floor_distance(each, here), each)):
        if floor_distance(place, here) >= 2 * BODY_RADIUS_M and agent_between(world, place, place) is None:
            return world.agent.model_copy(update={"position": place})
    raise ActionFailed(f"agentCount {world.settings.agent_count}: the house has no free place for agent {number}.")
