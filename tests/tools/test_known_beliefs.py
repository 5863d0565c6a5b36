"""The analysis of beliefs recovers what agents with known beliefs were made to be."""

import numpy as np
import pytest

from tools.known_beliefs import AGENTS, KnownAgent, estimates, study_of, truths
from vigil.analysis.measures.beliefs.scores import counts_of, recalibrated
from vigil.analysis.measures.beliefs.study import BeliefStudy, Estimate
from vigil.scoring.rates import Interval, Rate

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


def test_recalibration_repairs_the_overconfident_and_not_the_blind(studies: dict[str, BeliefStudy]) -> None:
    found = {name: study.recalibration() for name, study in studies.items()}
    assert interval_of(found["overconfident"]["gain"])[0] > 0
    assert interval_of(found["overconfident"]["skill_after"])[0] > 0
    assert found["overconfident"]["error_after"].value < found["overconfident"]["error_before"].value / 2
    assert interval_of(found["blind"]["gain"])[0] > 0  # it never states the base rate
    assert interval_of(found["blind"]["skill_after"])[0] <= 0
    assert found["blind"]["skill_after"].value < 0.02
    assert abs(found["calibrated"]["gain"].value) < 0.01
    for name, study in studies.items():
        assert found[name]["brier_before"].value == pytest.approx(study.calibration()["brier"].value)


def test_no_house_recalibrates_itself() -> None:
    counts = counts_of(np.array([20, 20, 0, 0]), np.array([1.0, 1.0, 0.0, 0.0]))
    houses = np.array(["a", "b", "a", "b"])
    assert recalibrated(counts, houses) == pytest.approx([1, 1, 0, 0])
    turned = counts_of(np.array([20, 20, 0, 0]), np.array([0.0, 1.0, 1.0, 0.0]))
    assert recalibrated(turned, houses) == pytest.approx([1, 0.5, 0, 0.5])
    assert recalibrated(counts, np.array(["a"] * 4)) is None


def interval_of(estimate: Estimate) -> Interval:
    assert estimate.interval is not None
    return estimate.interval


def share(rate: Rate) -> float:
    assert rate.value is not None
    return rate.value


def delay_of(study: BeliefStudy) -> float:
    delay = study.delay()
    assert delay is not None
    return delay.restricted_mean.value


def test_what_the_agents_were_made_to_be_is_told_apart(studies: dict[str, BeliefStudy]) -> None:
    calibration = {name: study.calibration() for name, study in studies.items()}
    assert interval_of(calibration["overconfident"]["debiased_error"])[0] > 0
    low, high = interval_of(calibration["calibrated"]["debiased_error"])
    assert low < 0.002
    assert high < calibration["overconfident"]["debiased_error"].value
    assert abs(calibration["blind"]["auroc_near"].value - 0.5) < 0.08
    assert calibration["calibrated"]["auroc_near"].value > 0.7
    assert share(studies["forgetful"].lost()) > 0.3
    assert studies["doubting"].lost().hits == 0
    assert delay_of(studies["doubting"]) > 3 * delay_of(studies["forgetful"])
    shares = {name: study.parts for name, study in studies.items()}
    assert share(shares["forgetful"]["knew_and_did_not_say"]["NR"].rate) > 0.1
    assert shares["blind"]["no_answer"]["NR"].rate.hits > 0
    assert shares["calibrated"]["no_answer"]["NR"].rate.hits == 0
