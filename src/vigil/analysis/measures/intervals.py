"""Intervals and tests: the uncertainty of an estimate, or of a difference between two runs.

Single rates have Wilson's interval (`vigil.scoring.rates`). This module has the other methods. A bootstrap that
resamples houses is for episodes that share houses. McNemar's exact test, the Stuart-Maxwell test and a paired bootstrap
over houses compare two runs on the same episodes. The module also computes the smallest difference that n episodes can
show. Each resampling has a fixed seed and sorts the houses, so the same rows in any order give the same interval.
"""

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vigil.scoring.rates import PRIOR_HITS, Interval, wilson

if TYPE_CHECKING:
    import pandas as pd

RESAMPLES = 2000
SEED = 20260101
CONFIDENCE = 0.95
POWER = 0.80
MIN_CLUSTERS = 5
"""Smallest number of houses for a bootstrap that resamples houses."""
PRIOR_CORRELATION = 0.1
"""Assumed correlation of two plays in one house, for data with too few plays to estimate it."""
SHRINKAGE = 2.0
"""Number of imaginary plays that are added to each group to shrink its rate; they have the mean rate of all groups."""
RateWithEnds = tuple[float, float, float]
"""A rate and the ends of its interval."""
_NO_VARIANCE = 1e-9
"""A variance below this share of the largest variance counts as 0: only rounding made it positive. Some variances are 0
because the labels add up to 1, or because a label never changes."""


@dataclass(frozen=True, slots=True)
class McNemar:
    """McNemar's exact test of two paired yes/no outcomes. Before the test, the differences of all plays of an
    episode are summed."""

    only_first: int
    """Number of episodes in which the first column has the outcome more often than the second."""
    only_second: int
    difference: float | None
    """Rate of the second column minus rate of the first, over all plays."""
    p: float


@dataclass(frozen=True, slots=True)
class PairedTest:
    """Test of the difference between two runs in a yes/no fact about the same plays."""

    difference: float
    """Rate of the second run minus rate of the first; NaN without plays."""
    interval: Interval | None
    """Interval from resampled houses; None with fewer than five houses, or if all houses have the same difference."""
    test: McNemar


@dataclass(frozen=True, slots=True)
class Homogeneity:
    """Test of whether each label is equally frequent in two paired columns."""

    statistic: float
    """Test statistic. Under the null hypothesis, it has a chi-square distribution with `df` degrees of freedom."""
    df: int
    p: float


def clustered_interval(values: np.ndarray, houses: np.ndarray) -> Interval | None:
    """Return the 95 % interval of the mean of `values` from resampled houses.

    Return None with fewer than five houses, or if all houses have the same mean: every resample then gives the same
    value.
    """
    intervals = clustered_mean_intervals(values.reshape(-1, 1), houses)
    return None if intervals is None else intervals[0]


def clustered_mean_intervals(values: np.ndarray, houses: np.ndarray) -> list[Interval | None] | None:
    """Return the interval of the mean of each column of `values`, (n, columns); None as for `clustered_interval`."""
    return clustered_ratio_intervals(values, np.ones(len(values)), houses)


def clustered_ratio_intervals(
    values: np.ndarray, sizes: np.ndarray, houses: np.ndarray
) -> list[Interval | None] | None:
    """Return, for each column of `values`, the interval of its sum divided by the sum of `sizes` (> 0); None as for
    `clustered_interval`."""
    resampling = HouseResampling.of(houses)
    if resampling is None:
        return None
    means = resampling.sums(values.astype(float)) / resampling.sums(sizes)[:, None]
    centre = values.sum(axis=0) / sizes.sum()
    return [resampling.interval(draws, at) for draws, at in zip(means.T, centre, strict=True)]


@dataclass(frozen=True, eq=False)
class HouseResampling:
    """Resamples of houses, for the interval of any statistic that is computed from sums over rows."""

    index: np.ndarray
    """(n,) number of each row's house."""
    houses: int

    @classmethod
    def of(cls, houses: np.ndarray) -> "HouseResampling | None":
        """Return the resamples of the houses of rows; None with fewer than five houses."""
        names, index = np.unique(houses.astype(str), return_inverse=True)
        return cls(index, len(names)) if len(names) >= MIN_CLUSTERS else None

    def house_sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of `values`, (n, ...), over the rows of each house, (houses, ...)."""
        flat = values.reshape(len(values), -1).astype(float)
        sums = [np.bincount(self.index, weights=column, minlength=self.houses) for column in flat.T]
        return np.stack(sums, axis=1).reshape(self.houses, *values.shape[1:])

    def resampled(self, house_sums: np.ndarray) -> np.ndarray:
        """Return the sum of `house_sums`, (houses, ...), over the houses in each resample, (RESAMPLES, ...)."""
        return np.tensordot(resampling_counts(self.houses), house_sums, axes=1)

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of `values`, (n, ...), over each resample, (RESAMPLES, ...)."""
        return self.resampled(self.house_sums(values))

    def interval(self, draws: np.ndarray, centre: float) -> Interval | None:
        """Return the interval of a statistic from its values in the resamples; None if they are all equal.

        Resamples where the statistic is not defined (NaN) are left out. `centre` is the statistic's value in the rows.
        """
        tail, known = tail_share(self.houses), draws[np.isfinite(draws)]
        if not len(known):
            return None
        low, high = np.quantile(known, [tail, 1 - tail])
        return (float(min(low, centre)), float(max(high, centre))) if high > low else None


@cache
def _normal_quantiles() -> tuple[float, float]:
    """Return the quantiles of the standard normal distribution for the significance level and for the power."""
    from scipy.special import ndtri  # noqa: PLC0415

    return float(ndtri(1 - (1 - CONFIDENCE) / 2)), float(ndtri(POWER))


def tail_share(clusters: int) -> float:
    """Return the tail share to cut off at either end: smaller for few clusters, whose resampled means vary too little.

    Source: Hesterberg, "What teachers should know about the bootstrap", 2015 (the expanded percentile interval).
    """
    from scipy.special import ndtr, stdtrit  # noqa: PLC0415

    reach = math.sqrt(clusters / (clusters - 1)) * float(stdtrit(clusters - 1, 1 - (1 - CONFIDENCE) / 2))
    return float(ndtr(-reach))


@lru_cache(maxsize=16)
def resampling_counts(clusters: int) -> np.ndarray:
    """Return how often each cluster is drawn in each resample, (RESAMPLES, clusters)."""
    return np.random.default_rng(SEED).multinomial(clusters, np.full(clusters, 1 / clusters), size=RESAMPLES)


def mcnemar(first: np.ndarray, second: np.ndarray, episodes: np.ndarray) -> McNemar:
    """Return McNemar's exact test of two boolean columns over the same plays; `episodes` names each play's episode.

    The differences of an episode's plays are added up. Under the null hypothesis, the sign of each sum is random.
    """
    _, index = np.unique(episodes, return_inverse=True)
    gains = np.bincount(index, weights=second.astype(float) - first.astype(float)).astype(int)
    difference = float(gains.sum()) / len(first) if len(first) else None
    return McNemar(int((gains < 0).sum()), int((gains > 0).sum()), difference, _sign_flip_p(gains))


def _sign_flip_p(gains: np.ndarray) -> float:
    """Return the two-sided p-value of the sum of gains, if the sign of each gain were random."""
    sizes, counts = np.unique(np.abs(gains[gains != 0]), return_counts=True)
    likely = np.ones(1)
    for size, count in zip(sizes.tolist(), counts.tolist(), strict=True):
        signs = np.zeros(2 * size * count + 1)
        signs[:: 2 * size] = [math.comb(count, k) / 2**count for k in range(count + 1)]
        likely = np.convolve(likely, signs)
    reach = len(likely) // 2
    is_as_far = np.abs(np.arange(-reach, reach + 1)) >= abs(int(gains.sum()))
    return min(1.0, float(likely[is_as_far].sum()))


def stuart_maxwell(first: np.ndarray, second: np.ndarray, episodes: np.ndarray) -> Homogeneity | None:
    """Return the Stuart-Maxwell test of two columns of labels over the same plays; None if no label changed.

    If an episode was played repeatedly, its plays' changes are added up, as in `mcnemar`. The p-value is approximate
    and needs about ten changes or more. Source: Maxwell, "Comparing the classification of subjects by two independent
    judges", 1970.
    """
    labels = np.unique(np.concatenate([first, second]))
    changes = (second[:, None] == labels).astype(float) - (first[:, None] == labels)
    _, index = np.unique(episodes, return_inverse=True)
    gains = np.stack([np.bincount(index, weights=column) for column in changes.T], axis=1)
    if not gains.any():
        return None
    from scipy.special import chdtrc  # noqa: PLC0415

    variances, axes = np.linalg.eigh(gains.T @ gains)
    is_free = variances > _NO_VARIANCE * variances[-1]
    statistic = float(np.sum((gains.sum(axis=0) @ axes[:, is_free]) ** 2 / variances[is_free]))
    df = int(is_free.sum())
    return Homogeneity(statistic, df, float(chdtrc(df, statistic)))


def paired_difference(first: np.ndarray, second: np.ndarray, houses: np.ndarray) -> tuple[float, Interval | None]:
    """Return mean(second - first) with its 95 % interval, from a paired bootstrap that resamples houses."""
    difference = second.astype(float) - first.astype(float)
    return float(difference.mean()) if len(difference) else math.nan, clustered_interval(difference, houses)


def paired_test(first: np.ndarray, second: np.ndarray, *, episodes: np.ndarray, houses: np.ndarray) -> PairedTest:
    """Return the difference of two boolean columns over the same plays, with its interval and McNemar's test."""
    return PairedTest(*paired_difference(first, second, houses), mcnemar(first, second, episodes))


def holm(p_values: list[float]) -> list[float]:
    """Return p-values adjusted for multiple tests by Holm's method, in the same order."""
    adjusted = [0.0] * len(p_values)
    running = 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        running = max(running, min(1.0, p_values[index] * (len(p_values) - rank)))
        adjusted[index] = running
    return adjusted


def smallest_difference(n: float, rate: float = 0.5) -> float | None:
    """Return the smallest difference between two rates near `rate` that can be detected with n trials of each.

    The two sets of trials are independent. The significance level is 5 %, the power 80 %. None without trials.
    """
    if not n:
        return None
    return min(1.0, sum(_normal_quantiles()) * math.sqrt(2 * rate * (1 - rate) / n))


def smallest_paired_difference(n: int, discordant: float) -> float | None:
    """Return the smallest difference between two runs that can be detected with n shared episodes.

    `discordant` is the share of episodes on which the runs differ. The significance level is 5 %, the power 80 %
    (Connor's formula for McNemar's test). None if no difference can be detected.
    """
    if not n or not 0 < discordant <= 1:
        return None
    level, power = _normal_quantiles()
    difference = (level + power) * math.sqrt(discordant / n)
    for _ in range(50):
        spread = max(0.0, discordant - difference**2)
        difference = (level * math.sqrt(discordant) + power * math.sqrt(spread)) / math.sqrt(n)
    return difference if difference <= discordant else None


def houses_of(rows: "pd.DataFrame") -> np.ndarray:
    """Return the house of each row; the rows of one house are a cluster."""
    return rows["house"].to_numpy(dtype=str)


def rate_interval_by_houses(hits: np.ndarray, trials: np.ndarray, houses: np.ndarray) -> Interval | None:
    """Return the 95 % interval of sum(hits) / sum(trials), which accounts for the similarity of plays in one house.

    The interval is Wilson's, for the number of independent plays that would give as much information, with Student's t
    in place of the normal quantile. The arrays have one entry for each play; `trials` is 1 where the play counts,
    `hits` 1 where it also is a hit. None with fewer than five houses. Source: Dean and Pagano, "Evaluating confidence
    interval methods for binomial proportions in clustered surveys", 2015.
    """
    is_trial = trials > 0
    found, n = hits[is_trial].astype(float), int(is_trial.sum())
    _, index = np.unique(houses[is_trial].astype(str), return_inverse=True)
    if n == 0 or index.max() + 1 < MIN_CLUSTERS:
        return None
    rate = float(found.mean())
    spreads = np.full(n, math.sqrt(rate * (1 - rate)))
    design = _design_effect(found - rate, spreads, index, min(found.sum(), n - found.sum()))
    effective = n / design * _quantile_ratio(int(index.max()) + 1)
    return wilson(effective * rate, effective)


def mean_of_rates_interval(hits: np.ndarray, groups: np.ndarray, houses: np.ndarray) -> Interval:
    """Return the 95 % interval of the unweighted mean of the groups' rates; the arrays have one entry for each play.

    The interval is Wilson's, for the number of independent plays that would give as much information; this number
    follows from the groups' variances. Each group's rate is shrunk to the mean of all rates (`SHRINKAGE`), so that a
    group with one play has a variance. With five houses or more, the interval accounts for the similarity of plays in
    one house.
    """
    _, group = np.unique(groups.astype(str), return_inverse=True)
    found, sizes = hits.astype(float), np.bincount(group)
    rates = np.bincount(group, weights=found) / sizes
    centre = float(rates.mean())
    shrunk = (sizes * rates + SHRINKAGE * centre) / (sizes + SHRINKAGE)
    weights = 1 / (len(sizes) * sizes)
    middle = float(shrunk.mean())
    variance = float(np.sum(shrunk * (1 - shrunk) * sizes * weights**2))
    effective = middle * (1 - middle) / variance if variance else 1 / float(np.sum(sizes * weights**2))
    _, index = np.unique(houses.astype(str), return_inverse=True)
    if index.max() + 1 >= MIN_CLUSTERS:
        of_play = weights[group]
        spreads = of_play * np.sqrt(shrunk * (1 - shrunk))[group]
        rare = min(found.sum(), len(found) - found.sum())
        effective *= _quantile_ratio(int(index.max()) + 1)
        effective /= _design_effect(of_play * (found - shrunk[group]), spreads, index, rare)
    return wilson(effective * centre, effective)


def _design_effect(misses: np.ndarray, spreads: np.ndarray, index: np.ndarray, rare: float) -> float:
    """Return the factor (at least 1) by which the similarity of plays in one house raises the variance of a weighted
    sum.

    `misses` are the plays' differences from their expected values, `spreads` the standard deviations, `index` the
    houses. The correlation of two plays in one house is estimated from the products of their differences. It is shrunk
    towards `PRIOR_CORRELATION` if `rare`, the number of hits or of misses, is small.
    """
    clusters = int(index.max()) + 1
    alone = float(np.sum(spreads**2))
    together = float(np.sum(np.bincount(index, weights=spreads) ** 2))
    if together <= alone * (1 + _NO_VARIANCE):
        return 1.0 if alone else 1 + PRIOR_CORRELATION * (_mean_cluster_size(index) - 1)
    seen = clusters / (clusters - 1) * float(np.sum(np.bincount(index, weights=misses) ** 2)) - float(np.sum(misses**2))
    correlation = min(1.0, max(0.0, seen / (together - alone)))
    correlation = (rare * correlation + PRIOR_HITS * PRIOR_CORRELATION) / (rare + PRIOR_HITS)
    return 1 + correlation * (together / alone - 1)


def _mean_cluster_size(index: np.ndarray) -> float:
    """Return the mean, over plays, of the number of plays in the same house."""
    return float(np.sum(np.bincount(index).astype(float) ** 2)) / len(index)


def _quantile_ratio(clusters: int) -> float:
    """Return the factor by which to reduce a number of plays, so that an interval by normal quantiles is as wide as one
    by Student's t."""
    from scipy.special import stdtrit  # noqa: PLC0415

    return (_normal_quantiles()[0] / float(stdtrit(clusters - 1, 1 - (1 - CONFIDENCE) / 2))) ** 2


def independent_difference(first: RateWithEnds, second: RateWithEnds) -> tuple[float, Interval]:
    """Return the difference (first minus second) of two independent rates, and its interval from the rates' intervals.

    Source: Zou and Donner, "Construction of confidence limits about effect measures", 2008 (MOVER).
    """
    (one, low_1, high_1), (two, low_2, high_2) = first, second
    change = one - two
    return change, (change - math.hypot(one - low_1, high_2 - two), change + math.hypot(high_1 - one, two - low_2))
