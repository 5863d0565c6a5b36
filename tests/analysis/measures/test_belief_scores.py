"""Measures of stated beliefs against their published formulas, written out over single beliefs."""

import numpy as np
import pytest

from vigil.analysis.measures.beliefs import scores

RNG = np.random.default_rng(5)
SURE = RNG.integers(0, 21, 400)
TRUE = RNG.random(400) < 0.2 + 0.5 * SURE / 20
Q = SURE / 20


def counts(sure: np.ndarray = SURE, true: np.ndarray = TRUE) -> np.ndarray:
    return scores.counts_of(sure, true).sum(axis=0)


def test_the_brier_score_is_the_mean_squared_error_and_the_sum_of_its_parts() -> None:
    assert scores.brier(counts()) == pytest.approx(np.mean((Q - TRUE) ** 2))
    parts = scores.reliability_term(counts()) - scores.resolution(counts()) + scores.uncertainty(counts())
    assert scores.brier(counts()) == pytest.approx(parts)
    assert scores.skill(counts()) == pytest.approx(1 - np.mean((Q - TRUE) ** 2) / (TRUE.mean() * (1 - TRUE.mean())))
    assert scores.overconfidence(counts()) == pytest.approx(Q.mean() - TRUE.mean())


def test_auroc_counts_pairs_with_ties_half() -> None:
    high, low = Q[TRUE][:, None], Q[~TRUE][None]
    assert scores.auroc(counts()) == pytest.approx(np.mean((high > low) + 0.5 * (high == low)))
    assert np.isnan(scores.auroc(counts(SURE, np.ones(400, dtype=bool))))
    assert scores.auroc(counts(np.array([3, 17]), np.array([False, True]))) == 1.0


def test_the_debiased_error_of_independent_beliefs_is_the_published_formula() -> None:
    rows = scores.counts_of(SURE, TRUE)
    found = scores.debiased_calibration_error(rows.sum(axis=0), scores.square_sums(rows).sum(axis=0))
    expected = 0.0
    for value in range(21):
        y = TRUE[value == SURE]
        mean = y.mean()
        expected += len(y) / len(SURE) * ((mean - value / 20) ** 2 - mean * (1 - mean) / (len(y) - 1))
    assert found == pytest.approx(expected)


def test_copies_in_a_house_do_not_make_an_error_more_certain() -> None:
    houses = np.repeat(np.arange(100), 4)
    sure, true = np.repeat(SURE[:100], 4), np.repeat(TRUE[:100], 4)
    rows = scores.counts_of(sure, true)
    by_house = np.stack([rows[houses == house].sum(axis=0) for house in range(100)])
    once = scores.counts_of(SURE[:100], TRUE[:100])
    found = scores.debiased_calibration_error(rows.sum(axis=0), scores.square_sums(by_house).sum(axis=0))
    single = scores.debiased_calibration_error(once.sum(axis=0), scores.square_sums(once).sum(axis=0))
    assert found == pytest.approx(single)


def area(sure: np.ndarray, true: np.ndarray, orders: int = 400) -> float:
    """Return the mean area under risk and coverage over random orders of ties."""
    wrong = np.where(sure == 10, 0.5, (sure > 10) != true)
    found = []
    for _ in range(orders):
        order = np.lexsort((RNG.random(len(sure)), -np.abs(sure - 10)))
        found.append(np.mean(np.cumsum(wrong[order]) / np.arange(1, len(sure) + 1)))
    return float(np.mean(found))


def test_risk_and_coverage_agree_with_beliefs_taken_one_by_one() -> None:
    sure, true = np.repeat(SURE, 20), np.repeat(TRUE, 20)
    risk = np.where(sure == 10, 0.5, (sure > 10) != true).mean()
    best = risk + (1 - risk) * np.log(1 - risk)
    expected = 1 - (area(sure, true, 20) - best) / (risk - best)
    assert scores.risk_coverage(counts(sure, true)) == pytest.approx(expected, abs=0.01)
    surest_right = counts(np.array([20, 20, 11, 11]), np.array([True, True, False, False]))
    assert scores.risk_coverage(surest_right) == pytest.approx(1.0)
    surest_wrong = counts(np.array([20, 20, 11, 11]), np.array([False, False, True, True]))
    assert scores.risk_coverage(surest_wrong) < 0
    assert scores.risk_coverage(counts(np.array([15] * 4), np.array([True, False] * 2))) == pytest.approx(0.0)


def test_many_resamples_are_measured_at_once() -> None:
    both = np.stack([counts(), counts(SURE[:50], TRUE[:50])])
    names = ("brier", "reliability_term", "resolution", "auroc", "risk_coverage", "overconfidence", "skill")
    for name in names:
        measure = getattr(scores, name)
        assert measure(both).tolist() == pytest.approx([float(measure(one)) for one in both])
