"""Floor plans as shapes for SVG: in metres, x to the right, north (+z) up."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import shapely

from vigil.assets.database import AssetDatabase
from vigil.errors import VigilError
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.plan import FloorPlan, PlanRoom, floor_plan
from vigil.scene.things import Thing
from vigil.web.films.plan import FilmPlan
from vigil.web.library import LibraryPack

MARGIN_M = 0.4
MIN_LABELLED_M2 = 0.3
"""Smallest footprint of a labelled object; a reader would take the label of a smaller one for its neighbour's."""
TEXT_SHARE = 0.026
"""Height of the letters as a share of the plan's width; legible at the size at which pages show it."""
PAGE_ASPECT = 1.2
"""Width over height of the area that pages give to a plan."""
LETTER_WIDTH = 0.56
"""Mean width of a letter over its height."""
LINE_HEIGHT = 1.1
"""Smallest distance between two lines, over the height of the letters."""
NAME_SHIFTS = (0, -1.5, 1.5, -3, 3, -5, 5, -7, 7)
"""Shifts to try for a room's name: down from its default position, in heights of its letters."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A polygon of the plan."""

    kind: str
    points: str
    """The points in SVG's format; z is negated."""
    id: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    """The centre of a dot."""


@dataclass(frozen=True, slots=True)
class PlanLabel:
    """A text on the plan, centred at (x, y)."""

    kind: Literal["room-name", "label"]
    text: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class PlanDrawing:
    """A house seen from above."""

    view_box: str
    text_m: float
    """Height of the letters."""
    shapes: tuple[Shape, ...]
    labels: tuple[PlanLabel, ...]
    rooms: tuple[dict[str, Any], ...]
    things: tuple[dict[str, Any], ...]


def plan_of(house: House, assets: AssetDatabase) -> PlanDrawing:
    """Return the drawing of a house's plan."""
    things = _built(house, assets)
    plan = floor_plan(house, things)
    low, high = (corner + margin for corner, margin in zip(plan.bounds, (-MARGIN_M, MARGIN_M), strict=True))
    width, height = (float(value) for value in high - low)
    text_m = TEXT_SHARE * max(width, height * PAGE_ASPECT)
    return PlanDrawing(
        view_box=f"{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}",
        text_m=text_m,
        shapes=tuple(_shapes(plan)),
        labels=tuple(_labels(plan, text_m)),
        rooms=tuple({"id": room.id, "type": room.name, "area_m2": room.area_m2} for room in plan.rooms),
        things=tuple(_thing_facts(thing) for thing in things),
    )


def floor_plan_of(house: House, assets: AssetDatabase) -> FloorPlan:
    """Return the floor plan of a house; without furniture if its objects cannot be built."""
    return floor_plan(house, _built(house, assets))


def _built(house: House, assets: AssetDatabase) -> list[Thing]:
    try:
        return list(build_scene(house, assets).things.values())
    except VigilError:
        return []


def try_plan(pack: LibraryPack, episode: Episode) -> PlanDrawing | None:
    """Return the floor plan of an episode's house; None if the house cannot be read."""
    try:
        return _cached_plan(pack.house(episode.house.name), pack.assets)
    except VigilError:
        return None


def try_film_plan(pack: LibraryPack, episode: Episode) -> FilmPlan | None:
    """Return a film's floor plan of an episode's house; None if the house cannot be read."""
    try:
        return FilmPlan(floor_plan_of(pack.house(episode.house.name), pack.assets))
    except VigilError:
        return None


@lru_cache(maxsize=32)
def _cached_plan(house: House, assets: AssetDatabase) -> PlanDrawing:
    return plan_of(house, assets)


def _shapes(plan: FloorPlan) -> Iterator[Shape]:
    """Yield the shapes, from the bottom layer to the top."""
    yield from (Shape(f"room room-{room.room_type}", _points(room.corners), room.id) for room in plan.rooms)
    yield from (Shape(thing.kind, _points(thing.corners), thing.id) for thing in plan.things)
    yield from (Shape("wall", _points(ends)) for ends in plan.walls)
    yield from (Shape("opening", _points(opening.corners), opening.id) for opening in plan.openings)
    yield from (Shape("small", "", name, (x, -z)) for name, x, z in plan.small)


def _labels(plan: FloorPlan, text_m: float) -> list[PlanLabel]:
    """Return the labels that fit: first large objects, then the rooms' names where nothing is in the way."""
    placed: list[PlanLabel] = []
    low, high = plan.bounds
    for thing in plan.labelled:
        if thing.area_m2 >= MIN_LABELLED_M2:
            half = LETTER_WIDTH * text_m * len(thing.label) / 2
            x = float(np.clip(thing.middle[0], low[0] + half, max(low[0] + half, high[0] - half)))
            _add_first_free(placed, [PlanLabel("label", thing.label, x, -thing.middle[1])], text_m)
    for room in plan.rooms:
        _add_first_free(placed, _names(room, text_m), text_m)
    return placed


def _names(room: PlanRoom, text_m: float) -> list[PlanLabel]:
    """Return a room's name at each position to try inside the room."""
    floor, (x, z) = shapely.Polygon(room.corners), room.name_at
    tried = [z - shift * text_m for shift in NAME_SHIFTS]
    return [PlanLabel("room-name", room.name, x, -each) for each in tried if shapely.contains_xy(floor, x, each)]


def _add_first_free(placed: list[PlanLabel], tried: list[PlanLabel], text_m: float) -> None:
    """Add the first label that does not overlap an earlier one, if there is one."""
    for label in tried:
        if not any(_overlap(label, other, text_m) for other in placed):
            placed.append(label)
            return


def _overlap(one: PlanLabel, other: PlanLabel, text_m: float) -> bool:
    wide = LETTER_WIDTH * text_m * (len(one.text) + len(other.text)) / 2
    return abs(one.x - other.x) < wide + text_m / 2 and abs(one.y - other.y) < LINE_HEIGHT * text_m


def _points(corners: np.ndarray) -> str:
    return " ".join(f"{x:.3f},{-z:.3f}" for x, z in corners.tolist())


def _thing_facts(thing: Thing) -> dict[str, Any]:
    return {
        "id": thing.id,
        "category": thing.category,
        "parent": thing.parent or "",
        "opens": thing.is_openable,
        "openness": thing.openness,
    }
