"""Floor plan: the shapes of a house seen from above, in metres on the floor plane; other modules draw them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely

from vigil.assets.catalog import CATALOG
from vigil.base.geometry import Box
from vigil.protocol.house import House
from vigil.scene.geometry import bounding_box, moving_prisms_of, prisms_of
from vigil.scene.outlines import floor_corners, floor_of, footprint, polygon_of
from vigil.scene.things import Thing

HUNG_M = 1.0
"""Bottom height above which a thing hangs on a wall; only its outline is drawn, so that what is below it shows."""
SHOWN_BELOW_M = 1.8
"""Bottom height from which on a thing is not drawn."""
LABELLED_DEPTH_M = 0.1
"""Least depth of a thing with a label."""
LEAST_FILLED = 0.75
"""Least share of its box that a thing drawn as a box fills.

A thing that fills less, such as a countertop around a corner, is drawn by its true outline.
"""
SMOOTHED_M = 0.01
"""Tolerance to which outlines are simplified."""
NAME_STEP_M = 0.1
"""Step of the grid of points that are tried for a room's name."""


@dataclass(frozen=True, slots=True)
class PlanRoom:
    """A room's floor with its name."""

    id: str
    room_type: str
    name: str
    corners: np.ndarray
    """Corners (n, 2) of the floor."""
    area_m2: float
    name_at: tuple[float, float]
    """Point (x, z) for the name, with the most free floor around it."""


@dataclass(frozen=True, slots=True)
class PlanThing:
    """A thing that stands or hangs in a room."""

    id: str
    kind: Literal["rug", "thing", "hung"]
    corners: np.ndarray
    """Corners (n, 2) of its outline; of four, the last two are those of its front."""
    middle: tuple[float, float]
    area_m2: float
    label: str
    """Name that is drawn on it; empty where none is."""


@dataclass(frozen=True, slots=True)
class PlanOpening:
    """A door or a window."""

    id: str
    is_window: bool
    corners: np.ndarray
    """Corners (4, 2) of its box."""
    leaves: tuple[np.ndarray, ...]
    """Outlines (n, 2) of the parts that swing or slide, as open as they are now."""


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """The shapes of a floor plan; the fields are in the order of drawing."""

    rooms: tuple[PlanRoom, ...]
    things: tuple[PlanThing, ...]
    """Rugs, then the other things from the lowest up."""
    walls: tuple[np.ndarray, ...]
    """The two ends (2, 2) of each wall that is not empty."""
    openings: tuple[PlanOpening, ...]
    small: tuple[tuple[str, float, float], ...]
    """Things in or on others, without drawers: id, x, z."""

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest (x, z) of all floors."""
        corners = np.concatenate([room.corners for room in self.rooms])
        return corners.min(axis=0), corners.max(axis=0)

    @property
    def labelled(self) -> list[PlanThing]:
        """The things with a label, the largest first."""
        return sorted((thing for thing in self.things if thing.label), key=lambda thing: (-thing.area_m2, thing.id))


def floor_plan(house: House, things: Iterable[Thing]) -> FloorPlan:
    """Return the plan of a house with `things` in it."""
    things = list(things)
    in_rooms = [thing for thing in things if thing.parent is None and not thing.is_structure]
    bottoms = {thing.id: bounding_box(thing).bottom for thing in in_rooms}
    shown = [thing for thing in in_rooms if bottoms[thing.id] < SHOWN_BELOW_M]
    drawn = [_thing(thing) for thing in sorted(shown, key=lambda each: (bottoms[each.id], each.id))]
    furniture = shapely.union_all([shapely.Polygon(each.corners) for each in drawn if each.kind != "rug"])
    return FloorPlan(
        rooms=tuple(_rooms(house, furniture)),
        things=tuple(sorted(drawn, key=lambda each: each.kind != "rug")),
        walls=tuple(np.array(wall.ends) for wall in house.document.walls if not wall.empty),
        openings=tuple(_opening(thing) for thing in things if thing.is_structure),
        small=tuple((e.id, e.position.x, e.position.z) for e in things if e.parent is not None and not e.is_drawer),
    )


def _thing(thing: Thing) -> PlanThing:
    box, size, is_rug = bounding_box(thing), thing.asset.size, thing.category == "Rug"
    is_labelled = not is_rug and size.z > LABELLED_DEPTH_M
    return PlanThing(
        id=thing.id,
        kind="rug" if is_rug else "hung" if box.bottom > HUNG_M else "thing",
        corners=_outline(thing, box),
        middle=(thing.position.x, thing.position.z),
        area_m2=size.x * size.z,
        label=CATALOG[thing.category].display_name if is_labelled else "",
    )


def _outline(thing: Thing, box: Box) -> np.ndarray:
    """Return the corners (n, 2) of a thing's box on the floor, or of its solids if they leave much of the box free."""
    solids = shapely.union_all([polygon_of(prism) for prism in prisms_of(thing, openness=0.0)])
    if isinstance(solids, shapely.Polygon) and solids.area < LEAST_FILLED * footprint(box).area:
        return shapely.get_coordinates(solids.exterior.simplify(SMOOTHED_M))[:-1]
    return floor_corners(box)


def _opening(thing: Thing) -> PlanOpening:
    leaves = tuple(leaf.polygon for leaf in moving_prisms_of(thing))
    return PlanOpening(thing.id, thing.category == "Window", floor_corners(bounding_box(thing)), leaves)


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
    """Return the grid point (x, z) inside a floor that is farthest from the floor's edge and all furniture.

    For a floor without a grid point inside, return any point inside.
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
