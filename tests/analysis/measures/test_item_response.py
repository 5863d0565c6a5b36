"""Item response: what was put into simulated plays is found again, and what plays do not tell is not made up."""

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from vigil.analysis.measures.item_response import (
    ABILITY_SD,
    DIFFICULTY_SD,
    Fit,
    SuccessTable,
    discriminations,
    fit,
    rank_correlation,
    rank_correlation_interval,
    without_group_means,
)
from vigil.errors import SettingError


def plays_by(chances: np.ndarray, seed: int, repeats: int = 1) -> SuccessTable:
    """Plays drawn with these chances of success, (agents, episodes)."""
    hits = np.random.default_rng(seed).binomial(repeats, chances).astype(float)
    agents, episodes = chances.shape
    names = tuple(f"a{n}" for n in range(agents)), tuple(f"e{n:04d}" for n in range(episodes))
    return SuccessTable(*names, hits, np.full_like(hits, repeats))


def simulated(agents: int, episodes: int, seed: int) -> tuple[Fit, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    ability, difficulty = rng.normal(0.5, 1.2, agents), rng.normal(0.0, 1.2, episodes)
    chances = 1 / (1 + np.exp(difficulty - ability[:, None]))
    return fit(plays_by(chances, seed)), ability, difficulty


def test_difficulties_and_abilities_are_recovered() -> None:
    found, ability, difficulty = simulated(30, 400, 1)
    assert np.corrcoef(found.difficulty, difficulty)[0, 1] > 0.92
    assert np.corrcoef(found.ability, ability)[0, 1] > 0.99
    assert np.polyfit(difficulty, found.difficulty, 1)[0] == pytest.approx(1.0, abs=0.12)


def test_standard_errors_are_what_they_say() -> None:
    """Of many simulated studies, the share of true values within 1.96 standard errors is near 95 %."""
    inside, errors = [], []
    for seed in range(8):
        found, _, difficulty = simulated(20, 200, seed)
        centred = difficulty - difficulty.mean() + found.difficulty.mean()
        inside.append(np.mean(np.abs(found.difficulty - centred) <= 1.96 * found.difficulty_se))
        errors.append(found.difficulty_se.mean())
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)
    assert 0.3 < np.mean(errors) < 0.8


def test_the_slope_vanishes_at_the_fit() -> None:
    found, _, _ = simulated(6, 40, 3)
    missed = found.plays.hits - found.plays.plays * found.probabilities
    assert missed.sum(axis=1) == pytest.approx(found.ability / ABILITY_SD**2, abs=1e-6)
    assert -missed.sum(axis=0) == pytest.approx(found.difficulty / DIFFICULTY_SD**2, abs=1e-6)


def test_what_all_or_none_solve_is_finite_with_large_errors() -> None:
    chances = np.tile([0.0, 0.5, 1.0], (4, 10))
    found = fit(plays_by(chances, 0))
    never, sometimes, always = (found.difficulty[n::3] for n in range(3))
    assert never.min() > sometimes.max() > always.max()
    assert np.isfinite(found.difficulty).all()
    assert found.difficulty_se[0::3].min() > found.difficulty_se[1::3].mean()


def test_an_episode_that_nobody_played_keeps_the_prior() -> None:
    plays = plays_by(np.full((3, 5), 0.5), 0)
    plays.plays[:, 2] = plays.hits[:, 2] = 0.0
    found = fit(plays)
    assert found.difficulty[2] == 0.0
    assert found.difficulty_se[2] == pytest.approx(DIFFICULTY_SD)


def test_repeats_count_as_so_many_plays() -> None:
    chances = np.full((4, 30), 0.4)
    once, often = (fit(plays_by(chances, 5, repeats)) for repeats in (1, 10))
    assert often.difficulty_se.mean() < once.difficulty_se.mean()


def test_nothing_played_is_refused() -> None:
    with pytest.raises(SettingError, match="do not have any scored episode"):
        fit(SuccessTable(("a",), ("e",), np.zeros((1, 1)), np.zeros((1, 1))))


def test_an_episode_that_the_abler_fail_is_told() -> None:
    rng = np.random.default_rng(2)
    ability = np.linspace(-2, 2, 12)
    chances = 1 / (1 + np.exp(rng.normal(0, 1, 60) - ability[:, None]))
    plays = plays_by(chances, 2)
    plays.hits[:, 7] = (ability < 0).astype(float)
    found = discriminations(fit(plays))
    assert np.nanargmin(found) == 7
    assert found[7] < -0.5
    assert np.isnan(discriminations(fit(plays_by(chances[:4], 2)))).all()


def test_ranks_agree_with_scipy() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 9, 50).astype(float), rng.normal(size=50)
    assert rank_correlation(a, b) == pytest.approx(spearmanr(a, b)[0])
    assert math.isnan(rank_correlation(a[:7], b[:7]))
    assert math.isnan(rank_correlation(np.ones(20), b[:20]))


def test_the_interval_of_a_correlation_knows_houses() -> None:
    rng = np.random.default_rng(0)
    house = np.repeat(np.arange(40), 3)
    a = rng.normal(size=40)[house]
    b = a + rng.normal(size=40)[house]
    low, high = rank_correlation_interval(a, b, house) or (0.0, 0.0)
    assert low < rank_correlation(a, b) < high
    own_low, own_high = rank_correlation_interval(a, b, np.arange(120)) or (0.0, 0.0)
    assert high - low > own_high - own_low
    assert rank_correlation_interval(a[:12], b[:12], house[:12]) is None


def test_group_means_are_taken_out() -> None:
    found = without_group_means(np.array([1.0, 3.0, 10.0, 20.0]), np.array(["a", "a", "b", "b"]))
    assert found.tolist() == [-1.0, 1.0, -5.0, 5.0]
