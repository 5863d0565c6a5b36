"""Fixtures of the renderer's tests."""

import pytest

from tests.support.cabinet_scene import make_scene
from vigil.scene.things import Scene
from vigil.sim.engines.mujoco.compiled.binding import BACKEND


@pytest.fixture
def scene() -> Scene:
    return make_scene()


@pytest.fixture
def drawing() -> None:
    """Skip a test if no OpenGL library is installed."""
    if BACKEND.fault:
        pytest.skip(BACKEND.fault)
