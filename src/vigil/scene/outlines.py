"""Outlines of floors, walls and things on the floor plane (x, z in metres), and which of them can block the agent's
body."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vigil.base.geometry import Box
from vigil.protocol.house import Room
from vigil.scene.geometry import Prism, prisms_of
from vigil.scene.things import RoomShape, Thing, WallPanel

BODY_RADIUS_M = 0.2
"""Radius (m) of the agent's body, an upright cylinder."""
BODY_LOW_M = 0.05
"""Height (m) of the bottom of the agent's body; solids below it do not block the body."""
BODY_HIGH_M = 1.8
"""Height (m) of the top of the agent's body; solids above it do not block the body."""
GRID_M = 0.25
"""Step (m) of the grid on which agents walk."""
FLOOR_GROWTH_M = 0.005
"""How far (m) a room's floor is extended under its walls, so that a body can cross the line where two rooms meet."""


def floor_of(room: Room) -> shapely.Polygon:
    """Return the floor polygon of a room of a house document."""
    return shapely.Polygon([(point.x, point.z) for point in room.floor_polygon])


def room_floor(room: RoomShape) -> shapely.Polygon:
    """Return the floor polygon of a room of a scene."""
    return shapely.Polygon(room.polygon)


def floor_of_rooms(rooms: list[RoomShape]) -> BaseGeometry:
    """Return the floor of all rooms together, grown by `FLOOR_GROWTH_M`."""
    floors = shapely.unary_union([room_floor(room).buffer(0) for room in rooms])
    return floors.buffer(FLOOR_GROWTH_M, join_style="mitre")


def footprint(box: Box) -> shapely.Polygon:
    """Return the rectangle of an upright box on the floor plane."""
    return shapely.Polygon(floor_corners(box))


def floor_corners(box: Box) -> np.ndarray:
    """Return the corners (4, 2) of an upright box on the floor plane; the last two are at the box's front."""
    return np.array([(corner.x, corner.z) for corner in box.corners()[:4]])


def polygon_of(prism: Prism) -> shapely.Polygon | shapely.LineString:
    """Return the prism's shape on the floor plane: a polygon, or a line when the prism has no width."""
    return shapely.Polygon(prism.polygon) if len(prism.polygon) > 2 else shapely.LineString(prism.polygon)


def meets_body(prism: Prism) -> bool:
    """Return whether a solid is partly at the height of the agent's body, so that it can block the body."""
    return prism.bottom < BODY_HIGH_M and prism.top > BODY_LOW_M


def thing_shapes(thing: Thing) -> list[BaseGeometry]:
    """Return the shapes, on the floor plane, of the thing's solids that can block a body."""
    return [polygon_of(prism) for prism in prisms_of(thing) if meets_body(prism)]


def wall_shapes(panel: WallPanel) -> list[BaseGeometry]:
    """Return the shapes, on the floor plane, of the parts of a panel that can block a body; holes are left out."""
    return [polygon_of(prism) for prism in wall_prisms(panel) if meets_body(prism)]


def wall_prisms(panel: WallPanel) -> list[Prism]:
    """Return the parts of the panel around its holes, as prisms without thickness."""
    start, end = np.array(panel.start), np.array(panel.end)
    length = float(np.hypot(*(end - start)))
    if length < 1e-9:
        return []
    direction, top = (end - start) / length, panel.bottom + panel.height
    spans: list[tuple[float, float, float, float]] = []
    along = 0.0
    for hole in panel.holes:
        spans.append((along, hole.left, panel.bottom, top))
        spans.append((hole.left, hole.right, panel.bottom, panel.bottom + hole.bottom))
        spans.append((hole.left, hole.right, panel.bottom + hole.top, top))
        along = max(along, hole.right)
    spans.append((along, length, panel.bottom, top))
    return [
        Prism(np.array([start + direction * left, start + direction * right]), low, high)
        for left, right, low, high in spans
        if right - left > 1e-6 and high - low > 1e-6
    ]
