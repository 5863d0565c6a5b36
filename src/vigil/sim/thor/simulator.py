"""A `PrivilegedSimulator` that runs a house in AI2-THOR: THOR's engine decides what happens and what is visible.

THOR lacks some rules of the protocol: the steps of a walk, the limits of the pitch, reach, interlocks, and rules for
placing. This module applies them before it sends an action. See docs/ai2thor.md.
"""

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3, floor_distance
from vigil.errors import SimulatorError
from vigil.protocol.actions import MAX_TURN_DEG, InteractPixel, Look, Navigate, PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, ObjectState, Setup, WorldState
from vigil.scene.outlines import room_floor
from vigil.scene.supports import drawers_of, furniture_of
from vigil.scene.things import Scene, Thing
from vigil.sim.core.agent_actions import horizon_after, object_state, support_facts, walk
from vigil.sim.core.handling import InteractionResult
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.setup import blocked_start_error, thing_named
from vigil.sim.core.sight import HEIGHT, WIDTH, ObjectVisibility
from vigil.sim.thor.engine_session import EngineClient, EngineSession
from vigil.sim.thor.interaction import ObjectClick, drop_in_thor, interact_in_thor, place_of_pixel
from vigil.sim.thor.refusals import refusal_of
from vigil.sim.thor.restoring import restore_snapshot, set_up, stand
from vigil.sim.thor.scene_sync import SceneSync, ThorSnapshot
from vigil.sim.thor.units import from_thor, teleport_arguments, to_thor

Connect = Callable[[dict[str, Any]], EngineClient]
"""Function that starts an engine and opens a house in it. Raises SimulatorError and SettingError."""
FAR_M = 100.0
"""Length (m) of the rays that are cast."""


@dataclass(slots=True)
class _Loaded:
    house: House
    session: EngineSession
    initial: ThorSnapshot


class ThorSimulator:
    """A `PrivilegedSimulator` that uses AI2-THOR's engine or a compatible engine."""

    def __init__(self, name: str, connect: Connect, assets: AssetDatabase) -> None:
        self.name = name
        self._connect = connect
        self._assets = assets
        self._client: EngineClient | None = None
        self._loaded: _Loaded | None = None

    def prepare(self, house: House) -> None:
        """Do nothing, because the engine holds only one house at a time."""

    def load(self, house: House) -> None:
        """Make THOR build the house, replacing any earlier one; start an engine if none runs."""
        self._loaded = None
        if self._client is None or self._client.is_over:
            self._client = self._connect(house.data)
        else:
            self._client.open(house.data)
        scene_sync = SceneSync(house, self._assets, self._client.step("Pass", renderImage=False).metadata)
        self._loaded = _Loaded(house, EngineSession(self._client, scene_sync), scene_sync.snapshot())

    def reset(self, start: Pose, setup: Setup) -> None:
        """Restore the house as loaded, apply `setup` and put the agent at `start`. Raises EpisodeError."""
        self._restore(self._require_loaded().initial)
        loaded = self._require_loaded()
        set_up(loaded.session, setup, loaded.house.name)
        if not loaded.session.do("TeleportFull", **teleport_arguments(start)).is_done:
            stand(loaded.session, start)
            if not CollisionMap(loaded.session.scene_sync.scene).centre_is_free(start.position):
                raise blocked_start_error(start, loaded.house.name)

    def step(self, action: PhysicalAction) -> Effect:
        """Carry out or refuse one action; never raises because of an agent's action."""
        if isinstance(action, Navigate):
            return self._turn(action) if action.mode.startswith("turn") else walk(action, self._step)
        return self._look(action) if isinstance(action, Look) else self._interact(action)

    def frame(self) -> np.ndarray:
        """Return the current egocentric frame, (480, 640, 3) uint8."""
        return self._require_loaded().session.frame()

    def object_at(self, x: int, y: int) -> str | None:
        """Return the id of the object at a pixel; None for sky and for structure without an id, such as a wall."""
        thing = self._shown(x, y)
        return thing.id if thing else None

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the hidden state of the agent and the objects with these ids. Raises EpisodeError on an unknown id."""
        scene_sync = self._scene_sync
        things = [self._thing(object_id) for object_id in dict.fromkeys(object_ids)]
        objects = {thing.id: self._object_state(thing, things) for thing in things}
        return WorldState(agent=scene_sync.agent, held=scene_sync.held, objects=objects)

    def renderer(self) -> str:
        """Return a text with this simulator's name, because AI2-THOR's client does not say which renderer is used."""
        return f"AI2-THOR's engine ({self.name})"

    def close(self) -> None:
        """End the engine; the simulator can load again."""
        if self._client is not None:
            self._client.close()
        self._client = self._loaded = None

    # The rest of `PrivilegedSimulator`: for solvers, validation and authoring alone.

    def object_ids(self) -> list[str]:
        """Return the ids of all objects present, sorted."""
        return sorted(thing.id for thing in self._scene_sync.scene.things.values() if thing.is_present)

    def scene(self) -> Scene:
        """Return the scene, whose things follow THOR's metadata. The caller must not change it."""
        return self._scene_sync.scene

    def room_at(self, position: Vec3) -> str | None:
        """Return the id of the room of the house document whose floor contains a position; None outside every room."""
        where = shapely.Point(position.x, position.z)
        return next((room.id for room in self._scene_sync.scene.rooms if room_floor(room).covers(where)), None)

    def can_stand(self, position: Vec3) -> bool:
        """Return whether a position is in a room and THOR can teleport the agent there."""
        if self.room_at(position) is None:
            return False
        session, here = self._require_loaded().session, self._scene_sync.agent
        there = here.model_copy(update={"position": position._replace(y=here.position.y)})
        is_free = session.do("TeleportFull", **teleport_arguments(there)).is_done
        if is_free:
            stand(session, here)
        return is_free

    def pixels_of(self, object_id: str) -> np.ndarray:
        """Return the pixels (n, 2; x and y) that show the object. Only pixels of a fixed lattice are listed."""
        thing = self._thing(object_id)
        return self._require_loaded().session.segmented_frame().pixels_of(thing.id)

    def points_visible_from(
        self, eye: Vec3, points: np.ndarray, object_id: str, *, through_glass: bool = False
    ) -> np.ndarray:
        """Return a mask (n,) of the points (n, 3) on an object at which a ray of THOR from `eye` meets this object
        first.

        Panes of other things always stop these rays, even with `through_glass`, because THOR has no other rays.
        """
        del through_glass
        thing = self._thing(object_id)
        if thing.is_held or not thing.is_present:
            return np.zeros(len(points), dtype=bool)
        return np.array([self._meets(eye, Vec3(*point)) == thing.id for point in points.tolist()], dtype=bool)

    def may_be_visible(self, object_id: str, min_px: int) -> bool:
        """Return whether the frame shows at least `min_px` pixels of the object."""
        thing = self._thing(object_id)
        if thing.is_held or not thing.is_present:
            return min_px <= 0
        return self._require_loaded().session.segmented_frame().pixel_count(*self._names_of(thing)).pixels >= min_px

    def is_in_frame(self, object_id: str) -> bool:
        """Return whether at least one pixel of the frame shows the object."""
        return self.may_be_visible(object_id, 1)

    def looking_at(self, object_ids: Collection[str]) -> AbstractContextManager[None]:
        """Return a context without effect, because THOR always says which objects are visible."""
        del object_ids
        self._require_loaded()
        return nullcontext()

    @contextmanager
    def rollback(self) -> Iterator[None]:
        """Return a context that undoes, when it ends, everything that was done inside it."""
        snapshot = self._scene_sync.snapshot()
        try:
            yield
        finally:
            self._restore(snapshot)
            if self._scene_sync.agent != snapshot.agent:
                stand(self._require_loaded().session, snapshot.agent)

    @contextmanager
    def at_pose(self, pose: Pose) -> Iterator[None]:
        """Return a context in which the agent is at a pose. Whether the body fits there is not checked."""
        with self.rollback():
            stand(self._require_loaded().session, pose)
            yield

    def _require_loaded(self) -> _Loaded:
        if self._loaded is None:
            raise SimulatorError(f"Simulator {self.name!r} has no house: call `load` first.")
        return self._loaded

    @property
    def _scene_sync(self) -> SceneSync:
        return self._require_loaded().session.scene_sync

    def _thing(self, object_id: str) -> Thing:
        return thing_named(object_id, self._scene_sync.scene, self._require_loaded().house.name)

    def _restore(self, snapshot: ThorSnapshot) -> None:
        """Restore the objects and the hand to a snapshot. If that fails, build the house again and try once more."""
        loaded = self._require_loaded()
        if restore_snapshot(loaded.session, snapshot):
            return
        assert self._client is not None
        self._client.open(loaded.house.data)
        loaded.session.do("Pass")
        if not restore_snapshot(loaded.session, snapshot):
            raise SimulatorError(f"AI2-THOR did not restore house {loaded.house.name!r} to an earlier state.")

    def _meets(self, eye: Vec3, point: Vec3) -> str | None:
        """Return the id of the object that a ray of THOR from `eye` through `point` meets; None if it meets none."""
        way = np.subtract(point, eye)
        end = np.array(eye) + way * (FAR_M / max(float(np.linalg.norm(way)), 1e-9))
        outcome = self._require_loaded().session.query(
            "PerformRaycast", origin=to_thor(eye), destination=to_thor(Vec3(*end))
        )
        return outcome.returned["objectId"] if outcome.is_done else None

    def _shown(self, x: int, y: int) -> Thing | None:
        """Return the thing at a pixel of the frame. A held thing is ignored: return the thing behind it, or None."""
        session, things = self._require_loaded().session, self._scene_sync.scene.things
        name = session.segmented_frame().at(x, y)
        if name in self._scene_sync.in_hand():
            name = session.query("GetObjectInFrame", **place_of_pixel(x, y), checkVisible=False).returned
        thing = things.get(name or "")
        return None if thing is None or thing.is_held else thing

    def _step(self, length_m: float) -> InteractionResult:
        """Move the body by a length (m; negative means backward), or refuse."""
        action = "MoveAhead" if length_m > 0.0 else "MoveBack"
        outcome = self._require_loaded().session.do(action, moveMagnitude=abs(length_m))
        return InteractionResult() if outcome.is_done else refusal_of(outcome.message)

    def _turn(self, action: Navigate) -> Effect:
        degrees, is_right = min(action.magnitude, MAX_TURN_DEG), action.mode == "turn_right"
        outcome = self._require_loaded().session.do("RotateRight" if is_right else "RotateLeft", degrees=degrees)
        is_capped = action.magnitude > MAX_TURN_DEG
        if not outcome.is_done:
            result = refusal_of(outcome.message)
            return Effect(refusal=result.refusal, blocked_by=result.blocked_by, capped=is_capped)
        return Effect(turned_deg=degrees if is_right else -degrees, capped=is_capped)

    def _look(self, action: Look) -> Effect:
        """Change the pitch with THOR's Teleport: LookUp and LookDown accept only tenths of degrees within limits."""
        before = self._scene_sync.agent
        self._require_loaded().session.do("Teleport", horizon=horizon_after(action, before.horizon), forceAction=True)
        pitched = self._scene_sync.agent.horizon - before.horizon
        return Effect(pitched_deg=pitched, capped=action.magnitude > MAX_TURN_DEG)

    def _interact(self, action: InteractPixel) -> Effect:
        session = self._require_loaded().session
        if action.x is None or action.y is None or action.intent == "drop":
            result = drop_in_thor(session)
            return Effect(refusal=result.refusal, changed=result.changed)
        if not (0 <= action.x < WIDTH and 0 <= action.y < HEIGHT):
            return Effect(refusal="nothing_hit")
        thing, near = self._shown(action.x, action.y), session.segmented_frame().ids_near_pixel(action.x, action.y)
        point = self._point_under(action.x, action.y)
        things = self._scene_sync.scene.things
        known = {name for name in near if name in things} | ({thing.id} if thing else set())
        wholes = (furniture_of(self._scene_sync.scene, things[name]) for name in known)
        known = known.union(whole.id for whole in wholes if whole is not None)
        seen = Effect(
            hit=thing.id if thing else None,
            hit_category=thing.category if thing else None,
            near=tuple(sorted(known)),
            click_m=None if point is None else floor_distance(self._scene_sync.agent.position, point),
        )
        if thing is None or point is None:
            return seen.model_copy(update={"refusal": "nothing_hit"})
        result = interact_in_thor(session, action.intent, ObjectClick(thing, point, action.x, action.y))
        facts = {"refusal": result.refusal, "blocked_by": result.blocked_by, "changed": result.changed}
        return seen.model_copy(update={**facts, "too_far": result.refusal == "too_far"})

    def _point_under(self, x: int, y: int) -> Vec3 | None:
        """Return the point (m) that THOR's ray through a pixel meets; None if it meets nothing."""
        returned = self._require_loaded().session.query("GetCoordinateFromRaycast", **place_of_pixel(x, y)).returned
        if returned is None or not any(returned.values()):
            return None
        return from_thor(returned)

    def _names_of(self, thing: Thing) -> list[str]:
        """Return the ids of a thing and of its drawers; in frames, the drawers count as parts of the thing."""
        return [thing.id, *(part.id for part in drawers_of(self._scene_sync.scene, thing))]

    def _object_state(self, thing: Thing, asked: list[Thing]) -> ObjectState:
        scene_sync = self._scene_sync
        is_seen, names = thing.is_present and not thing.is_held, self._names_of(thing)
        count = self._require_loaded().session.segmented_frame().pixel_count(*names)
        pixels = count.pixels if is_seen else 0
        seen = ObjectVisibility(
            visible=is_seen and not scene_sync.visible.isdisjoint(names),
            visible_px=pixels,
            open_px=pixels if thing.is_openable else 0,
            toggle_px=pixels if thing.is_toggleable else 0,
            nearest_m=count.nearest_m if pixels else None,
        )
        return object_state(
            scene_sync, thing, scene_sync.box(thing), seen, support_facts(scene_sync.scene, thing, asked)
        )
