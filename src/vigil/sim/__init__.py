"""Simulators: the protocol, the engine-neutral embedded simulator and its engines.

An engine is imported when a simulator of it is made, so that nothing else needs its libraries.
"""

from collections.abc import Callable
from typing import Literal

from vigil.assets.sizes import AssetDatabase
from vigil.errors import SettingError
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.engines.fake import FakeEngine

Quality = Literal["default", "fast"]


def _fake(assets: AssetDatabase, quality: Quality) -> EmbeddedSimulator:
    del quality  # its pictures are always coarse
    return EmbeddedSimulator(FakeEngine(), assets)


def _mujoco(assets: AssetDatabase, quality: Quality) -> EmbeddedSimulator:
    from vigil.sim.engines.mujoco.engine import MujocoEngine  # noqa: PLC0415 - loads MuJoCo

    return EmbeddedSimulator(MujocoEngine(quality), assets)


BACKENDS: dict[str, Callable[[AssetDatabase, Quality], EmbeddedSimulator]] = {"mujoco": _mujoco, "fake": _fake}
"""Backend name -> maker."""


def make_simulator(name: str, *, assets: AssetDatabase, quality: Quality = "default") -> EmbeddedSimulator:
    """Returns a simulator of the named backend. Raises SettingError on an unknown name."""
    if name not in BACKENDS:
        raise SettingError(f"Simulator backend {name!r} is unknown. Choose one of {', '.join(sorted(BACKENDS))}.")
    return BACKENDS[name](assets, quality)
