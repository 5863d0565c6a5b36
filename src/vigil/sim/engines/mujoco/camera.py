"""Drawing of frames. Each process has one OpenGL context, and each live scene has one painter."""

import atexit
import ctypes
import hashlib
import math
import os
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace

import numpy as np
from cachetools import LRUCache

from vigil.base.geometry import Pose
from vigil.errors import SimulatorError
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Quality
from vigil.rendering.context import GraphicsError
from vigil.rendering.painter import Painter
from vigil.rendering.scene import PointLight, RenderState
from vigil.rendering.viewer import HeldGeoms, Viewer
from vigil.scene.things import Thing
from vigil.sim.core.sight import FOCAL_PX
from vigil.sim.core.views import pose_of, rolled
from vigil.sim.engines.mujoco import held
from vigil.sim.engines.mujoco.compiled import frames, gl
from vigil.sim.engines.mujoco.compiled.binding import BACKEND, GL, GLContext
from vigil.sim.engines.mujoco.compiled.model import CompiledModel
from vigil.sim.scene_editor import NOTHING, STRUCTURES, CameraImage, CameraView, Layer

SAMPLES: dict[Quality, int] = {"default": 4, "fast": 0}
"""Number of samples for each pixel (antialiasing), by quality."""
FOVY_DEG = 2 * math.degrees(math.atan2(FRAME_HEIGHT / 2, FOCAL_PX))
"""Vertical field of view (deg) of the agent's camera."""
KEPT_FRAMES = 4
"""Number of frames of a scene that are kept. Copies of the scene share them, e.g. the rollouts of one episode."""


class _Window:
    """The OpenGL context of the process; it belongs to the thread that draws first."""

    def __init__(self) -> None:
        gl.demand(BACKEND)
        self.thread, self.process = threading.get_ident(), os.getpid()
        try:
            self.context = GLContext(FRAME_WIDTH, FRAME_HEIGHT)
            self.context.make_current()
        except Exception as error:  # MuJoCo, PyOpenGL and GLFW raise different errors
            raise _no_picture("was found but does not provide a context", error) from error

    def enter(self) -> None:
        """Make the context current. Raises SimulatorError in any other thread or in a fork of the process."""
        if os.getpid() != self.process:
            raise SimulatorError(
                "A MuJoCo frame was requested in a fork of a process that has already drawn; OpenGL does not survive "
                "a fork. Start worker processes with the `spawn` or `forkserver` method."
            )
        if threading.get_ident() != self.thread:
            raise SimulatorError(
                "A MuJoCo frame was requested in a second thread; OpenGL allows one per process. "
                "Draw in one thread, or in several processes."
            )
        self.context.make_current()


_window: list[_Window] = []
_cameras: "weakref.WeakSet[Camera]" = weakref.WeakSet()


def _enter() -> None:
    if not _window:
        _window.append(_Window())
        atexit.register(_close_window)
    _window[0].enter()


@contextmanager
def _drawing() -> Iterator[None]:
    """Make the context current; turn an error of OpenGL into a SimulatorError that names environment variables."""
    _enter()
    try:
        yield
    except GraphicsError as error:
        raise _no_picture("cannot draw", error) from error


def _no_picture(what: str, error: Exception) -> SimulatorError:
    reason = " ".join(str(error).split()).rstrip(".")
    return SimulatorError(f"OpenGL ({BACKEND.name}) {what}: {reason}. {BACKEND.advice}.")


def _close_window() -> None:
    for camera in list(_cameras):
        camera.close()
    while _window:
        _window.pop().context.free()


_KINDS = {"wall": "wall", "skirting": "wall", "floor": "floor", "ceiling": "ceiling"}


class Camera:
    """A camera that draws pictures of one model."""

    def __init__(self, model: CompiledModel, quality: Quality) -> None:
        self._model, self._quality = model, quality
        self._frames: LRUCache[bytes, np.ndarray] = model.render_scene.cache.setdefault("frames", LRUCache(KEPT_FRAMES))
        with _drawing():
            self._painter = Painter(model.render_scene, BACKEND.module, SAMPLES[quality], has_ssao=quality == "default")
        _cameras.add(self)

    def draw(self, agent: Pose, point_lights: list[PointLight], in_hand: list[Thing]) -> np.ndarray:
        """Return the agent's frame, (480, 640, 3) uint8; `in_hand` has the held thing, then the things it carries.

        A frame with the same contents is not drawn twice, unless a thing is held.
        """
        viewer = _agent_viewer(agent)
        if in_hand:
            return self._paint(viewer, point_lights, self._hold(viewer.eye, agent, in_hand))
        _enter()  # in another thread, even a kept frame is refused
        key = self._contents(self._model.render_state(), viewer, point_lights)
        if key not in self._frames:
            self._frames[key] = self._paint(viewer, point_lights, None)
        return self._frames[key].copy()

    def render_view(
        self, view: CameraView, layers: frozenset[Layer], point_lights: list[PointLight], in_hand: list[Thing]
    ) -> CameraImage:
        """Return layers of a camera's image; `in_hand` has the held thing, then the things that it carries."""
        looker = pose_of(view)
        viewer = _viewer(looker, view.fovy_deg, view.width, view.height)
        viewer = replace(viewer, axes=rolled(viewer.axes.T, view.roll).T)
        things_held = self._hold(viewer.eye, looker, in_hand)
        rgb = self._paint(viewer, point_lights, things_held) if "rgb" in layers else None
        if layers <= {"rgb"}:
            return CameraImage(rgb)
        with _drawing():
            geoms, depth = self._painter.identify(self._model.render_state(), viewer, things_held)
        things = _things_of(self._model)[geoms]
        return CameraImage(rgb, depth if "depth" in layers else None, things if "things" in layers else None)

    def draw_from(self, viewer: Viewer) -> np.ndarray:
        """Return a picture (height, width, 3) uint8 in which every room's lamp is on and no other lamp is."""
        self._model.lamps.dim_rooms = frozenset()
        return self._paint(viewer, [], None)

    def segment(self, agent: Pose) -> np.ndarray:
        """Return the number of the geom at each pixel, (480, 640) int32, -1 for none; tests compare them with rays."""
        with _drawing():
            return self._painter.identify(self._model.render_state(), _agent_viewer(agent))[0]

    def close(self) -> None:
        """Free the OpenGL objects."""
        _enter()
        _cameras.discard(self)
        self._painter.close()

    def _contents(self, state: RenderState, viewer: Viewer, point_lights: list[PointLight]) -> bytes:
        """Return a hash of everything that decides the pixels of a frame without a held thing."""
        arrays = [getattr(state, each.name) for each in fields(state)] + [viewer.eye, viewer.axes]
        arrays += [each for light in point_lights for each in (light.place, light.colour)]
        found = hashlib.blake2b(self._quality.encode(), digest_size=16)
        for each in arrays:
            found.update(np.ascontiguousarray(each).data)
        return found.digest()

    def _paint(self, viewer: Viewer, point_lights: list[PointLight], in_hand: HeldGeoms | None) -> np.ndarray:
        lamp = self._model.lamps.place_over(viewer.eye)
        with _drawing():
            return self._painter.paint(self._model.render_state(), viewer, lamp, point_lights, in_hand)

    def _hold(self, eye: np.ndarray, looker: Pose, things: list[Thing]) -> HeldGeoms | None:
        if not things:
            return None
        in_hand = held.pose_in_hand(things[0], looker)
        held.put_in_hand(self._model, things, in_hand.center, in_hand.matrix)
        geoms = np.concatenate([self._model.things[thing.id].geoms for thing in things])
        gripper = held.gripper(eye, frames.mujoco_camera_axes(looker), in_hand)
        # It shrinks about its centre, then about the eye.
        near, smaller = held.NEARER, in_hand.smaller
        return HeldGeoms(geoms, near * smaller, near * (1.0 - smaller) * in_hand.center + (1.0 - near) * eye, gripper)


def _agent_viewer(agent: Pose) -> Viewer:
    return _viewer(agent, FOVY_DEG, FRAME_WIDTH, FRAME_HEIGHT)


def _viewer(looker: Pose, fovy_deg: float, width: int, height: int) -> Viewer:
    return Viewer(frames.points(np.array(looker.eye)), frames.mujoco_camera_axes(looker), fovy_deg, width, height)


def gl_strings() -> dict[str, str]:
    """Return the OpenGL driver's vendor, renderer and version."""
    _enter()
    names = {"vendor": GL.GL_VENDOR, "renderer": GL.GL_RENDERER, "version": GL.GL_VERSION}
    found = {name: GL.glGetString(key) for name, key in names.items()}
    return {name: ctypes.string_at(text).decode(errors="replace") if text else "" for name, text in found.items()}


def _things_of(model: CompiledModel) -> np.ndarray:
    """Return for each geom (geoms + 1,) the index of its thing; for structure, the negative number of its kind.

    The last entry stands for no geom.
    """
    table = model.geom_things.copy()
    for geom, kind in enumerate(model.render_scene.structure_kinds):
        table[geom] = -2 - STRUCTURES.index(_KINDS[kind]) if kind in _KINDS else NOTHING
    return table
