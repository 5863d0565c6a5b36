"""Assets: things of a house as shapes, at any size, made on demand.

`make` looks the maker of a category up in `MAKERS`; a module of makers exports its own `MAKERS` table
and stands in `_MODULES`.
"""

import zlib
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from vigil.assets import (
    appliances,
    bathroom,
    beds,
    containers,
    cookware,
    crockery,
    decor,
    electronics,
    food,
    household,
    kitchen,
    lighting,
    openings,
    ornaments,
    personal,
    plain,
    sanitary,
    seating,
    sofas,
    storage,
    tables,
    textiles,
    vessels,
)
from vigil.assets.asset import Asset
from vigil.pose import Vec3

Maker = Callable[[Vec3, np.random.Generator, Sequence[float]], Asset]

_MODULES = (
    appliances,
    bathroom,
    beds,
    containers,
    cookware,
    crockery,
    decor,
    electronics,
    food,
    household,
    kitchen,
    lighting,
    openings,
    ornaments,
    personal,
    sanitary,
    seating,
    sofas,
    storage,
    tables,
    textiles,
    vessels,
)

MAKERS: dict[str, Maker] = {name: maker for module in _MODULES for name, maker in module.MAKERS.items()}

_SMALLEST_M = 0.002


_NEAR_M = 0.025
"""A surface so near to a level serves it."""


@lru_cache(maxsize=4096)
def make(category: str, size: Vec3, variant: int, levels: tuple[float, ...] = ()) -> Asset:
    """Returns the asset of a category that fills `size`; a category without a maker becomes a labelled box.

    `levels` are heights (m) above the bottom at which things rest in or on it: they change the shape only where the
    usual one has no surface at such a height. Same arguments, same bytes.
    """
    room = Vec3(*(max(float(length), _SMALLEST_M) for length in size))
    maker = MAKERS.get(category)
    if maker is None:
        return plain.labelled_box(category, room, _stream(category, variant))
    if levels:
        usual = make(category, size, variant)
        tops = [surface.center.y + room.y / 2 for surface in usual.surfaces]
        if all(any(abs(level - top) < _NEAR_M for top in tops) for level in levels):
            return usual
    return maker(room, _stream(category, variant), tuple(sorted(levels)))


def _stream(category: str, variant: int) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(category.encode()), variant])
