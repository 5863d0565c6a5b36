"""Item response: how difficult each episode is and how able each agent, fitted together to who succeeded where.

The Rasch model: the log-odds of success are an agent's ability minus an episode's difficulty. Normal priors make it fit
for few agents and for episodes that all or none of them solve: what the plays do not tell is drawn to the middle, with
a standard error that says so. The posterior has one mode, found by Newton's method; errors are of its curvature there.
"""

from dataclasses import dataclass

import numpy as np

from vigil.analysis.measures.intervals import RESAMPLES, SEED
from vigil.errors import SettingError
from vigil.scoring.rates import Interval

DIFFICULTY_SD, ABILITY_SD = 1.5, 3.0
"""Of the priors, in logits, both around 0: which fixes the origin at an episode of middling difficulty."""
MAX_ITERATIONS, TOLERANCE = 100, 1e-9
MIN_AGENTS = 5
"""With fewer agents a correlation over agents says nothing."""
MIN_EPISODES = 8
"""With fewer episodes a correlation over episodes says nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class SuccessTable:
    """Who succeeded how often where."""

    agents: tuple[str, ...]
    episodes: tuple[str, ...]
    hits: np.ndarray
    """(agents, episodes) plays that succeeded."""
    plays: np.ndarray
    """(agents, episodes) plays in all; 0 where an agent did not play an episode."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The fitted model, in logits."""

    plays: SuccessTable
    difficulty: np.ndarray
    """(episodes,)"""
    difficulty_se: np.ndarray
    ability: np.ndarray
    """(agents,)"""
    ability_se: np.ndarray

    @property
    def probabilities(self) -> np.ndarray:
        """(agents, episodes) fitted chances of success."""
        return _probabilities(self.ability, self.difficulty)


def fit(plays: SuccessTable) -> Fit:
    """Return the most likely difficulties and abilities. Raises SettingError without any play."""
    if not plays.plays.sum():
        raise SettingError("There is no scored episode to fit difficulties to. Give runs that have some.")
    agents, episodes = plays.plays.shape
    precision = np.concatenate([np.full(agents, ABILITY_SD**-2), np.full(episodes, DIFFICULTY_SD**-2)])
    found = np.zeros(agents + episodes)
    for _ in range(MAX_ITERATIONS):
        slope, curvature = _derivatives(found, plays, precision)
        step = np.linalg.solve(curvature, slope)
        scale = 1.0
        while _log_posterior(found + scale * step, plays, precision) < _log_posterior(found, plays, precision) - 1e-12:
            scale /= 2
        found = found + scale * step
        if np.abs(step).max() < TOLERANCE:
            break
    _, curvature = _derivatives(found, plays, precision)
    errors = np.sqrt(np.diag(np.linalg.inv(curvature)))
    return Fit(plays, found[agents:], errors[agents:], found[:agents], errors[:agents])


def _probabilities(ability: np.ndarray, difficulty: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(difficulty[None, :] - ability[:, None]))


def _log_posterior(at: np.ndarray, plays: SuccessTable, precision: np.ndarray) -> float:
    agents = len(plays.agents)
    logits = at[:agents, None] - at[None, agents:]
    likely = plays.hits * logits - plays.plays * np.logaddexp(0.0, logits)
    return float(likely.sum() - 0.5 * (precision * at**2).sum())


def _derivatives(at: np.ndarray, plays: SuccessTable, precision: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the slope of the log-posterior, abilities first, and its curvature with the sign turned."""
    agents = len(plays.agents)
    probabilities = _probabilities(at[:agents], at[agents:])
    missed = plays.hits - plays.plays * probabilities
    weights = plays.plays * probabilities * (1.0 - probabilities)
    slope = np.concatenate([missed.sum(axis=1), -missed.sum(axis=0)]) - precision * at
    curvature = np.diag(np.concatenate([weights.sum(axis=1), weights.sum(axis=0)]) + precision)
    curvature[:agents, agents:] = -weights
    curvature[agents:, :agents] = -weights.T
    return slope, curvature


def discriminations(fitted: Fit) -> np.ndarray:
    """Return, for each episode, how its success goes with the agents' success elsewhere (-1 to 1).

    NaN with fewer than five agents on it, or where all agree. Below 0 the abler ones fail: a reason to look at it.
    """
    plays = fitted.plays
    with np.errstate(invalid="ignore", divide="ignore"):
        own = plays.hits / plays.plays
        elsewhere = plays.hits.sum(axis=1, keepdims=True) - plays.hits
        rest = elsewhere / (plays.plays.sum(axis=1, keepdims=True) - plays.plays)
    return np.array([_correlation(own[:, at], rest[:, at], MIN_AGENTS) for at in range(len(plays.episodes))])


def _correlation(first: np.ndarray, second: np.ndarray, least: int) -> float:
    is_known = np.isfinite(first) & np.isfinite(second)
    a, b = first[is_known], second[is_known]
    if len(a) < least or np.ptp(a) == 0 or np.ptp(b) == 0:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def rank_correlation(first: np.ndarray, second: np.ndarray) -> float:
    """Return Spearman's correlation of two columns; NaN with fewer than eight values, or where all agree."""
    return _correlation(_ranks(first), _ranks(second), MIN_EPISODES)


def rank_correlation_interval(first: np.ndarray, second: np.ndarray, houses: np.ndarray) -> Interval | None:
    """Return the 95 % interval of Spearman's correlation when houses are resampled; None where that says nothing."""
    names, index = np.unique(houses, return_inverse=True)
    members = [np.flatnonzero(index == house) for house in range(len(names))]
    rng = np.random.default_rng(SEED)
    found = []
    for _ in range(RESAMPLES):
        drawn = np.concatenate([members[house] for house in rng.integers(len(names), size=len(names))])
        found.append(rank_correlation(first[drawn], second[drawn]))
    known = np.array(found)[np.isfinite(found)]
    if len(names) < MIN_EPISODES or len(known) < RESAMPLES / 2:
        return None
    low, high = np.quantile(known, [0.025, 0.975])
    return float(low), float(high)


def without_group_means(values: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return values less the mean of their group: what they say besides which group they are of."""
    _, index = np.unique(groups, return_inverse=True)
    return values - (np.bincount(index, weights=values) / np.bincount(index))[index]


def _ranks(values: np.ndarray) -> np.ndarray:
    """Return the ranks of values; equal ones share the mean of theirs."""
    _, index, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[index]
