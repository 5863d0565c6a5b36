"""Fixtures for every test."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("vigil", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("vigil")

PROCTHOR = Path(__file__).parents[2] / "shared" / "procthor"


@pytest.fixture(scope="session")
def procthor() -> Path:
    """The folder of real ProcTHOR houses and databases; skips where it is not there."""
    if not PROCTHOR.is_dir():
        pytest.skip(f"no real houses at {PROCTHOR}")
    return PROCTHOR
