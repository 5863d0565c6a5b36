"""Several plays of each episode: the chance that all of k plays succeed, and the chance that any of k plays succeeds.

Both are unbiased estimates: they average over all sets of k plays of an episode. Sources: Chen and others, "Evaluating
large language models trained on code", 2021 (any of k); Yao and others, "tau-bench", 2024 (all of k).
"""

from dataclasses import dataclass
from math import comb
from typing import Literal

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import clustered_interval, houses_of
from vigil.analysis.measures.rows import select_rows, values
from vigil.scoring.rates import Interval


@dataclass(frozen=True, slots=True)
class PlaysOfK:
    """Chances about k plays of an episode, as means over the episodes that were played at least k times."""

    k: int
    episodes: int
    plays: int
    """Number of plays of the episodes that were played at least k times."""
    every: tuple[float, Interval | None]
    """Chance that all k plays succeed (pass^k). It equals the expected result of the worst of k plays."""
    any: tuple[float, Interval | None]
    """Chance that at least one of k plays succeeds. It equals the expected result of the best of k plays."""


def plays_of_k(rows: pd.DataFrame, name: Literal["W", "B"]) -> list[PlaysOfK]:
    """Return the chances for k = 1, 2 ... up to the largest number of plays of an episode. Intervals resample
    houses."""
    by_episode = rows.groupby("episode_id", sort=True)
    plays = pd.DataFrame(by_episode.agg(hits=(name, "sum"), n=(name, "size"), house=("house", "first")))
    found: list[PlaysOfK] = []
    for k in range(1, max(values(plays, "n", int), default=0) + 1):
        enough = select_rows(plays, values(plays, "n", int) >= k)
        hits, n = values(enough, "hits", int), values(enough, "n", int)
        sets = np.array([comb(count, k) for count in n], dtype=float)
        every = np.array([comb(hit, k) for hit in hits], dtype=float) / sets
        none = np.array([comb(count - hit, k) for hit, count in zip(hits, n, strict=True)], dtype=float) / sets
        houses = houses_of(enough)
        means = [(float(each.mean()), clustered_interval(each, houses)) for each in (every, 1 - none)]
        found.append(PlaysOfK(k, len(enough), int(n.sum()), means[0], means[1]))
    return found
