"""Sizes: from an asset id to its category, bounding box and variant.

Three sources, in this order: the project's own ids (`vigil_<Category>_<n>`, whose size follows from the catalogue and
n), an asset database file (AI2-THOR's `asset-database.json`, not part of this project), and, without one, a guess from
the words of the ids with the catalogue's typical size.
"""

import json
import math
import re
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.errors import HouseError, SettingError
from vigil.pose import Vec3

MIN_SIDE_M = 0.001
MAX_SIDE_M = 30.0

_OWN_ID = re.compile(r"vigil_([A-Za-z]+)_(\d+)")
_INCH, _FOOT = 0.0254, 0.3048
_U_OVERHANG_M = 0.02
"""How much deeper than whole modules AI2-THOR's U-shaped countertops are; tells them from L-shaped ones."""

_ALIASES = {
    "alarm": "AlarmClock",
    "basketball": "BasketBall",
    "basin": "Sink",
    "bathtowel": "Towel",
    "bench": "Ottoman",
    "bin": "GarbageCan",
    "blackberry": "CellPhone",
    "boot": "Boots",
    "bookcase": "ShelvingUnit",
    "bookshelf": "ShelvingUnit",
    "bnydpepper": "PepperShaker",
    "bnydsalt": "SaltShaker",
    "butterknife": "ButterKnife",
    "carpet": "Rug",
    "cellphone": "CellPhone",
    "clock": "AlarmClock",
    "computer": "Desktop",
    "couch": "Sofa",
    "counter": "CounterTop",
    "curtain": "Curtains",
    "cushion": "Pillow",
    "decorativebox": "Box",
    "door": "Doorway",
    "dryer": "ClothesDryer",
    "fertilitystatue": "Statue",
    "foil": "AluminumFoil",
    "garbagebin": "GarbageCan",
    "hamper": "LaundryHamper",
    "handstatue": "Statue",
    "keys": "KeyChain",
    "lamp": "DeskLamp",
    "lightfixture": "CeilingLamp",
    "monitor": "Television",
    "nightstand": "SideTable",
    "oven": "Stove",
    "papertowel": "PaperTowelRoll",
    "phone": "CellPhone",
    "photo": "Painting",
    "picture": "Painting",
    "plant": "HousePlant",
    "racket": "TennisRacket",
    "racquet": "TennisRacket",
    "refrigerator": "Fridge",
    "remote": "RemoteControl",
    "shower": "ShowerHead",
    "sponge": "DishSponge",
    "switch": "LightSwitch",
    "table": "DiningTable",
    "teddy": "TeddyBear",
    "tennisracquet": "TennisRacket",
    "tissue": "TissueBox",
    "tissues": "TissueBox",
    "trashcan": "GarbageCan",
    "tv": "Television",
    "vacuum": "VacuumCleaner",
    "walldecorpainting": "Painting",
    "walldecorphoto": "Painting",
    "wardrobe": "Dresser",
    "washer": "WashingMachine",
    "wine": "WineBottle",
    "winebottle": "WineBottle",
}
_LONGEST_NAME_WORDS = 4


@dataclass(frozen=True, slots=True)
class AssetEntry:
    """What is known of an asset before its shape is made."""

    category: str
    size: Vec3
    variant: int
    """Which of the category's looks: a stable hash of the asset id."""


class AssetDatabase:
    """The sizes of assets by id."""

    def __init__(self, known: dict[str, tuple[str, Vec3]] | None = None) -> None:
        """`known` maps an asset id to its category and bounding box; none of it is needed."""
        self._known = dict(known or {})

    @classmethod
    def default(cls) -> "AssetDatabase":
        """Returns the database without a file: own ids, and guesses from words and typical sizes."""
        return cls()

    @classmethod
    def load(cls, path: Path) -> "AssetDatabase":
        """Returns the database in AI2-THOR's `asset-database.json` at `path`. Raises SettingError."""
        try:
            data = json.loads(path.read_bytes())
        except OSError as error:
            reason = error.strerror or str(error)
            raise SettingError(f"Asset database {str(path)!r} cannot be read: {reason}. {_WANTED}") from None
        except (ValueError, RecursionError) as error:
            raise SettingError(f"Asset database {str(path)!r} is not JSON: {error}. {_WANTED}") from None
        if not isinstance(data, dict) or not data:
            raise SettingError(f"Asset database {str(path)!r} holds no object of categories. {_WANTED}")
        known: dict[str, tuple[str, Vec3]] = {}
        for category, rows in data.items():
            if not isinstance(rows, list):
                raise SettingError(f"Asset database {str(path)!r}: {category!r} is not a list of assets. {_WANTED}")
            for index, row in enumerate(rows):
                asset_id, size = _read_row(row, f"Asset database {str(path)!r}: {category}[{index}]")
                known[asset_id] = (category, size)
        return cls(known)

    def __len__(self) -> int:
        return len(self._known)

    def look_up(self, asset_id: str, object_id: str) -> AssetEntry:
        """Returns the category, size and variant of `asset_id`, which object `object_id` of a house names.

        Raises HouseError when neither the database nor the words of the ids say what it is.
        """
        own = _OWN_ID.fullmatch(asset_id)
        if own:
            return _own_entry(asset_id, own[1], object_id)
        if asset_id in self._known:
            stated, size = self._known[asset_id]
            category = stated if stated in CATALOG else guess_category(asset_id, stated)
        else:
            category = guess_category(asset_id, object_id)
            size = _guessed_size(category, asset_id) if category else Vec3(0.0, 0.0, 0.0)
        if category is None:
            raise HouseError(
                f"Object {object_id!r}: nothing is known of asset {asset_id!r}, and no category follows from the "
                "ids. Give an asset database that has it, or an assetId such as 'vigil_Chair_1'."
            )
        return AssetEntry(category, size, _variant(asset_id))


def own_asset_id(category: str, number: int) -> str:
    """Returns the project's own asset id `number` of a category."""
    return f"vigil_{category}_{number}"


def guess_category(asset_id: str, object_id: str) -> str | None:
    """Returns the category that the ids speak of; None when no word of theirs is known.

    An object id that starts with a category ("Chair|7|0") decides; else the asset id's words, then the object id's.
    """
    prefix = object_id.split("|")[0]
    if prefix in CATALOG:
        return prefix
    return _category_in(asset_id) or _category_in(prefix)


_WANTED = "Expected AI2-THOR's form: {category: [{assetId, boundingBox: {x, y, z}}, ...], ...}."


def _read_row(row: Any, place: str) -> tuple[str, Vec3]:
    if not isinstance(row, dict) or not isinstance(row.get("assetId"), str):
        raise SettingError(f"{place} has no `assetId`. {_WANTED}")
    box = row.get("boundingBox")
    sides = [_side(box.get(axis)) for axis in "xyz"] if isinstance(box, dict) else [None]
    known = [side for side in sides if side is not None]
    if len(known) != 3:
        raise SettingError(
            f"{place} ({row['assetId']}): `boundingBox` must hold x, y, z up to {MAX_SIDE_M:g}. {_WANTED}"
        )
    return row["assetId"], Vec3(*known)


def _side(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return max(float(value), MIN_SIDE_M) if math.isfinite(value) and 0.0 <= value <= MAX_SIDE_M else None


def _own_entry(asset_id: str, category: str, object_id: str) -> AssetEntry:
    if category not in CATALOG:
        raise HouseError(
            f"Object {object_id!r}: asset {asset_id!r} names the category {category!r}, which does not exist. "
            "Own asset ids read vigil_<Category>_<number> with a category of vigil.assets.catalog."
        )
    row = CATALOG[category]
    variant = _variant(asset_id)
    rng = np.random.default_rng(variant)
    whole, *each = (float(share) * row.size_spread for share in rng.uniform(-1.0, 1.0, 4))
    scales = (1.0 + 0.7 * whole + 0.3 * extra for extra in each)
    size = Vec3(*(round(side * scale, 4) for side, scale in zip(row.typical_size, scales, strict=True)))
    return AssetEntry(category, size, variant)


def _variant(asset_id: str) -> int:
    return zlib.crc32(asset_id.encode())


@cache
def _names() -> dict[str, str]:
    names = {row.name.lower(): row.name for row in CATALOG.values()}
    names |= {row.spoken.replace(" ", "").lower(): row.name for row in CATALOG.values()}
    return names | _ALIASES


def _category_in(text: str) -> str | None:
    """Returns the category whose name takes up the most words of `text`; of equals the last, as in "Hand_Statue"."""
    words = [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", text.removeprefix("RoboTHOR"))]
    names = _names()
    for length in range(min(_LONGEST_NAME_WORDS, len(words)), 0, -1):
        for start in range(len(words) - length, -1, -1):
            joined = "".join(words[start : start + length])
            found = names.get(joined) or names.get(joined.removesuffix("s"))
            if found:
                return found
    return None


def _guessed_size(category: str, asset_id: str) -> Vec3:
    """Returns the typical size, but for ids that state theirs: windows in inches, countertops in feet, double doors."""
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
