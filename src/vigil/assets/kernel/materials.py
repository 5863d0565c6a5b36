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
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vigil.assets.kernel import colours, textures
from vigil.assets.kernel.colours import Rgb


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """The look of a surface."""

    name: str
    rgba: tuple[float, float, float, float]
    texture_name: str | None
    metres: float
    """Length (m) of one repeat of the texture."""
    shininess: float
    emission: float
    is_metal: bool
    """Whether the surface reflects its surroundings in its own colour."""
    is_mirror: bool

    @property
    def texture(self) -> np.ndarray | None:
        """Return the texture (h, w, 3), uint8 and read-only; None without a texture. It is drawn on first use and
        shared."""
        return None if self.texture_name is None else textures.texture(self.texture_name)


_METAL_KINDS = frozenset({"metal", "chrome", "mirror"})


@dataclass(frozen=True, slots=True)
class _Kind:
    texture: str | None = None
    metres: float = 1.0
    shininess: float = 0.2
    emission: float = 0.0
    alpha: float = 1.0
    colour: str = "d8d6d2"
    """Colour that is used if the material's name does not contain a colour."""


_KINDS: dict[str, _Kind] = {
    "wood": _Kind("wood", 0.7, 0.3, colour="a87848"),
    "paint": _Kind("paint", 0.7, 0.3, colour="f2f1ee"),
    "planks": _Kind("planks", 1.4, 0.3, colour="b08a5c"),
    "parquet": _Kind("parquet", 1.6, 0.3, colour="b08a5c"),
    "wicker": _Kind("wicker", 0.24, 0.1, colour="c9a56b"),
    "metal": _Kind("brushed", 0.5, 0.6, colour="b9bcc0"),
    "chrome": _Kind(None, 1.0, 0.9, colour="c9ccd0"),
    "plastic": _Kind(None, 1.0, 0.5, colour="d8d6d2"),
    "rubber": _Kind(None, 1.0, 0.1, colour="2c2c2e"),
    "ceramic": _Kind(None, 1.0, 0.8, colour="f4f2ee"),
    "wax": _Kind(None, 1.0, 0.3, colour="f0e6cc"),
    "fabric": _Kind("weave", 0.3, 0.05, colour="8a8f96"),
    "velvet": _Kind("velvet", 0.5, 0.1, colour="6d4a63"),
    "knit": _Kind("knit", 0.25, 0.05, colour="b7aa98"),
    "stripes": _Kind("stripes", 0.4, 0.05, colour="8fa3b8"),
    "plaid": _Kind("plaid", 0.4, 0.05, colour="b05a4a"),
    "dots": _Kind("dots", 0.4, 0.05, colour="a9b8c4"),
    "leather": _Kind("leather", 0.35, 0.3, colour="5f4030"),
    "carpet": _Kind("carpet", 0.6, 0.0, colour="a39a8c"),
    "plaster": _Kind("plaster", 2.0, 0.05, colour="eceae4"),
    "concrete": _Kind("concrete", 1.5, 0.1, colour="b4b2ae"),
    "brick": _Kind("brick", 1.0, 0.05, colour="b0654c"),
    "tiles": _Kind("tiles", 0.8, 0.6, colour="e2ded6"),
    "small_tiles": _Kind("small_tiles", 0.9, 0.6, colour="dcd8d0"),
    "subway": _Kind("subway", 0.8, 0.6, colour="eeece6"),
    "hexagons": _Kind("hexagons", 0.7, 0.6, colour="e6e4de"),
    "checker": _Kind("checker", 1.2, 0.6, colour="f2f1ee"),
    "marble": _Kind("marble", 1.2, 0.6, colour="eceae6"),
    "marble_tiles": _Kind("marble_tiles", 1.2, 0.6, colour="eceae6"),
    "granite": _Kind("granite", 0.5, 0.6, colour="a5a29d"),
    "stone": _Kind("concrete", 0.6, 0.2, colour="a39d92"),
    "cardboard": _Kind("cardboard", 0.4, 0.05, colour="b98e5f"),
    "paper": _Kind("paper", 0.3, 0.05, colour="f3f1ea"),
    "foam": _Kind("bumps", 0.06, 0.05, colour="e9d45f"),
    "skin": _Kind("speckle", 0.12, 0.4, colour="c9553a"),
    "streaks": _Kind("streaks", 0.12, 0.3, colour="b03a2e"),
    "leaf": _Kind("leaf", 0.1, 0.2, colour="4f8a3f"),
    "grass": _Kind("grass", 2.0, 0.0, colour="ffffff"),
    "glass": _Kind(None, 1.0, 0.9, alpha=0.25, colour="cfe3e6"),
    "smoked_glass": _Kind(None, 1.0, 0.9, alpha=0.5, colour="2c3033"),
    "water": _Kind(None, 1.0, 0.9, alpha=0.6, colour="9cc7dc"),
    "mirror": _Kind(None, 1.0, 0.9, colour="b7c4cc"),
    "gleam": _Kind(None, 1.0, 0.0, alpha=0.06, colour="ffffff"),
    "glow": _Kind(None, 1.0, 0.0, 0.7, colour="ffeecc"),
    "flame": _Kind(None, 1.0, 0.0, 0.7, colour="ffb347"),
    "picture": _Kind("picture", 1.0, 0.1, colour="ffffff"),
    "screen": _Kind("screen", 1.0, 0.3, 0.6, colour="ffffff"),
    "cover": _Kind("cover", 1.0, 0.3, colour="ffffff"),
    "print": _Kind("print", 1.0, 0.05, colour="ffffff"),
}
_FITTED = frozenset({"picture", "screen", "cover", "print"})

_SPECIES: dict[str, str] = {
    "ash": "d2bc95", "beech": "cfa577", "birch": "dcc59d", "black": "37312e", "cherry": "94502f", "dark": "5d3f2b",
    "ebony": "3a2e28", "grey": "9a958d", "light": "d3b184", "mahogany": "74392a", "maple": "dcb886", "medium": "9b6c43",
    "oak": "bf935c", "pale": "e0cba6", "pine": "deb573", "red": "8c4630", "rich": "8b5430", "tan": "c8a272",
    "teak": "a66f3d", "walnut": "6e4a31", "white": "efece4", "worn": "a08a70",
}  # fmt: skip
_METALS: dict[str, str] = {
    "aluminum": "c3c6c9", "black": "303236", "brass": "c9a24e", "brushed": "b4b7ba", "copper": "bd7650",
    "dark": "55585c", "gold": "d0a845", "iron": "4a4a4c", "steel": "aeb2b6", "white": "ececea",
}  # fmt: skip

_COLOURS_OF = {
    "wood": _SPECIES, "planks": _SPECIES, "parquet": _SPECIES, "metal": _METALS, "brick": {"red": "9c4c3a"},
}  # fmt: skip
"""Kind of surface -> colours of the words that have a special meaning for this kind, e.g. "red" for bricks."""


@lru_cache(maxsize=4096)
def material(name: str, tint: Rgb | None = None) -> Material:
    """Return the material that `name` stands for; a `tint` (r, g, b in 0..1) replaces the material's colour."""
    kind_name, slash, variant = name.partition("/")
    if slash and kind_name in _KINDS:
        table = _COLOURS_OF.get(kind_name, {})
        own = None if kind_name in _FITTED else colours.rgb(table.get(variant, variant))
        return _made(name, kind_name, tint or own, variant)
    if name in _KINDS:
        return _made(name, name, tint, "0")
    return _made(name, *_by_words(name, tint), "0")


def _made(name: str, kind_name: str, colour: Rgb | None, variant: str) -> Material:
    kind = _KINDS[kind_name]
    red, green, blue = colour or colours.rgb(kind.colour) or (1.0, 1.0, 1.0)
    texture_name = f"{kind.texture}/{variant}" if kind_name in _FITTED else kind.texture
    return Material(
        name=name,
        rgba=(red, green, blue, kind.alpha),
        texture_name=texture_name,
        metres=kind.metres,
        shininess=kind.shininess,
        emission=kind.emission,
        is_metal=kind_name in _METAL_KINDS,
        is_mirror=kind_name == "mirror",
    )


_WHOLE_NAMES: dict[str, tuple[str, str]] = {
    "beams": ("planks", "8b6a48"),
    "bedroomfloor": ("planks", "b98f63"),
    "brownpot": ("plaster", "8a5f45"),
    "greyfloor": ("planks", "a5a29c"),
    "kitchenfloor": ("tiles", "d9cdb8"),
    "kitchenwalls": ("plaster", "e9e0cc"),
    "lightwhite": ("plaster", "f4f3f0"),
    "no name": ("fabric", "8a8f96"),
    "orangecabinet": ("planks", "c07a3e"),
    "purewhite": ("plaster", "f5f4f1"),
    "pvclit": ("plaster", "f0efec"),
    "robinegg": ("planks", "9cc3c0"),
    "test scene physics floor": ("plastic", "b9bcc0"),
}
"""Names whose words are misleading: normalised name (or its beginning) -> kind and colour."""

_KIND_WORDS: tuple[tuple[str, str], ...] = (
    ("picture", "picture"), ("glasstiles", "small_tiles"), ("subway", "subway"), ("hextiles", "hexagons"),
    ("checkerboard", "checker"), ("bathroomtiles", "small_tiles"), ("smalltiles", "small_tiles"),
    ("smallkitchentiles", "small_tiles"), ("marbletiles", "marble_tiles"), ("marble floor", "marble_tiles"),
    ("granitetiles", "tiles"), ("fireplacebrick", "brick"), ("brick", "brick"), ("drywall", "plaster"),
    ("clothpattern", "fabric"), ("carpet", "carpet"),
    ("tile", "tiles"), ("marble", "marble"), ("granite", "granite"), ("countertop", "granite"),
    ("lamp shade", "fabric"), ("lamp", "metal"), ("furniture", "wood"), ("plaster", "plaster"),
    ("concrete", "concrete"), ("cross", "parquet"), ("slashhatch", "parquet"), ("planks", "planks"),
    ("floor", "planks"), ("carpet", "carpet"), ("rug", "carpet"), ("porcelain", "ceramic"), ("ceramic", "ceramic"),
    ("wicker", "wicker"), ("leather", "leather"), ("velvet", "velvet"), ("knit", "knit"), ("fabric", "fabric"),
    ("fabirc", "fabric"), ("cloth", "fabric"), ("cushion", "fabric"), ("cusion", "fabric"), ("pillow", "fabric"),
    ("blanket", "fabric"), ("bedsheet", "fabric"), ("sheet", "fabric"), ("mattress", "fabric"), ("curtain", "fabric"),
    ("satin", "fabric"), ("ottoman", "fabric"), ("wood mat", "wood"), ("wood brown", "wood"), ("wood white", "wood"),
    ("wood 1 mat", "wood"), ("wood 2 mat", "wood"), ("wood", "planks"), ("cabinet", "wood"), ("couchlegs", "wood"),
    ("framemat", "wood"),
    ("cardboard", "cardboard"), ("paper", "paper"),
    ("steel", "metal"), ("alumin", "metal"), ("chrome", "chrome"), ("foil", "metal"), ("metal", "metal"),
    ("meta", "metal"), ("iron", "metal"), ("gold", "metal"), ("brass", "metal"), ("copper", "metal"),
    ("coil", "metal"), ("castiron", "metal"), ("plastic", "plastic"), ("plasitc", "plastic"), ("rubber", "rubber"),
    ("wax", "wax"), ("candle", "wax"), ("screen", "plastic"), ("window", "glass"), ("glass", "glass"),
    ("sofa", "fabric"), ("couch", "fabric"), ("grunge", "concrete"), ("wall", "plaster"), ("leaves", "leaf"),
    ("lettuce", "leaf"), ("apple", "skin"), ("potato", "skin"), ("tomato", "skin"), ("bread", "skin"),
    ("plate", "ceramic"), ("bowl", "ceramic"), ("pot", "metal"), ("pan", "metal"), ("statue", "stone"),
    ("fertility", "stone"), ("soap", "wax"), ("basketball", "leather"),
)  # fmt: skip
"""Rows (part of a name in lower case, kind of surface); the first row whose part occurs in a name is used."""

_COLOUR_WORDS: tuple[tuple[str, str], ...] = (
    ("lightblue", "8fb4d6"), ("darkgreen", "3c5a3c"), ("offwhite", "ece8dc"), ("robinegg", "9cc3c0"),
    ("stainless", "aeb2b6"), ("castiron", "3c3c3e"), ("camo", "6a7350"), ("frosted", "e4ecec"),
    ("lettuce", "7fae4e"), ("tomato", "c43a2c"), ("potato", "c2a06a"), ("bread", "c98f4e"), ("apple", "b8332e"),
    ("basketball", "c4632c"),
)  # fmt: skip
_DARKER = ("dark", "dull")
_LIGHTER = ("light", "pale", "clean")


def _by_words(name: str, tint: Rgb | None) -> tuple[str, Rgb | None]:
    """Return the kind and colour that the words of an AI2-THOR material name mean."""
    plain = re.sub(r"[_\W]+", " ", name.lower()).strip()
    for start, (kind, colour) in _WHOLE_NAMES.items():
        if plain.startswith(start):
            return kind, tint or colours.rgb(colour)
    kind = next((kind for word, kind in _KIND_WORDS if word in plain), "plastic")
    return kind, tint or _colour_in(plain, kind) or (colours.guess(name) if kind == "plastic" else None)


def _colour_in(plain: str, kind: str) -> Rgb | None:
    joined = plain.replace(" ", "")
    special = next((colour for word, colour in _COLOUR_WORDS if word in joined), None)
    if special is not None:
        return colours.rgb(special)
    table = _COLOURS_OF.get(kind, {})
    words = sorted({*table, *colours.WORDS}, key=lambda word: (-len(word), word))
    found = next((word for word in words if word in joined and not _is_accident(word, joined)), None)
    base = colours.rgb(table.get(found, found)) if found else colours.rgb(_KINDS[kind].colour)
    if base is None:
        return None
    if found not in _DARKER and any(word in joined for word in _DARKER):
        return colours.blend(base, (0.1, 0.09, 0.08), 0.45)
    if found not in _LIGHTER and any(word in joined for word in _LIGHTER) and "lightfix" not in joined:
        return colours.blend(base, (1.0, 1.0, 0.98), 0.3)
    return base


def _is_accident(word: str, joined: str) -> bool:
    """Return whether a colour word occurs only as part of another word ("red" in "shredded", "tan" in "standing")."""
    return any(word in trap and trap in joined for trap in ("textured", "shredded", "brushed", "standing", "washed"))
