"""The engine that uses MuJoCo to draw scenes and to cast rays into them."""

import math
from collections.abc import Sequence

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.protocol.observation import Quality
from vigil.rendering.scene import PointLight
from vigil.scene.things import Scene, Thing
from vigil.sim.core.engine import RayHits
from vigil.sim.core.sight import AGENT_LENS, Lens
from vigil.sim.core.views import lens_of, pose_of
from vigil.sim.engines.mujoco import light_sources, rays
from vigil.sim.engines.mujoco.camera import Camera, gl_strings
from vigil.sim.engines.mujoco.compiled import model_cache
from vigil.sim.engines.mujoco.compiled.binding import BACKEND, mujoco
from vigil.sim.engines.mujoco.compiled.model import CompiledModel
from vigil.sim.scene_editor import CameraImage, CameraView, Layer


class MujocoEngine:
    """An engine with a live scene in MuJoCo. Its camera is made on first use, because rays do not need OpenGL."""

    def __init__(self, quality: Quality = "default") -> None:
        self.name = f"mujoco {mujoco.__version__} ({quality})"
        self._quality: Quality = quality
        self._scene: Scene | None = None
        self._model: CompiledModel | None = None
        self._camera: Camera | None = None
        model_cache.register_engine(self)

    def load(self, scene: Scene) -> None:
        """Load `scene`, replacing any earlier one."""
        self.close()
        self._scene, self._model = scene, model_cache.model_of(scene)

    def prepare(self, scene: Scene) -> None:
        """Compile the model of `scene` into the cache."""
        model_cache.prepare(scene)

    def update(self, scene: Scene, ids: set[str]) -> None:
        """Update the poses and states of the named things."""
        model = self.model
        for thing_id in sorted(ids):
            model.place(scene.things[thing_id])
        model.update_kinematics()

    def cast(
        self,
        origin: Vec3,
        directions: np.ndarray,
        *,
        through_glass: bool,
        only: str | None = None,
        without: Sequence[str] = (),
        within_m: float = math.inf,
    ) -> RayHits:
        """Cast rays along unit `directions` (n, 3), in THOR's frame (see `Engine.cast`)."""
        return rays.cast(
            self.model, origin, directions, through_glass=through_glass, only=only, without=without, within_m=within_m
        )

    def draw(self, agent: Pose, held: str | None) -> np.ndarray:
        """Return the egocentric frame, (480, 640, 3) uint8, with the held object at the bottom centre."""
        in_hand = self._in_hand(held)
        return self.camera.draw(agent, self._point_lights(agent, AGENT_LENS, in_hand), in_hand)

    def render_view(self, view: CameraView, layers: frozenset[Layer], held: str | None) -> CameraImage:
        """Return the requested layers of a camera's image, with the object `held` in front of the camera."""
        in_hand = self._in_hand(held)
        point_lights = self._point_lights(pose_of(view), lens_of(view), in_hand) if "rgb" in layers else []
        return self.camera.render_view(view, layers, point_lights, in_hand)

    def renderer(self) -> str:
        """Return the name and version of OpenGL's renderer; "none" without OpenGL."""
        if BACKEND.fault:
            return "none"
        strings = gl_strings()
        return f"{strings['renderer']}; {strings['version']}"

    def close(self) -> None:
        """Free the scene."""
        if self._camera is not None:
            self._camera.close()
        self._scene = self._model = self._camera = None

    @property
    def camera(self) -> Camera:
        """The camera for the loaded scene. Raises SimulatorError without OpenGL."""
        if self._camera is None:
            self._camera = Camera(self.model, self._quality)
        return self._camera

    @property
    def model(self) -> CompiledModel:
        """The loaded scene's model. Raises RuntimeError before the first `load`."""
        if self._model is None:
            raise RuntimeError("MujocoEngine: load a scene first")
        return self._model

    def _point_lights(self, looker: Pose, lens: Lens, in_hand: list[Thing]) -> list[PointLight]:
        """Return the lights of objects for a picture. Also set the lamps of rooms by the visible light switches."""
        if self._scene is None:
            return []
        light_sources.update_room_lamps(self.model, self._scene, looker, lens)
        return light_sources.point_lights_of(self.model, self._scene, looker, lens, in_hand)

    def _in_hand(self, held: str | None) -> list[Thing]:
        if self._scene is None or held is None:
            return []
        carried = [thing for thing in self._scene.things.values() if thing.is_held and thing.id != held]
        return [self._scene.things[held], *carried]
