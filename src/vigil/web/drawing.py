"""Drawing on demand: one process of its own holds the simulator and its GL context, and draws what the pages ask for.

A picture is named by a scene (house, start, setup, actions carried out); the process goes on from where it stands when
it can, and begins anew when it cannot. Drawn pictures are kept for a while.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, ProcessPoolExecutor
from concurrent.futures import TimeoutError as Overdue
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, Literal, TypeVar

from cachetools import LRUCache

from vigil.actions import PhysicalAction
from vigil.agents.picture import encode
from vigil.assets.sizes import AssetDatabase
from vigil.errors import SimulatorError
from vigil.house import House
from vigil.pose import Pose
from vigil.sim import make_simulator
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.world import Effect, Setup

PATIENCE_S = 90.0
KEPT_PICTURES = 400
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """Which backend draws, at which quality, with which assets."""

    backend: str = "mujoco"
    quality: Literal["default", "fast"] = "default"
    asset_database: Path | None = None


@dataclass(frozen=True, slots=True)
class EpisodeMoment:
    """A house at the start of an episode, and what has been done since."""

    render_settings: RenderSettings
    house: Path
    start: Pose
    setup: Setup
    actions: tuple[PhysicalAction, ...] = ()

    @property
    def name(self) -> str:
        """A string that differs between scenes that look different."""
        setup = "".join(f"{key}={value!r};" for key, value in sorted(self.setup.objects.items()))
        held = self.setup.held or ""
        return f"{self.render_settings!r}|{self.house}|{self.start!r}|{setup}|{held}|{self.actions!r}"


@dataclass(frozen=True, slots=True)
class WalkResult:
    """Where one action led, and what is seen from there."""

    pose: Pose
    effect: Effect
    picture: bytes


class RenderService:
    """Draws for the pages; safe to call from any thread, one picture at a time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._executor: ProcessPoolExecutor | None = None
        self._kept: LRUCache[str, bytes] = LRUCache(KEPT_PICTURES)

    def picture(self, scene: EpisodeMoment) -> bytes:
        """Returns the frame (PNG) of a scene. Raises SimulatorError or InputError."""
        name = scene.name
        with self._lock:
            if name in self._kept:
                return self._kept[name]
        data = self._ask(_draw, scene)
        with self._lock:
            self._kept[name] = data
        return data

    def walk(self, scene: EpisodeMoment, action: PhysicalAction | None) -> WalkResult:
        """Returns where `action` leads in a scene. Raises SimulatorError or InputError."""
        return self._ask(_walk, scene, action)

    def name_at(self, scene: EpisodeMoment, x: int, y: int) -> str | None:
        """Returns the id of what is under a pixel; None for structure and sky."""
        return self._ask(_name_at, scene, x, y)

    def close(self) -> None:
        """Ends the process."""
        with self._lock:
            self._end()

    def _ask(self, task: Callable[..., _T], *arguments: Any) -> _T:
        with self._lock:
            if self._executor is None:
                context = multiprocessing.get_context("spawn")
                self._executor = ProcessPoolExecutor(1, context, initializer=_prepare_process)
            executor = self._executor
            future = executor.submit(task, *arguments)
        try:
            return future.result(PATIENCE_S)
        except (BrokenProcessPool, CancelledError, Overdue) as error:
            with self._lock:
                if self._executor is executor:
                    self._end()
            raise SimulatorError(f"The drawing process did not answer ({type(error).__name__}); try again.") from None

    def _end(self) -> None:
        executor, self._executor = self._executor, None
        if executor is None:
            return
        processes = list(getattr(executor, "_processes", {}).values())
        executor.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        for process in processes:
            process.join()


# --- in the drawing process -------------------------------------------------------------------------------------------


def _prepare_process() -> None:
    """Leaves Ctrl-C to the main process, and ends when that has gone, however it went."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(0)


class _SceneRenderer:
    """One simulator, and the moment of an episode that it shows."""

    def __init__(self, render_settings: RenderSettings) -> None:
        assets = AssetDatabase.of(render_settings.asset_database)
        self.simulator: EmbeddedSimulator = make_simulator(
            render_settings.backend, assets=assets, quality=render_settings.quality
        )
        self._loaded: tuple[Path, int] | None = None
        self._stands: EpisodeMoment | None = None

    def stand(self, scene: EpisodeMoment) -> EmbeddedSimulator:
        """Returns the simulator in that scene."""
        version = (scene.house, scene.house.stat().st_mtime_ns)
        if self._loaded != version:
            self._stands = self._loaded = None
            self.simulator.load(House.load(scene.house))
            self._loaded = version
        done = self._done_of(scene)
        if done is None:
            self._stands = None
            self.simulator.reset(scene.start, scene.setup)
            done = 0
        for action in scene.actions[done:]:
            self.simulator.step(action)
        self._stands = scene
        return self.simulator

    def moved(self) -> None:
        """Says that the simulator was led away from the scene it was in."""
        self._stands = None

    def _done_of(self, scene: EpisodeMoment) -> int | None:
        """Returns how many of the scene's actions are done already; None when it must begin anew."""
        stands = self._stands
        if stands is None or (stands.house, stands.start, stands.setup) != (scene.house, scene.start, scene.setup):
            return None
        done = len(stands.actions)
        return done if scene.actions[:done] == stands.actions else None


_renderers: dict[RenderSettings, _SceneRenderer] = {}


def _stand(scene: EpisodeMoment) -> tuple[_SceneRenderer, EmbeddedSimulator]:
    renderer = _renderers.get(scene.render_settings)
    if renderer is None:
        for other in _renderers.values():
            other.simulator.close()
        _renderers.clear()
        renderer = _renderers[scene.render_settings] = _SceneRenderer(scene.render_settings)
    return renderer, renderer.stand(scene)


def _draw(scene: EpisodeMoment) -> bytes:
    return encode(_stand(scene)[1].frame()).data


def _walk(scene: EpisodeMoment, action: PhysicalAction | None) -> WalkResult:
    renderer, simulator = _stand(scene)
    effect = Effect()
    if action is not None:
        renderer.moved()
        effect = simulator.step(action)
    return WalkResult(simulator.world(()).agent, effect, encode(simulator.frame()).data)


def _name_at(scene: EpisodeMoment, x: int, y: int) -> str | None:
    return _stand(scene)[1].object_at(x, y)
