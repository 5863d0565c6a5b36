"""Item response: the difficulty of each episode and the ability of each agent, fitted together to their successes.

This is the Rasch model: the log-odds of success are an agent's ability minus an episode's difficulty. Thanks to normal
priors, the fit works for few agents, and for episodes that all or none of them solve: estimates with little data shrink
to the middle and have a large standard error. Newton's method finds the posterior's only mode; the curvature at the
mode gives the standard errors.
"""

from dataclasses import dataclass

import numpy as np

from vigil.analysis.measures.intervals import RESAMPLES, SEED
from vigil.errors import SettingError
from vigil.scoring.rates import Interval

DIFFICULTY_SD, ABILITY_SD = 1.5, 3.0
"""Standard deviations of the priors, in logits. Both priors have mean 0, so 0 is a medium difficulty."""
MAX_ITERATIONS, TOLERANCE = 100, 1e-9
MIN_AGENTS = 5
"""Smallest number of agents for a correlation over agents."""
MIN_EPISODES = 8
"""Smallest number of episodes for a correlation over episodes."""


@dataclass(frozen=True, slots=True, eq=False)
class SuccessTable:
    """Number of successes and of plays of each agent on each episode."""

    agents: tuple[str, ...]
    episodes: tuple[str, ...]
    hits: np.ndarray
    """(agents, episodes) number of successful plays."""
    plays: np.ndarray
    """(agents, episodes) number of plays; 0 if an agent did not play an episode."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The fitted difficulties and abilities, in logits, with their standard errors."""

    plays: SuccessTable
    difficulty: np.ndarray
    """(episodes,) difficulty of each episode, in logits."""
    difficulty_se: np.ndarray
    ability: np.ndarray
    """(agents,) ability of each agent, in logits."""
    ability_se: np.ndarray

    @property
    def probabilities(self) -> np.ndarray:
        """(agents, episodes) fitted probabilities of success."""
        return _probabilities(self.ability, self.difficulty)


def fit(plays: SuccessTable) -> Fit:
    """Return the most likely difficulties and abilities. Raises SettingError without plays."""
    if not plays.plays.sum():
        raise SettingError(
            "These runs do not have any scored episode, so difficulties cannot be fitted. Give runs with scored "
            "episodes."
        )
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
    """Return the gradient of the log-posterior, abilities first, and its negative Hessian."""
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
    """Return, for each episode, the correlation of agents' success on it with their success elsewhere (-1 to 1).

    NaN if fewer than five agents played the episode, or if all had the same success. If the value is below 0, more able
    agents fail more often at the episode than less able agents, which is a reason to inspect it.
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
    """Return Spearman's correlation of two columns; NaN with fewer than eight values, or if a column is constant."""
    return _correlation(_ranks(first), _ranks(second), MIN_EPISODES)


def rank_correlation_interval(first: np.ndarray, second: np.ndarray, houses: np.ndarray) -> Interval | None:
    """Return the 95 % interval of Spearman's correlation from resampled houses; None if it cannot be estimated."""
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
    """Return the values minus the mean of their group."""
    _, index = np.unique(groups, return_inverse=True)
    return values - (np.bincount(index, weights=values) / np.bincount(index))[index]


def _ranks(values: np.ndarray) -> np.ndarray:
    """Return the ranks of values; equal values get the mean of their ranks."""
    _, index, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[index]
