"""Our intervals and tests against those of statsmodels, where it has the same."""

from typing import Any

import numpy as np
import pytest
from statsmodels.stats.contingency_tables import SquareTable
from statsmodels.stats.contingency_tables import mcnemar as mcnemar_of_statsmodels
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint, samplesize_proportions_2indep_onetail

from tests.support.narrowing import present
from vigil.analysis.measures.intervals import holm, mcnemar, smallest_difference, stuart_maxwell
from vigil.scoring.rates import wilson

SEEDS = range(20)


@pytest.mark.parametrize("n", [1, 2, 7, 125, 1000])
def test_wilson(n: int) -> None:
    for hits in {0, 1, n // 3, n // 2, n - 1, n}:
        assert wilson(hits, n) == pytest.approx(proportion_confint(hits, n, method="wilson"), abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_mcnemar_of_runs_with_one_epoch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 400))
    first, second = rng.random(n) < rng.random(), rng.random(n) < rng.random()
    found = mcnemar(first, second, np.arange(n).astype(str))
    table = [[int((first & second).sum()), int((first & ~second).sum())]]
    table.append([int((~first & second).sum()), int((~first & ~second).sum())])
    expected: Any = mcnemar_of_statsmodels(table, exact=True)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("seed", SEEDS)
def test_stuart_maxwell_of_runs_with_one_epoch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, kinds = int(rng.integers(60, 400)), int(rng.integers(2, 6))
    first = rng.integers(0, kinds, n)
    second = np.where(rng.random(n) < 0.5, first, rng.choice(kinds, n, p=rng.dirichlet(np.full(kinds, 2.0))))
    found = stuart_maxwell(first.astype(str), second.astype(str), np.arange(n).astype(str))
    table = np.array([[int(((first == one) & (second == two)).sum()) for two in range(kinds)] for one in range(kinds)])
    expected: Any = SquareTable(table, shift_zeros=False).homogeneity(method="stuart_maxwell")
    assert found is not None
    assert (found.df, found.statistic) == (expected.df, pytest.approx(expected.statistic, rel=1e-9))
    assert found.p == pytest.approx(expected.pvalue, rel=1e-6, abs=1e-12)


def test_a_label_that_never_changes_costs_no_degree_of_freedom() -> None:
    first = np.array(["B"] * 30 + ["FR"] * 40 + ["NR"] * 30)
    second = np.array(["B"] * 30 + ["FR"] * 15 + ["NR"] * 30 + ["FR"] * 5 + ["NR"] * 20)
    found = stuart_maxwell(first, second, np.arange(100).astype(str))
    assert found is not None
    assert (found.df, found.statistic) == (1, pytest.approx((25 - 5) ** 2 / 30))


def test_playing_the_same_again_makes_labels_no_surer() -> None:
    first, second = np.array(["FR"] * 30 + ["NR"] * 10), np.array(["NR"] * 20 + ["FR"] * 20)
    once = stuart_maxwell(first, second, np.arange(40).astype(str))
    again = stuart_maxwell(np.tile(first, 3), np.tile(second, 3), np.tile(np.arange(40).astype(str), 3))
    assert once is not None
    assert again is not None
    assert (again.df, again.p) == (once.df, pytest.approx(once.p))
    assert stuart_maxwell(first, first, np.arange(40).astype(str)) is None


@pytest.mark.parametrize("seed", SEEDS)
def test_holm(seed: int) -> None:
    p_values = (np.random.default_rng(seed).random(seed % 9 + 1) ** 3).tolist()
    assert holm(p_values) == pytest.approx(present(multipletests(p_values, method="holm")[1]).tolist(), abs=1e-15)


@pytest.mark.parametrize("n", [1000, 10000])
def test_the_smallest_difference_needs_so_many_trials(n: int) -> None:
    """Ours takes the variance of the common rate for both, which is theirs for small differences."""
    difference = smallest_difference(n)
    assert difference is not None
    needed = samplesize_proportions_2indep_onetail(difference, 0.5, 0.8, alpha=0.025, alternative="larger")
    assert needed == pytest.approx(n, rel=0.01)
