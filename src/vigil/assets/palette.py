"""Colours by the words people use for them, and drawing lots among them."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

COLOURS = {
    "white": "#ecebe6",
    "cream": "#e4d8bd",
    "beige": "#cbb594",
    "grey": "#8b8d90",
    "dark grey": "#4b4e52",
    "black": "#1f2022",
    "brown": "#6b4628",
    "red": "#b4262b",
    "orange": "#d9722a",
    "yellow": "#e2b93b",
    "green": "#3f7f49",
    "light green": "#9cc07c",
    "teal": "#2f8386",
    "blue": "#2f5ba0",
    "light blue": "#8db5d6",
    "navy": "#22304f",
    "purple": "#6d4a8a",
    "pink": "#d98ea3",
}

T = TypeVar("T")


def one_of(rng: np.random.Generator, options: Sequence[T]) -> T:
    """Returns one of several options, all equally likely."""
    return options[int(rng.integers(len(options)))]


def colour(rng: np.random.Generator, *names: str) -> tuple[str, str]:
    """Returns one of the named colours (of all without names) as its word and "#rrggbb"."""
    name = one_of(rng, names or tuple(COLOURS))
    return name, COLOURS[name]
