"""Houses, simulators and packs for authoring tests."""

import pytest

from vigil.assets.database import AssetDatabase
from vigil.packs.pack import Pack
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="session")
def simulator() -> PrivilegedSimulator:
    return make_simulator("mujoco", assets=AssetDatabase.default())


@pytest.fixture(scope="session")
def starter() -> Pack:
    return Pack.load("starter")
