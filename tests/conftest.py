"""Fixtures for every test."""

from pathlib import Path

import pytest

PROCTHOR = Path(__file__).parents[2] / "shared" / "procthor"


@pytest.fixture(scope="session")
def procthor() -> Path:
    """The folder of real ProcTHOR houses and databases; skips where it is not there."""
    if not PROCTHOR.is_dir():
        pytest.skip(f"no real houses at {PROCTHOR}")
    return PROCTHOR
