"""Frames: one OpenGL context per process, one MuJoCo render context per live scene."""

import atexit
import ctypes
import os
import threading
import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.errors import SimulatorError
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH, Quality
from vigil.pose import Pose
from vigil.scene.things import Thing
from vigil.sim.core.views import pose_of
from vigil.sim.engines.mujoco import frames, gl, held, tuning
from vigil.sim.engines.mujoco.binding import BACKEND, GL, GLContext, NativeModel, RenderContext, mujoco
from vigil.sim.engines.mujoco.culling import unseen
from vigil.sim.engines.mujoco.lights import Sun
from vigil.sim.engines.mujoco.model import FOVY_DEG, GLASS, HELD, HIDDEN, STRUCTURE, THING, CompiledModel
from vigil.sim.staging import NOTHING, STRUCTURES, Layer, Picture, View


@dataclass(frozen=True, slots=True)
class _Settings:
    shadow_pixels: int
    samples: int


SETTINGS: dict[Quality, _Settings] = {"default": _Settings(2048, 4), "fast": _Settings(1024, 0)}


_HINT = f"Try MUJOCO_GL=osmesa, or {gl.ADVICE}."


class _Window:
    """The process's OpenGL context; it belongs to the thread that first draws."""

    def __init__(self) -> None:
        gl.demand(BACKEND)
        self.thread, self.process = threading.get_ident(), os.getpid()
        try:
            self.context = GLContext(FRAME_WIDTH, FRAME_HEIGHT)
            self.context.make_current()
        except (ImportError, RuntimeError, OSError) as error:
            raise SimulatorError(f"OpenGL ({BACKEND.name}) was found but gives no context: {error}. {_HINT}") from error

    def enter(self) -> None:
        """Makes the context current. Raises SimulatorError in another thread than the first."""
        if os.getpid() != self.process:
            raise SimulatorError(
                "A MuJoCo frame was asked for in a fork of a process that has drawn already; OpenGL does not survive "
                "a fork. Start worker processes with the `spawn` or `forkserver` method."
            )
        if threading.get_ident() != self.thread:
            raise SimulatorError(
                "A MuJoCo frame was asked for in a second thread; OpenGL allows one per process. "
                "Draw in one thread, or give each thread a process of its own."
            )
        self.context.make_current()


_window: list[_Window] = []
_cameras: "weakref.WeakSet[Camera]" = weakref.WeakSet()


def _enter() -> _Window:
    if not _window:
        _window.append(_Window())
        atexit.register(_close_window)
    _window[0].enter()
    return _window[0]


def _close_window() -> None:
    for camera in list(_cameras):
        camera.close()
    while _window:
        _window.pop().context.free()


def _render_context(native: NativeModel) -> RenderContext:
    try:
        return mujoco.MjrContext(native, mujoco.mjtFontScale.mjFONTSCALE_50.value)
    except mujoco.FatalError as error:
        raise SimulatorError(f"OpenGL ({BACKEND.name}) cannot take the scene: {error}. {_HINT}") from error


def _view_of(agent: Pose) -> tuple[np.ndarray, np.ndarray, float]:
    return frames.points(np.array(agent.eye)), frames.camera_axes(agent), FOVY_DEG


_KINDS = {"wall": "wall", "skirting": "wall", "floor": "floor", "ceiling": "ceiling"}


class Camera:
    """Draws one model."""

    def __init__(self, model: CompiledModel, quality: Quality) -> None:
        _enter()
        self._model = model
        native = model.native
        native.vis.quality.shadowsize = SETTINGS[quality].shadow_pixels
        native.vis.quality.offsamples = SETTINGS[quality].samples
        native.vis.global_.offwidth, native.vis.global_.offheight = FRAME_WIDTH, FRAME_HEIGHT
        self._scene = mujoco.MjvScene(native, maxgeom=native.ngeom + 16)
        self._context = _render_context(native)
        tuning.tune(self._context)
        self._option, self._perturb, self._view = mujoco.MjvOption(), mujoco.MjvPerturb(), mujoco.MjvCamera()
        self._view.type, self._view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED.value, 0
        self._option.geomgroup[:] = 0
        self._option.geomgroup[[STRUCTURE, THING, GLASS, HELD]] = 1
        flags = mujoco.mjtRndFlag
        self._scene.flags[:] = 0
        for flag in (flags.mjRND_SHADOW, flags.mjRND_CULL_FACE, flags.mjRND_SKYBOX):
            self._scene.flags[int(flag)] = 1
        _cameras.add(self)
        self._viewport = mujoco.MjrRect(0, 0, FRAME_WIDTH, FRAME_HEIGHT)
        self._buffer = np.empty((FRAME_HEIGHT, FRAME_WIDTH, 3), dtype=np.uint8)

    def draw(self, agent: Pose, glowing: list[Thing], in_hand: list[Thing]) -> np.ndarray:
        """Returns the frame that the agent sees, (480, 640, 3) uint8.

        `glowing` are the things that give light; `in_hand` what is held, with what it carries after it.
        """
        self._context.shadowScale = self._model.lamps.select(self._model.native, agent.eye, glowing)
        groups = self._model.native.geom_group.copy()
        self._model.native.geom_group[unseen(self._model, *_view_of(agent))] = HIDDEN
        if in_hand:
            self._update_holding(agent, in_hand)
        else:
            self._update(*_view_of(agent))
        self._model.native.geom_group[:] = groups
        tuning.lift(tuning.LAMP_BIAS)
        return self._render()

    def look(self, view: View, layers: frozenset[Layer], glowing: list[Thing], in_hand: list[Thing]) -> Picture:
        """Returns the layers of what a camera sees; `in_hand` is what it holds, with what that carries after it."""
        self._grow(view)
        looker = pose_of(view)
        eye, axes, _ = _view_of(looker)
        self._context.shadowScale = self._model.lamps.select(self._model.native, looker.eye, glowing)
        groups = self._model.native.geom_group.copy()
        aspect = view.width / view.height
        self._model.native.geom_group[unseen(self._model, eye, axes, view.fovy_deg, aspect)] = HIDDEN
        if in_hand:
            self._update_holding(looker, in_hand, view.fovy_deg)
        else:
            self._update(eye, axes, view.fovy_deg)
        self._model.native.geom_group[:] = groups
        tuning.lift(tuning.LAMP_BIAS)
        rect = mujoco.MjrRect(0, 0, view.width, view.height)
        rgb = _colours(self._scene, self._context, rect) if "rgb" in layers else None
        if layers <= {"rgb"}:
            return Picture(rgb)
        things, depth = _surfaces(self._model, self._scene, self._context, rect)
        return Picture(rgb, depth if "depth" in layers else None, things if "things" in layers else None)

    def _grow(self, view: View) -> None:
        """Makes the buffer at least as large as a view."""
        size = self._model.native.vis.global_
        if view.width > size.offwidth or view.height > size.offheight:
            _enter()
            size.offwidth, size.offheight = max(view.width, size.offwidth), max(view.height, size.offheight)
            self._context.free()
            self._context = _render_context(self._model.native)
            tuning.tune(self._context)

    def survey(self, eye: np.ndarray, axes: np.ndarray, fovy_deg: float, sun: Sun) -> np.ndarray:
        """Returns a picture by daylight from anywhere; `eye` and `axes` (right, up, backward) in MuJoCo's frame."""
        self._model.lamps.daylight(self._model.native, sun)
        self._context.shadowClip = sun.reach_m
        self._update(eye, axes, fovy_deg)
        tuning.lift(tuning.SUN_BIAS)
        return self._render()

    def segment(self, agent: Pose) -> np.ndarray:
        """Returns the geom that each pixel shows, (480, 640) int32, -1 for none: a check on the rays."""
        self._update(*_view_of(agent))
        flags = [int(mujoco.mjtRndFlag.mjRND_SEGMENT), int(mujoco.mjtRndFlag.mjRND_IDCOLOR)]
        self._scene.flags[flags] = 1
        picture = self._render().astype(np.int32)
        self._scene.flags[flags] = 0
        numbers = picture[..., 0] + (picture[..., 1] << 8) + (picture[..., 2] << 16) - 1
        geoms = np.array([geom.objid for geom in self._drawn()] + [-1], dtype=np.int32)
        return geoms[numbers]

    def close(self) -> None:
        """Frees the render context."""
        _enter()
        _cameras.discard(self)
        self._context.free()

    def _update(self, eye: np.ndarray, axes: np.ndarray, fovy_deg: float) -> None:
        _enter()
        native, data = self._model.native, self._model.data
        native.cam_pos[0], native.cam_quat[0], native.cam_fovy[0] = eye, frames.quaternion(axes), fovy_deg
        mujoco.mj_camlight(native, data)
        mujoco.mjv_updateScene(
            native, data, self._option, self._perturb, self._view, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        for place in self._without_shadow():
            self._scene.geoms[place].category = mujoco.mjtCatBit.mjCAT_DECOR.value

    def _update_holding(self, agent: Pose, things: list[Thing], fovy_deg: float = FOVY_DEG) -> None:
        center, matrix, smaller = held.pose_in_hand(things[0], agent)
        held.put_in_hand(self._model, things, center, matrix)
        eye, axes, _ = _view_of(agent)
        self._update(eye, axes, fovy_deg)
        geoms = {geom for thing in things for geom in self._model.things[thing.id].geoms.tolist()}
        held.bring_near([geom for geom in self._drawn() if geom.objid in geoms], eye, center, smaller)

    def _without_shadow(self) -> np.ndarray:
        """Returns the places in the drawing list of what casts no shadow: glass, what hangs, what is in the hand."""
        groups = self._model.native.geom_group
        lets_light_through = (groups == GLASS) | (groups == HELD)
        lets_light_through[self._model.lets_light_through] = True
        return np.flatnonzero(lets_light_through[groups != HIDDEN])

    def _drawn(self) -> list[Any]:
        return [self._scene.geoms[number] for number in range(self._scene.ngeom)]

    def _render(self) -> np.ndarray:
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        mujoco.mjr_render(self._viewport, self._scene, self._context)
        mujoco.mjr_readPixels(self._buffer, None, self._viewport, self._context)
        return self._buffer[::-1].copy()


def gl_strings() -> dict[str, str]:
    """Returns what the OpenGL driver says of itself: vendor, renderer and version."""
    _enter()
    names = {"vendor": GL.GL_VENDOR, "renderer": GL.GL_RENDERER, "version": GL.GL_VERSION}
    found = {name: GL.glGetString(key) for name, key in names.items()}
    return {name: ctypes.string_at(text).decode(errors="replace") if text else "" for name, text in found.items()}


def _colours(scene: Any, context: RenderContext, rect: Any) -> np.ndarray:
    """Returns the picture (height, width, 3) uint8, the first row on top."""
    rgb, _ = _read(scene, context, rect, with_depth=False)
    return rgb


def _surfaces(model: CompiledModel, scene: Any, context: RenderContext, rect: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns the thing (int32) and the depth (float32 metres) of each pixel."""
    flags = [int(mujoco.mjtRndFlag.mjRND_SEGMENT), int(mujoco.mjtRndFlag.mjRND_IDCOLOR)]
    scene.flags[flags] = 1
    context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
    picture, buffer = _read(scene, context, rect, with_depth=True)
    scene.flags[flags] = 0
    parts = picture.astype(np.int32)
    numbers = parts[..., 0] + (parts[..., 1] << 8) + (parts[..., 2] << 16) - 1
    drawn = [scene.geoms[number].objid for number in range(scene.ngeom)]
    geoms = np.array([*drawn, -1], dtype=np.int32)
    return _things_of(model)[geoms[numbers]], _metres(model, buffer)


def _read(scene: Any, context: RenderContext, rect: Any, *, with_depth: bool) -> tuple[np.ndarray, np.ndarray]:
    shape = rect.height, rect.width
    rgb = np.empty((*shape, 3), dtype=np.uint8)
    depth = np.empty(shape, dtype=np.float32)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, context)
    mujoco.mjr_render(rect, scene, context)
    mujoco.mjr_readPixels(rgb, depth if with_depth else None, rect, context)
    return rgb[::-1].copy(), depth[::-1].copy()


def _things_of(model: CompiledModel) -> np.ndarray:
    """Returns the thing of each geom, structure as the negative number of its kind; nothing in the last place."""
    table = model.geom_things.copy()
    for geom, kind in model.structure_kinds.items():
        table[geom] = -2 - STRUCTURES.index(_KINDS[kind]) if kind in _KINDS else NOTHING
    return table


def _metres(model: CompiledModel, buffer: np.ndarray) -> np.ndarray:
    """Returns the depth along the axis, from a buffer that is 1 at the near plane and 0 at the far one."""
    near, far = (
        float(value * model.native.stat.extent) for value in (model.native.vis.map.znear, model.native.vis.map.zfar)
    )
    with np.errstate(divide="ignore"):
        metres = near * far / (near + buffer.astype(np.float64) * (far - near))
    return np.where(buffer <= 0.0, np.inf, metres).astype(np.float32)
