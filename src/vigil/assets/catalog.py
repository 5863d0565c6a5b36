"""The catalogue: every category of thing, with its usual size, what can be done with it and where it belongs.

The rows are in `catalog.toml`. An object in a scene can be opened when its category says so *and* its asset has joints
(`vigil.assets.kernel.asset.Asset.can_open`). So a desk without drawers cannot be opened. Makers, not this module,
define what things look like.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vigil.base.geometry import Vec3
from vigil.errors import did_you_mean

FLOOR, WALL, CEILING = "Floor", "Wall", "Ceiling"
ROWS = Path(__file__).parent / "catalog.toml"

ROOMS = {"K": "Kitchen", "L": "LivingRoom", "B": "Bedroom", "W": "Bathroom"}
"""Letter -> kind of room."""
ROOM_TYPES = tuple(ROOMS.values())
_FLAGS = {
    "pick": "is_pickupable", "move": "is_moveable", "open": "is_openable", "toggle": "is_toggleable",
    "hold": "is_receptacle", "interlock": "runs_only_when_closed",
}  # fmt: skip
_KEYS = ("called", "size", "spread", "rooms", "on", "can", "accepts", "also")


@dataclass(frozen=True, slots=True)
class Category:
    """A category of things, e.g. "Fridge"."""

    name: str
    display_name: str
    """Name that people use, e.g. "coffee machine"."""
    typical_size: Vec3
    """Width x, height y and depth z (m) of the bounding box while the thing is closed and off."""
    size_spread: float
    """Greatest deviation of sizes from the typical size, as a share of the typical size."""
    rooms: tuple[str, ...]
    """Kinds of rooms in which the thing is normally found."""
    rests_on: tuple[str, ...]
    """Categories on or in which the thing is normally found, or "Floor", "Wall" or "Ceiling"; the likeliest first."""
    is_pickupable: bool = False
    is_moveable: bool = False
    """Whether the thing can be pushed but not carried."""
    is_openable: bool = False
    is_toggleable: bool = False
    is_receptacle: bool = False
    runs_only_when_closed: bool = False
    """Whether the thing can be switched on only while closed, and opened only while off."""
    accepts: tuple[str, ...] | None = None
    """Categories that may be put on or in the thing; None means everything that can be picked up and fits."""
    other_names: tuple[str, ...] = ()
    """Other names that ids use for the category, in lower case and without spaces, e.g. "trashcan"."""

    def can_hold(self, other: "Category") -> bool:
        """Return whether objects of `other` may be put on or in objects of this category, if there is room."""
        if not self.is_receptacle or not other.is_pickupable:
            return False
        return (
            other.name in self.accepts if self.accepts is not None else other.name != self.name or self.name == "Plate"
        )


def category_of(name: str, row: Mapping[str, Any], groups: Mapping[str, Sequence[str]]) -> Category:
    """Return the category that a row of the catalogue describes.

    Raises ValueError if the row has an unknown key or word.
    """
    for given, known in ((row, _KEYS), (row.get("can", "").split(), _FLAGS), (row["rooms"], ROOMS)):
        for word in given:
            if word not in known:
                raise ValueError(
                    f"category {name}: {word!r} is not among {', '.join(known)}.{did_you_mean(word, known)}"
                )
    return Category(
        name=name,
        display_name=row["called"],
        typical_size=Vec3(*row["size"]),
        size_spread=row["spread"],
        rooms=tuple(ROOMS[letter] for letter in row["rooms"]),
        rests_on=expand_groups(row["on"], groups),
        accepts=expand_groups(row["accepts"], groups) if "accepts" in row else None,
        other_names=tuple(row.get("also", ())),
        **{_FLAGS[word]: True for word in row.get("can", "").split()},
    )


def expand_groups(names: Sequence[str], groups: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return names of categories; each "@group" in `names` is replaced by the group's members."""
    return tuple(each for name in names for each in (groups[name[1:]] if name.startswith("@") else (name,)))


_TABLE = tomllib.loads(ROWS.read_text(encoding="utf-8"))
CATALOG = {name: category_of(name, row, _TABLE["groups"]) for name, row in _TABLE["categories"].items()}
"""Name of a category -> the category."""
