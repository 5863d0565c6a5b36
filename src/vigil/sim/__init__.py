"""Simulators: their protocols, the engine-neutral embedded simulator with its engines, and AI2-THOR as a backend.

An engine is imported only when a simulator with this engine is made, so that no other code needs the engine's
libraries.
"""

from collections.abc import Callable

from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError
from vigil.protocol.observation import Quality
from vigil.sim.privileged import PrivilegedSimulator


def _fake(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.core.embedded import EmbeddedSimulator  # noqa: PLC0415 - loads the rules of the world
    from vigil.sim.engines.fake import FakeEngine  # noqa: PLC0415 - loads SciPy

    del quality  # its frames are always coarse
    return EmbeddedSimulator(FakeEngine(), assets)


def _mujoco(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.core.embedded import EmbeddedSimulator  # noqa: PLC0415 - loads the rules of the world
    from vigil.sim.engines.mujoco.engine import MujocoEngine  # noqa: PLC0415 - loads MuJoCo

    return EmbeddedSimulator(MujocoEngine(quality), assets)


def _thor(assets: AssetDatabase, quality: Quality) -> PrivilegedSimulator:
    from vigil.sim.thor.start import thor_simulator  # noqa: PLC0415 - needs AI2-THOR's client

    return thor_simulator(assets, quality)


BACKENDS: dict[str, Callable[[AssetDatabase, Quality], PrivilegedSimulator]] = {
    "mujoco": _mujoco,
    "fake": _fake,
    "thor": _thor,
}
"""Name of a backend -> function that makes its simulator. Code outside `vigil.sim` calls only these functions."""
NAMELESS_BACKENDS = ("thor",)
"""Backends in which an agent cannot name the object that it acts on (`vigil.sim.protocol.NamesObjects`)."""
EDITABLE_BACKENDS = ("mujoco", "fake")
"""Backends that implement `vigil.sim.scene_editor.SceneEditor`; the AI2-THOR-compatible engine can run on them."""


def make_simulator(name: str, *, assets: AssetDatabase, quality: Quality = "default") -> PrivilegedSimulator:
    """Return a simulator of the named backend. Raises SettingError on an unknown name."""
    if name not in BACKENDS:
        raise SettingError(f"Simulator backend {name!r} is unknown. Choose one of {', '.join(sorted(BACKENDS))}.")
    return BACKENDS[name](assets, quality)
