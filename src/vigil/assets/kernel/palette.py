"""Colours by code and by word, the words that people use for colours, and random choices of colours."""

import re
import tomllib
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

Rgb = tuple[float, float, float]
"""Red, green and blue, 0..1."""
TABLES: dict[str, Any] = tomllib.loads((Path(__file__).parents[1] / "materials.toml").read_text(encoding="utf-8"))
"""Name of a table of materials or colours -> its rows."""
WORDS: dict[str, str] = TABLES["words"]
"""Word in names of materials -> code of its colour."""
COLOURS: dict[str, str] = TABLES["palette"]
"""Word that people use for a colour -> code of the colour."""

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


def rgb(code: str) -> Rgb | None:
    """Return the colour of "#rrggbb", "rrggbb" or a word in WORDS; None for any other text."""
    found = re.fullmatch(r"#?([0-9a-fA-F]{6})", code)
    digits = found.group(1) if found else WORDS.get(code.lower())
    if digits is None:
        return None
    return int(digits[0:2], 16) / 255, int(digits[2:4], 16) / 255, int(digits[4:6], 16) / 255


def code_of(colour: Sequence[float]) -> str:
    """Return the code "#rrggbb" of a colour whose parts are 0..1."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)


def blend(a: Rgb, b: Rgb, part: float) -> Rgb:
    """Return a mixture of two colours: `a` if `part` is 0, `b` if `part` is 1."""
    red, green, blue = (x + part * (y - x) for x, y in zip(a, b, strict=True))
    return red, green, blue


def guess(name: str) -> Rgb:
    """Return a muted colour that depends only on `name`."""
    seed = zlib.crc32(name.encode())
    shade = 0.45 + 0.3 * ((seed >> 8) % 256) / 255
    warm = 0.06 * ((seed % 256) / 127.5 - 1)
    return shade + warm, shade, shade - warm


def word_for(red: int, green: int, blue: int) -> str | None:
    """Return the word that people use for a colour (parts 0 .. 255); None if two words fit about equally."""
    far = _distances(red, green, blue)
    first, second = sorted(far, key=far.__getitem__)[:2]
    return first if far[first] <= CLEARLY_NEARER * far[second] else None


def nearest_word(red: int, green: int, blue: int) -> str:
    """Return the word whose colour is nearest to a colour (parts 0 .. 255), even if the two differ much."""
    far = _distances(red, green, blue)
    return min(far, key=far.__getitem__)


def _distances(red: int, green: int, blue: int) -> dict[str, float]:
    place = _lab((red / 255, green / 255, blue / 255))
    return {name: float(np.linalg.norm(place - _lab(rgb(code)))) for name, code in COLOURS.items()}


def _lab(parts: Rgb | None) -> np.ndarray:
    """Return CIE L*a*b* of an sRGB colour (D65), with L* multiplied by the lightness weight."""
    values = np.array(parts, dtype=float)
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    x, y, z = np.cbrt(np.maximum(_XYZ @ linear / _WHITE, 1e-6))
    return np.array([LIGHTNESS_WEIGHT * (116.0 * y - 16.0), 500.0 * (x - y), 200.0 * (y - z)])
