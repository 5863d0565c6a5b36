"""What a person calls a thing by its looks, where that is not what the catalog calls it.

A counter's doors are those of a cabinet, a strip beside a washbasin is no kitchen counter, and a stool with white legs
under a blue seat is no white stool.
"""

from collections import defaultdict
from functools import lru_cache

import numpy as np

from vigil.assets.kernel.asset import Asset, Mesh
from vigil.assets.kernel.materials import material
from vigil.assets.kernel.palette import nearest_word
from vigil.scene.supports import surface_named
from vigil.scene.things import Thing

WITH_DOORS = frozenset({"CounterTop"})
"""Base cabinets under a worktop, always."""
VANITY_HEIGHT_M = 0.5
"""A taller washbasin stands on a foot or on a cabinet of painted wood."""
PAINTED = "paint/"
SEATS = frozenset({"Chair", "Footstool", "Ottoman", "Stool"})
MIN_COLOUR_SHARE, MIN_SEAT_COLOUR_SHARE = 0.4, 0.6
"""Of what one sees of a thing, so much is of the colour that names it; of a seat more than its legs can be."""
_LOOKING_DOWN_DEG = 30.0
_AROUND = np.radians(np.arange(0.0, 360.0, 45.0))
_LEVEL, _UP = np.cos(np.radians(_LOOKING_DOWN_DEG)), np.sin(np.radians(_LOOKING_DOWN_DEG))
_TOWARDS = np.stack([_LEVEL * np.cos(_AROUND), np.full_like(_AROUND, _UP), _LEVEL * np.sin(_AROUND)], axis=1)
"""Unit vectors from a thing to who looks at it, from eight sides."""


def names_by_appearance(thing: Thing) -> tuple[str, ...]:
    """Return what else a thing would be called by who sees it: a counter with doors is a cabinet, too."""
    is_vanity = thing.category == "Sink" and thing.asset.size.y > VANITY_HEIGHT_M
    has_doors = is_vanity and any(part.material.startswith(PAINTED) for part in thing.asset.parts)
    return ("cabinet",) if has_doors or thing.category in WITH_DOORS else ()


def is_open_shelf(thing: Thing, name: str | None) -> bool:
    """Whether a surface of a thing is a shelf that nobody opens: what lies there lies on it, not in the thing."""
    surface = surface_named(thing, name)
    is_shelved = any(each.needs_opening or each.name.startswith("shelf") for each in thing.asset.surfaces)
    return surface is not None and surface.is_inside and not surface.needs_opening and is_shelved


def has_misleading_name(category: str, room: str | None) -> bool:
    """Whether nobody would call a thing there by its name: a worktop beside a washbasin is not "the countertop"."""
    return category == "CounterTop" and room == "bathroom"


def min_colour_share(category: str) -> float:
    """Return which share of what one sees of a thing a colour must have to name it."""
    return MIN_SEAT_COLOUR_SHARE if category in SEATS else MIN_COLOUR_SHARE


@lru_cache(maxsize=1024)
def colour_shares(*assets: Asset) -> dict[str, float]:
    """Return word for a colour -> the share of it in what one sees of a thing from around; nothing for glass.

    Furniture with drawers of its own is several assets.
    """
    seen: defaultdict[str, float] = defaultdict(float)
    for part in (part for asset in assets for part in asset.parts):
        if not part.is_glass and part.shown != "on":
            look = material(part.material)
            rgb = np.array(look.rgba[:3])
            if look.texture is not None:
                rgb = rgb * look.texture.reshape(-1, 3).mean(axis=0) / 255
            seen[nearest_word(*(round(255 * float(value)) for value in rgb))] += _seen_area(part.mesh)
    whole = sum(seen.values())
    return {word: area / whole for word, area in seen.items()}


def _seen_area(mesh: Mesh) -> float:
    """Return the area of a mesh as it is seen from around and a little above, hidden or not (m2)."""
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    return float(np.maximum(normals @ _TOWARDS.T, 0.0).mean(axis=1).sum())
