"""Fixtures of a small scene in MuJoCo."""

from collections.abc import Iterator

import pytest

from tests.support.cabinet_scene import make_scene
from vigil.base.geometry import Pose, Vec3
from vigil.scene.things import Scene
from vigil.sim.engines.mujoco.engine import MujocoEngine


@pytest.fixture
def scene() -> Scene:
    return make_scene()


@pytest.fixture
def agent() -> Pose:
    return Pose(position=Vec3(0.0, 0.0, -1.5), rotation=0.0, horizon=20.0)


@pytest.fixture
def engine(scene: Scene) -> Iterator[MujocoEngine]:
    loaded = MujocoEngine("fast")
    loaded.load(scene)
    yield loaded
    loaded.close()
