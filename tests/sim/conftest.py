"""What the tests of simulators share."""

import pytest

from vigil.sim.engines.mujoco.compiled.binding import BACKEND


@pytest.fixture
def drawing() -> None:
    """Skips where no OpenGL library is installed."""
    if BACKEND.fault:
        pytest.skip(BACKEND.fault)
