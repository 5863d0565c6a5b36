"""Random generators for the stages of house generation. Each depends only on the seed, spec, version and stage."""

import hashlib
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from vigil.protocol.house import canonical_json

GENERATOR_VERSION = "7"
"""Version of the house generator; it is raised whenever a seed and spec would otherwise give another house."""
STREAM_VERSION = "4"
"""Earliest version of the generator that draws the same random numbers as this one for the same seed and spec.

Since that version, the same objects are chosen for a house; only the shapes that are made for them have changed.
"""

Item = TypeVar("Item")


def generator(*key: object) -> np.random.Generator:
    """Return the random generator for a key of numbers and words."""
    digest = hashlib.sha256(canonical_json([STREAM_VERSION, *(str(part) for part in key)])).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "big"))


def pick(rng: np.random.Generator, items: Sequence[Item]) -> Item:
    """Return one item at random."""
    return items[int(rng.integers(len(items)))]


def pick_weighted(rng: np.random.Generator, items: Sequence[Item], weights: Sequence[float]) -> Item:
    """Return one item at random, in proportion to its weight."""
    edges = np.cumsum(np.asarray(weights, dtype=float))
    return items[min(int(np.searchsorted(edges, rng.random() * edges[-1], side="right")), len(items) - 1)]


def shuffled(rng: np.random.Generator, items: Sequence[Item]) -> list[Item]:
    """Return the items in random order."""
    return [items[int(index)] for index in rng.permutation(len(items))]


def chance(rng: np.random.Generator, probability: float) -> bool:
    """Return True with the given probability."""
    return bool(rng.random() < probability)
