"""Names and colours by appearance, for things that people would not call what the catalogue calls them.

A counter with doors is also a cabinet; a worktop next to a washbasin is not a kitchen counter; and a stool with white
legs under a blue seat is not a white stool.
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
"""Categories of base cabinets under a worktop, which always have doors."""
VANITY_HEIGHT_M = 0.5
"""A washbasin higher than this (m) includes its foot, or a cabinet of painted wood."""
PAINTED = "paint/"
"""Beginning of the names of painted materials."""
SEATS = frozenset({"Chair", "Footstool", "Ottoman", "Stool"})
MIN_COLOUR_SHARE, MIN_SEAT_COLOUR_SHARE = 0.4, 0.6
"""Minimum share of a thing's visible area that a colour must have to name the thing. For seats it is higher, so that
the legs do not suffice."""
_LOOKING_DOWN_DEG = 30.0
_AROUND = np.radians(np.arange(0.0, 360.0, 45.0))
_LEVEL, _UP = np.cos(np.radians(_LOOKING_DOWN_DEG)), np.sin(np.radians(_LOOKING_DOWN_DEG))
_TOWARDS = np.stack([_LEVEL * np.cos(_AROUND), np.full_like(_AROUND, _UP), _LEVEL * np.sin(_AROUND)], axis=1)
"""Unit vectors (8, 3) from a thing towards viewers on eight sides who look down at the thing."""


def names_by_appearance(thing: Thing) -> tuple[str, ...]:
    """Return other names that people who see a thing may use: a counter with doors is also a cabinet."""
    is_vanity = thing.category == "Sink" and thing.asset.size.y > VANITY_HEIGHT_M
    has_doors = is_vanity and any(part.material.startswith(PAINTED) for part in thing.asset.parts)
    return ("cabinet",) if has_doors or thing.category in WITH_DOORS else ()


def is_open_shelf(thing: Thing, name: str | None) -> bool:
    """Return whether a thing's surface `name` is an open shelf: objects there are on a shelf, not in the thing."""
    surface = surface_named(thing, name)
    is_shelved = any(each.needs_opening or each.name.startswith("shelf") for each in thing.asset.surfaces)
    return surface is not None and surface.is_inside and not surface.needs_opening and is_shelved


def has_misleading_name(category: str, room: str | None) -> bool:
    """Return whether people in a room would not use a category's name, e.g. "countertop" for a bathroom worktop."""
    return category == "CounterTop" and room == "bathroom"


def min_colour_share(category: str) -> float:
    """Return the minimum share of a thing's visible area that a colour must have to name the thing."""
    return MIN_SEAT_COLOUR_SHARE if category in SEATS else MIN_COLOUR_SHARE


@lru_cache(maxsize=1024)
def colour_shares(*assets: Asset) -> dict[str, float]:
    """Return colour word -> share of a thing's visible area that has this colour. Glass does not count.

    `assets` are the thing's parts: furniture and each of its drawers are separate assets. Empty if all is glass.
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
    """Return the mean projected area (m2) of a mesh for viewers around and above it. Occlusion is ignored."""
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    return float(np.maximum(normals @ _TOWARDS.T, 0.0).mean(axis=1).sum())
