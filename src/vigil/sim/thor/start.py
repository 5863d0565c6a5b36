"""The engine that the AI2-THOR backend starts, and its settings.

The environment variable `VIGIL_THOR_ENGINE` chooses the engine. If it is unset, AI2-THOR's own build is started. The
value `vigil` starts this project's engine on MuJoCo, and `vigil:fake` starts it without a renderer. Any other value is
a command that starts another engine.
"""

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.protocol import WORKER_NUMBER
from vigil.sim.thor.guarded_client import GuardedClient
from vigil.sim.thor.requirements import BUILD, CLIENT, PLATFORMS, examine, is_own_release, release_folder
from vigil.sim.thor.simulator import ThorSimulator

ENGINE_VARIABLE = "VIGIL_THOR_ENGINE"
"""Environment variable that chooses the engine."""
OWN = "vigil"
"""Value of `VIGIL_THOR_ENGINE` that chooses this project's engine."""
NO_DISPLAY = ":0"
"""Value for DISPLAY. AI2-THOR's client requires this variable, but does not check that the display exists."""
SEEN_BY = "masks"
"""Word that says how visible pixels are counted.

It is part of the simulator's name in run headers. So runs are not compared in pairs if their pixels were counted in
different ways.
"""
UNITY_START_S = 300.0
"""Time limit (s) for the start of AI2-THOR's own build."""
GPUS = "CUDA_VISIBLE_DEVICES"
"""Environment variable that lists GPUs."""

INITIALIZE: dict[str, Any] = {
    "width": WIDTH,
    "height": HEIGHT,
    "fieldOfView": 90.0,
    "gridSize": 0.25,
    "snapToGrid": False,
    "rotateStepDegrees": 90.0,
    "visibilityDistance": 6.0,
    "renderInstanceSegmentation": True,
    "renderDepthImage": True,
    "autoSimulation": False,
}
"""Settings of the client's Controller: the camera of the protocol, the paper's visibility distance (6 m), and a clock
that advances only on request."""


@dataclass(frozen=True, slots=True)
class ChosenEngine:
    """The engine that the environment variable chooses: its name and its command."""

    name: str
    command: str | None
    """Command line that starts the engine; None for AI2-THOR's own build."""


def chosen_engine(quality: str = "default", assets: Path | None = None) -> ChosenEngine:
    """Return the engine that the environment variable chooses; `quality` and `assets` are for this project's engine."""
    wanted = os.environ.get(ENGINE_VARIABLE, "").strip()
    if not wanted and any(is_own_release(release_folder(kind)) for kind in PLATFORMS):
        wanted = OWN  # `vigil thor install` put this engine into the place of AI2-THOR's build
    if not wanted:
        return ChosenEngine(f"unity-{BUILD[:8]}", None)
    own, _, backend = wanted.partition(":")
    if own != OWN:
        return ChosenEngine(f"other ({wanted})", wanted)
    backend = backend or "mujoco"
    return ChosenEngine(f"{OWN}-{backend}", own_command(engine_options(backend, quality, assets)))


def simulator_name(engine: ChosenEngine) -> str:
    """Return the simulator's name and version for run headers."""
    return f"thor/{CLIENT} {engine.name} {SEEN_BY}"


def own_command(options: list[str]) -> str:
    """Return the command of this project's engine. If DISPLAY is unset, also set it, because the client requires it."""
    os.environ.setdefault("DISPLAY", NO_DISPLAY)
    return shlex.join([sys.executable, "-m", "vigil.thor", *options])


def engine_options(backend: str, quality: str, asset_database: str | Path | None) -> list[str]:
    """Return the command-line options of this project's engine."""
    words = [f"--backend={backend}", f"--render-quality={quality}"]
    return words if asset_database is None else [*words, f"--assets={Path(asset_database).absolute()}"]


def thor_simulator(assets: AssetDatabase, quality: str) -> ThorSimulator:
    """Return a simulator with the engine that the environment variable chooses.

    The engine starts when the first house is loaded.
    """
    engine = chosen_engine(quality, assets.path)

    def connect(house: dict[str, Any]) -> GuardedClient:
        if engine.command is not None:
            return GuardedClient(house, engine.command, **INITIALIZE)
        platform = _unity_platform(
            f"{ENGINE_VARIABLE}={OWN} takes this project's engine, which needs the client alone."
        )
        where = {"platform": platform, "gpu_device": own_gpu()}
        return GuardedClient(house, None, start_s=UNITY_START_S, **where, **INITIALIZE)

    return ThorSimulator(simulator_name(engine), connect, assets)


def require_engine(simulator_version: str, *, instead: str) -> None:
    """Raise SettingError unless the chosen engine is the one in a run's header and can start on this machine.

    `instead` is a sentence that says what the user can do without this engine.
    """
    engine = chosen_engine()
    if simulator_name(engine) != simulator_version:
        raise SettingError(
            "Hidden states can be compared only in the engine in which the run was played. That engine is "
            f"{simulator_version!r}, but {ENGINE_VARIABLE} chooses {simulator_name(engine)!r} here. {instead}"
        )
    if engine.command is None:
        _unity_platform(instead)


def _unity_platform(instead: str) -> str | None:
    """Return the platform of AI2-THOR's build for this machine. Raises SettingError if a requirement is missing."""
    needed = examine()
    if needed.missing:
        raise SettingError(
            f"AI2-THOR's own engine cannot run here, because this is missing: {'; '.join(needed.missing)}. {instead}"
        )
    return needed.platform


def own_gpu() -> int | None:
    """Return the index of this worker's GPU in the list CUDA_VISIBLE_DEVICES; None if the list has at most one GPU."""
    named = [name for name in os.environ.get(GPUS, "").split(",") if name.strip()]
    return int(os.environ.get(WORKER_NUMBER, "0")) % len(named) if len(named) > 1 else None
