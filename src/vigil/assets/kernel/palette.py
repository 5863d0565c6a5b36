"""Colours and the words that people use for them, and random choices of colours."""

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

CLEARLY_NEARER = 0.75
"""The nearest colour word is used only if its distance is at most this share of the distance of the next word."""
LIGHTNESS_WEIGHT = 0.5
"""Weight of lightness in the distance of two colours. People name the hue first, so a dark green is still green."""
_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_WHITE = np.array([0.9505, 1.0, 1.089])

T = TypeVar("T")


def one_of(rng: np.random.Generator, options: Sequence[T]) -> T:
    """Return one of several options; all are equally likely."""
    return options[int(rng.integers(len(options)))]


def colour(rng: np.random.Generator, *names: str) -> tuple[str, str]:
    """Return the word and the "#rrggbb" of a random colour: one of the named colours, or any if none is named."""
    name = one_of(rng, names or tuple(COLOURS))
    return name, COLOURS[name]


def word_for(red: int, green: int, blue: int) -> str | None:
    """Return the word that people use for a colour (parts 0 .. 255); None if two words fit about equally."""
    place = _lab(red, green, blue)
    far = {name: float(np.linalg.norm(place - _lab(*_parts(code)))) for name, code in COLOURS.items()}
    first, second = sorted(far, key=far.__getitem__)[:2]
    return first if far[first] <= CLEARLY_NEARER * far[second] else None


def nearest_word(red: int, green: int, blue: int) -> str:
    """Return the word whose colour is nearest to a colour (parts 0 .. 255), even if the two differ much."""
    place = _lab(red, green, blue)
    return min(COLOURS, key=lambda name: float(np.linalg.norm(place - _lab(*_parts(COLOURS[name])))))


def _parts(code: str) -> tuple[int, int, int]:
    red, green, blue = (int(code[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue


def _lab(red: int, green: int, blue: int) -> np.ndarray:
    """Return CIE L*a*b* of an sRGB colour (D65), with L* multiplied by the lightness weight."""
    parts = np.array([red, green, blue]) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(np.maximum(_XYZ @ linear / _WHITE, 1e-6))
    return np.array([LIGHTNESS_WEIGHT * (116.0 * y - 16.0), 500.0 * (x - y), 200.0 * (y - z)])
