"""Snapshots of a simulator's whole hidden state, and what must hold of it at any moment."""

import math
from collections.abc import Iterable

import shapely

from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG
from vigil.scene.geometry import body_box
from vigil.scene.things import Scene, Thing
from vigil.sim.privileged import PrivilegedSimulator

ROOM_SLACK_M = 0.006
"""How far beyond the floors the agent's axis may be; the floor plan takes 5 mm more for inside."""
BOUNDS_SLACK_M = 1.0
"""How far beyond the outermost floor and the highest wall a thing may be: windows and doors of outer walls are."""

Snapshot = dict[str, str]
"""Id of a thing, or "agent" -> its state, each number with all its digits."""


def snapshot(simulator: PrivilegedSimulator) -> Snapshot:
    """Return all that can change in a loaded house; equal snapshots are equal to the last bit."""
    world = simulator.world(())
    taken = {thing.id: repr(_state(thing)) for thing in simulator.scene().things.values()}
    return {"agent": f"{world.agent!r}, holding {world.held}", **taken}


def changed(before: Snapshot, after: Snapshot) -> set[str]:
    """Return what differs in two snapshots of one house."""
    return {name for name, state in after.items() if before.get(name) != state}


def difference(before: Snapshot, after: Snapshot) -> str:
    """Return the first difference of two snapshots in words; empty when they are equal to the last bit."""
    name = min(changed(before, after), default=None)
    return "" if name is None else f"{name}: {before.get(name)} became {after[name]}"


def _state(thing: Thing) -> tuple[object, ...]:
    place = (*thing.position, *thing.rotation, thing.parent, thing.parent_joint, thing.surface)
    return (*place, thing.openness, thing.is_toggled, thing.is_held, thing.is_present)


class SanityCheck:
    """What must hold of the hidden state of a loaded house at any moment."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        rooms = simulator.scene().rooms
        self.floor = shapely.unary_union([shapely.Polygon(room.polygon).buffer(0) for room in rooms])
        self._bounds = self.floor.buffer(BOUNDS_SLACK_M).bounds
        self._top = max(room.height for room in rooms) + BOUNDS_SLACK_M
        self._inside = self.floor.buffer(ROOM_SLACK_M)
        shapely.prepare(self._inside)

    def faults(self, floor_y: float, names: Iterable[str]) -> list[tuple[str, str]]:
        """Return what is wrong now, as (kind, detail), with the agent, the hand and the named things.

        `floor_y` is the height at which the agent started.
        """
        scene, world = self._simulator.scene(), self._simulator.world(())
        agent = world.agent
        if not all(map(math.isfinite, (*agent.position, agent.rotation, agent.horizon))):
            return [("the agent is nowhere", repr(agent))]
        faults: list[tuple[str, str]] = []
        if not HORIZON_UP_DEG <= agent.horizon <= HORIZON_DOWN_DEG or not 0.0 <= agent.rotation < 360.0:
            faults.append(("the agent's head is turned too far", repr(agent)))
        if agent.position.y != floor_y:
            faults.append(("the agent left the floor", repr(agent)))
        if not self._inside.covers(shapely.Point(agent.position.x, agent.position.z)):
            faults.append(("the agent is in no room", repr(agent)))
        faults += _hand_faults(scene, world.held)
        things = [scene.things[name] for name in sorted(names) if name in scene.things]
        return faults + [fault for thing in things for fault in self._thing_faults(scene, thing)]

    def _thing_faults(self, scene: Scene, thing: Thing) -> list[tuple[str, str]]:
        if not all(map(math.isfinite, (*thing.position, *thing.rotation, thing.openness))):
            return [("a thing is nowhere", f"{thing.id} {thing.position} {thing.rotation}")]
        faults = _support_faults(scene, thing)
        if not 0.0 <= thing.openness <= 1.0:
            faults.append(("openness out of 0..1", f"{thing.id} {thing.openness}"))
        if thing.is_present and not thing.is_held and not self._is_within(thing):
            faults.append(("a thing is out of the house", f"{thing.id} {thing.position}"))
        return faults

    def _is_within(self, thing: Thing) -> bool:
        left, front, right, back = self._bounds
        x, y, z = thing.position
        return left <= x <= right and front <= z <= back and 0.0 <= y <= self._top and body_box(thing).bottom >= -0.1


def _hand_faults(scene: Scene, held: str | None) -> list[tuple[str, str]]:
    marked = {thing.id for thing in scene.things.values() if thing.is_held}
    stack = {held} if held else set()
    for _ in range(len(marked)):
        stack |= {thing.id for thing in scene.things.values() if thing.parent in stack and thing.is_present}
    faults = [] if marked == stack else [("two opinions of the hand", f"held {held}, marked {sorted(marked)}")]
    if held is not None:
        thing = scene.things[held]
        if thing.parent or thing.surface or thing.parent_joint or not thing.is_present:
            faults.append(("what is held is also supported or absent", repr((held, thing.parent, thing.surface))))
    return faults


def _support_faults(scene: Scene, thing: Thing) -> list[tuple[str, str]]:
    seen, below = {thing.id}, thing
    while below.parent is not None:
        if below.parent not in scene.things:
            return [("a parent that is not there", f"{below.id} on {below.parent}")]
        is_gone = below.is_present and not scene.things[below.parent].is_present
        below = scene.things[below.parent]
        if is_gone:
            return [("on what is absent", f"{thing.id}, by way of {below.id}")]
        if below.id in seen:
            return [("a ring of supports", thing.id)]
        seen.add(below.id)
    return []
