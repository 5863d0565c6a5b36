"""Floor plans as shapes in metres, drawn by the pages as SVG: x to the right, north (+z) up."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

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


@dataclass(frozen=True, slots=True)
class Shape:
    """A polygon of the plan."""

    kind: str
    points: str
    """As SVG takes them; z is turned round."""
    label: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    id: str = ""


@dataclass(frozen=True, slots=True)
class Plan:
    """A house seen from above."""

    view_box: str
    width: float
    height: float
    shapes: tuple[Shape, ...]
    rooms: tuple[dict[str, Any], ...]
    things: tuple[dict[str, Any], ...]


def plan_of(house: House, assets: AssetDatabase) -> Plan:
    """Returns the plan of a house; without furniture when its things cannot be built."""
    floors = [np.array([(point.x, point.z) for point in room.floor_polygon]) for room in house.document.rooms]
    low = np.min([floor.min(axis=0) for floor in floors], axis=0) - MARGIN_M
    high = np.max([floor.max(axis=0) for floor in floors], axis=0) + MARGIN_M
    width, height = (float(value) for value in high - low)
    shapes = [
        Shape(f"room room-{room.room_type}", _points(floor), room.room_type, _middle(floor), room.id)
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
    shapes += [Shape("opening", _points(body.box_corners()), id=body.id) for body in bodies if body.is_opening]
    shapes += [_dot(body) for body in bodies if body.parent is not None]
    return Plan(
        view_box=f"{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}",
        width=width,
        height=height,
        shapes=tuple(shapes),
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
    corners = body.box_corners()
    is_large = body.asset.size.x * body.asset.size.z >= LABELLED_M2 and body.category != "Rug"
    spoken = CATALOG[body.category].spoken if is_large and body.category in CATALOG else ""
    kind = "rug" if body.category == "Rug" else "thing"
    return Shape(kind, _points(corners), spoken, (body.position.x, -body.position.z), body.id)


def _dot(body: Body) -> Shape:
    return Shape("small", "", body.category, (body.position.x, -body.position.z), body.id)


def _points(corners: np.ndarray) -> str:
    return " ".join(f"{x:.3f},{-z:.3f}" for x, z in corners.tolist())


def _middle(corners: np.ndarray) -> tuple[float, float]:
    x, z = (float(value) for value in corners.mean(axis=0))
    return x, -z


def _room_facts(house: House) -> list[dict[str, Any]]:
    facts = []
    for room in house.document.rooms:
        corners = np.array([(point.x, point.z) for point in room.floor_polygon])
        x, z = corners[:, 0], corners[:, 1]
        area = abs(float(np.dot(x, np.roll(z, 1)) - np.dot(z, np.roll(x, 1)))) / 2
        facts.append({"id": room.id, "type": room.room_type, "area_m2": area})
    return facts


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
