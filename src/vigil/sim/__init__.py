"""Simulators: the protocols, the engine-neutral embedded simulator and its engines.

An engine is imported when a simulator of it is made, so that nothing else needs its libraries.
"""

from collections.abc import Callable

from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError
from vigil.protocol.observation import Quality
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.privileged import PrivilegedSimulator


def _fake(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.engines.fake import FakeEngine  # noqa: PLC0415 - loads SciPy

    del quality  # its pictures are always coarse
    return EmbeddedSimulator(FakeEngine(), assets)


def _mujoco(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.engines.mujoco.engine import MujocoEngine  # noqa: PLC0415 - loads MuJoCo

    return EmbeddedSimulator(MujocoEngine(quality), assets)


def _thor(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.thor.start import thor_simulator  # noqa: PLC0415 - what only a program with AI2-THOR needs

    return thor_simulator(assets, quality)


BACKENDS: dict[str, Callable[[AssetDatabase, Quality], PrivilegedSimulator]] = {
    "mujoco": _mujoco,
    "fake": _fake,
    "thor": _thor,
}
"""Backend name -> maker. The concrete classes are named here, in `vigil.sim` and in its tests, and nowhere else."""
EDITABLE_BACKENDS = ("mujoco", "fake")
"""Those that keep `vigil.sim.scene_editor.Stage`, so that the AI2-THOR-compatible engine can be one over them."""


def make_simulator(name: str, *, assets: AssetDatabase, quality: Quality = "default") -> PrivilegedSimulator:
    """Return a simulator of the named backend. Raises SettingError on an unknown name."""
    if name not in BACKENDS:
        raise SettingError(f"Simulator backend {name!r} is unknown. Choose one of {', '.join(sorted(BACKENDS))}.")
    return BACKENDS[name](assets, quality)
