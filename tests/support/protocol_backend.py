"""Backend that has only the members of the privileged protocol, and no other attribute of the embedded engine."""

from vigil.assets.database import AssetDatabase
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator
from vigil.sim.protocol import Simulator

PROTOCOLS = (Simulator, PrivilegedSimulator)


def members() -> set[str]:
    """Return the names of all members of the privileged protocol."""
    named = {name for protocol in PROTOCOLS for name in (*vars(protocol), *protocol.__annotations__)}
    return {name for name in named if not name.startswith("_")}


def with_protocol_only(simulator: PrivilegedSimulator) -> PrivilegedSimulator:
    """Return a wrapper of `simulator` with only the members of the protocol."""
    made = type("AnotherBackend", (), {name: getattr(simulator, name) for name in members()})()
    assert isinstance(made, PrivilegedSimulator)
    return made


def make(assets: AssetDatabase, quality: str) -> PrivilegedSimulator:
    """Return such a backend over the test engine, as a `SimulatorFactory`."""
    del quality
    return with_protocol_only(make_simulator("fake", assets=assets))
