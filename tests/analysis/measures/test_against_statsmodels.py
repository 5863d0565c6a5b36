"""Our intervals and tests against those of statsmodels, where it has the same."""

import numpy as np
import pytest
from statsmodels.stats.contingency_tables import mcnemar as mcnemar_of_statsmodels
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint, samplesize_proportions_2indep_onetail

from vigil.analysis.measures.intervals import holm, mcnemar, smallest_difference
from vigil.rates import wilson

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
    assert found.p == pytest.approx(mcnemar_of_statsmodels(table, exact=True).pvalue, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("seed", SEEDS)
def test_holm(seed: int) -> None:
    p_values = (np.random.default_rng(seed).random(seed % 9 + 1) ** 3).tolist()
    assert holm(p_values) == pytest.approx(multipletests(p_values, method="holm")[1].tolist(), abs=1e-15)


@pytest.mark.parametrize("n", [1000, 10000])
def test_the_smallest_difference_needs_so_many_trials(n: int) -> None:
    """Ours takes the variance of the common rate for both, which is theirs for small differences."""
    difference = smallest_difference(n)
    assert difference is not None
    needed = samplesize_proportions_2indep_onetail(difference, 0.5, 0.8, alpha=0.025, alternative="larger")
    assert needed == pytest.approx(n, rel=0.01)
