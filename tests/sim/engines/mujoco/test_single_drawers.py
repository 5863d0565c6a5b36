"""Drawers that open one by one, drawn."""

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.world import Setup
from vigil.sim import make_simulator
from vigil.sim.conformance.harness import opened
from vigil.sim.conformance.reference_house import DRAWER, reference_house

BEFORE = Pose(position=Vec3(8.0, 0.0, 1.4), rotation=180.0, horizon=35.0)
SEEN = 12
"""Of 255: what may differ by rounding."""


@pytest.fixture
def frames(drawing: None) -> dict[str, np.ndarray]:
    simulator = make_simulator("mujoco", assets=AssetDatabase.default())
    found = {}
    simulator.load(reference_house())
    for name, setup in (("shut", Setup()), ("open", opened(DRAWER)), ("shut again", Setup())):
        simulator.reset(BEFORE, setup)
        found[name] = simulator.frame()
    simulator.close()
    return found


def _differing(one: np.ndarray, two: np.ndarray) -> int:
    return int((np.abs(one.astype(int) - two.astype(int)).max(axis=2) > SEEN).sum())


def test_a_drawer_that_was_shut_again_leaves_nothing_behind(frames: dict[str, np.ndarray]) -> None:
    assert np.array_equal(frames["shut"], frames["shut again"])


def test_one_open_drawer_is_seen(frames: dict[str, np.ndarray]) -> None:
    assert _differing(frames["shut"], frames["open"]) > 2000
