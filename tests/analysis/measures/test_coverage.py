"""Intervals cover what they should in simulated runs; docs/intervals.md has the numbers of longer simulations."""

from functools import cache

import numpy as np
import pytest

from benchmarks.coverage import PROFILES, World, coverage
from vigil.analysis.measures.calibration import disattenuated, reliability
from vigil.analysis.measures.intervals import MIN_CLUSTERS, mean_of_rates_interval, rate_interval_by_houses
from vigil.scoring.rates import wilson

RUNS = 200
LEAST = 0.90
"""Share that an interval with 95 % falls below in one of two thousand simulations of this size."""
WORLDS = (World(8, 7, 0.1), World(80, 24, 0.2), World(240, 12, 0.2))


@cache
def simulated(world: World) -> dict[str, tuple[float | None, float | None]]:
    return coverage(world, RUNS, np.array(PROFILES["Families alike"]), np.random.default_rng(5))


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("kind", ["one rate: by houses", "mean of families", "own minus published"])
def test_an_interval_by_houses_covers(world: World, kind: str) -> None:
    share, _ = simulated(world)[kind]
    assert share is not None
    assert share >= LEAST


@pytest.mark.parametrize("kind", ["one rate: Wilson", "mean of families: MOVER (former)"])
def test_an_interval_without_houses_does_not(kind: str) -> None:
    share, _ = simulated(World(240, 12, 0.2))[kind]
    assert share is not None
    assert share < LEAST


def test_one_episode_in_a_house_needs_only_students_t() -> None:
    hits, houses = np.arange(400) < 100, np.arange(400)
    found = rate_interval_by_houses(hits, np.ones(400), houses)
    assert found == pytest.approx(wilson(100, 400), abs=0.002)
    assert rate_interval_by_houses(hits, np.ones(400), houses % (MIN_CLUSTERS - 1)) is None


def test_plays_that_agree_within_houses_count_as_one() -> None:
    houses = np.repeat(np.arange(40), 10)
    same, mixed = houses < 20, np.arange(400) % 2 == 0
    wide, narrow = (rate_interval_by_houses(hits, np.ones(400), houses) for hits in (same, mixed))
    assert wide is not None
    assert narrow is not None
    assert wide[1] - wide[0] > 2 * (narrow[1] - narrow[0])


def test_only_trials_count() -> None:
    houses = np.arange(300) % 30
    trials = houses < 20
    found = rate_interval_by_houses(trials & (np.arange(300) % 3 == 0), trials, houses)
    assert found == rate_interval_by_houses((np.arange(300) % 3 == 0)[trials], np.ones(200), houses[trials])


def test_the_mean_of_families_weighs_them_alike() -> None:
    families = np.array(["AI"] * 100 + ["CR"] * 4)
    low, high = mean_of_rates_interval(families == "AI", families, np.arange(104))
    assert low < 0.5 < high


def test_uncertain_difficulties_widen_away_from_zero() -> None:
    known = reliability(np.array([-1.0, 1.0]), np.array([1.0, 1.0]))
    assert known == 0.5
    assert disattenuated((0.2, 0.4), known) == pytest.approx((0.2, 0.4 * 2**0.5))
    assert disattenuated((-0.9, 0.3), known) == pytest.approx((-1.0, 0.3 * 2**0.5))
