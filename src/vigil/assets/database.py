"""Sizes: finds the category, bounding box and variant of an asset id.

There are three sources, in this order. (1) The project's own ids, `vigil_<Category>_<n>`: n and the catalogue determine
the size; `_drawer<k>` after such an id means one of its drawers. (2) An asset database file (AI2-THOR's
`asset-database.json`, not part of this project). (3) The words of the id, and the catalogue's typical size; hashes in
ids are not words.
"""

import hashlib
import math
import re
import zlib
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.drawers import DRAWER, drawer_names, drawer_of, split_drawer_id
from vigil.base.files import read_file
from vigil.base.geometry import Vec3
from vigil.base.json_files import read_json
from vigil.errors import SettingError

MIN_SIDE_M = 0.001
MAX_SIDE_M = 30.0

_OWN_ID = re.compile(r"vigil_([A-Za-z]+)_(\d+)")
_INCH, _FOOT = 0.0254, 0.3048
_U_OVERHANG_M = 0.02
"""AI2-THOR's U-shaped countertops are this much (m) deeper than the size in their ids; L-shaped countertops are not."""

_LONGEST_NAME_WORDS = 4
_NON_WORDS = re.compile(
    r"(?<![A-Za-z\d])[\da-f]{8}(?:-[\da-f]{4}){3}-[\da-f]{12}"
    r"|(?<![A-Za-z\d])(?=[\da-f]*\d[a-f])[\da-f]{6,}(?![A-Za-z\d])"
    r"|(?=[\da-f]*\d)[\da-f]{16,}"
    r"|(?<=\d)[A-Za-z]+(?=\d)",
    re.IGNORECASE,
)
"""Parts of an id that are not words: hashes, and letters that stand between digits."""
_MIN_SIMILARITY, _MIN_LETTERS = 0.72, 4
"""A word counts as a misspelt category if it is at least this similar (0..1) to the category's name, and has at least
this many letters."""
FALLBACK_CATEGORY = "Box"
"""Category that is shown for an asset about which nothing is known."""


@dataclass(frozen=True, slots=True)
class AssetEntry:
    """What is known about an asset before its shape is made: category, size and variant."""

    category: str
    size: Vec3
    variant: int
    """Number that selects one of the category's looks: a stable hash of the asset id."""
    note: str | None = None
    """Note for people on what was guessed; None if the category and the size were known."""
    is_measured: bool = True
    """Whether the size was measured from this asset; False if it is only typical of the category."""


class AssetDatabase:
    """The sizes of assets by id."""

    def __init__(
        self, known: dict[str, tuple[str, Vec3]] | None = None, path: Path | None = None, sha256: str | None = None
    ) -> None:
        """Create a database; `known` has the category and the bounding box of each asset id.

        `path` and `sha256` are those of the file from which `known` was read; None without a file.
        """
        self._known = dict(known or {})
        self.path = path
        self.sha256 = sha256

    @classmethod
    def default(cls) -> "AssetDatabase":
        """Return a database without a file: it knows the project's own ids, and guesses other sizes."""
        return cls()

    @classmethod
    def from_file(cls, path: Path | None) -> "AssetDatabase":
        """Return the database in the file at `path`; if `path` is None, return a database without a file.

        Raises SettingError.
        """
        return cls.load(path) if path else cls.default()

    @classmethod
    def load(cls, path: Path) -> "AssetDatabase":
        """Return the database in AI2-THOR's `asset-database.json` at `path`. Raises SettingError."""
        raw = read_file(path, f"Asset database {str(path)!r}", SettingError)
        try:
            data = read_json(raw)
        except ValueError as error:
            raise SettingError(f"Asset database {str(path)!r} is not JSON: {error}. {_WANTED}") from None
        if not isinstance(data, dict) or not data:
            raise SettingError(f"Asset database {str(path)!r} does not map categories to objects. {_WANTED}")
        known: dict[str, tuple[str, Vec3]] = {}
        for category, rows in data.items():
            if not isinstance(rows, list):
                raise SettingError(f"Asset database {str(path)!r}: {category!r} is not a list of assets. {_WANTED}")
            for index, row in enumerate(rows):
                asset_id, size = _read_row(row, f"Asset database {str(path)!r}: {category}[{index}]")
                known[asset_id] = (category, size)
        return cls(known, path, hashlib.sha256(raw).hexdigest())

    def __len__(self) -> int:
        return len(self._known)

    def __contains__(self, asset_id: str) -> bool:
        """Whether the database's file names this asset."""
        return asset_id in self._known

    def of_category(self, category: str) -> list[tuple[str, Vec3]]:
        """Return (id, bounding box) of each asset in the database's file that belongs to a category."""
        return [(asset_id, size) for asset_id, (stated, size) in self._known.items() if stated == category]

    def look_up(self, asset_id: str, name: str) -> AssetEntry:
        """Return the category, size and variant of `asset_id`; `name` is the object's name or id in the house.

        An unknown asset gets the known category whose name is most similar, and a note that says what was guessed.
        """
        own = _OWN_ID.fullmatch(asset_id)
        if own and own[1] in CATALOG:
            return _own_entry(asset_id, own[1])
        drawer = _own_drawer(asset_id)
        if drawer is not None:
            return drawer
        stated, size = self._known.get(asset_id, (name, None))
        category, note = _category_of(asset_id, stated)
        if category is None:
            category = nearest_category(asset_id, name)
            note = f"asset {asset_id!r} is of no known category; it is shown as the nearest one, {category}"
        elif note is None and size is None and (own or self._known):
            note = f"asset {asset_id!r} is not known; it is shown as a {category} of usual size"
        variant, is_measured = zlib.crc32(asset_id.encode()), size is not None
        return AssetEntry(category, size or _guessed_size(category, asset_id), variant, note, is_measured)


def own_asset_id(category: str, number: int) -> str:
    """Return the asset id of the project's own asset with this number in a category."""
    return f"vigil_{category}_{number}"


def _category_of(asset_id: str, name: str) -> tuple[str | None, str | None]:
    """Return the category named in an object's name or asset id (or None), and a note on what was guessed (or None).

    A name that begins with a category ("Chair|7|0") is certain. Otherwise, words of the name are preferred to words of
    the asset id.
    """
    own = _object_name(name)
    if own in CATALOG:
        return own, None
    by_name, by_asset = _category_in(own), _category_in(asset_id)
    if by_name is None or by_name == by_asset:
        return by_asset, None
    against = f", though its id speaks of {by_asset}" if by_asset else ""
    return by_name, f"asset {asset_id!r} is shown as {by_name}, a guess by the name {own!r}{against}"


def _object_name(name: str) -> str:
    """Return the part of a name before the object's places, e.g. "lamp-0" of "lamp-0|desk-1 (living room)"."""
    return name.split("|")[0].partition(" (")[0]


def nearest_category(asset_id: str, name: str) -> str:
    """Return the category whose name is most similar to a word in `asset_id` or `name`; "Box" if none is similar."""
    own = _OWN_ID.fullmatch(asset_id)
    names = _names(len(CATALOG))
    for text in (own[1] if own else asset_id, _object_name(name)):
        words = [word for word in _words(text) if len(word) >= _MIN_LETTERS]
        for word in ["".join(words), *reversed(words)]:
            matches = get_close_matches(word, names, n=1, cutoff=_MIN_SIMILARITY)
            if matches:
                return names[matches[0]]
    return FALLBACK_CATEGORY


_WANTED = "Expected AI2-THOR's form: {category: [{assetId, boundingBox: {x, y, z}}, ...], ...}."


def _read_row(row: Any, place: str) -> tuple[str, Vec3]:
    if not isinstance(row, dict) or not isinstance(row.get("assetId"), str):
        raise SettingError(f"{place} has no `assetId`. {_WANTED}")
    box = row.get("boundingBox")
    sides = [_side(box.get(axis)) for axis in "xyz"] if isinstance(box, dict) else [None]
    known = [side for side in sides if side is not None]
    if len(known) != 3:
        raise SettingError(
            f"{place} ({row['assetId']}): `boundingBox` must hold x, y and z, each at most {MAX_SIDE_M:g}. {_WANTED}"
        )
    return row["assetId"], Vec3(*known)


def _side(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return max(float(value), MIN_SIDE_M) if math.isfinite(value) and 0.0 <= value <= MAX_SIDE_M else None


@lru_cache(maxsize=4096)
def _own_entry(asset_id: str, category: str) -> AssetEntry:
    row = CATALOG[category]
    variant = zlib.crc32(asset_id.encode())
    rng = np.random.default_rng(variant)
    whole, *each = (float(share) * row.size_spread for share in rng.uniform(-1.0, 1.0, 4))
    scales = (1.0 + 0.7 * whole + 0.3 * extra for extra in each)
    size = Vec3(*(round(side * scale, 4) for side, scale in zip(row.typical_size, scales, strict=True)))
    return AssetEntry(category, size, variant)


def _own_drawer(asset_id: str) -> AssetEntry | None:
    """Return the entry of a drawer of one of the project's own pieces of furniture; None for any other asset id."""
    chest_id, name = split_drawer_id(asset_id) or ("", "")
    own = _OWN_ID.fullmatch(chest_id)
    if own is None or own[1] not in CATALOG:
        return None
    from vigil.assets.making import make  # noqa: PLC0415 - loads every maker

    chest = _own_entry(chest_id, own[1])
    asset = make(chest.category, chest.size, chest.variant)
    return AssetEntry(DRAWER, drawer_of(asset, name)[0].size, chest.variant) if name in drawer_names(asset) else None


@lru_cache(maxsize=1)
def _names(_count: int) -> dict[str, str]:
    """Return name in lower case -> category. The result is cached until the number of categories changes."""
    names = {row.name.lower(): row.name for row in CATALOG.values()}
    names |= {row.display_name.replace(" ", "").lower(): row.name for row in CATALOG.values()}
    return names | {name: row.name for row in CATALOG.values() for name in row.other_names}


def _category_in(text: str) -> str | None:
    """Return the category whose name matches the most words of `text`. If several match equally many words, return the
    last ("Statue" in "Hand_Statue")."""
    words, names = _words(text), _names(len(CATALOG))
    for length in range(min(_LONGEST_NAME_WORDS, len(words)), 0, -1):
        for start in range(len(words) - length, -1, -1):
            joined = "".join(words[start : start + length])
            found = names.get(joined) or names.get(joined.removesuffix("s"))
            if found:
                return found
    return None


def _words(text: str) -> list[str]:
    named = _NON_WORDS.sub(" ", text.removeprefix("RoboTHOR"))
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", named)]


def _guessed_size(category: str, asset_id: str) -> Vec3:
    """Return the size that an asset id states (a window's in inches, a countertop's in feet), or else the category's
    typical size. A double door is twice as wide."""
    width, height, depth = CATALOG[category].typical_size
    stated = re.search(r"_(\d+)x(\d+)$", asset_id)
    if stated and category == "Window":
        return Vec3(int(stated[1]) * _INCH, int(stated[2]) * _INCH, depth)
    if stated and category == "CounterTop":
        overhang = _U_OVERHANG_M if "_C_" in asset_id else 0.0
        return Vec3(int(stated[1]) * _FOOT, height, int(stated[2]) * _FOOT + overhang)
    if "Double" in asset_id and category in ("Doorway", "Doorframe"):
        return Vec3(2 * width, height, depth)
    return Vec3(width, height, depth)
