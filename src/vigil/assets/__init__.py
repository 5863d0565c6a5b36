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


@lru_cache(maxsize=4096)
def make(category: str, size: Vec3, variant: int, levels: tuple[float, ...] = ()) -> Asset:
    """Returns the asset of a category that fills `size`; a category without a maker becomes a labelled box.

    `levels` are heights (m) above the bottom at which things rest in or on it. Same arguments, same bytes.
    """
    rng = np.random.default_rng([zlib.crc32(category.encode()), variant])
    room = Vec3(*(max(float(length), _SMALLEST_M) for length in size))
    maker = MAKERS.get(category)
    if maker is None:
        return plain.labelled_box(category, room, rng)
    return maker(room, rng, tuple(sorted(levels)))
