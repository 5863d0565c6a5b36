"""The changing part of a loaded scene: the agent, its hand, which things changed, and where every solid is now."""

from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np

from vigil.base.geometry import Pose, Vec3, heading
from vigil.scene.geometry import Motion, Prism, euler_angles, place_of, prisms_of, rotation_matrix
from vigil.scene.outlines import BODY_HIGH_M, BODY_LOW_M, BODY_RADIUS_M
from vigil.scene.partitions import Partitions
from vigil.scene.supports import contents
from vigil.scene.things import Scene, Thing
from vigil.sim.core.motion import CollisionMap

HAND_AHEAD_M = 0.4
"""A held object's reported position is this far (m) ahead of the eye."""
HAND_DROP_M = 0.45
"""A held object's reported position is this far (m) below the eye."""
ROUNDED_DECIMALS = 9
"""Number of decimals to which positions (m) and angles (deg) of things are rounded when other things move them along.

This rounding is far finer than any check needs, and far coarser than floating-point errors.
"""
AGENT = "agent"
"""Id that stands for the agent's body in lists of solids."""
MUTABLE_FIELDS = (
    *("position", "rotation", "parent", "parent_joint", "surface"),
    *("openness", "is_toggled", "is_broken", "is_held", "from_hand", "is_present"),
)
"""Names of the fields of a thing that may change after the scene is built."""
_BODY_SIDES = 24
_USUAL_PLACE = Vec3(0.0, 0.0, 0.0)
_mutable_state = attrgetter(*MUTABLE_FIELDS)


@dataclass(slots=True, eq=False)
class SceneState:
    """A scene with its agent. Code that changes a thing's fields must call `mark_changed`."""

    scene: Scene
    agent: Pose
    collision_map: CollisionMap
    held: str | None = None
    """Id of the thing in the hand; None when the hand is empty."""
    hand_offset: Vec3 = _USUAL_PLACE
    """Offset (m) of the hand from its usual place: to the right, up and ahead."""
    changed: set[str] = field(default_factory=set)
    """Ids of the things that may have changed since the last call of `flush`."""
    partitions: Partitions = field(init=False)
    _prisms: dict[str, list[Prism]] = field(default_factory=dict)
    _last_flushed: dict[str, tuple[Any, ...]] = field(init=False)
    """Id of a thing -> values of its `MUTABLE_FIELDS` at the last call of `flush`."""

    def __post_init__(self) -> None:
        self._last_flushed = dict(zip(self.scene.things, mutable_state_of(self.scene), strict=True))
        self.partitions = Partitions(self.scene)

    def mark_changed(self, thing: Thing) -> None:
        """Record that a thing's position or state has changed."""
        self.changed.add(thing.id)
        self._prisms.pop(thing.id, None)

    def flush(self) -> set[str]:
        """Update the collision map; return the ids of the things that differ from their state at the last `flush`.

        A thing that changed and changed back since then is not listed.
        """
        now = {thing_id: _mutable_state(self.scene.things[thing_id]) for thing_id in self.changed}
        ids = {thing_id for thing_id, facts in now.items() if facts != self._last_flushed[thing_id]}
        self._last_flushed |= now
        self.changed = set()
        if ids:
            self.collision_map.refresh(ids)
        return ids

    def prisms(self, thing: Thing) -> list[Prism]:
        """Return the thing's solids at their present place; they are cached."""
        if thing.id not in self._prisms:
            self._prisms[thing.id] = prisms_of(thing)
        return self._prisms[thing.id]

    def solids(self, ignored: set[str]) -> list[tuple[str, Prism]]:
        """Return (id, prism) of the walls, and of all present things that are neither held nor in `ignored`."""
        return self.thing_solids(ignored) + self.partitions.walls

    def thing_solids(self, ignored: set[str]) -> list[tuple[str, Prism]]:
        """Return (id, prism) of all present things that are neither held nor in `ignored`."""
        return [
            (thing.id, prism)
            for thing in self.scene.things.values()
            if thing.is_present and not thing.is_held and thing.id not in ignored
            for prism in self.prisms(thing)
        ]

    def body(self) -> Prism:
        """Return the agent's body as a prism between `BODY_LOW_M` and `BODY_HIGH_M`."""
        angles = np.arange(_BODY_SIDES) * (2 * np.pi / _BODY_SIDES)
        circle = BODY_RADIUS_M * np.column_stack([np.cos(angles), np.sin(angles)])
        x, y, z = self.agent.position
        return Prism(circle + np.array([x, z]), y + BODY_LOW_M, y + BODY_HIGH_M)

    def move(self, thing: Thing, position: Vec3, rotation: Vec3) -> list[Thing]:
        """Move a thing and everything that rests on it; return all these things, `thing` first."""
        before = place_of(thing)
        after = Motion(rotation_matrix(rotation), np.array(position))
        thing.position, thing.rotation = position, rotation
        self.mark_changed(thing)
        return [thing, *self.shift(contents(self.scene, thing.id), after.after(before.inverse()))]

    def shift(self, things: list[Thing], motion: Motion) -> list[Thing]:
        """Move things by a rigid motion and return them.

        Positions are rounded, so that moving a thing away and back restores its position exactly.
        """
        is_turned = not np.allclose(motion.turn, np.eye(3), atol=1e-12)
        for thing in things:
            thing.position = _rounded(Vec3(*motion(np.array(thing.position)[None])[0]))
            if is_turned:
                thing.rotation = _rounded(euler_angles(motion.turn @ rotation_matrix(thing.rotation)))
            self.mark_changed(thing)
        return things

    def take(self, thing: Thing) -> list[Thing]:
        """Put a thing and everything that rests on it into the hand; return all these things, `thing` first."""
        stack = [thing, *contents(self.scene, thing.id)]
        thing.parent = thing.surface = thing.parent_joint = None
        for each in stack:
            each.is_held = True
            self.mark_changed(each)
        self.held = thing.id
        self.hand_offset = _USUAL_PLACE
        self.move_hand(_USUAL_PLACE, Vec3(0.0, thing.rotation.y, 0.0))
        return stack

    def move_hand(self, by: Vec3, rotation: Vec3) -> None:
        """Move the held thing, with what rests on it, by `by` (m: right, up, ahead), and turn it to `rotation`."""
        held = self.scene.things[self.held or ""]
        self.hand_offset = Vec3(*(old + new for old, new in zip(self.hand_offset, by, strict=True)))
        self.move(held, self._hand(), rotation)
        for each in [held, *contents(self.scene, held.id)]:
            each.from_hand = Vec3(*np.subtract(each.position, held.position).tolist())

    def release(self) -> list[Thing]:
        """Empty the hand; return the things that were in it, the held thing first."""
        held = self.scene.things[self.held or ""]
        stack = [held, *contents(self.scene, held.id)]
        for each in stack:
            each.is_held, each.from_hand = False, None
            self.mark_changed(each)
        self.held = None
        return stack

    def move_held(self) -> None:
        """Move the held thing to the present position of the hand; the thing's yaw does not change."""
        if self.held is None:
            return
        hand = self._hand()
        for thing in [self.scene.things[self.held], *contents(self.scene, self.held)]:
            if thing.from_hand is not None:
                thing.position = Vec3(*(a + b for a, b in zip(hand, thing.from_hand, strict=True)))
            self._prisms.pop(thing.id, None)  # not marked as changed: rays and bodies never meet what is held

    def _hand(self) -> Vec3:
        ahead_x, ahead_z = heading(self.agent.rotation)
        x, y, z = self.agent.eye
        right, up, ahead = self.hand_offset
        ahead += HAND_AHEAD_M
        return Vec3(x + ahead * ahead_x + right * ahead_z, y - HAND_DROP_M + up, z + ahead * ahead_z - right * ahead_x)


def mutable_state_of(scene: Scene) -> list[tuple[Any, ...]]:
    """Return the present values of `MUTABLE_FIELDS` for each thing, in the scene's order."""
    return list(map(_mutable_state, scene.things.values()))


def _rounded(values: Vec3) -> Vec3:
    return Vec3(*(round(float(value), ROUNDED_DECIMALS) for value in values))
