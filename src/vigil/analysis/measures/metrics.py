"""Metrics: the numbers of the paper's tables beyond simple rates (`vigil.scoring.rates`), from a table of episodes.

These are pure functions of rows (`vigil.analysis.measures.rows`). A rate over no episodes is None, never zero. Source:
`protocol.md` sections 5 and 6.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import comb
from typing import Literal

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import (
    clustered_interval,
    clustered_mean_intervals,
    clustered_ratio_intervals,
    houses_of,
    mean_of_rates_interval,
    rate_interval_by_houses,
)
from vigil.analysis.measures.rows import ACTION_KINDS, Run, select_rows, values
from vigil.protocol.families import FAMILIES
from vigil.scoring.rates import (
    ALL,
    COLUMNS,
    CONDITIONAL,
    Columns,
    Counts,
    Interval,
    Rate,
    broken_identities,
    count,
    count_masks,
    mean,
)

EVENTS = ("too_far", "path_blocked", "retry")
"""Columns with the numbers of events that action feedback reports, or that it may prevent."""
LABELS = ("B", "FR", "Other", "NR", "IL")
"""Labels of the outcome partition, in the order of the stacked bars."""
COMPARABLE_W_PP = 1.0
EXCLUDED_IL = 0.50
CLOSURE_STEPS = 20
FLOOR_W = 0.05
"""Smallest W at which a family is informative about closure, because the gap W - B cannot be larger than W."""

NR_HEAVY = 0.40
FR_HEAVY = 0.65
STATE_COUPLED = 0.80
LOW_COMPLIANCE = 0.50


@dataclass(frozen=True)
class RunMetrics(Counts):
    """All measures of one table of episodes."""

    means: Mapping[str, float | None] = field(default_factory=dict)
    """Means over episodes: steps, too_far, path_blocked, retry, lags."""


def rate_columns(rows: pd.DataFrame) -> Columns:
    """Return the columns from which rates are computed."""
    return {name: values(rows, name, kind) for name, kind in COLUMNS.items()}


def measure(rows: pd.DataFrame) -> RunMetrics:
    """Return the measures of a set of episodes."""
    found = count(rate_columns(rows))
    return RunMetrics(found.n, found.counts, found.by_episode, _means(rows))


def by_family(rows: pd.DataFrame) -> dict[str, RunMetrics]:
    """Return the measures of each family that has episodes, in the families' order."""
    groups = dict(tuple(rows.groupby("family", sort=False)))
    return {family: measure(groups[family]) for family in FAMILIES if family in groups}


def macro(families: Mapping[str, RunMetrics], name: str) -> float | None:
    """Return the unweighted mean of a rate over the families that have episodes."""
    return mean([value for measures in families.values() if (value := measures.share(name)) is not None])


def macro_interval(rows: pd.DataFrame, name: str) -> Interval | None:
    """Return the interval of the mean over the families (`macro`) of the rate `name`; None without episodes."""
    if not len(rows):
        return None
    hits = count_masks(rate_columns(rows))[name]
    return mean_of_rates_interval(hits, values(rows, "family", str), houses_of(rows))


def house_intervals(rows: pd.DataFrame, names: Iterable[str]) -> dict[str, Interval | None]:
    """Return intervals of rates, by name, that allow for episodes in the same house being alike. With fewer than five
    houses, an interval is None."""
    masks, houses = count_masks(rate_columns(rows)), houses_of(rows)
    masks = {**masks, ALL: np.ones(len(rows), dtype=bool)}
    parts = {name: CONDITIONAL.get(name, (name, ALL)) for name in names}
    return {
        name: rate_interval_by_houses(masks[what] & masks[among], masks[among], houses)
        for name, (what, among) in parts.items()
    }


def mean_with_interval(rows: pd.DataFrame, column: str) -> tuple[float, float | None, float | None] | None:
    """Return the mean of a column's known values, with its interval from resampled houses; None without values."""
    found = values(rows, column)
    known = np.isfinite(found)
    if not known.any():
        return None
    low, high = clustered_interval(found[known], houses_of(rows)[known]) or (None, None)
    return float(found[known].mean()), low, high


def clustered_intervals(rows: pd.DataFrame) -> dict[str, Interval | None]:
    """Return the intervals of W, B and Delta from a bootstrap over houses; None if there are too few houses."""
    w, b = values(rows, "W"), values(rows, "B")
    found = clustered_mean_intervals(np.stack([w, b, w - b], axis=1), houses_of(rows)) if len(rows) else None
    return dict(zip(("W", "B", "Delta"), found or (None, None, None), strict=True))


def after_goal_shares(rows: pd.DataFrame) -> dict[str, tuple[float, float] | None]:
    """Return {kind of action: (pooled share, mean share)} for the actions after the goal first held, in episodes with
    W=1.

    The pooled share is the share among the actions of all episodes. The mean share is the mean of the episodes' shares.
    """
    counts, _ = _after_goal(rows)
    if not len(counts):
        return dict.fromkeys(ACTION_KINDS)
    pooled = counts.sum(axis=0) / counts.sum()
    mean = (counts / counts.sum(axis=1, keepdims=True)).mean(axis=0)
    return {kind: (float(pooled[index]), float(mean[index])) for index, kind in enumerate(ACTION_KINDS)}


def after_goal_intervals(rows: pd.DataFrame) -> dict[str, tuple[Interval | None, Interval | None]]:
    """Return the intervals of both shares in `after_goal_shares`, from resampled houses."""
    counts, houses = _after_goal(rows)
    sizes = counts.sum(axis=1)
    pooled = clustered_ratio_intervals(counts, sizes, houses) or [None] * len(ACTION_KINDS)
    means = clustered_mean_intervals(counts / sizes[:, None], houses) or [None] * len(ACTION_KINDS)
    return dict(zip(ACTION_KINDS, zip(pooled, means, strict=True), strict=True))


def _after_goal(rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return the actions after the goal first held, (episodes, kinds), and the houses; only of episodes with W=1."""
    held = select_rows(rows, values(rows, "W", bool))
    counts = np.stack([values(held, f"actions_after_goal.{kind}") for kind in ACTION_KINDS], axis=1)
    has_any = counts.sum(axis=1) > 0
    return counts[has_any], houses_of(held)[has_any]


def closure_curve(rows: pd.DataFrame, steps: int = CLOSURE_STEPS) -> list[float] | None:
    """Return the share of W=1 episodes closed by a matching report at most 0, 1, ... `steps` steps after attainment."""
    held = select_rows(rows, values(rows, "W", bool))
    if not len(held):
        return None
    lags = values(held, "lag")
    return [float(np.sum(lags <= k) / len(held)) for k in range(steps + 1)]


def regimes(measures: RunMetrics) -> dict[str, str]:
    """Return {regime: certainty} for a run's closure regimes.

    The certainty is `clear` if the rate's interval lies wholly beyond the threshold, else `borderline`. A run may be in
    several regimes; a run in none of them is `mixed`.
    """
    limits = {
        "low-compliance": ("IL", LOW_COMPLIANCE),
        "FR-heavy": ("P_FR_W0", FR_HEAVY),
        "NR-heavy": ("P_norep_W1", NR_HEAVY),
    }
    certainties = {name: _certainty(measures.rate(rate), limit) for name, (rate, limit) in limits.items()}
    found = {name: certainty for name, certainty in certainties.items() if certainty is not None}
    if not found and (certainty := _certainty(measures.rate("P_B_W1"), STATE_COUPLED)):
        found["state-coupled"] = certainty
    return found or {"mixed": ""}


def is_excluded(measures: RunMetrics) -> bool:
    """Return whether a run is excluded from the main panel, because it has B = 0, or IL above one half."""
    return measures.n > 0 and (measures.counts["B"] == 0 or (measures.share("IL") or 0.0) > EXCLUDED_IL)


def broken_run_identities(run: Run) -> list[str]:
    """Return the equations between rates (such as B + FR + NR + IL + Other = all) that do not hold in a run: overall,
    by family and by epoch."""
    parts = {"all": run.rows}
    parts |= {f"family {family}": rows for family, rows in run.rows.groupby("family")}
    parts |= {f"epoch {epoch}": rows for epoch, rows in run.rows.groupby("epoch")}
    found = [
        f"{run.name}, {part}: {name}" for part, rows in parts.items() for name in broken_identities(rate_columns(rows))
    ]
    found += [f"{run.name}, beliefs: {name}" for beliefs in run.beliefs for name in beliefs.broken_identities]
    if run.n + len(run.errors) > run.n_planned:
        found.append(f"{run.name}: {run.n} scored and {len(run.errors)} errors are more than {run.n_planned} planned")
    return found


def _means(rows: pd.DataFrame) -> dict[str, float | None]:
    columns = {name: values(rows, name) for name in ("steps", *EVENTS, "lag", "lag_from_reset")}
    columns["lag_without_sv"] = columns["lag"][values(rows, "expected", object) == None]  # noqa: E711 - element by element
    known = {name: column[np.isfinite(column)] for name, column in columns.items()}
    return {name: float(column.mean()) if len(column) else None for name, column in known.items()}


def _certainty(rate: Rate, limit: float) -> str | None:
    """Return `clear` if the whole interval of a rate is above the limit, `borderline` if only the rate itself is above
    it.

    None if the rate is not above the limit.
    """
    if rate.value is None or rate.interval is None or rate.value <= limit:
        return None
    return "clear" if rate.interval[0] > limit else "borderline"


@dataclass(frozen=True, slots=True)
class PlaysOfK:
    """Chances about k plays of an episode, as means over the episodes that were played at least k times."""

    k: int
    episodes: int
    plays: int
    """Number of plays of these episodes."""
    every: tuple[float, Interval | None]
    """Chance that all k plays succeed (pass^k). It equals the expected result of the worst of k plays."""
    any: tuple[float, Interval | None]
    """Chance that at least one of k plays succeeds. It equals the expected result of the best of k plays."""


def plays_of_k(rows: pd.DataFrame, name: Literal["W", "B"]) -> list[PlaysOfK]:
    """Return the chances for k = 1, 2 ... up to the most plays of an episode. Intervals resample houses.

    The chances are unbiased estimates: they average over all sets of k plays of an episode. Sources: Chen and others,
    "Evaluating large language models trained on code", 2021 (any of k); Yao and others, "tau-bench", 2024 (all of k).
    """
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
