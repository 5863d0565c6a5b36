"""What must hold of solids after things were handled: overlaps, rooms, and what things rest on."""

from collections.abc import Iterable

import numpy as np
import shapely
from shapely import Polygon

from vigil.assets.catalog import CATALOG, WALL
from vigil.scene.geometry import Prism, bounding_box, penetration, prisms_of
from vigil.scene.outlines import polygon_of, wall_prisms
from vigil.scene.supports import ancestors, contents, offset_from, surface_frame, surface_named
from vigil.scene.things import Scene, Thing
from vigil.sim.privileged import PrivilegedSimulator

PLACED_M = 0.0065
"""Largest overlap (m) of a thing that was put down: the simulator shrinks footprints by 3 mm a side."""
LEAF_M, LEAF_AT_WALL_M = 0.0155, 0.0505
"""Largest increase (m) of a leaf's overlap, by the simulator's own rule (`vigil.sim.core.opening`)."""
FLOAT_M = 0.004
ROOM_M = 0.002
"""Largest distance (m) by which a thing that was put down may stand out of its room."""

Pair = tuple[str, str]


class Solids:
    """The solids of a loaded house at one moment, to compare with later ones."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._scene: Scene = simulator.scene()
        self._walls = [(panel.id, prism) for panel in self._scene.panels for prism in wall_prisms(panel)]
        self._rooms = {room.id: Polygon(room.polygon).buffer(0) for room in self._scene.rooms}
        self._deepest: dict[Pair, float] = {}

    def remember(self, names: Iterable[str]) -> None:
        """Note how deep the named things are in others now; they may be so again."""
        for pair, depth in self._overlaps(names).items():
            self._deepest[pair] = max(depth, self._deepest.get(pair, 0.0))

    def overlap_faults(self, names: Iterable[str], is_leaf: bool) -> list[tuple[str, str]]:
        """Return which of the named things are deeper in others than ever before, by more than the tolerance."""
        faults: list[tuple[str, str]] = []
        for (name, other), depth in self._overlaps(names).items():
            before = max(self._deepest.get((name, other), 0.0), self._deepest.get((other, name), 0.0))
            allowed = PLACED_M if not is_leaf else LEAF_AT_WALL_M if self._is_wall(other) else LEAF_M
            if depth > before + allowed:
                kind = "a leaf or what it carries in another solid" if is_leaf else "put down into another solid"
                faults.append((kind, f"{name} is {depth * 1000:.1f} mm in {other}, was {before * 1000:.1f}"))
        return faults

    def room_faults(self, names: Iterable[str]) -> list[tuple[str, str]]:
        """Return which of the named things lie with their solids in more than the room that holds their middle."""
        faults: list[tuple[str, str]] = []
        for thing in self._present(names):
            middle = shapely.Point(thing.position.x, thing.position.z)
            room = next((floor for floor in self._rooms.values() if floor.covers(middle)), None)
            if room is None:
                faults.append(("in no room", f"{thing.id} at {thing.position}"))
                continue
            grown = room.buffer(ROOM_M, join_style="mitre")
            if not all(grown.covers(polygon_of(prism)) for prism in prisms_of(thing)):
                gap = max(_beyond(room, prism) for prism in prisms_of(thing))
                faults.append(("out of its room", f"{thing.id} stands out of its room by {gap * 1000:.1f} mm"))
        return faults

    def float_faults(self, names: Iterable[str]) -> list[tuple[str, str]]:
        """Return which of the named things neither stand on the floor nor on the surface that carries them."""
        faults: list[tuple[str, str]] = []
        for thing in self._present(names):
            bottom, parent = bounding_box(thing).bottom, self._scene.things.get(thing.parent or "")
            surface = parent and surface_named(parent, thing.surface)
            if parent is not None and surface is not None:
                frame = surface_frame(parent, surface)
                low = thing.position._replace(y=bottom)
                x, height, z = offset_from(frame, low)
                beside = max(abs(x) - surface.size_x / 2, abs(z) - surface.size_z / 2)
                if abs(height) > FLOAT_M or beside > 1e-6:
                    where = (
                        f"{height * 1000:.1f} mm over and {beside * 1000:.1f} mm beside {parent.id}'s {surface.name}"
                    )
                    faults.append(("not on its surface", f"{thing.id} {where}"))
            elif parent is None and abs(bottom) > FLOAT_M:
                faults.append(("not on the floor", f"{thing.id}: bottom at {bottom * 1000:.1f} mm, on nothing"))
        return faults

    def _present(self, names: Iterable[str]) -> list[Thing]:
        things = (self._scene.things[name] for name in sorted(names) if name in self._scene.things)
        return [thing for thing in things if thing.is_present and not thing.is_held and not thing.is_structure]

    def _is_wall(self, name: str) -> bool:
        thing = self._scene.things.get(name)
        return thing is None or thing.is_structure or WALL in CATALOG[thing.category].rests_on

    def _overlaps(self, names: Iterable[str]) -> dict[Pair, float]:
        """Return how deep (m) each named thing is in each other one or wall; not in what it rests on or carries."""
        wanted = [self._scene.things[name] for name in sorted(names) if name in self._scene.things]
        wanted = [thing for thing in wanted if thing.is_present and not thing.is_held]
        if not wanted:
            return {}
        others = [thing for thing in self._scene.things.values() if thing.is_present and not thing.is_held]
        solids = [(thing.id, prism) for thing in others for prism in prisms_of(thing)] + self._walls
        bounds = np.array([prism.bounds for _, prism in solids])
        found: dict[Pair, float] = {}
        for thing in wanted:
            kin = {thing.id} | {each.id for each in (*ancestors(self._scene, thing), *contents(self._scene, thing.id))}
            for prism in prisms_of(thing):
                left, front, right, back = prism.bounds
                near = (bounds[:, 0] < right) & (bounds[:, 2] > left) & (bounds[:, 1] < back) & (bounds[:, 3] > front)
                for index in np.flatnonzero(near):
                    owner, other = solids[index]
                    depth = 0.0 if owner in kin else penetration(prism, other)
                    if depth > 0.0:
                        found[thing.id, owner] = max(depth, found.get((thing.id, owner), 0.0))
        return found


def _beyond(room: Polygon, prism: Prism) -> float:
    """Return how far (m) the farthest corner of a solid is out of a room."""
    return max(room.distance(shapely.Point(*corner)) for corner in prism.polygon)
