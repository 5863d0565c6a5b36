"""Floor plans as shapes in metres, drawn by the pages as SVG: x to the right, north (+z) up."""

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from shapely import Point
from shapely.affinity import scale

from vigil.assets.catalog import CATALOG
from vigil.assets.sizes import AssetDatabase
from vigil.episode import Episode
from vigil.errors import VigilError
from vigil.house import House
from vigil.scene.build import build_scene
from vigil.scene.geometry import whole_box
from vigil.scene.outlines import floor_corners, floor_of
from vigil.scene.things import Thing
from vigil.web.library import ShownPack

MARGIN_M = 0.4
LABELLED_M2 = 0.3
"""Things with a smaller footprint carry no label."""
HUNG_M = 1.0
"""What begins higher hangs on a wall: drawn by its outline alone."""
SHOWN_BELOW_M = 1.8
"""What begins higher is not drawn."""
TEXT_SHARE = 0.026
"""Height of the letters, as a share of the plan's width: legible at the size at which pages show it."""
PAGE_ASPECT = 1.2
"""Width over height of the room that pages give to a plan."""
LETTER_WIDTH = 0.56
"""Mean width of a letter over its height."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A polygon of the plan."""

    kind: str
    points: str
    """As SVG takes them; z is turned round."""
    id: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    """Of a dot."""


@dataclass(frozen=True, slots=True)
class Label:
    """A word on the plan, by its middle."""

    kind: Literal["room-name", "label"]
    text: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class PlanDrawing:
    """A house seen from above."""

    view_box: str
    width: float
    height: float
    text_m: float
    """Height of the letters."""
    shapes: tuple[Shape, ...]
    labels: tuple[Label, ...]
    rooms: tuple[dict[str, Any], ...]
    things: tuple[dict[str, Any], ...]


def plan_of(house: House, assets: AssetDatabase) -> PlanDrawing:
    """Returns the plan of a house; without furniture when its things cannot be built."""
    floors = [np.array([(point.x, point.z) for point in room.floor_polygon]) for room in house.document.rooms]
    low = np.min([floor.min(axis=0) for floor in floors], axis=0) - MARGIN_M
    high = np.max([floor.max(axis=0) for floor in floors], axis=0) + MARGIN_M
    width, height = (float(value) for value in high - low)
    shapes = [
        Shape(f"room room-{room.room_type}", _points(floor), room.id)
        for room, floor in zip(house.document.rooms, floors, strict=True)
    ]
    try:
        things = list(build_scene(house, assets).things.values())
    except VigilError:
        things = []
    shapes += [_thing(thing) for thing in _in_order(things)]
    for wall in house.document.walls:
        ends = np.array([(point.x, point.z) for point in wall.polygon[:2]])
        shapes.append(Shape("wall", _points(ends)))
    openings = [thing for thing in things if thing.is_structure]
    shapes += [Shape("opening", _points(floor_corners(whole_box(thing))), thing.id) for thing in openings]
    shapes += [_dot(thing) for thing in things if thing.parent is not None]
    text_m = TEXT_SHARE * max(width, height * PAGE_ASPECT)
    return PlanDrawing(
        view_box=f"{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}",
        width=width,
        height=height,
        text_m=text_m,
        shapes=tuple(shapes),
        labels=tuple(_labels(house, things, text_m)),
        rooms=tuple(_room_facts(house)),
        things=tuple(_thing_facts(thing) for thing in things),
    )


def try_plan(pack: ShownPack, episode: Episode) -> PlanDrawing | None:
    """Returns the floor plan of an episode's house; None when the house cannot be read."""
    try:
        return _kept_plan(pack.house(episode.house.name), pack.assets)
    except VigilError:
        return None


@lru_cache(maxsize=32)
def _kept_plan(house: House, assets: AssetDatabase) -> PlanDrawing:
    return plan_of(house, assets)


def _in_order(things: list[Thing]) -> list[Thing]:
    """Returns what stands or hangs in the rooms, lowest first, rugs before all."""
    standing = [thing for thing in things if thing.parent is None and not thing.is_structure]
    shown = [thing for thing in standing if _bottom(thing) < SHOWN_BELOW_M]
    return sorted(shown, key=lambda thing: (thing.category != "Rug", _bottom(thing), thing.id))


def _bottom(thing: Thing) -> float:
    return whole_box(thing).bottom


def _thing(thing: Thing) -> Shape:
    kind = "rug" if thing.category == "Rug" else "hung" if _bottom(thing) > HUNG_M else "thing"
    return Shape(kind, _points(floor_corners(whole_box(thing))), thing.id)


def _dot(thing: Thing) -> Shape:
    return Shape("small", "", thing.id, (thing.position.x, -thing.position.z))


def _labels(house: House, things: list[Thing], text_m: float) -> list[Label]:
    """Returns the words that find room: large things first, then the rooms' names where nothing stands in the way."""
    placed: list[Label] = []
    across = [point.x for room in house.document.rooms for point in room.floor_polygon]
    left, right = min(across), max(across)
    named = [thing for thing in _in_order(things) if _bottom(thing) <= HUNG_M and thing.category != "Rug"]
    named = [thing for thing in named if _footprint_m2(thing) >= LABELLED_M2]
    for thing in sorted(named, key=lambda thing: (-_footprint_m2(thing), thing.id)):
        spoken = CATALOG[thing.category].spoken
        half = LETTER_WIDTH * text_m * len(spoken) / 2
        x = float(np.clip(thing.position.x, left + half, max(left + half, right - half)))
        _place(placed, [Label("label", spoken, x, -thing.position.z)], text_m)
    for room in house.document.rooms:
        floor = scale(floor_of(room), yfact=-1.0, origin=(0.0, 0.0))
        middle = floor.representative_point()
        tried = [(middle.x, middle.y + step * text_m) for step in (0, -1.5, 1.5, -3, 3, -5, 5, -7, 7)]
        within = [
            Label("room-name", _room_words(room.room_type), x, y) for x, y in tried if floor.contains(Point(x, y))
        ]
        _place(placed, within, text_m)
    return placed


def _place(placed: list[Label], tried: list[Label], text_m: float) -> None:
    """Adds the first label that overlaps no earlier one; none when all do."""
    for label in tried:
        if not any(_overlap(label, other, text_m) for other in placed):
            placed.append(label)
            return


def _overlap(one: Label, other: Label, text_m: float) -> bool:
    wide = LETTER_WIDTH * text_m * (len(one.text) + len(other.text)) / 2
    return abs(one.x - other.x) < wide + text_m / 2 and abs(one.y - other.y) < 1.1 * text_m


def _footprint_m2(thing: Thing) -> float:
    return thing.asset.size.x * thing.asset.size.z


def _points(corners: np.ndarray) -> str:
    return " ".join(f"{x:.3f},{-z:.3f}" for x, z in corners.tolist())


def _room_facts(house: House) -> list[dict[str, Any]]:
    return [
        {"id": room.id, "type": _room_words(room.room_type), "area_m2": floor_of(room).area}
        for room in house.document.rooms
    ]


def _room_words(room_type: str) -> str:
    """Returns "living room" for "LivingRoom"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", room_type).lower()


def _thing_facts(thing: Thing) -> dict[str, Any]:
    return {
        "id": thing.id,
        "category": thing.category,
        "parent": thing.parent or "",
        "opens": thing.is_openable,
        "openness": thing.openness,
    }
