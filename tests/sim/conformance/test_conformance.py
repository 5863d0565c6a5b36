"""Every backend passes every conformance check, but for those of which the docs say why they cannot hold."""

import pytest

from tests.support.thor_client import in_process
from vigil.assets.database import AssetDatabase
from vigil.sim import BACKENDS, make_simulator
from vigil.sim.conformance.checks import CHECKS, ConformanceCheck
from vigil.sim.conformance.harness import Harness
from vigil.sim.thor.differences import EXPECTED_FAILURES


@pytest.fixture(scope="module", params=sorted(BACKENDS))
def harness(request):
    """For `thor`, our engine in this process takes the place of AI2-THOR's client."""
    is_thor = request.param == "thor"
    simulator = (
        in_process() if is_thor else make_simulator(request.param, assets=AssetDatabase.default(), quality="fast")
    )
    yield Harness(simulator)
    simulator.close()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_backend_conforms(harness: Harness, check: ConformanceCheck):
    if harness.simulator.name.startswith("thor/") and check.__name__ in EXPECTED_FAILURES:
        with pytest.raises(AssertionError):
            check(harness)
        return
    check(harness)


def test_what_cannot_hold_is_a_check():
    assert set(EXPECTED_FAILURES) <= {check.__name__ for check in CHECKS}
