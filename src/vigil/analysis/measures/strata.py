"""Strata: groups of a run's episodes, by size of the target, template, constraint, rooms of the house and distance."""

from collections.abc import Callable
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
    facts = rate_columns(rows)
    found = {way: names_of(rows) for way, names_of in STRATA.items()}
    return {
        way: [
            Stratum(name, count(rows_where(facts, names == name))) for name in sorted(set(names) - {""}, key=_sort_key)
        ]
        for way, names in found.items()
    }


def _sort_key(name: str) -> tuple[int, str]:
    """Return the sort key of a stratum: sizes and distances in their usual order, templates in the order of
    families."""
    known = (*_SIZES, *_BANDS, *FAMILIES)
    word = name if name in known else name.split()[0]
    return known.index(word) if word in known else len(known), name


def _is_of_family(rows: pd.DataFrame, *families: Family) -> np.ndarray:
    return np.isin(values(rows, "family", str), families)


def _names_where(wanted: np.ndarray, names: list[str]) -> np.ndarray:
    """Return the names of the episodes for which `wanted` is true, and an empty name for the others."""
    return np.where(wanted, np.array(names, dtype=object), "")


def _size(rows: pd.DataFrame) -> np.ndarray:
    """Return the size class of each target. Some categories have a fixed class; for others, the pack states it."""
    pairs = zip(values(rows, "target", object), values(rows, "target_size", object), strict=True)
    sizes = [SIZE_OF_CATEGORY.get(target, size) or "" for target, size in pairs]
    return _names_where(_is_of_family(rows, *_BY_SIZE), sizes)


def _template(rows: pd.DataFrame) -> np.ndarray:
    pairs = zip(values(rows, "family", str), values(rows, "template", object), strict=True)
    names = [f"{family} {template}" if template else "" for family, template in pairs]
    return _names_where(_is_of_family(rows, *_BY_TEMPLATE), names)


def _rooms(rows: pd.DataFrame) -> np.ndarray:
    rooms = values(rows, "rooms")
    return _names_where(np.isfinite(rooms), [f"{count:.0f}" for count in rooms])


def _distance(rows: pd.DataFrame) -> np.ndarray:
    distances = values(rows, "distance_m")
    return _names_where(np.isfinite(distances), [distance_band(distance_m) for distance_m in distances])


def _constraint(rows: pd.DataFrame) -> np.ndarray:
    return _names_where(_is_of_family(rows, *_CONSTRAINED), list(values(rows, "template", object)))


def _distance_of_some(rows: pd.DataFrame) -> np.ndarray:
    return np.where(_is_of_family(rows, *_BY_DISTANCE), _distance(rows), "")


STRATA: dict[str, Callable[[pd.DataFrame], np.ndarray]] = {
    f"Target size ({', '.join(_BY_SIZE)})": _size,
    f"Template ({', '.join(_BY_TEMPLATE)})": _template,
    f"Constraint ({', '.join(_CONSTRAINED)})": _constraint,
    "Rooms of the house (all families)": _rooms,
    f"Distance from start to target ({', '.join(_BY_DISTANCE)})": _distance_of_some,
    "Distance from start to target (all families)": _distance,
}
"""Criterion -> function that returns the name of each episode's stratum; empty for an episode without a stratum."""
