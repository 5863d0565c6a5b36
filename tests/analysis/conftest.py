"""A small pack of two episodes a family, and runs of a model on it."""

import pytest

from tests.support.small_runs import small_pack, write

__all__ = ["small_pack", "usual_agent", "write"]


@pytest.fixture(scope="session")
def usual_agent() -> str:
    """Who played a run that names nobody."""
    return "vllm/model"
