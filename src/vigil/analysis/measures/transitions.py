"""Transitions: how the labels of the same episodes change from one run to another.

Every function takes the rows of two runs; both have the same plays in the same order.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import Homogeneity, houses_of, paired_test, stuart_maxwell
from vigil.analysis.measures.metrics import LABELS
from vigil.analysis.measures.rows import values
from vigil.scoring.rates import Interval


@dataclass(frozen=True, slots=True)
class Transition:
    """Number of episodes whose label changed from `source` to `target` between two runs, and number of opposite
    changes."""

    source: str
    target: str
    forward: int
    backward: int
    net: float
    """`forward` minus `backward`, as a share of the episodes."""
    interval: Interval | None
    p: float
    """p-value of McNemar's exact test of `forward` against `backward`, for which each episode's plays are summed."""


def label_matrix(base: pd.DataFrame, other: pd.DataFrame) -> dict[str, dict[str, int]]:
    """Return the number of episodes for each pair of labels: in the base run (rows) and in the other run (columns)."""
    before, after = (values(table, "label", str) for table in (base, other))
    return {one: {two: int(np.sum((before == one) & (after == two))) for two in LABELS} for one in LABELS}


def transitions(base: pd.DataFrame, other: pd.DataFrame) -> list[Transition]:
    """Return the transitions for each pair of labels between which at least one episode changed."""
    before, after = (values(table, "label", str) for table in (base, other))
    houses, episodes = houses_of(base), values(base, "episode_id", str)
    found = []
    for source, target in combinations(LABELS, 2):
        forward, backward = (before == source) & (after == target), (before == target) & (after == source)
        if forward.any() or backward.any():
            net = paired_test(backward, forward, episodes=episodes, houses=houses)
            counts = int(forward.sum()), int(backward.sum())
            found.append(Transition(source, target, *counts, net.difference, net.interval, net.test.p))
    return found


def homogeneity(base: pd.DataFrame, other: pd.DataFrame) -> Homogeneity | None:
    """Return the test of whether every label is equally frequent in both runs; None if no label changed."""
    before, after = (values(table, "label", str) for table in (base, other))
    return stuart_maxwell(before, after, values(base, "episode_id", str))
