"""Privileged access to a loaded simulator: shortest walks, visibility from any pose, and actions that are undone."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from weakref import WeakKeyDictionary

import numpy as np
from shapely.geometry.base import BaseGeometry

from vigil.authoring.solving.clearance import ClearanceGrid
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import InteractPixel, PhysicalAction
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.world import Effect, ObjectState, RefusalCode, WorldState
from vigil.scene.floor import FreeSpace, Point2, ShortestPaths, WalkableMap
from vigil.scene.things import Scene, Thing
from vigil.sim.privileged import PrivilegedSimulator

_SPACES: WeakKeyDictionary[PrivilegedSimulator, FreeSpace] = WeakKeyDictionary()
"""Simulator -> the free floor of the scene that was last asked for. All views of the simulator share it."""


class PrivilegedView:
    """Privileged access to the house that is loaded in a simulator, and to the agent in it."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self._clearance: ClearanceGrid | None = None

    @property
    def scene(self) -> Scene:
        """The scene in its current state. Callers must not change it."""
        return self._simulator.scene()

    @property
    def agent(self) -> Pose:
        """The agent's pose."""
        return self._simulator.world(()).agent

    @property
    def held(self) -> str | None:
        """Id of the held object; None if the hand is empty."""
        return self._simulator.world(()).held

    def state_key(self) -> tuple:
        """Return a key that is the same if the agent and all things are in the same state."""
        things = self.scene.things.values()
        return self.agent, self.held, tuple((t.position, t.rotation, t.openness, t.is_toggled) for t in things)

    def plan(self) -> WalkableMap:
        """Return the walkable map of the scene in its current state, cached."""
        return self._free_space().plan()

    def bare_floor(self) -> BaseGeometry:
        """Return the floor on which nothing stands in the current state, cached."""
        return self._free_space().bare()

    def _free_space(self) -> FreeSpace:
        space = _SPACES.get(self._simulator)
        if space is None or space.scene is not self.scene:
            space = _SPACES[self._simulator] = FreeSpace(self.scene)
        return space

    def clearance_grid(self) -> ClearanceGrid:
        """Return the clearance grid of the scene's floor. It is made once and used for all states of the scene."""
        if self._clearance is None or self._clearance.scene is not self.scene:
            self._clearance = ClearanceGrid(self.scene)
        return self._clearance

    def walks(self, *, is_exact: bool = False) -> ShortestPaths:
        """Return the shortest walks from the agent's position; if `is_exact`, without a margin to obstacles."""
        position = self.agent.position
        plan = self.plan()
        return (plan.exact if is_exact else plan).walks_from((position.x, position.z))

    def corners_to(self, place: Point2) -> list[Point2]:
        """Return the corners (x, z) of the walk from the agent to a place; an empty list if there is no walk."""
        walks = self.walks()
        cell = walks.plan.entry(place)
        return (walks.corners_to(cell) or []) if cell is not None else []

    def sees(self, eye: Vec3, points: np.ndarray, thing_id: str, *, through_glass: bool = False) -> np.ndarray:
        """Return a mask (n,) of the points (n, 3) on a thing that are visible from an eye, in any direction."""
        return self._simulator.points_visible_from(eye, points, thing_id, through_glass=through_glass)

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the hidden state of the agent and of the objects with these ids."""
        return self._simulator.world(object_ids)

    def may_be_visible(self, thing_id: str, min_px: int) -> bool:
        """Return False if fewer than `min_px` pixels of a thing can be visible to the agent; faster than `state_of`."""
        return self._simulator.may_be_visible(thing_id, min_px)

    def is_in_frame(self, thing_id: str) -> bool:
        """Return whether any pixel shows a thing, even if it is too thin for the sampled count of `state_of`."""
        return self._simulator.is_in_frame(thing_id)

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room at a position; None outside all rooms."""
        return self._simulator.room_at(position)

    def state_of(self, thing_id: str) -> ObjectState:
        """Return a thing's hidden state, with its visibility from the agent's pose."""
        return self._simulator.world([thing_id]).objects[thing_id]

    def centre_distances(self, thing: Thing, places: np.ndarray) -> np.ndarray:
        """Return the distances (n,) in metres from an agent at places (n, 2) in x, z to a thing's position."""
        x, y, z = thing.position
        rise = y - self.agent.position.y
        return np.sqrt((places[:, 0] - x) ** 2 + (places[:, 1] - z) ** 2 + rise**2)

    def object_at(self, pixel: tuple[int, int]) -> str | None:
        """Return the id of the thing at a pixel; None if there is none."""
        return self._simulator.object_at(*pixel)

    def click_pixel(self, thing_id: str) -> tuple[int, int] | None:
        """Return, of the pixels that show a thing, the one farthest from other things; None if it is out of view."""
        from scipy import ndimage  # noqa: PLC0415 - loads over 200 modules

        pixels = self._simulator.pixels_of(thing_id)
        if not len(pixels):
            return None
        stride = _stride(pixels)
        columns, rows = ((pixels - pixels.min(axis=0)) // stride + 1).T
        mask = np.zeros((rows.max() + 2, columns.max() + 2), dtype=bool)
        mask[rows, columns] = True
        depths = np.asarray(ndimage.distance_transform_edt(mask))[rows, columns] * stride
        border = np.minimum.reduce(
            [pixels[:, 0], pixels[:, 1], FRAME_WIDTH - 1 - pixels[:, 0], FRAME_HEIGHT - 1 - pixels[:, 1]]
        )
        best = int(np.argmax(np.minimum(depths, border + 1)))
        return int(pixels[best, 0]), int(pixels[best, 1])

    def try_interaction(
        self, action: InteractPixel, is_good: Callable[[Effect], bool] = lambda effect: True
    ) -> RefusalCode | None:
        """Return the reason why an interaction would be refused in the current state; None if it would work.

        If it would work, but `is_good` is false for its effect, return "no_room". The state is not changed.
        """
        with self.rollback():
            effect = self.step(action)
            if effect.refusal is not None:
                return effect.refusal
            return None if is_good(effect) else "no_room"

    def step(self, action: PhysicalAction) -> Effect:
        """Carry out an action and return its effect. Inside `rollback`, the action is undone later."""
        return self._simulator.step(action)

    @contextmanager
    def rollback(self) -> Iterator[None]:
        """At the end of the `with` block, undo everything that was done inside it."""
        with self._simulator.rollback():
            yield

    @contextmanager
    def at_pose(self, pose: Pose) -> Iterator[None]:
        """Put the agent at a pose for the time of the `with` block."""
        with self._simulator.at_pose(pose):
            yield


def _stride(pixels: np.ndarray) -> int:
    """Return the step (px) of the grid on which pixels (n, 2) were sampled."""
    steps = [int(np.diff(np.unique(pixels[:, axis])).min(initial=FRAME_WIDTH)) for axis in (0, 1)]
    step = min(steps)
    return step if step < FRAME_WIDTH else 1
