"""Furniture with single drawers is drawn as it is with drawers that move as one, as long as they are shut."""

import numpy as np
import pytest

from vigil.assets.sizes import AssetDatabase
from vigil.pose import Pose, Vec3
from vigil.sim import make_simulator
from vigil.sim.conformance.trial import opened
from vigil.sim.conformance.trial_house import DRAWER, trial_house
from vigil.world import Setup

BEFORE = Pose(position=Vec3(8.0, 0.0, 1.4), rotation=180.0, horizon=35.0)
SEEN = 12
"""Of 255: what may differ by rounding."""


@pytest.fixture
def frames(drawing: None) -> dict[str, np.ndarray]:
    simulator = make_simulator("mujoco", assets=AssetDatabase.default())
    found = {}
    simulator.load(trial_house())
    simulator.reset(BEFORE, Setup())
    found["whole"] = simulator.frame()
    simulator.load(trial_house(has_single_drawers=True))
    for name, setup in (("shut", Setup()), ("open", opened(DRAWER)), ("shut again", Setup())):
        simulator.reset(BEFORE, setup)
        found[name] = simulator.frame()
    simulator.close()
    return found


def _differing(one: np.ndarray, two: np.ndarray) -> int:
    return int((np.abs(one.astype(int) - two.astype(int)).max(axis=2) > SEEN).sum())


def test_shut_one_sees_no_difference_gaps_included(frames: dict[str, np.ndarray]) -> None:
    assert _differing(frames["whole"], frames["shut"]) <= 20
    assert np.array_equal(frames["shut"], frames["shut again"])


def test_one_open_drawer_is_seen(frames: dict[str, np.ndarray]) -> None:
    assert _differing(frames["shut"], frames["open"]) > 2000
