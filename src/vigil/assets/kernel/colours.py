"""Colours of materials, by word and by hex code."""

import re
import zlib

Rgb = tuple[float, float, float]

WORDS: dict[str, str] = {
    "almond": "e6d5bd", "amber": "d98c2b", "aqua": "58b8b4", "beige": "d9c8a9", "black": "26262a", "blue": "4a6fa5",
    "bronze": "8c6a3f", "brown": "7a5236", "burgundy": "6d2334", "charcoal": "3a3d42", "cherry": "8a3f2b",
    "copper": "b87348", "cream": "efe4cc", "creame": "efe4cc", "eggshell": "ebe3d0", "gold": "caa23c",
    "green": "5c8a58", "gray": "8e9092", "grey": "8e9092", "ivory": "f1ead8", "lavender": "a99bc4",
    "maroon": "6b2430", "mint": "a9d3bd", "mustard": "c99a2e", "navy": "2b3a5c", "olive": "7a7b45",
    "orange": "d27f3e", "pink": "d8a3a8", "plum": "6b3f5e", "purple": "72538f", "red": "a83a35", "rose": "c08a86",
    "sand": "d4c19c", "sienna": "9a5a38", "silver": "b9bcc0", "tan": "cdb28c", "taupe": "8f8173", "teal": "3f8a88",
    "terracotta": "b8674a", "turquoise": "5fb9b3", "violet": "7b5ea7", "white": "f2f1ee", "yellow": "e3c264",
}  # fmt: skip


def rgb(code: str) -> Rgb | None:
    """Return the colour of "#rrggbb", "rrggbb" or a colour word; None for any other text."""
    found = re.fullmatch(r"#?([0-9a-fA-F]{6})", code)
    digits = found.group(1) if found else WORDS.get(code.lower())
    if digits is None:
        return None
    return int(digits[0:2], 16) / 255, int(digits[2:4], 16) / 255, int(digits[4:6], 16) / 255


def code(colour: Rgb) -> str:
    """Return the code "#rrggbb" of a colour whose components are 0..1."""
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in colour)


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
