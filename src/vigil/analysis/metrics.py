"""Metrics: a flat table of episodes -> every number of the paper's tables, and those beside them.

Pure functions of rows (`vigil.analysis.rows`); a rate over no episodes is None, never zero. Source: `protocol.md`
sections 5 and 6.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vigil.analysis.intervals import Interval, Rate, clustered_means, houses_of
from vigil.analysis.rows import KINDS, Run, values, where
from vigil.episode import FAMILIES
from vigil.summary import independent_trials

LABELS = ("B", "FR", "Other", "NR", "IL")
"""The partition, in the order of the stacked bars."""
HIGH_PROGRESS = 0.75
COMPARABLE_W_PP = 1.0
EXCLUDED_IL = 0.50
CLOSURE_STEPS = 20
FLOOR_W = 0.05
"""Below this share of completed episodes a family says nothing about closure: the gap is bounded by W."""

NR_HEAVY = 0.40
FR_HEAVY = 0.65
STATE_COUPLED = 0.80
LOW_COMPLIANCE = 0.50


@dataclass(frozen=True)
class Measures:
    """All that one table of episodes says, as counts; every rate is derived from them."""

    n: int
    counts: Mapping[str, int]
    """W, W_strict, B, the five labels, reports and their parts."""
    means: Mapping[str, float | None]
    """Means over episodes: steps, too_far, path_blocked, retry, lags."""
    by_episode: Mapping[str, tuple[int, ...]] | None = None
    """The counts of each episode, and its plays as `n`, when any was played repeatedly."""

    @property
    def episodes(self) -> int:
        """How many different episodes were played."""
        return self.n if self.by_episode is None else len(self.by_episode["n"])

    def rate(self, name: str, given: str | None = None) -> Rate:
        """Returns the share of `name`, of all episodes or of those counted under `given`."""
        trials = self.n if given is None else self.counts[given]
        if self.by_episode is None:
            return Rate(self.counts[name], trials, trials)
        return Rate(self.counts[name], trials, independent_trials(self.by_episode[name], self.by_episode[given or "n"]))

    def share(self, name: str, given: str | None = None) -> float | None:
        """Returns the value of `rate`."""
        return self.rate(name, given).value


def measure(rows: pd.DataFrame) -> Measures:
    """Returns the measures of any set of episodes."""
    masks = _masks(rows)
    counts = {name: int(np.count_nonzero(mask)) for name, mask in masks.items()}
    names, index = np.unique(values(rows, "episode_id", str), return_inverse=True)
    if len(names) == len(rows):
        return Measures(len(rows), counts, _means(rows))
    masks = {"n": np.ones(len(rows)), **masks}
    each = {name: np.bincount(index, weights=mask != 0).astype(int) for name, mask in masks.items()}
    return Measures(len(rows), counts, _means(rows), {name: tuple(found.tolist()) for name, found in each.items()})


def by_family(rows: pd.DataFrame) -> dict[str, Measures]:
    """Returns the measures of each family that has episodes, in the families' order."""
    groups = dict(tuple(rows.groupby("family", sort=False)))
    return {family: measure(groups[family]) for family in FAMILIES if family in groups}


def macro(families: Mapping[str, Measures], name: str) -> float | None:
    """Returns the unweighted mean of a rate over the families that have episodes."""
    values = [value for measures in families.values() if (value := measures.share(name)) is not None]
    return float(np.mean(values)) if values else None


def clustered_intervals(rows: pd.DataFrame) -> dict[str, Interval | None]:
    """Returns the intervals of W, B and Delta from a bootstrap over houses; None where it says nothing."""
    w, b = values(rows, "W"), values(rows, "B")
    found = clustered_means(np.stack([w, b, w - b], axis=1), houses_of(rows)) if len(rows) else None
    return dict(zip(("W", "B", "Delta"), found or (None, None, None), strict=True))


def after_goal_shares(rows: pd.DataFrame) -> dict[str, tuple[float, float] | None]:
    """Returns, per kind of action, its share after the goal first held in W=1 episodes: pooled, and episode mean."""
    held = where(rows, values(rows, "W", bool))
    counts = np.stack([values(held, f"actions_after_goal.{kind}") for kind in KINDS], axis=1)
    counts = counts[counts.sum(axis=1) > 0]
    if not len(counts):
        return dict.fromkeys(KINDS)
    pooled = counts.sum(axis=0) / counts.sum()
    mean = (counts / counts.sum(axis=1, keepdims=True)).mean(axis=0)
    return {kind: (float(pooled[index]), float(mean[index])) for index, kind in enumerate(KINDS)}


def closure_curve(rows: pd.DataFrame, steps: int = CLOSURE_STEPS) -> list[float] | None:
    """Returns the share of W=1 episodes closed by a matching report within 0 .. `steps` steps of attainment."""
    held = where(rows, values(rows, "W", bool))
    if not len(held):
        return None
    lags = values(held, "lag")
    return [float(np.sum(lags <= k) / len(held)) for k in range(steps + 1)]


def regimes(measures: Measures) -> dict[str, str]:
    """Returns the closure regimes that a run is in: `clear` when its interval lies on that side, else `borderline`.

    Regimes are not exclusive; a run in none of them is `mixed`.
    """
    rates = {
        "low-compliance": (measures.rate("IL"), LOW_COMPLIANCE),
        "FR-heavy": (measures.rate("FR_W0", "W0"), FR_HEAVY),
        "NR-heavy": (measures.rate("NoRep_W1", "W"), NR_HEAVY),
    }
    found = {name: _verdict(rate, limit) for name, (rate, limit) in rates.items() if _reaches(rate, limit)}
    coupled = measures.rate("B", "W")
    if not found and _reaches(coupled, STATE_COUPLED):
        found["state-coupled"] = _verdict(coupled, STATE_COUPLED)
    return found or {"mixed": ""}


def is_excluded(measures: Measures) -> bool:
    """Whether a row goes to the extended panel: no benchmark success at all, or IL above one half."""
    return measures.n > 0 and (measures.counts["B"] == 0 or (measures.share("IL") or 0.0) > EXCLUDED_IL)


def broken_identities(rows: pd.DataFrame) -> list[str]:
    """Returns the identities of protocol.md section 5 that the rows break; none, if all is well."""
    counts, n = measure(rows).counts, len(rows)
    w, b, lag = values(rows, "W", bool), values(rows, "B", bool), values(rows, "lag")
    identities = {
        "B + FR + NR + IL + Other = all": sum(counts[f"label_{label}"] for label in LABELS) == n,
        "Stop + NR + IL = all": counts["Stop"] + counts["NR"] + counts["IL"] == n,
        "Stop = B + FR + Other": counts["Stop"] == counts["B"] + counts["FR"] + counts["Other"],
        "B = label B": counts["B"] == counts["label_B"],
        "W - B = no report given W=1 + mismatched reports given W=1": counts["W"] - counts["B"]
        == counts["NoRep_W1"] + counts["FR_W1"],
        "Actual = B": values(rows, "credit.actual").sum() == counts["B"],
        "Random = W/2": values(rows, "credit.random").sum() == counts["W"] / 2,
        "Oracle = W": values(rows, "credit.oracle").sum() == counts["W"],
        "Always = W minus SV's share": counts["Always"] == counts["W"] - counts["W_sv"],
        "the four categories = all": sum(counts[name] for name in _CATEGORIES) == n,
        "P(report | W=0) and P(no report | W=1) make Stop": counts["rep_W0"] + counts["W"] - counts["NoRep_W1"]
        == counts["Stop"],
        "B <= W on every episode": bool((~b | w).all()),
        "W_strict <= W on every episode": bool((~values(rows, "W_strict", bool) | w).all()),
        "lag >= 0 and only where B": bool((np.isfinite(lag) == b).all() and (lag[b] >= 0).all()),
    }
    return [name for name, holds in identities.items() if not holds]


def run_faults(run: Run) -> list[str]:
    """Returns the identities that a run breaks, over all its episodes, by family and by epoch."""
    parts = {"all": run.rows}
    parts |= {f"family {family}": rows for family, rows in run.rows.groupby("family")}
    parts |= {f"epoch {epoch}": rows for epoch, rows in run.rows.groupby("epoch")}
    found = [f"{run.name}, {part}: {name}" for part, rows in parts.items() for name in broken_identities(rows)]
    if run.n + len(run.errors) > run.n_planned:
        found.append(f"{run.name}: {run.n} scored and {len(run.errors)} errors are more than {run.n_planned} planned")
    return found


_CATEGORIES = ("verified_success", "unsupported_commitment", "post_attainment_drift", "missed_execution")


def _masks(rows: pd.DataFrame) -> dict[str, np.ndarray]:
    """Returns, for each count, the rows that it counts."""
    w, stop = values(rows, "W", bool), values(rows, "is_reported", bool)
    label, subtype = values(rows, "label", object), values(rows, "subtype", object)
    is_sv = values(rows, "expected", object) != None  # noqa: E711 - element by element
    is_false = (label == "FR").astype(bool)
    is_success = (subtype == "false_success").astype(bool)
    progress = values(rows, "progress_at_report")
    ever, category = values(rows, "ever_satisfied", bool), values(rows, "category", object)
    return {
        "W": w,
        "W0": ~w,
        "W_strict": values(rows, "W_strict", bool),
        "B": values(rows, "B", bool),
        "Delta": w & ~values(rows, "B", bool),
        "Stop": stop,
        "NoRep": ~stop,
        "FR_W0": is_false & ~w,
        "FR_W1": is_false & w,
        "rep_W0": stop & ~w,
        "NoRep_W1": ~stop & w,
        "NR_W1": (label == "NR") & w,
        "IL_W1": (label == "IL") & w,
        "W_sv": w & is_sv,
        "Always": values(rows, "credit.always_success"),
        "Always_reported": values(rows, "credit.always_success_if_reported"),
        "StopOnly": w & stop,
        "FS": is_success,
        "FS_zero": is_success & values(rows, "zero_progress", bool),
        "FS_high": is_success & (np.nan_to_num(progress, nan=-1.0) > HIGH_PROGRESS),
        "ever": ever,
        "lost": ever & ~w,
        "tampered": values(rows, "state_tampered", bool),
        **{f"label_{name}": label == name for name in LABELS},
        **{name: label == name for name in ("FR", "NR", "IL", "Other")},
        **{name: category == name for name in _CATEGORIES},
    }


def _means(rows: pd.DataFrame) -> dict[str, float | None]:
    names = ("steps", "too_far", "path_blocked", "retry", "lag", "lag_from_reset")
    columns = {name: values(rows, name) for name in (*names, "input_tokens", "output_tokens", "seconds")}
    columns["random"] = values(rows, "credit.random")
    columns["invalid"] = values(rows, "protocol_failures") + values(rows, "malformed_actions")
    columns["lag_without_sv"] = columns["lag"][values(rows, "expected", object) == None]  # noqa: E711 - as above
    known = {name: column[np.isfinite(column)] for name, column in columns.items()}
    return {name: float(column.mean()) if len(column) else None for name, column in known.items()}


def _reaches(rate: Rate, limit: float) -> bool:
    return rate.value is not None and rate.value > limit


def _verdict(rate: Rate, limit: float) -> str:
    return "clear" if rate.interval[0] > limit else "borderline"
