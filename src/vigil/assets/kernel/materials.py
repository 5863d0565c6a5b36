"""Materials: every name stands for a colour, a texture and a shine.

There are two kinds of names. The project's own names are "kind/variant": "wood/oak", "wood/#6b4a2e", "metal/brushed",
"fabric/#aa3322", "plastic/red", "glass", "glow/#ffeecc", "screen/3", "picture/7", "print/news" (see `_KINDS`). Any
other name is understood as a material name of AI2-THOR, from its words: "WoodFloorsCrossRED" means a red parquet, and
"bathroomTilesBlue" means small blue tiles. A name without a known word means a plain colour, so every name has a
material.

Textures are neutral: the visible colour is rgba times texture. Uv (0, 0) is the bottom left of a texture, and row 0 of
its array is the top. A mesh's uvs are metres; divided by `metres`, they count repeats. Pictures fill uv 0..1.
"""

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from vigil.assets.kernel import palette, textures
from vigil.assets.kernel.palette import Rgb


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """The look of a surface."""

    name: str
    rgba: tuple[float, float, float, float]
    texture_name: str | None = None
    metres: float = 1.0
    """Length (m) of one repeat of the texture."""
    shininess: float = 0.2
    emission: float = 0.0
    is_metal: bool = False
    """Whether the surface reflects its surroundings in its own colour."""
    is_mirror: bool = False

    @property
    def texture(self) -> np.ndarray | None:
        """Return the texture (h, w, 3), uint8 and read-only; None without a texture. It is drawn on first use and
        shared."""
        return None if self.texture_name is None else textures.texture(self.texture_name)


def _kind(name: str, colour: str, alpha: float = 1.0, **look: Any) -> Material:
    red, green, blue = palette.rgb(colour) or (1.0, 1.0, 1.0)
    return Material(name, (red, green, blue, alpha), **look)


_KINDS = {name: _kind(name, **row) for name, row in palette.TABLES["kinds"].items()}
"""Kind of surface -> its look, in the colour that is used if a material's name does not contain a colour."""
_FITTED = frozenset({"picture", "screen", "cover", "print"})
_DARKER, _LIGHTER = ("dark", "dull"), ("light", "pale", "clean")

_SPECIES: dict[str, str] = palette.TABLES["species"]
_COLOURS_OF: dict[str, dict[str, str]] = {
    "wood": _SPECIES, "planks": _SPECIES, "parquet": _SPECIES, "metal": palette.TABLES["metals"],
    "brick": {"red": "9c4c3a"},
}  # fmt: skip
"""Kind of surface -> colours of the words that have a special meaning for this kind, e.g. "red" for bricks."""


@lru_cache(maxsize=4096)
def material(name: str, tint: Rgb | None = None) -> Material:
    """Return the material that `name` stands for; a `tint` (r, g, b in 0..1) replaces the material's colour."""
    kind_name, slash, variant = name.partition("/")
    if slash and kind_name in _KINDS:
        table = _COLOURS_OF.get(kind_name, {})
        own = None if kind_name in _FITTED else palette.rgb(table.get(variant, variant))
        return _made(name, kind_name, tint or own, variant)
    if name in _KINDS:
        return _made(name, name, tint, "0")
    return _made(name, *_by_words(name, tint), "0")


def _made(name: str, kind_name: str, colour: Rgb | None, variant: str) -> Material:
    kind = _KINDS[kind_name]
    texture_name = f"{kind.texture_name}/{variant}" if kind_name in _FITTED else kind.texture_name
    return replace(kind, name=name, rgba=(*(colour or kind.rgba[:3]), kind.rgba[3]), texture_name=texture_name)


def _by_words(name: str, tint: Rgb | None) -> tuple[str, Rgb | None]:
    """Return the kind and colour that the words of an AI2-THOR material name mean."""
    plain = re.sub(r"[_\W]+", " ", name.lower()).strip()
    for start, (kind, colour) in palette.TABLES["whole_names"].items():
        if plain.startswith(start):
            return kind, tint or palette.rgb(colour)
    kind = next((kind for word, kind in palette.TABLES["kind_words"] if word in plain), "plastic")
    return kind, tint or _colour_in(plain, kind) or (palette.guess(name) if kind == "plastic" else None)


def _colour_in(plain: str, kind: str) -> Rgb | None:
    joined = plain.replace(" ", "")
    special = next((colour for word, colour in palette.TABLES["colour_words"] if word in joined), None)
    if special is not None:
        return palette.rgb(special)
    table = _COLOURS_OF.get(kind, {})
    words = sorted({*table, *palette.WORDS}, key=lambda word: (-len(word), word))
    found = next((word for word in words if word in joined and not _is_accident(word, joined)), None)
    base = palette.rgb(table.get(found, found)) if found else _KINDS[kind].rgba[:3]
    if base is None:
        return None
    if found not in _DARKER and any(word in joined for word in _DARKER):
        return palette.blend(base, (0.1, 0.09, 0.08), 0.45)
    if found not in _LIGHTER and any(word in joined for word in _LIGHTER) and "lightfix" not in joined:
        return palette.blend(base, (1.0, 1.0, 0.98), 0.3)
    return base


def _is_accident(word: str, joined: str) -> bool:
    """Return whether a colour word occurs only as part of another word ("red" in "shredded", "tan" in "standing")."""
    return any(word in trap and trap in joined for trap in ("textured", "shredded", "brushed", "standing", "washed"))
