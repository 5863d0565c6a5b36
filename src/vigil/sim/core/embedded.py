"""The embedded simulator: motion, handling and visibility in a scene. Any engine can draw and cast rays for it.

It implements `vigil.sim.scene_editor.SceneEditor`, which includes every other protocol of a simulator. A frame is drawn
only when it is requested.
"""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Box, Pose, Vec3, floor_distance, heading, wrap_deg
from vigil.errors import EpisodeError, SimulatorError
from vigil.protocol.actions import MAX_TURN_DEG, Intent, InteractPixel, Look, Navigate, PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup, WorldState
from vigil.scene.build import build_scene
from vigil.scene.geometry import body_box
from vigil.scene.things import Scene, Thing
from vigil.sim.core.agent_actions import horizon_after, object_state, support_facts, walk
from vigil.sim.core.engine import Engine
from vigil.sim.core.handling import InteractionResult, apply_intent, interact, open_to
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.naming import pixel_of_named
from vigil.sim.core.setup import apply_setup, blocked_start_error, thing_named
from vigil.sim.core.sight import HEIGHT, NOT_VISIBLE, WIDTH, Sight
from vigil.sim.core.state import MUTABLE_FIELDS, SceneState, mutable_state_of
from vigil.sim.scene_editor import CameraImage, CameraView, Layer

OFF_SEAMS = np.array([6.1e-7, 5.3e-7, 5.9e-7])
"""Vector (3,) that is added to the direction of each ray of `meets`. Surfaces are cut into triangles along round
numbers of metres, and a ray exactly in the plane of a cut would pass between two triangles."""


@dataclass(slots=True)
class _Loaded:
    house: House
    state: SceneState
    sight: Sight
    initial: list[tuple[Any, ...]]
    """Values of `MUTABLE_FIELDS` of each thing when the house was loaded."""
    places: dict[tuple[str, Vec3, tuple[str, ...]], tuple[Box, dict[str, Any]]] = field(default_factory=dict)
    """Cached boxes and `support_facts`, by the thing's id, its position, which changes while it is held, and the ids of
    all things whose state is requested. A change in the scene empties the cache."""


@dataclass(frozen=True, slots=True)
class _WorldSnapshot:
    """The state of the world at one moment; the world can be restored to it."""

    agent: Pose
    held: str | None
    things: list[tuple[Any, ...]]
    """Values of `MUTABLE_FIELDS` of each thing."""


class EmbeddedSimulator:
    """A simulator and `SceneEditor` that lets an engine draw and cast rays."""

    def __init__(self, engine: Engine, assets: AssetDatabase) -> None:
        self.name = engine.name
        self._engine = engine
        self._assets = assets
        self._loaded: _Loaded | None = None
        self._is_looked_at: Callable[[str], bool] = lambda object_id: True
        """Function that says whether `world` measures how much of the object with an id is visible."""

    def load(self, house: House) -> None:
        """Build the scene of `house`, replacing any earlier one. Raises HouseError."""
        scene = build_scene(house, self._assets)
        self._engine.load(scene)
        first = scene.rooms[0].polygon[0]
        nowhere = Pose(position=Vec3(float(first[0]), 0.0, float(first[1])), rotation=0.0)
        state = SceneState(scene, nowhere, CollisionMap(scene))
        initial = mutable_state_of(scene)
        self._loaded = _Loaded(house, state, Sight(self._engine, scene), initial)

    def prepare(self, house: House) -> None:
        """Build and cache what a later `load` of `house` needs; any thread may call this. Raises HouseError."""
        self._engine.prepare(build_scene(house, self._assets))

    def reset(self, start: Pose, setup: Setup) -> None:
        """Restore the house as loaded, apply `setup` and put the agent at `start`. Raises EpisodeError."""
        loaded = self._require_loaded()
        state = loaded.state
        state.agent, state.held = start, None
        _restore(state, loaded.initial)
        apply_setup(state, setup, loaded.house.name)
        self._flush()
        if not state.collision_map.centre_is_free(start.position):
            raise blocked_start_error(start, loaded.house.name)

    def step(self, action: PhysicalAction) -> Effect:
        """Carry out or refuse one action; never raises because of an agent's action."""
        if isinstance(action, Navigate):
            effect = self._turn(action) if action.mode.startswith("turn") else walk(action, self._step)
        elif isinstance(action, Look):
            effect = self._look(action)
        else:
            effect = self._interact(action)
        self._require_loaded().state.move_held()
        self._flush()
        return effect

    def frame(self) -> np.ndarray:
        """Return the current egocentric frame, (480, 640, 3) uint8."""
        state = self._require_loaded().state
        return self._engine.draw(state.agent, state.held)

    def object_at(self, x: int, y: int) -> str | None:
        """Return the id of the object that a click on the pixel hits; None for e.g. a wall or the sky."""
        loaded = self._require_loaded()
        thing, _ = loaded.sight.click(loaded.state.agent, x, y)
        return thing.id if thing else None

    def pixel_of_named(self, name: str) -> tuple[int, int] | None:
        """Return a pixel (x, y) of the object called `name`; None unless exactly one object in view has this name."""
        loaded = self._require_loaded()
        return pixel_of_named(loaded.state.scene, loaded.sight, loaded.state.agent, name)

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the hidden state of the agent and the objects with these ids. Raises EpisodeError on an unknown id."""
        loaded = self._require_loaded()
        state, things = loaded.state, [self._thing(object_id) for object_id in dict.fromkeys(object_ids)]
        seen = loaded.sight.see(state.agent, [each for each in things if self._is_looked_at(each.id)])
        objects = {
            each.id: object_state(state, each, box, seen.get(each.id, NOT_VISIBLE), supports)
            for each, (box, supports) in zip(things, self._places(things), strict=True)
        }
        return WorldState(agent=state.agent, held=state.held, objects=objects)

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when no frame can be drawn."""
        return self._engine.renderer()

    def close(self) -> None:
        """Release the scene; the simulator can load again."""
        self._engine.close()
        self._loaded = None

    # The rest of `PrivilegedSimulator`: for solvers, validation and authoring alone.

    def object_ids(self) -> list[str]:
        """Return the ids of all objects present, sorted."""
        return sorted(thing.id for thing in self._require_loaded().state.scene.things.values() if thing.is_present)

    def pixels_of(self, object_id: str) -> np.ndarray:
        """Return the pixels (n, 2; x and y) on which a click hits the object; only a lattice of pixels is tried."""
        loaded = self._require_loaded()
        return loaded.sight.click_pixel(loaded.state.agent, self._thing(object_id))

    def can_stand(self, position: Vec3) -> bool:
        """Return whether the agent's body fits at a position."""
        return self._require_loaded().state.collision_map.can_stand(position)

    def scene(self) -> Scene:
        """Return the scene, whose things have their present state. The caller must not change it."""
        return self._require_loaded().state.scene

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room whose floor contains a position; None outside every room."""
        return self._require_loaded().state.collision_map.room_at(position)

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return a mask (n,) of the points (n, 3) on an object at which a ray from `eye` meets this object first."""
        offsets = points - np.array(eye)
        away = np.maximum(np.linalg.norm(offsets, axis=1), 1e-9)
        rays, thing = offsets / away[:, None], self._thing(object_id)
        return self._require_loaded().sight.meets(eye, rays, thing, through_glass=through_glass)

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Return whether at least `min_px` pixels of an object would be visible if no other thing hid it."""
        loaded = self._require_loaded()
        return loaded.sight.may_be_visible(loaded.state.agent, self._thing(object_id), min_px)

    def is_in_frame(self, object_id: str) -> bool:
        """Return whether at least one pixel of the frame shows an object."""
        loaded = self._require_loaded()
        return loaded.sight.is_in_frame(loaded.state.agent, self._thing(object_id))

    @contextmanager
    def looking_at(self, object_ids: Collection[str]) -> Iterator[None]:
        """Return a context in which `world` says of all objects but these that they are not visible."""
        self._require_loaded()
        before, self._is_looked_at = self._is_looked_at, frozenset(object_ids).__contains__
        try:
            yield
        finally:
            self._is_looked_at = before

    @contextmanager
    def rollback(self) -> Iterator[None]:
        """Return a context that undoes, when it ends, everything that was done inside it."""
        before = self._snapshot()
        try:
            yield
        finally:
            self._restore_snapshot(before)

    @contextmanager
    def at_pose(self, pose: Pose) -> Iterator[None]:
        """Return a context in which the agent is at a pose. Whether the body fits there is not checked."""
        with self.rollback():
            self.stand(pose)
            yield

    # The rest of `SceneEditor`: for programs that edit a scene.

    def stand(self, pose: Pose) -> None:
        """Put the agent, with what it holds, at a pose. Whether the body fits there is not checked."""
        state = self._require_loaded().state
        state.agent = pose
        state.move_held()
        self._flush()

    def apply_changes(self, setup: Setup) -> None:
        """Apply a setup to the world as it is now. Raises EpisodeError; in that case nothing has changed."""
        loaded = self._require_loaded()
        before = self._snapshot()
        change = setup.objects.get(loaded.state.held or "")
        try:
            if change is not None and (change.is_absent or change.placement is not None):
                loaded.state.release()
            apply_setup(loaded.state, setup, loaded.house.name, checks_leaves=False)
        except EpisodeError:
            self._restore_snapshot(before)
            raise
        self._flush()

    def restore_object(self, object_id: str) -> None:
        """Put an object that was removed from the scene back where it was."""
        thing = self._thing(object_id)
        thing.is_present = True
        self._require_loaded().state.mark_changed(thing)
        self._flush()

    def apply_intent(self, intent: Intent, object_id: str, point: Vec3) -> Effect:
        """Do what a click on a point of an object would do, at any distance."""
        return self._effect_of(apply_intent(self._require_loaded().state, intent, self._thing(object_id), point))

    def open_to(self, object_id: str, openness: float) -> Effect:
        """Open or close an object to `openness` (0 to 1), or refuse."""
        return self._effect_of(open_to(self._require_loaded().state, self._thing(object_id), openness))

    def redecorate(self, house: House) -> None:
        """Load a house that differs from the present one only in materials and lights; things keep their states."""
        before = self._snapshot()
        self.load(house)
        self._restore_snapshot(before)

    def move_hand(self, by: Vec3, rotation: Vec3) -> None:
        """Move the held object by `by` (m to the agent's right, up and ahead), and turn it to `rotation`."""
        self._require_loaded().state.move_hand(by, rotation)
        self._flush()

    def reachable(self, start: Vec3, step_m: float, yaw: float = 0.0) -> np.ndarray:
        """Return the places (n, 2; x, z) that the body reaches on a grid through `start`, turned by `yaw` (deg)."""
        return self._require_loaded().state.collision_map.reachable(start, step_m, yaw)

    def blocker(self, start: Vec3, end: Vec3) -> str | None:
        """Return the id of what stops the body on the straight way from `start` to `end`; None if nothing does."""
        return self._require_loaded().state.collision_map.blocker(start, end, leaves_overlaps=True)

    def meets(self, eye: Vec3, directions: np.ndarray, *, through_glass: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return two arrays (n,): for each ray, the index of the thing that it meets first (-1: none) and the distance
        in metres."""
        self._require_loaded()
        turned = directions + OFF_SEAMS
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        hits = self._engine.cast(eye, turned, through_glass=through_glass)
        return hits.things, hits.distances

    def render_view(self, view: CameraView, layers: frozenset[Layer], *, with_hand: bool) -> CameraImage:
        """Return the requested layers of a camera's image."""
        held = self._require_loaded().state.held
        return self._engine.render_view(view, layers, held if with_hand else None)

    def _places(self, things: list[Thing]) -> Iterator[tuple[Box, dict[str, Any]]]:
        """Yield the box and the `support_facts` of each of the things whose state is requested."""
        loaded, asked = self._require_loaded(), tuple(thing.id for thing in things)
        for thing in things:
            key = thing.id, thing.position, asked
            if key not in loaded.places:
                loaded.places[key] = body_box(thing), support_facts(loaded.state.scene, thing, things)
            yield loaded.places[key]

    def _snapshot(self) -> _WorldSnapshot:
        state = self._require_loaded().state
        return _WorldSnapshot(state.agent, state.held, mutable_state_of(state.scene))

    def _restore_snapshot(self, snapshot: _WorldSnapshot) -> None:
        state = self._require_loaded().state
        state.agent, state.held = snapshot.agent, snapshot.held
        _restore(state, snapshot.things)
        self._flush()

    def _effect_of(self, result: InteractionResult) -> Effect:
        self._require_loaded().state.move_held()
        self._flush()
        return Effect(refusal=result.refusal, blocked_by=result.blocked_by, changed=result.changed)

    def _require_loaded(self) -> _Loaded:
        if self._loaded is None:
            raise SimulatorError(f"Simulator {self.name!r} has no house: call `load` first.")
        return self._loaded

    def _thing(self, object_id: str) -> Thing:
        loaded = self._require_loaded()
        return thing_named(object_id, loaded.state.scene, loaded.house.name)

    def _flush(self) -> None:
        loaded = self._require_loaded()
        changed = loaded.state.flush()
        if changed:
            self._engine.update(loaded.state.scene, changed)
            loaded.sight.clear_cache()
            loaded.places.clear()

    def _step(self, length_m: float) -> InteractionResult:
        """Move the body by a length (m; negative means backward), or refuse."""
        state = self._require_loaded().state
        (x, y, z), (ahead_x, ahead_z) = state.agent.position, heading(state.agent.rotation)
        end = Vec3(x + length_m * ahead_x, y, z + length_m * ahead_z)
        blocker = state.collision_map.blocker(state.agent.position, end)
        if blocker is not None:
            return InteractionResult("path_blocked", blocker)
        state.agent = state.agent.model_copy(update={"position": end})
        return InteractionResult()

    def _turn(self, action: Navigate) -> Effect:
        state = self._require_loaded().state
        angle = min(action.magnitude, MAX_TURN_DEG) * (1.0 if action.mode == "turn_right" else -1.0)
        state.agent = state.agent.model_copy(update={"rotation": wrap_deg(state.agent.rotation + angle)})
        return Effect(turned_deg=angle, capped=action.magnitude > MAX_TURN_DEG)

    def _look(self, action: Look) -> Effect:
        state = self._require_loaded().state
        before, horizon = state.agent.horizon, horizon_after(action, state.agent.horizon)
        state.agent = state.agent.model_copy(update={"horizon": horizon})
        return Effect(pitched_deg=horizon - before, capped=action.magnitude > MAX_TURN_DEG)

    def _interact(self, action: InteractPixel) -> Effect:
        loaded = self._require_loaded()
        state = loaded.state
        if action.x is None or action.y is None or action.intent == "drop":
            result = interact(state, action.intent, None, None)
            return Effect(refusal=result.refusal, changed=result.changed)
        if not (0 <= action.x < WIDTH and 0 <= action.y < HEIGHT):
            return Effect(refusal="nothing_hit")
        thing, point = loaded.sight.click(state.agent, action.x, action.y)
        near = loaded.sight.ids_near_pixel(state.agent, action.x, action.y)
        result = interact(state, action.intent, thing, point)
        return Effect(
            hit=thing.id if thing else None,
            hit_category=thing.category if thing else None,
            near=near,
            click_m=None if point is None else floor_distance(state.agent.position, point),
            too_far=result.refusal == "too_far",
            blocked_by=result.blocked_by,
            refusal=result.refusal,
            changed=result.changed,
        )


def _restore(state: SceneState, before: list[tuple[Any, ...]]) -> None:
    """Restore the mutable fields of all things to the values `before`; mark the things that differed as changed."""
    for thing, now, then in zip(state.scene.things.values(), mutable_state_of(state.scene), before, strict=True):
        if now != then:
            for name, value in zip(MUTABLE_FIELDS, then, strict=True):
                setattr(thing, name, value)
            state.mark_changed(thing)
