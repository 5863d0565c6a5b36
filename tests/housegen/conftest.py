"""Generated houses that the tests of this folder share."""

from functools import lru_cache

import pytest

from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House

SEEDS = {
    "kitchen": (0, 1, 2),
    "living-room": (0, 1),
    "bedroom": (0, 1),
    "bathroom": (0, 1),
    "2": (0, 1, 2),
    "4": (0, 1),
}


@lru_cache(maxsize=64)
def house_of(spec: str, seed: int) -> House:
    return generate(seed, spec_for(spec))


@pytest.fixture(
    scope="session",
    params=[(spec, seed) for spec, seeds in SEEDS.items() for seed in seeds],
    ids=lambda pair: f"{pair[0]}-{pair[1]}",
)
def house(request: pytest.FixtureRequest) -> House:
    return house_of(*request.param)


@pytest.fixture
def bedroom() -> House:
    return house_of("bedroom", 0)
