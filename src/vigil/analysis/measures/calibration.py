"""Calibration: compares the index of difficulty with difficulties that item response theory fits to plays of runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vigil.analysis.measures.item_response import (
    Fit,
    SuccessTable,
    discriminations,
    fit,
    rank_correlation,
    rank_correlation_interval,
    without_group_means,
)
from vigil.analysis.measures.rows import Run, values
from vigil.errors import RecordError
from vigil.scoring.rates import Interval

Success = Literal["W", "B"]
FEW_AGENTS = 10
"""Number of agents below which the fitted difficulties are called uncertain."""
MIN_DISCRIMINATION = 0.0
"""Lowest discrimination that is not suspicious. Discrimination is the correlation of agents' success on an episode with
their success on the others."""


@dataclass(frozen=True, slots=True)
class Correlation:
    """Rank correlation of two columns over episodes: its value, its interval, and the number of episodes."""

    value: float
    """Spearman's correlation; NaN if it cannot be estimated."""
    interval: Interval | None
    """The 95 % interval of the correlation with the true difficulties: from resampled houses, and wider where the
    fitted difficulties are uncertain."""
    n: int


@dataclass(frozen=True, slots=True, eq=False)
class DifficultyCalibration:
    """Difficulty of a pack's episodes, as measured by the plays of runs."""

    fit: Fit
    families: np.ndarray
    """(episodes,) family of each episode."""
    levels: np.ndarray
    """(episodes,) name of each episode's level; None if no levels were measured."""
    indices: np.ndarray
    """(episodes,) index of difficulty; NaN if it was not measured."""
    discriminations: np.ndarray
    """(episodes,) correlation of the agents' success on an episode with their success on the other episodes."""
    overall: Correlation
    """Correlation of the index with the fitted difficulty."""
    within_families: Correlation
    """Correlation of the index with the fitted difficulty, after each family's mean is subtracted from both."""

    @property
    def reliability(self) -> float:
        """Share (0 to 1) of the variance of the true difficulties that the fitted difficulties capture."""
        return reliability(self.fit.difficulty, self.fit.difficulty_se)

    @property
    def has_few_agents(self) -> bool:
        """Whether there are too few agents to know the difficulty of single episodes."""
        return len(self.fit.plays.agents) < FEW_AGENTS

    @property
    def suspects(self) -> list[str]:
        """The episodes at which more able agents fail and less able agents succeed, the clearest cases first."""
        order = np.argsort(self.discriminations, kind="stable")
        return [self.fit.plays.episodes[at] for at in order if self.discriminations[at] < MIN_DISCRIMINATION]


def calibrate_difficulty(runs: Sequence[Run], success: Success = "B") -> DifficultyCalibration:
    """Return the calibration from runs of one pack. Raises RecordError if the runs have different packs."""
    packs = {run.header.spec.pack_sha256: run.header.spec.pack for run in runs}
    if len(packs) > 1:
        raise RecordError(
            f"These runs were played on {len(packs)} packs ({', '.join(sorted(packs.values()))}): their episodes "
            "cannot be fitted together. Give runs of one pack."
        )
    facts = {name: row for run in runs for name, row in _facts(run).items()}
    plays = success_table(runs, sorted(facts), success)
    fitted = fit(plays)
    houses, families, levels, indices = (
        np.array(each, dtype=object) for each in zip(*(facts[name] for name in sorted(facts)), strict=True)
    )
    indices, is_known = indices.astype(float), np.isfinite(indices.astype(float))
    groups = families.astype(str)
    clusters, own = houses[is_known].astype(str), groups[is_known]
    difficulty, index = fitted.difficulty[is_known], indices[is_known]
    known = reliability(difficulty, fitted.difficulty_se[is_known])
    return DifficultyCalibration(
        fitted,
        groups,
        levels,
        indices,
        discriminations(fitted),
        _correlation(difficulty, index, clusters, known),
        _correlation(without_group_means(difficulty, own), without_group_means(index, own), clusters, known),
    )


def success_table(runs: Sequence[Run], episodes: Sequence[str], success: Success) -> SuccessTable:
    """Return the successes of each agent on each episode. Repeats of a model under one condition count as one agent."""
    agents = sorted({run.marked_name for run in runs})
    column = {name: at for at, name in enumerate(episodes)}
    hits, plays = (np.zeros((len(agents), len(episodes))) for _ in range(2))
    for run in runs:
        row = agents.index(run.marked_name)
        at = [column[name] for name in values(run.rows, "episode_id", str)]
        np.add.at(hits[row], at, values(run.rows, success, float))
        np.add.at(plays[row], at, 1.0)
    return SuccessTable(tuple(agents), tuple(episodes), hits, plays)


_EpisodeFacts = tuple[str, str, str | None, float]


def _facts(run: Run) -> dict[str, _EpisodeFacts]:
    """Return the house, family, level and index of each episode in a run."""
    columns = [values(run.rows, name, object) for name in ("house", "family", "level", "level_index")]
    return dict(zip(values(run.rows, "episode_id", str), zip(*columns, strict=True), strict=True))


def reliability(estimates: np.ndarray, errors: np.ndarray) -> float:
    """Return the share of the true values' variance that shrunken estimates capture; 0 without estimates."""
    if not len(estimates):
        return 0.0
    known = float(np.var(estimates))
    return known / (known + float(np.mean(errors**2)))


def disattenuated(interval: Interval, known: float) -> Interval:
    """Return the interval of a correlation with true values. `interval` is the interval of the correlation with
    estimates, and `known` the reliability of the estimates.

    Uncertain estimates make a correlation smaller, so each end moves away from 0; at most to -1 and 1. Source:
    Spearman, "The proof and measurement of association between two things", 1904.
    """
    factor = 1 / np.sqrt(known) if known else np.inf
    low, high = interval
    return max(-1.0, low * factor) if low < 0 else low, min(1.0, high * factor) if high > 0 else high


def _correlation(first: np.ndarray, second: np.ndarray, houses: np.ndarray, known: float) -> Correlation:
    value = rank_correlation(first, second)
    interval = rank_correlation_interval(first, second, houses) if np.isfinite(value) else None
    return Correlation(value, None if interval is None else disattenuated(interval, known), len(first))
