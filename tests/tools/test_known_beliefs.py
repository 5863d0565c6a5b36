"""The analysis of beliefs recovers what agents with known beliefs were made to be."""

import numpy as np
import pytest

from tools.known_beliefs import AGENTS, KnownAgent, estimates, study_of, truths
from vigil.analysis.measures.beliefs.study import BeliefStudy

PLAYS = 200


@pytest.fixture(scope="module")
def studies() -> dict[str, BeliefStudy]:
    return {agent.name: study_of(agent, PLAYS, np.random.default_rng(3)) for agent in AGENTS}


@pytest.mark.parametrize("agent", AGENTS, ids=lambda agent: agent.name)
def test_an_agent_is_recovered(agent: KnownAgent, studies: dict[str, BeliefStudy]) -> None:
    study, known = studies[agent.name], truths(agent)
    found = {name: each for name, each in estimates(study).items() if name in known}
    assert found.keys() == known.keys()
    assert study.broken_identities == []
    inside = [
        low <= known[name] <= high for name, (_, interval) in found.items() if interval for low, high in [interval]
    ]
    assert len(inside) >= 15
    assert sum(inside) >= len(inside) - 3  # of about 20 intervals, one is expected to miss
    for name, (value, _) in found.items():
        assert value == pytest.approx(known[name], abs=0.3 if name == "restricted_mean" else 0.12), name


def test_what_the_agents_were_made_to_be_is_told_apart(studies: dict[str, BeliefStudy]) -> None:
    calibration = {name: study.calibration() for name, study in studies.items()}
    assert calibration["overconfident"]["debiased_error"].interval[0] > 0
    low, high = calibration["calibrated"]["debiased_error"].interval
    assert low < 0.002
    assert high < calibration["overconfident"]["debiased_error"].value
    assert abs(calibration["blind"]["auroc_near"].value - 0.5) < 0.08
    assert calibration["calibrated"]["auroc_near"].value > 0.7
    assert studies["forgetful"].lost().value > 0.3
    assert studies["doubting"].lost().hits == 0
    assert studies["doubting"].delay().restricted_mean.value > 3 * studies["forgetful"].delay().restricted_mean.value
    shares = {name: study.parts for name, study in studies.items()}
    assert shares["forgetful"]["knew_and_did_not_say"]["NR"].rate.value > 0.1
    assert shares["blind"]["no_answer"]["NR"].rate.hits > 0
    assert shares["calibrated"]["no_answer"]["NR"].rate.hits == 0
