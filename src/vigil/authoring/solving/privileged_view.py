"""The oracle: privileged access to a loaded simulator: shortest paths, visibility from any pose, actions tried and
undone."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import numpy as np
from cachetools import LRUCache
from scipy.ndimage import distance_transform_edt
from shapely.geometry.base import BaseGeometry

from vigil.authoring.solving.clearance import ClearanceGrid
from vigil.authoring.solving.free_space import Obstacles
from vigil.authoring.solving.paths import Point2, ShortestPaths, WalkableMap
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import InteractPixel, PhysicalAction
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.world import Effect, ObjectState, RefusalCode, WorldState
from vigil.scene.things import Scene, Thing
from vigil.sim.privileged import PrivilegedSimulator

PLAN_CACHE_SIZE = 32


class PrivilegedView:
    """The house that is loaded, with its agent."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self._obstacles: Obstacles | None = None
        self._plans: LRUCache[tuple, WalkableMap] = LRUCache(PLAN_CACHE_SIZE)
        self._bare: LRUCache[tuple, BaseGeometry] = LRUCache(PLAN_CACHE_SIZE)
        self._clearance: ClearanceGrid | None = None

    @property
    def scene(self) -> Scene:
        """The scene as it is now; to look at, never to change."""
        return self._simulator.scene()

    @property
    def agent(self) -> Pose:
        """Where the agent is."""
        return self._simulator.world(()).agent

    @property
    def held(self) -> str | None:
        """What is in the hand."""
        return self._simulator.world(()).held

    def state_key(self) -> tuple:
        """Return what tells the present moment of the world from any other: where all is, and how."""
        things = self.scene.things.values()
        return self.agent, self.held, tuple((t.position, t.rotation, t.openness, t.is_toggled) for t in things)

    def plan(self) -> WalkableMap:
        """Return the floor plan of the scene as it is now."""
        obstacles, key = self._current(), self._arrangement()
        if key not in self._plans:
            self._plans[key] = obstacles.plan()
        return self._plans[key]

    def bare_floor(self) -> BaseGeometry:
        """Return the floor on which nothing stands now."""
        obstacles, key = self._current(), self._arrangement()
        if key not in self._bare:
            self._bare[key] = obstacles.bare()
        return self._bare[key]

    def _arrangement(self) -> tuple:
        """Return where everything stands that takes up floor."""
        return tuple(
            (thing.id, thing.position, thing.rotation, thing.openness)
            for thing in self.scene.things.values()
            if thing.is_present and not thing.is_held
        )

    def _current(self) -> Obstacles:
        if self._obstacles is None or self._obstacles.scene is not self.scene:
            self._obstacles = Obstacles(self.scene)
            self._plans.clear()
            self._bare.clear()
        return self._obstacles

    def clearance_grid(self) -> ClearanceGrid:
        """Return the distances on the floor of the scene, whatever stands on it."""
        if self._clearance is None or self._clearance.scene is not self.scene:
            self._clearance = ClearanceGrid(self.scene)
        return self._clearance

    def walks(self, *, is_exact: bool = False) -> ShortestPaths:
        """Return the shortest walks from where the agent is; exact ones keep no margin from obstacles."""
        position = self.agent.position
        plan = self.plan()
        return (plan.exact if is_exact else plan).walks_from((position.x, position.z))

    def corners_to(self, place: Point2) -> list[Point2]:
        """Return the corners of the walk from here to a place; none when there is no way."""
        walks = self.walks()
        cell = walks.plan.entry(place)
        return (walks.corners_to(cell) or []) if cell is not None else []

    def sees(self, eye: Vec3, points: np.ndarray, thing_id: str, *, through_glass: bool = False) -> np.ndarray:
        """Return which of the points (n, 3) on a thing are seen from an eye that may be elsewhere."""
        return self._simulator.points_visible_from(eye, points, thing_id, through_glass=through_glass)

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the hidden state of the agent and the named objects."""
        return self._simulator.world(object_ids)

    def may_be_visible(self, thing_id: str, min_px: int) -> bool:
        """Whether so many pixels of a thing may be visible from where the agent is: no is told sooner than a state."""
        return self._simulator.may_be_visible(thing_id, min_px)

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room that holds a place."""
        return self._simulator.room_at(position)

    def state_of(self, thing_id: str) -> ObjectState:
        """Return a thing's hidden state, seen from where the agent is."""
        return self._simulator.world([thing_id]).objects[thing_id]

    def centre_distances(self, thing: Thing, places: np.ndarray) -> np.ndarray:
        """Return the distances (m) that the simulator would report between an agent at places (n, 2) and a thing."""
        x, y, z = thing.position
        rise = y - self.agent.position.y
        return np.sqrt((places[:, 0] - x) ** 2 + (places[:, 1] - z) ** 2 + rise**2)

    def object_at(self, pixel: tuple[int, int]) -> str | None:
        """Return the id of what is under a pixel."""
        return self._simulator.object_at(*pixel)

    def click_pixel(self, thing_id: str) -> tuple[int, int] | None:
        """Return the pixel of a thing that is farthest from all that is not the thing; None when it is out of view."""
        pixels = self._simulator.pixels_of(thing_id)
        if not len(pixels):
            return None
        stride = _stride(pixels)
        columns, rows = ((pixels - pixels.min(axis=0)) // stride + 1).T
        mask = np.zeros((rows.max() + 2, columns.max() + 2), dtype=bool)
        mask[rows, columns] = True
        depths = np.asarray(distance_transform_edt(mask))[rows, columns] * stride
        border = np.minimum.reduce(
            [pixels[:, 0], pixels[:, 1], FRAME_WIDTH - 1 - pixels[:, 0], FRAME_HEIGHT - 1 - pixels[:, 1]]
        )
        best = int(np.argmax(np.minimum(depths, border + 1)))
        return int(pixels[best, 0]), int(pixels[best, 1])

    def try_interaction(
        self, action: InteractPixel, is_good: Callable[[Effect], bool] = lambda effect: True
    ) -> RefusalCode | None:
        """Return why an interaction would be refused now; None when it works, and `is_good` says so after it."""
        with self.rollback():
            effect = self.step(action)
            if effect.refusal is not None:
                return effect.refusal
            return None if is_good(effect) else "no_room"

    def step(self, action: PhysicalAction) -> Effect:
        """Carries out an action (inside a rehearsal: it is undone at its end)."""
        return self._simulator.step(action)

    @contextmanager
    def rollback(self) -> Iterator[None]:
        """Undoes all that is done inside."""
        with self._simulator.rollback():
            yield

    @contextmanager
    def at_pose(self, pose: Pose) -> Iterator[None]:
        """Stands the agent elsewhere for the time being."""
        with self._simulator.at_pose(pose):
            yield


def _stride(pixels: np.ndarray) -> int:
    """Return the step of the lattice on which pixels were sampled."""
    steps = [int(np.diff(np.unique(pixels[:, axis])).min(initial=FRAME_WIDTH)) for axis in (0, 1)]
    step = min(steps)
    return step if step < FRAME_WIDTH else 1
