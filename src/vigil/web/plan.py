"""Floor plans as shapes in metres, drawn by the pages as SVG: x to the right, north (+z) up."""

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from shapely import Point, Polygon

from vigil.assets.catalog import CATALOG
from vigil.assets.sizes import AssetDatabase
from vigil.episode import Episode
from vigil.errors import VigilError
from vigil.house import House
from vigil.housegen.solids import Body, bodies_of
from vigil.web.library import ShownPack

MARGIN_M = 0.4
LABELLED_M2 = 0.3
"""Things with a smaller footprint carry no label."""
HUNG_M = 1.0
"""What begins higher hangs on a wall: drawn by its outline alone."""
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
class Plan:
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


def plan_of(house: House, assets: AssetDatabase) -> Plan:
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
        bodies = bodies_of(house, assets)[0]
    except VigilError:
        bodies = []
    shapes += [_thing(body) for body in _in_order(bodies)]
    for wall in house.document.walls:
        ends = np.array([(point.x, point.z) for point in wall.polygon[:2]])
        shapes.append(Shape("wall", _points(ends)))
    shapes += [Shape("opening", _points(body.box_corners()), body.id) for body in bodies if body.is_opening]
    shapes += [_dot(body) for body in bodies if body.parent is not None]
    text_m = TEXT_SHARE * max(width, height * PAGE_ASPECT)
    return Plan(
        view_box=f"{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}",
        width=width,
        height=height,
        text_m=text_m,
        shapes=tuple(shapes),
        labels=tuple(_labels(house, bodies, text_m)),
        rooms=tuple(_room_facts(house)),
        things=tuple(_thing_facts(body) for body in bodies),
    )


def try_plan(pack: ShownPack, episode: Episode) -> Plan | None:
    """Returns the floor plan of an episode's house; None when the house cannot be read."""
    try:
        return _kept_plan(pack.house(episode.house.name), pack.assets)
    except VigilError:
        return None


@lru_cache(maxsize=32)
def _kept_plan(house: House, assets: AssetDatabase) -> Plan:
    return plan_of(house, assets)


def _in_order(bodies: list[Body]) -> list[Body]:
    standing = [body for body in bodies if body.parent is None and not body.is_opening and body.bottom < 1.8]
    return sorted(standing, key=lambda body: (body.category != "Rug", body.bottom, body.id))


def _thing(body: Body) -> Shape:
    kind = "rug" if body.category == "Rug" else "hung" if body.bottom > HUNG_M else "thing"
    return Shape(kind, _points(body.box_corners()), body.id)


def _dot(body: Body) -> Shape:
    return Shape("small", "", body.id, (body.position.x, -body.position.z))


def _labels(house: House, bodies: list[Body], text_m: float) -> list[Label]:
    """Returns the words that find room: large things first, then the rooms' names where nothing stands in the way."""
    placed: list[Label] = []
    across = [point.x for room in house.document.rooms for point in room.floor_polygon]
    left, right = min(across), max(across)
    named = [body for body in _in_order(bodies) if body.bottom <= HUNG_M and body.category in CATALOG]
    named = [body for body in named if body.category != "Rug" and _footprint_m2(body) >= LABELLED_M2]
    for body in sorted(named, key=lambda body: (-_footprint_m2(body), body.id)):
        spoken = CATALOG[body.category].spoken
        half = LETTER_WIDTH * text_m * len(spoken) / 2
        x = float(np.clip(body.position.x, left + half, max(left + half, right - half)))
        _place(placed, [Label("label", spoken, x, -body.position.z)], text_m)
    for room in house.document.rooms:
        floor = Polygon([(point.x, -point.z) for point in room.floor_polygon])
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


def _footprint_m2(body: Body) -> float:
    return body.asset.size.x * body.asset.size.z


def _points(corners: np.ndarray) -> str:
    return " ".join(f"{x:.3f},{-z:.3f}" for x, z in corners.tolist())


def _room_facts(house: House) -> list[dict[str, Any]]:
    facts = []
    for room in house.document.rooms:
        corners = np.array([(point.x, point.z) for point in room.floor_polygon])
        x, z = corners[:, 0], corners[:, 1]
        area = abs(float(np.dot(x, np.roll(z, 1)) - np.dot(z, np.roll(x, 1)))) / 2
        facts.append({"id": room.id, "type": _room_words(room.room_type), "area_m2": area})
    return facts


def _room_words(room_type: str) -> str:
    """Returns "living room" for "LivingRoom"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", room_type).lower()


def _thing_facts(body: Body) -> dict[str, Any]:
    return {
        "id": body.id,
        "category": body.category,
        "room": body.room or "",
        "parent": body.parent.id if body.parent else "",
        "x": body.position.x,
        "z": body.position.z,
        "opens": body.can_open,
        "openness": body.openness,
    }
