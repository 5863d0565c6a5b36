"""Floor plan: the shapes of a house seen from above, in metres on the floor plane. Other modules draw the plan."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely

from vigil.assets.catalog import CATALOG
from vigil.protocol.house import House
from vigil.scene.geometry import bounding_box, moving_prisms_of, prisms_of
from vigil.scene.outlines import floor_corners, floor_of, footprint, polygon_of
from vigil.scene.things import Thing

HUNG_M = 1.0
"""If a thing's bottom is above this height (m), only its outline is drawn, so that things below it remain visible."""
SHOWN_BELOW_M = 1.8
"""A thing whose bottom is at this height (m) or higher is not drawn."""
LABELLED_DEPTH_M = 0.1
"""A thing with at most this depth (m) gets no label."""
LEAST_FILLED = 0.75
"""A thing that fills at least this share of its box is drawn as the box.

Any other thing, such as a countertop around a corner, is drawn by its true outline.
"""
SMOOTHED_M = 0.01
"""Tolerance (m) with which outlines are simplified."""
NAME_STEP_M = 0.1
"""Step (m) of the grid of points at which a room's name may be placed."""
MARGIN_M = 0.4
"""Width (m) of the margin that is drawn around the house."""
BOX_CORNERS = 4
LEAST_LABELLED = 2.0
"""Smallest footprint of a thing that gets a label, in units of a square that is as high as the letters.

A reader would think that the label of a smaller thing belongs to its neighbour.
"""
LETTER_WIDTH = 0.56
"""Mean width of a letter, as a share of the letter's height."""
LINE_HEIGHT = 1.1
"""Smallest distance between two lines of text, as a multiple of the height of the letters."""
THING_SHIFTS = (0, LINE_HEIGHT, -LINE_HEIGHT)
"""Positions tried for a thing's label: how far below the thing's middle, in heights of the letters."""
ROOM_SHIFTS = (0, -1.5, 1.5, -3, 3, -5, 5, -7, 7)
"""Positions tried for a room's name: how far below `PlanRoom.name_at`, in heights of the letters."""


@dataclass(frozen=True, slots=True)
class PlanShape:
    """A polygon, line or dot of a plan."""

    kind: str
    """Words that say how the shape is drawn, from the most general to the most specific, e.g. "room room-Kitchen"."""
    points: np.ndarray
    """Corners (n, 2) of a polygon, ends (2, 2) of a line, or middle (1, 2) of a dot."""
    id: str = ""


@dataclass(frozen=True, slots=True)
class PlanRoom:
    """The floor of a room, and the room's name."""

    id: str
    room_type: str
    name: str
    corners: np.ndarray
    """Corners (n, 2) of the floor."""
    area_m2: float
    name_at: tuple[float, float]
    """Point (x, z) at which the name is drawn; it is the point with the most free floor around it."""


@dataclass(frozen=True, slots=True)
class PlanThing:
    """A thing that stands or hangs in a room."""

    id: str
    kind: Literal["rug", "thing", "hung"]
    corners: np.ndarray
    """Corners (n, 2) of the thing's outline. If the outline has four corners, the last two are at the thing's front."""
    middle: tuple[float, float]
    area_m2: float
    label: str
    """Name that is drawn on the thing; empty for a thing without a label."""


@dataclass(frozen=True, slots=True)
class PlanLabel:
    """A text on a plan."""

    kind: Literal["room-name", "label"]
    text: str
    x: float
    z: float
    """Coordinate z (m) of the middle of the text."""


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """The rooms and things of a floor plan, and the shapes to draw."""

    rooms: tuple[PlanRoom, ...]
    things: tuple[PlanThing, ...]
    """Things in the order in which they are drawn: first rugs, then the other things from the lowest to the highest."""
    shapes: tuple[PlanShape, ...]
    """Shapes in drawing order: rooms, things with marks of their fronts, walls, doors and windows, small objects."""

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest (x, z) of the drawn area, which is all floors and a margin."""
        corners = np.concatenate([room.corners for room in self.rooms])
        return corners.min(axis=0) - MARGIN_M, corners.max(axis=0) + MARGIN_M

    def labels(self, text_m: float, *, detailed: bool = False) -> list[PlanLabel]:
        """Return the labels that fit without overlaps if letters are `text_m` high.

        Labels of things come first, from the largest thing to the smallest, then the names of rooms. With `detailed`,
        small things also have labels, and the label of a room includes its area.
        """
        placed: list[PlanLabel] = []
        low, high = self.bounds
        for thing in sorted(self.things, key=lambda thing: (-thing.area_m2, thing.id)):
            if thing.label and (detailed or thing.area_m2 >= LEAST_LABELLED * text_m**2):
                half = LETTER_WIDTH * text_m * len(thing.label) / 2
                x = float(np.clip(thing.middle[0], low[0] + half, max(low[0] + half, high[0] - half)))
                tried = [thing.middle[1] - shift * text_m for shift in THING_SHIFTS]
                _add_first_free(placed, [PlanLabel("label", thing.label, x, z) for z in tried], text_m)
        for room in self.rooms:
            text = f"{room.name}, {room.area_m2:.0f} m2" if detailed else room.name
            floor, (x, middle) = shapely.Polygon(room.corners), room.name_at
            tried = [z for shift in ROOM_SHIFTS if shapely.contains_xy(floor, x, z := middle - shift * text_m)]
            _add_first_free(placed, [PlanLabel("room-name", text, x, z) for z in tried], text_m)
        return placed


def _add_first_free(placed: list[PlanLabel], tried: list[PlanLabel], text_m: float) -> None:
    """Append to `placed` the first label of `tried` that does not overlap any label in `placed`, if there is one."""
    for label in tried:
        if not any(
            abs(label.x - other.x) < (LETTER_WIDTH * (len(label.text) + len(other.text)) + 1) * text_m / 2
            and abs(label.z - other.z) < LINE_HEIGHT * text_m
            for other in placed
        ):
            placed.append(label)
            return


def floor_plan(house: House, things: Iterable[Thing]) -> FloorPlan:
    """Return the plan of a house with the given things in it."""
    things = list(things)
    in_rooms = [thing for thing in things if thing.parent is None and not thing.is_structure]
    bottoms = {thing.id: bounding_box(thing).bottom for thing in in_rooms}
    shown = [thing for thing in in_rooms if bottoms[thing.id] < SHOWN_BELOW_M]
    drawn = [_thing(thing) for thing in sorted(shown, key=lambda each: (bottoms[each.id], each.id))]
    drawn.sort(key=lambda each: each.kind != "rug")
    rooms = _rooms(house, shapely.union_all([shapely.Polygon(each.corners) for each in drawn if each.kind != "rug"]))
    return FloorPlan(
        rooms=tuple(rooms),
        things=tuple(drawn),
        shapes=(
            *(PlanShape(f"room room-{room.room_type}", room.corners, room.id) for room in rooms),
            *(shape for thing in drawn for shape in _thing_shapes(thing)),
            *(PlanShape("wall", np.array(wall.ends)) for wall in house.document.walls if not wall.empty),
            *(shape for thing in things if thing.is_structure for shape in _opening_shapes(thing)),
            *(
                PlanShape("small", np.array([[thing.position.x, thing.position.z]]), thing.id)
                for thing in things
                if thing.parent is not None and not thing.is_drawer
            ),
        ),
    )


def _thing_shapes(thing: PlanThing) -> Iterator[PlanShape]:
    yield PlanShape(thing.kind, thing.corners, thing.id)
    if thing.kind == "thing" and len(thing.corners) == BOX_CORNERS:
        yield PlanShape("front", thing.corners[2:])


def _opening_shapes(thing: Thing) -> Iterator[PlanShape]:
    kind = "opening window" if thing.category == "Window" else "opening door"
    yield PlanShape(kind, floor_corners(bounding_box(thing)), thing.id)
    yield from (PlanShape("leaf", leaf.polygon) for leaf in moving_prisms_of(thing))


def _thing(thing: Thing) -> PlanThing:
    box, size, is_rug = bounding_box(thing), thing.asset.size, thing.category == "Rug"
    is_labelled = not is_rug and size.z > LABELLED_DEPTH_M
    corners = floor_corners(box)
    solids = shapely.union_all([polygon_of(prism) for prism in prisms_of(thing, openness=0.0)])
    if isinstance(solids, shapely.Polygon) and solids.area < LEAST_FILLED * footprint(box).area:
        corners = shapely.get_coordinates(solids.exterior.simplify(SMOOTHED_M))[:-1]
    return PlanThing(
        id=thing.id,
        kind="rug" if is_rug else "hung" if box.bottom > HUNG_M else "thing",
        corners=corners,
        middle=(thing.position.x, thing.position.z),
        area_m2=size.x * size.z,
        label=CATALOG[thing.category].display_name if is_labelled else "",
    )


def _rooms(house: House, furniture: shapely.Geometry) -> list[PlanRoom]:
    return [
        PlanRoom(
            id=room.id,
            room_type=room.kind,
            name=re.sub(r"(?<=[a-z])(?=[A-Z])", " ", room.kind).lower(),
            corners=np.array([(point.x, point.z) for point in room.floor_polygon]),
            area_m2=floor_of(room).area,
            name_at=_roomiest_point(floor_of(room), furniture),
        )
        for room in house.document.rooms
    ]


def _roomiest_point(floor: shapely.Polygon, furniture: shapely.Geometry) -> tuple[float, float]:
    """Return the grid point (x, z) on a floor that is farthest from the floor's edge and from all furniture.

    If the floor contains no grid point, return any point on it.
    """
    x0, z0, x1, z1 = floor.bounds
    xs, zs = (part.ravel() for part in np.meshgrid(np.arange(x0, x1, NAME_STEP_M), np.arange(z0, z1, NAME_STEP_M)))
    inside = shapely.contains_xy(floor, xs, zs)
    if not inside.any():
        middle = floor.representative_point()
        return middle.x, middle.y
    points = shapely.points(xs[inside], zs[inside])
    best = int(shapely.distance(points, shapely.union(furniture, floor.exterior)).argmax())
    return float(xs[inside][best]), float(zs[inside][best])
