"""Every backend passes every conformance check, but for those of which the docs say why they cannot hold."""

import pytest
from thor_line import in_process

from vigil.assets.sizes import AssetDatabase
from vigil.sim import BACKENDS, make_simulator
from vigil.sim.conformance.checks import CHECKS, ConformanceCheck
from vigil.sim.conformance.trial import Trial
from vigil.sim.thor.differences import CANNOT_HOLD


@pytest.fixture(scope="module", params=sorted(BACKENDS))
def trial(request):
    """For `thor`, our engine in this process takes the place of AI2-THOR's client."""
    is_thor = request.param == "thor"
    simulator = (
        in_process() if is_thor else make_simulator(request.param, assets=AssetDatabase.default(), quality="fast")
    )
    yield Trial(simulator)
    simulator.close()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_backend_conforms(trial: Trial, check: ConformanceCheck):
    if trial.simulator.name.startswith("thor/") and check.__name__ in CANNOT_HOLD:
        with pytest.raises(AssertionError):
            check(trial)
        return
    check(trial)


def test_what_cannot_hold_is_a_check():
    assert set(CANNOT_HOLD) <= {check.__name__ for check in CHECKS}
