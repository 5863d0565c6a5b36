"""Assets: shapes of household things in any size, made on demand.

`make` looks up the maker of a category (the function that makes its assets) in `MAKERS`. Some makers are rows of data
(`makers/rows/*.toml`, read by `vigil.assets.kernel.rows`). Shapes that need code have a function in a module of
`vigil.assets.makers`; each of these modules exports a table `MAKERS`. `register` adds a category from outside the
package.
"""

import colorsys
import threading
import zlib
from pathlib import Path

import numpy as np
from cachetools import LRUCache, cached

from vigil.assets.catalog import CATALOG, CEILING, FLOOR, WALL, Category
from vigil.assets.kernel import shapes
from vigil.assets.kernel.arrange import Maker
from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.builder import Builder
from vigil.assets.kernel.palette import code_of
from vigil.assets.kernel.rows import makers_in
from vigil.assets.makers import kitchen, plants, small_things, storage, tables
from vigil.base.geometry import Vec3
from vigil.errors import SettingError, did_you_mean

ROWS = Path(__file__).parent / "makers" / "rows"
"""Folder of the TOML files with the makers that are rows of data."""

MAKERS: dict[str, Maker] = {**kitchen.MAKERS, **plants.MAKERS, **small_things.MAKERS, **storage.MAKERS, **tables.MAKERS}
for _path in sorted(ROWS.glob("*.toml")):
    MAKERS |= makers_in(_path)

MAX_ASSET_BYTES = 32 * 2**20
"""Greatest size in bytes of the meshes of all cached assets together. Those of a house of four rooms have 2.6 MB."""
_SMALLEST_M = 0.002
_LEVEL_TOLERANCE_M = 0.025
"""A surface counts as at a level (a height at which things rest) if their heights differ by at most this (m)."""


def make(category: str, size: Vec3, variant: int, levels: tuple[float, ...] = ()) -> Asset:
    """Return an asset of a category that fills `size`; a category without a maker becomes a labelled box.

    `levels` are heights (m) above the bottom at which things rest on or in the asset. They change the shape only if the
    usual shape lacks a surface at one of these heights. Equal arguments give equal bytes and, while cached, the same
    object.
    """
    standard = _make_cached(category, size, variant, ())
    tops = [surface.center.y + standard.size.y / 2 for surface in standard.surfaces]
    if all(any(abs(level - top) < _LEVEL_TOLERANCE_M for top in tops) for level in levels):
        return standard
    return _make_cached(category, size, variant, tuple(sorted(levels)))


def register(category: Category, maker: Maker) -> None:
    """Add a category and its maker to the catalogue, in this process only.

    The category's assets have ids of the form `vigil_NAME_NUMBER`, which houses can name. Houses that are generated
    afterwards may contain such assets, in the category's rooms and on the things in its `rests_on`. Raises SettingError
    when the name is taken or `rests_on` has an unknown category.
    """
    if CATALOG.get(category.name, category) != category or MAKERS.get(category.name, maker) is not maker:
        raise SettingError(f"Asset category {category.name!r} exists already. Choose another name.")
    known = {*CATALOG, FLOOR, WALL, CEILING}
    for name in category.rests_on:
        if name not in known:
            raise SettingError(
                f"Asset category {category.name!r} rests on {name!r}, which does not exist.{did_you_mean(name, known)}"
            )
    CATALOG[category.name], MAKERS[category.name] = category, maker
    _make_cached.cache_clear()


def _bytes_of(asset: Asset) -> int:
    meshes = (part.mesh for part in asset.parts)
    return sum(each.vertices.nbytes + each.faces.nbytes + each.normals.nbytes + each.uvs.nbytes for each in meshes)


@cached(LRUCache(MAX_ASSET_BYTES, getsizeof=_bytes_of), lock=threading.Lock())
def _make_cached(category: str, size: Vec3, variant: int, levels: tuple[float, ...]) -> Asset:
    room = Vec3(*(max(float(length), _SMALLEST_M) for length in size))
    maker = MAKERS.get(category)
    stream = np.random.default_rng([zlib.crc32(category.encode()), variant])
    return _labelled_box(category, room, stream) if maker is None else maker(room, stream, levels)


def _labelled_box(category: str, size: Vec3, rng: np.random.Generator) -> Asset:
    """Return a box with round edges, a quiet colour and a label on its front."""
    builder = Builder(category, size)
    tint, radius = code_of(colorsys.hls_to_rgb(rng.random(), 0.6, 0.35)), 0.12 * min(size)
    builder.add(f"plastic/{tint}", shapes.rounded_box(size, (0, size.y / 2, 0), radius))
    label = shapes.panel(0.5 * size.x, 0.4 * size.y, (0, 0.55 * size.y, size.z / 2 - 1e-4 * size.z))
    builder.add("print/label", shapes.translate(label, (0, 0, 2e-4 * size.z)))
    builder.surface("top", (0, size.y, 0), (size.x - 2 * radius, size.z - 2 * radius))
    return builder.build()
