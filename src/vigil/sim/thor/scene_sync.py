"""The scene of a house in AI2-THOR, updated from THOR's metadata; nothing is simulated here.

Shapes, surfaces, rooms and walls come from the house's document (`vigil.scene`). Positions, states, boxes and carriers
of things, and what can be done with them, come from THOR.
"""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Box, Pose, Vec3, distance
from vigil.protocol.house import House
from vigil.protocol.world import CLOSED_BELOW
from vigil.scene.build import build_scene, rest_on_surface
from vigil.scene.geometry import rotation_matrix, upright_box
from vigil.scene.supports import contents
from vigil.scene.things import Scene, Thing
from vigil.sim.thor.units import from_thor, pose_from_thor

NO_OFFSET_M = 0.025
"""A thing's pivot in THOR counts as the middle of its box there if no coordinate of the two differs by more (m).

A handle that sticks out moves the middle of THOR's box by about this distance.
"""
SAME_PLACE_M = 1e-6
"""A thing that moved by at most this distance (m) still counts as at its place in the document."""
RIGHT_ANGLE_WITHIN = 1e-3
"""Tolerance, in entries of a rotation matrix, of the check that a thing is turned by right angles only."""

Metadata = Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class PivotBox:
    """A thing's box (m) in the thing's own frame, and the place of this frame relative to THOR's pivot."""

    low: np.ndarray
    """Lowest corner (3,)."""
    high: np.ndarray
    """Highest corner (3,)."""
    middle_from_pivot: np.ndarray
    """Vector (3,) from THOR's pivot to the origin of the thing's frame, which is in or near the box's middle."""


@dataclass(frozen=True, slots=True)
class ThorSnapshot:
    """The state in THOR's metadata at one moment; the house can be restored to it."""

    objects: dict[str, Metadata]
    """THOR's metadata of each object, by id."""
    agent: Pose
    held: str | None


class SceneSync:
    """The scene, the agent and the hand according to THOR's last metadata."""

    def __init__(self, house: House, assets: AssetDatabase, metadata: Metadata) -> None:
        """Build the scene of a house that THOR has just built. Raises HouseError on an invalid document."""
        self.scene: Scene = build_scene(house, assets)
        self.objects: dict[str, Metadata] = {}
        self.agent: Pose = pose_from_thor(metadata["agent"])
        self.held: str | None = None
        self.visible: set[str] = set()
        """Ids of the objects that THOR calls visible."""
        self._first = {thing.id: copy.copy(thing) for thing in self.scene.things.values()}
        self._pivot_boxes: dict[str, PivotBox] = {}
        for entry in metadata["objects"]:
            thing = self.scene.things.get(entry["objectId"])
            if thing is not None:
                self._pivot_boxes[thing.id] = _measure(thing, entry)
                thing.is_openable, thing.is_toggleable = bool(entry["openable"]), bool(entry["toggleable"])
                thing.is_pickupable = bool(entry["pickupable"])
                thing.is_receptacle = bool(entry["receptacle"]) and bool(thing.asset.surfaces)
        self._absent_here = frozenset(self.scene.things) - frozenset(self._pivot_boxes)
        self.update(metadata)

    def update(self, metadata: Metadata) -> None:
        """Copy positions and states from metadata."""
        found = {entry["objectId"]: entry for entry in metadata["objects"] if entry["objectId"] in self._pivot_boxes}
        held = [each["objectId"] for each in metadata["inventoryObjects"]]
        self.agent = pose_from_thor(metadata["agent"])
        self.held = next((name for name in held if name in self.scene.things), None)
        self.visible = {name for name, entry in found.items() if entry["visible"]}
        moved = [thing for thing in self.scene.things.values() if self._take_over(thing, found.get(thing.id))]
        self.objects = found
        for thing in moved:
            self._rest(thing)
        stack = self.in_hand()
        for thing in self.scene.things.values():
            thing.is_held = thing.id in stack

    def in_hand(self) -> frozenset[str]:
        """Return the ids of the thing in the hand and of everything that this thing carries."""
        if self.held is None:
            return frozenset()
        return frozenset({self.held, *(thing.id for thing in contents(self.scene, self.held))})

    def snapshot(self) -> ThorSnapshot:
        """Return a snapshot of the present state."""
        return ThorSnapshot(self.objects, self.agent, self.held)

    def box(self, thing: Thing) -> Box:
        """Return the box of a thing at its present place, measured as if the thing were shut."""
        measure = self._pivot_boxes.get(thing.id)
        half = np.array(thing.asset.size) / 2
        return upright_box(thing, *((-half, half) if measure is None else (measure.low, measure.high)))

    def pivot(self, thing: Thing, position: Vec3, rotation: Vec3) -> Vec3:
        """Return the pivot (THOR's position) of a thing that has this position and rotation."""
        shift = rotation_matrix(rotation) @ self._pivot_boxes[thing.id].middle_from_pivot
        return Vec3(*(float(value) for value in np.subtract(position, shift)))

    def is_movable(self, thing: Thing) -> bool:
        """Return whether THOR can move a thing."""
        entry = self.objects.get(thing.id, {})
        return bool(entry.get("pickupable") or entry.get("moveable"))

    def _take_over(self, thing: Thing, entry: Metadata | None) -> bool:
        """Copy a thing's state from its metadata; return whether its position, rotation or carrier changed."""
        if entry is None:
            thing.is_present = thing.id in self._absent_here and thing.is_structure
            return False
        thing.is_present = True
        thing.openness = float(entry["openness"]) if thing.is_openable else 0.0
        thing.is_toggled = bool(entry["isToggled"])
        parent, before = self._carrier(entry), self.objects.get(thing.id)
        is_same = before is not None and all(entry[name] == before[name] for name in ("position", "rotation"))
        if is_same and parent == thing.parent:
            return False
        thing.rotation = from_thor(entry["rotation"])
        shift = rotation_matrix(thing.rotation) @ self._pivot_boxes[thing.id].middle_from_pivot
        thing.position = Vec3(*np.add(from_thor(entry["position"]), shift).tolist())
        thing.parent = parent
        return True

    def _carrier(self, entry: Metadata) -> str | None:
        """Return the id of the smallest thing that THOR reports to carry or contain an object; None if none does."""
        if entry["isPickedUp"]:
            return None
        known = [
            name for name in entry["parentReceptacles"] or () if name in self._pivot_boxes and name != entry["objectId"]
        ]
        if len(known) > 1:
            boxes = self._pivot_boxes
            known.sort(key=lambda name: (float(np.prod(boxes[name].high - boxes[name].low)), name))
        return known[0] if known else None

    def _rest(self, thing: Thing) -> None:
        """Set the surface on which a thing rests.

        If the thing has not moved since the house was built, this is its surface in the document.
        """
        first, parent = self._first[thing.id], self.scene.things.get(thing.parent or "")
        if thing.parent == first.parent and distance(thing.position, first.position) <= SAME_PLACE_M:
            thing.surface, thing.parent_joint = first.surface, first.parent_joint
            return
        thing.surface = thing.parent_joint = None
        if parent is not None:
            rested = copy.copy(thing)
            rest_on_surface(rested, parent)
            thing.surface, thing.parent_joint = rested.surface, rested.parent_joint


def _measure(thing: Thing, entry: Metadata) -> PivotBox:
    """Return the box of a thing that THOR has just built.

    The box has the size of the asset in two cases: the thing is open; or the thing is not turned by right angles and
    has no oriented box in THOR's metadata.
    """
    turn = rotation_matrix(from_thor(entry["rotation"]))
    pivot, half = np.array(from_thor(entry["position"])), np.array(thing.asset.size) / 2
    if float(entry["openness"]) >= CLOSED_BELOW and entry["openable"]:
        return PivotBox(-half, half, _snapped(turn.T @ (np.array(thing.position) - pivot)))
    upright, oriented = entry["axisAlignedBoundingBox"], entry.get("objectOrientedBoundingBox")
    middle = np.array(from_thor(upright["center"]))
    offset = _snapped(turn.T @ (middle - pivot))
    corners = np.array((oriented or upright)["cornerPoints"], dtype=float)
    is_right_angled = bool((np.abs(turn).max(axis=1) > 1.0 - RIGHT_ANGLE_WITHIN).all())
    if oriented is None and not is_right_angled:
        return PivotBox(-half, half, offset)
    local = (corners - pivot) @ turn - offset
    return PivotBox(local.min(axis=0), local.max(axis=0), offset)


def _snapped(offset: np.ndarray) -> np.ndarray:
    return offset if float(np.abs(offset).max()) > NO_OFFSET_M else np.zeros(3)
