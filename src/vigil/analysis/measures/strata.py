"""Strata: groups of a run's episodes, by size of the target, template, constraint, rooms of the house and distance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vigil.analysis.measures.metrics import rate_columns
from vigil.analysis.measures.rows import values
from vigil.protocol.families import FAMILIES, Family
from vigil.scoring.rates import Counts, count, rows_where
from vigil.scoring.target_strata import DISTANCE_BANDS_M, SIZE_OF_CATEGORY, distance_band

_SIZES = ("large", "medium", "small")
_BANDS = tuple(distance_band(distance_m) for distance_m in (0.0, *DISTANCE_BANDS_M))
_CONSTRAINED: tuple[Family, ...] = ("CR",)
_BY_SIZE: tuple[Family, ...] = tuple(code for code, spec in FAMILIES.items() if spec.stratum == "target_size")
_BY_DISTANCE: tuple[Family, ...] = tuple(code for code, spec in FAMILIES.items() if spec.stratum == "distance")
_BY_TEMPLATE: tuple[Family, ...] = tuple(
    code for code in FAMILIES if code not in (*_CONSTRAINED, *_BY_SIZE, *_BY_DISTANCE)
)


@dataclass(frozen=True, slots=True)
class Stratum:
    """Name and counts of a group of episodes."""

    name: str
    counts: Counts


def by_stratum(rows: pd.DataFrame) -> dict[str, list[Stratum]]:
    """Return, for each criterion, the strata that have episodes."""
    facts, of_family = rate_columns(rows), values(rows, "family", str)
    found: dict[str, list[Stratum]] = {}
    for way, (families, names_of) in STRATA.items():
        names = np.where(np.isin(of_family, families), np.array(names_of(rows), dtype=object), "")
        shown = sorted(set(names) - {""}, key=_sort_key)
        found[way] = [Stratum(name, count(rows_where(facts, names == name))) for name in shown]
    return found


def _sort_key(name: str) -> tuple[int, str]:
    """Return the sort key of a stratum: sizes and distances in their usual order, templates in the order of
    families."""
    known = (*_SIZES, *_BANDS, *FAMILIES)
    word = name if name in known else name.split()[0]
    return known.index(word) if word in known else len(known), name


def _sizes(rows: pd.DataFrame) -> list[str]:
    """Return the size class of each target. Some categories have a fixed class; for others, the pack states it."""
    pairs = zip(values(rows, "target", object), values(rows, "target_size", object), strict=True)
    return [SIZE_OF_CATEGORY.get(target, size) or "" for target, size in pairs]


def _templates(rows: pd.DataFrame) -> list[str]:
    pairs = zip(values(rows, "family", str), values(rows, "template", object), strict=True)
    return [f"{family} {template}" if template else "" for family, template in pairs]


def _constraints(rows: pd.DataFrame) -> list[str]:
    return list(values(rows, "template", object))


def _rooms(rows: pd.DataFrame) -> list[str]:
    return [f"{rooms:.0f}" if np.isfinite(rooms) else "" for rooms in values(rows, "rooms")]


def _distances(rows: pd.DataFrame) -> list[str]:
    return [distance_band(distance_m) if np.isfinite(distance_m) else "" for distance_m in values(rows, "distance_m")]


STRATA: dict[str, tuple[Sequence[Family], Callable[[pd.DataFrame], list[str]]]] = {
    f"Target size ({', '.join(_BY_SIZE)})": (_BY_SIZE, _sizes),
    f"Template ({', '.join(_BY_TEMPLATE)})": (_BY_TEMPLATE, _templates),
    f"Constraint ({', '.join(_CONSTRAINED)})": (_CONSTRAINED, _constraints),
    "Rooms of the house (all families)": (tuple(FAMILIES), _rooms),
    f"Distance from start to target ({', '.join(_BY_DISTANCE)})": (_BY_DISTANCE, _distances),
    "Distance from start to target (all families)": (tuple(FAMILIES), _distances),
}
"""Criterion -> families to which it applies, and the function that returns the name of each episode's stratum; the name
is empty for an episode without a stratum."""
