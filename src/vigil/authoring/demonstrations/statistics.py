"""Statistics of columns, computed from all rows and pixels. LeRobot's policies normalize their input with them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
LEVELS = 256
Statistics = dict[str, Any]
"""Name of a statistic -> its values: one for each number of a column, or shape (3, 1, 1) for a frame's channels."""


def of_numbers(rows: np.ndarray) -> Statistics:
    """Return the statistics of each column of `rows` (n, numbers), computed over the n rows."""
    values = rows.astype(np.float64)
    found = {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        **{name: np.quantile(values, share, axis=0, method="inverted_cdf") for name, share in QUANTILES.items()},
    }
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(rows)]}


def pixel_counts(rgb: np.ndarray) -> np.ndarray:
    """Return for each channel of a frame (h, w, 3) how many pixels have each level 0..255; shape (3, 256)."""
    return np.stack([np.bincount(channel.ravel(), minlength=LEVELS) for channel in np.moveaxis(rgb, -1, 0)])


def of_pixels(counts: np.ndarray, frames: int) -> Statistics:
    """Return the statistics of pixel levels, scaled to 0..1. `counts` (3, 256) are the numbers of pixels with each
    level in several `frames`."""
    levels = np.arange(LEVELS) / (LEVELS - 1)
    until, total = counts.cumsum(axis=1), counts.sum(axis=1)
    mean = counts @ levels / total
    deviations = (levels - mean[:, None]) ** 2
    found = {
        "min": levels[(until > 0).argmax(axis=1)],
        "max": levels[(until == total[:, None]).argmax(axis=1)],
        "mean": mean,
        "std": np.sqrt((counts * deviations).sum(axis=1) / total),
        **{name: levels[(until >= share * total[:, None]).argmax(axis=1)] for name, share in QUANTILES.items()},
    }
    return {name: value.reshape(3, 1, 1).tolist() for name, value in found.items()} | {"count": [frames]}


def of_columns(numbers: Mapping[str, np.ndarray], camera: str, counts: np.ndarray) -> dict[str, Statistics]:
    """Return column -> statistics. `numbers` has columns of numbers (n, numbers); `counts` is for column `camera`."""
    frames = len(next(iter(numbers.values())))
    return {camera: of_pixels(counts, frames), **{name: of_numbers(rows) for name, rows in numbers.items()}}
