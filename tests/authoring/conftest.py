"""Houses, simulators and packs for authoring tests."""

import pytest

from vigil.assets.sizes import AssetDatabase
from vigil.authoring.solving.oracle import PrivilegedSimulator
from vigil.pack import Pack
from vigil.sim import make_simulator


@pytest.fixture(scope="session")
def simulator() -> PrivilegedSimulator:
    return make_simulator("mujoco", assets=AssetDatabase.default())


@pytest.fixture(scope="session")
def starter() -> Pack:
    return Pack.load("starter")
