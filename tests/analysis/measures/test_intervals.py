"""Intervals and tests: they contain what they should, are symmetric, and reproduce known values."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.narrowing import present
from vigil.analysis.measures.intervals import (
    clustered_interval,
    clustered_mean_intervals,
    clustered_ratio_intervals,
    holm,
    mcnemar,
    paired_difference,
    smallest_difference,
    smallest_paired_difference,
)
from vigil.scoring.rates import Rate

BOOLS = st.lists(st.booleans(), min_size=1, max_size=60)


@given(st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_contains_the_rate(hits_n: tuple[int, int]):
    rate = Rate(*hits_n, hits_n[1])
    assert rate.interval is not None
    low, high = rate.interval
    assert 0.0 <= low <= (rate.value or 0.0) <= high <= 1.0


def test_a_rate_over_nothing_has_no_value():
    assert Rate(0, 0, 0).value is None
    assert Rate(0, 0, 0).interval is None


def test_a_ratio_is_the_mean_of_its_units():
    sizes = np.array([1, 3, 2, 5, 1, 4, 2])
    hits = np.array([1, 1, 0, 4, 1, 0, 2])
    houses = np.array(list("abcdefg"))
    units = np.concatenate([np.arange(size) < hit for size, hit in zip(sizes, hits, strict=True)]).reshape(-1, 1)
    found = clustered_ratio_intervals(hits.reshape(-1, 1), sizes, houses)
    assert found is not None
    assert found == clustered_mean_intervals(units, np.repeat(houses, sizes))
    assert found[0] is not None
    assert found[0][0] < hits.sum() / sizes.sum() < found[0][1]


def test_wilson_reproduces_a_known_interval():
    assert Rate(564, 1000, 1000).interval == pytest.approx((0.5331, 0.5944), abs=1e-4)


@given(BOOLS, st.integers(0, 10**6))
def test_clustered_contains_the_mean_in_any_order(values: list[bool], seed: int):
    found = np.array(values, dtype=float)
    houses = np.array([f"house_{index % 7}" for index in range(len(found))])
    interval = clustered_interval(found, houses)
    shuffled = np.random.default_rng(seed).permutation(len(found))
    assert clustered_interval(found[shuffled], houses[shuffled]) == interval
    if interval is not None:
        assert interval[0] <= found.mean() <= interval[1]


def test_clusters_widen_the_interval():
    rng = np.random.default_rng(1)
    houses = np.repeat([f"h{index}" for index in range(40)], 25)
    values = np.repeat(rng.random(40) < 0.5, 25).astype(float)
    alone = np.array([f"e{index}" for index in range(1000)])
    (low, high), (inner_low, inner_high) = clustered_interval(values, houses), clustered_interval(values, alone)  # type: ignore[misc]
    assert high - low > 3 * (inner_high - inner_low)


def test_few_houses_or_no_variation_say_nothing():
    assert clustered_interval(np.array([1.0, 0.0, 1.0, 0.0]), np.array(["a", "b", "c", "d"])) is None
    assert clustered_interval(np.ones(10), np.array([f"h{index}" for index in range(10)])) is None


@pytest.mark.parametrize("houses", [5, 8, 20])
def test_clustered_intervals_of_few_houses_hold_the_truth(houses: int):
    rng = np.random.default_rng(5)
    names = np.repeat([f"h{index}" for index in range(houses)], 12)
    held = 0
    for _ in range(300):
        chances = np.repeat(np.clip(0.4 + 0.15 * rng.standard_normal(houses), 0, 1), 12)
        interval = clustered_interval((rng.random(12 * houses) < chances).astype(float), names)
        held += interval is not None and interval[0] <= 0.4 <= interval[1]
    assert held / 300 >= 0.92


def test_mcnemar_is_the_exact_binomial_test():
    first = np.array([True] * 10 + [False] * 5 + [True] * 20)
    second = np.array([False] * 10 + [False] * 4 + [True] * 21)
    found = mcnemar(first, second, np.arange(35))
    assert (found.only_first, found.only_second) == (10, 1)
    assert found.p == pytest.approx(2 * sum(math.comb(11, k) for k in range(2)) / 2**11)
    assert found.difference == pytest.approx(-9 / 35)


def test_playing_the_same_again_proves_nothing_more():
    first = np.array([True] * 10 + [False] * 25)
    second = np.array([False] * 9 + [True] * 26)
    once, thrice = (
        mcnemar(first, second, np.arange(35)),
        mcnemar(*(np.tile(a, 3) for a in (first, second, np.arange(35)))),
    )
    assert (thrice.only_first, thrice.only_second) == (once.only_first, once.only_second)
    assert thrice.difference == pytest.approx(once.difference)
    assert thrice.p == pytest.approx(once.p)


def test_the_test_and_the_difference_say_the_same_of_repeated_plays():
    """Twelve episodes gain one play of five, three lose all five: the difference is small and to the worse."""
    episodes = np.repeat(np.arange(60), 5)
    first = np.repeat(np.arange(60) >= 57, 5)
    second = (np.arange(300) % 5 == 0) & (episodes < 12)
    found = mcnemar(first, second, episodes)
    assert found.difference == pytest.approx(-0.01)
    gains = [1] * 12 + [5] * 3
    sums = np.zeros(1)
    for gain in gains:
        sums = np.concatenate([sums - gain, sums + gain])
    assert found.p == pytest.approx(float((np.abs(sums) >= 3).mean()))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=50))
def test_pairing_is_symmetric(pairs: list[tuple[bool, bool]]):
    first, second = (np.array([pair[side] for pair in pairs]) for side in (0, 1))
    episodes = np.arange(len(pairs)) // 2
    forth, back = mcnemar(first, second, episodes), mcnemar(second, first, episodes)
    assert forth.p == pytest.approx(back.p)
    assert forth.difference == pytest.approx(-(back.difference or 0.0))
    houses = np.array([f"h{index % 9}" for index in range(len(pairs))])
    (value, interval), (negative, mirrored) = (
        paired_difference(first, second, houses),
        paired_difference(second, first, houses),
    )
    assert value == pytest.approx(-negative)
    if interval is not None and mirrored is not None:
        assert interval == pytest.approx((-mirrored[1], -mirrored[0]))


def test_holm():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([]) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_holm_never_lowers_a_p_value(values: list[float]):
    assert all(value <= found <= 1.0 for value, found in zip(values, holm(values), strict=True))


def test_the_smallest_difference_is_found_about_four_times_of_five():
    n = 400
    difference = present(smallest_difference(n, 0.3))
    assert difference == pytest.approx(2.8016 * math.sqrt(2 * 0.21 / n), abs=1e-4)
    rng = np.random.default_rng(3)
    first, second = rng.binomial(n, 0.3 - difference / 2, 4000) / n, rng.binomial(n, 0.3 + difference / 2, 4000) / n
    spread = np.sqrt((first * (1 - first) + second * (1 - second)) / n)
    assert np.mean(np.abs(second - first) / spread > 1.96) == pytest.approx(0.80, abs=0.03)


def test_paired_power_needs_discordant_episodes():
    assert smallest_difference(0) is None
    assert smallest_paired_difference(1000, 0.0) is None
    assert smallest_paired_difference(10, 0.01) is None
    found = smallest_paired_difference(1000, 0.1)
    assert found is not None
    assert 0.025 < found < 0.03
    assert found < smallest_difference(1000, 0.5)  # type: ignore[operator]
