"""A backend of another make: it has the members of the privileged protocol, and nothing of the embedded one besides."""

from vigil.assets.database import AssetDatabase
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedQueries, PrivilegedSimulator, SupportsRollback
from vigil.sim.protocol import Simulator

PROTOCOLS = (Simulator, PrivilegedQueries, SupportsRollback)


def members() -> set[str]:
    """Return the names of all that the privileged protocol asks for."""
    named = {name for protocol in PROTOCOLS for name in (*vars(protocol), *protocol.__annotations__)}
    return {name for name in named if not name.startswith("_")}


def with_protocol_only(simulator: PrivilegedSimulator) -> PrivilegedSimulator:
    """Return what answers as `simulator` does, through the members of the protocol alone."""
    made = type("AnotherBackend", (), {name: getattr(simulator, name) for name in members()})()
    assert isinstance(made, PrivilegedSimulator)
    return made


def make(assets: AssetDatabase, quality: str) -> PrivilegedSimulator:
    """Return such a backend over the engine for tests, as a `SimulatorFactory`."""
    del quality
    return with_protocol_only(make_simulator("fake", assets=assets))
