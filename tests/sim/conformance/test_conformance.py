"""Every backend passes every conformance check."""

import pytest

from vigil.assets.sizes import AssetDatabase
from vigil.sim import BACKENDS, make_simulator
from vigil.sim.conformance.checks import CHECKS, ConformanceCheck
from vigil.sim.conformance.trial import Trial


@pytest.fixture(scope="module", params=sorted(BACKENDS))
def trial(request):
    simulator = make_simulator(request.param, assets=AssetDatabase.default(), quality="fast")
    yield Trial(simulator)
    simulator.close()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_backend_conforms(trial: Trial, check: ConformanceCheck):
    check(trial)
