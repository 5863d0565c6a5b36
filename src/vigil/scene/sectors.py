"""Sectors: sets of directions from an eye. A sector is an arc of angles in the plan and a range of slopes.

Places are (x, z, height) in metres.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

FULL = 2.0 * math.pi
"""Width of an arc that is the whole circle (radians)."""


@dataclass(frozen=True, slots=True, eq=False)
class Spans:
    """The directions from an eye to each of n things. Every array is (n,)."""

    start: np.ndarray
    """Angle in the plan (radians) at which each arc begins."""
    width: np.ndarray
    """Width of each arc (radians)."""
    low: np.ndarray
    """Least slope of the directions to each thing: metres up for each metre in the plan."""
    high: np.ndarray
    """Greatest slope of the directions to each thing."""

    @staticmethod
    def of(eye: np.ndarray, corners: np.ndarray) -> "Spans":
        """Return the directions from an eye (3,) to n things, given k corners of each thing's hull (k, n, 3)."""
        x, y, z = np.ascontiguousarray(np.moveaxis(corners - eye, -1, 0))
        middle_x, middle_y = x.mean(axis=0), y.mean(axis=0)
        away = np.hypot(middle_x, middle_y)
        with np.errstate(invalid="ignore"):
            along_x, along_y = np.where(away > 0.0, (middle_x, middle_y) / away, [[1.0], [0.0]])
        ahead, aside = x * along_x + y * along_y, y * along_x - x * along_y
        turns = np.arctan2(aside, ahead)
        first, last = turns.min(axis=0), turns.max(axis=0)
        is_around = last - first >= np.pi
        nearest = np.maximum(ahead.min(axis=0), 0.0)
        nearest[is_around] = 0.0
        farthest = np.hypot(x, y).max(axis=0)
        lowest, highest = z.min(axis=0), z.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(lowest < 0.0, lowest / nearest, lowest / farthest)
            high = np.where(highest > 0.0, highest / nearest, highest / farthest)
        return Spans(np.arctan2(along_y, along_x) + first, np.where(is_around, FULL, last - first), low, high)


@dataclass(frozen=True, slots=True)
class Sector:
    """A set of directions from an eye: an arc of angles in the plan, between two slopes."""

    start: float
    """Angle in the plan (radians) at which the arc begins."""
    width: float
    """Width of the arc (radians)."""
    low: float = -math.inf
    """Least slope: metres up for each metre in the plan."""
    high: float = math.inf
    """Greatest slope."""

    @staticmethod
    def of(eye: Iterable[float], corners: Iterable[Iterable[float]]) -> "Sector":
        """Return the directions from an eye to the convex hull of the corners of one thing (see `Spans.of`)."""
        eye_x, eye_y, eye_z = eye
        ways = [(x - eye_x, y - eye_y, z - eye_z) for x, y, z in corners]
        middle = sum(x for x, _, _ in ways), sum(y for _, y, _ in ways)
        angle = math.atan2(middle[1], middle[0])
        turns = [(math.atan2(y, x) - angle + math.pi) % FULL - math.pi for x, y, _ in ways]
        first, last = min(turns), max(turns)
        is_around = last - first >= math.pi
        along_x, along_y = math.cos(angle), math.sin(angle)
        nearest = 0.0 if is_around else max(min(x * along_x + y * along_y for x, y, _ in ways), 0.0)
        farthest = max(math.hypot(x, y) for x, y, _ in ways)
        lowest, highest = min(z for _, _, z in ways), max(z for _, _, z in ways)
        return Sector(
            angle + first,
            FULL if is_around else last - first,
            _slope(lowest, nearest if lowest < 0.0 else farthest),
            _slope(highest, nearest if highest > 0.0 else farthest),
        )

    def intersection(self, other: "Sector") -> "Sector | None":
        """Return a sector that contains all directions that this sector and `other` share; None if they share none."""
        low, high = max(self.low, other.low), min(self.high, other.high)
        if low > high:
            return None
        if self.width >= FULL or other.width >= FULL:
            arc = other if self.width >= FULL else self
            return Sector(arc.start, arc.width, low, high)
        first = (other.start - self.start + math.pi) % FULL - math.pi
        start, end = max(first, 0.0), min(first + other.width, self.width)
        return Sector(self.start + start, end - start, low, high) if start <= end else None


ALL = Sector(0.0, FULL)
"""All directions."""


def overlap(sectors: Sequence[Sector], spans: Spans) -> np.ndarray:
    """Return a mask (sectors, n) of the things that have any direction in common with each sector."""
    start, width, low, high = np.array([(each.start, each.width, each.low, each.high) for each in sectors]).T[..., None]
    first = (spans.start - start + np.pi) % FULL - np.pi
    is_across = (np.maximum(first, 0.0) <= np.minimum(first + spans.width, width)) | (spans.width >= FULL)
    return np.asarray((is_across | (width >= FULL)) & (spans.low <= high) & (spans.high >= low))


def _slope(rise: float, away: float) -> float:
    return rise / away if away > 0.0 else math.copysign(math.inf, rise)
