"""The shell of a house: wall panels with their holes, rooms, and the positions of doors and windows.

Only this module handles the way in which ProcTHOR writes walls. A room's wall lists its bottom points first; an outside
wall lists its top points first. Between two rooms, two panels of opposite direction are in the same place; the document
gives a hole only along the first panel. A wall that is `empty` is not built.
"""

import math

import numpy as np
import shapely

from vigil.base.geometry import Vec3, wrap_deg, yaw_towards
from vigil.errors import HouseError
from vigil.protocol.house import EXTERIOR, House, HouseDocument, Light, MaterialRef, Opening, Wall
from vigil.protocol.house import Room as RoomNode
from vigil.scene.outlines import floor_of
from vigil.scene.things import Hole, RoomShape, WallPanel

DEFAULT_HEIGHT_M = 2.6
"""Height (m) of the rooms of a house without walls."""
LIGHT_DROP_M = 0.2
"""How far (m) a room's light is below the ceiling if the document has no light for the room."""
DOOR_DEPTH_M = 0.14
WINDOW_DEPTH_M = 0.09
PROBE_M = 0.01
"""Distance (m) in front of a wall at which the room in front of the wall is looked up."""
LEAST_FLOOR_M2 = 0.01
LEAST_WALL_M = 1e-4
FARTHEST_SHELL_M = 200.0
"""Greatest coordinate (m) of a room, wall or opening. There is a limit because floors and walls are drawn in cells of
half a metre."""


def rooms_of(house: House) -> list[RoomShape]:
    """Return the rooms of a house.

    A room is as high as its highest wall. Its light comes from the document. A room without a light there gets a light
    near the middle of the ceiling. Raises HouseError when a floor crosses itself or has almost no area, or when the
    house is too large.
    """
    document = house.document
    _check_extent(house)
    for room in document.rooms:
        if not (floor := floor_of(room)).is_valid:
            raise HouseError(
                f"House {house.name!r}: room {room.id!r}: its floor is not a simple polygon "
                f"({shapely.is_valid_reason(floor)}). List its corners in order around the room."
            )
        if floor.area < LEAST_FLOOR_M2:
            raise HouseError(
                f"House {house.name!r}: room {room.id!r}: its floor has {floor.area:.2g} m2, expected at least "
                f"{LEAST_FLOOR_M2:g}. Fix its corners, or leave the room out."
            )
    points = [light for light in document.procedural_parameters.lights if light.type == "point"]
    return [_room(room, document, points) for room in document.rooms]


def _check_extent(house: House) -> None:
    """Raise HouseError when a room, wall or hole is so far away that the house would not fit into memory."""
    document = house.document
    shapes = [(f"room {room.id!r}", room.floor_polygon) for room in document.rooms]
    shapes += [(f"wall {wall.id!r}", wall.polygon) for wall in document.walls]
    shapes += [(f"opening {each.id!r}", each.hole_polygon) for each in [*document.doors, *document.windows]]
    for name, points in shapes:
        reach = max(abs(value) for point in points for value in point.vec)
        if reach > FARTHEST_SHELL_M:
            raise HouseError(
                f"House {house.name!r}: {name} reaches {reach:g} m from the origin, more than the limit of "
                f"{FARTHEST_SHELL_M:g} m. Are its coordinates metres?"
            )


def panels_of(house: House, *, empty: bool = False) -> list[WallPanel]:
    """Return the panels of the walls, with the holes of all doors and windows.

    With `empty`, return only the panels of the walls that the document marks as empty (not built). Raises HouseError on
    a wall without length or height.
    """
    document = house.document
    wanted = [wall for wall in document.walls if wall.empty == empty]
    for wall in wanted:
        heights = [point.y for point in wall.polygon]
        if math.dist(*wall.ends) < LEAST_WALL_M or max(heights) - min(heights) < LEAST_WALL_M:
            raise HouseError(
                f"House {house.name!r}: wall {wall.id!r} has no length or no height. Fix its corners, or leave it out."
            )
    walls = {wall.id: wall for wall in document.walls}
    rooms = {room.id: floor_of(room) for room in document.rooms}
    holes: dict[str, list[Hole]] = {}
    for opening in [*document.doors, *document.windows]:
        for wall_id in dict.fromkeys((opening.wall0, opening.wall1)):
            if wall_id in walls:
                holes.setdefault(wall_id, []).append(_hole_in(walls[wall_id], opening, walls[opening.wall0]))
    return [_panel(wall, tuple(holes.get(wall.id, ())), rooms) for wall in wanted]


def place_of_opening(house: House, opening: Opening, panels: dict[str, WallPanel]) -> tuple[Vec3, float, Vec3]:
    """Return a door's or window's centre, its yaw (deg; the front faces its first room) and the size (m) of its hole.

    `panels` are all panels by id, including those of empty walls.
    """
    panel = panels[opening.wall0]
    xs, ys = _hole_extent(opening)
    start, direction = np.array(panel.start), _direction(panel.start, panel.end)
    x, z = start + direction * (sum(xs) / 2)
    yaw = yaw_towards(Vec3(0.0, 0.0, 0.0), Vec3(panel.normal[0], 0.0, panel.normal[1]))
    depth = DOOR_DEPTH_M if opening in house.document.doors else WINDOW_DEPTH_M
    size = Vec3(round(xs[1] - xs[0], 4), round(ys[1] - ys[0], 4), depth)
    return Vec3(float(x), panel.bottom + sum(ys) / 2, float(z)), wrap_deg(yaw), size


def _room(room: RoomNode, document: HouseDocument, lights: list[Light]) -> RoomShape:
    floor = floor_of(room)
    own = [wall for wall in document.walls if wall.room_id == room.id and not wall.is_exterior]
    height = max((point.y for wall in own or document.walls for point in wall.polygon), default=DEFAULT_HEIGHT_M)
    ceilings = (ceiling.material for ceiling in room.ceilings if ceiling.material is not None)
    light = _light_of(room, floor, lights)
    if light is None:
        inner = floor.representative_point() if not floor.contains(floor.centroid) else floor.centroid
        place, rgb = Vec3(inner.x, height - LIGHT_DROP_M, inner.y), (1.0, 0.95, 0.9)
    else:
        place, rgb = light.position.vec, (light.rgb.r, light.rgb.g, light.rgb.b)
    return RoomShape(
        id=room.id,
        room_type=room.kind,
        polygon=np.array([(point.x, point.z) for point in room.floor_polygon]),
        height=height,
        floor_material=room.floor_material,
        ceiling_material=next(iter(ceilings), document.procedural_parameters.ceiling_material),
        light=place,
        light_rgb=rgb,
    )


def _light_of(room: RoomNode, floor: shapely.Polygon, lights: list[Light]) -> Light | None:
    """Return a room's light: a light in the room that has the room's name, else any light in the room, else a light
    elsewhere that has the room's name. None if there is no such light."""
    suffix = room.id.rpartition("|")[2]
    named = [light for light in lights if light.id.rpartition("_")[2] == suffix]
    inside = [light for light in lights if floor.contains(shapely.Point(light.position.x, light.position.z))]
    return next((light for light in named if light in inside), next(iter(inside), next(iter(named), None)))


def _direction(start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    along = np.subtract(end, start)
    length = float(np.hypot(*along))
    return along / length if length > 1e-9 else np.array([1.0, 0.0])


def _hole_extent(opening: Opening) -> tuple[tuple[float, float], tuple[float, float]]:
    xs, ys = [point.x for point in opening.hole_polygon], [point.y for point in opening.hole_polygon]
    return (min(xs), max(xs)), (min(ys), max(ys))


def _hole_in(wall: Wall, opening: Opening, first: Wall) -> Hole:
    """Return an opening's hole in metres along `wall`; the document gives it in metres along the wall `first`."""
    xs, ys = _hole_extent(opening)
    if wall.id != first.id:
        start, end = first.ends
        points = np.array(start) + np.outer(xs, _direction(start, end))
        start, end = wall.ends
        along = sorted(float(value) for value in (points - np.array(start)) @ _direction(start, end))
        xs = (along[0], along[1])
    length = math.dist(*wall.ends)
    return Hole(left=max(0.0, xs[0]), right=min(length, xs[1]), bottom=ys[0], top=ys[1])


def _panel(wall: Wall, holes: tuple[Hole, ...], rooms: dict[str, shapely.Polygon]) -> WallPanel:
    start, end = wall.ends
    heights = [point.y for point in wall.polygon]
    direction, middle = _direction(start, end), (np.array(start) + np.array(end)) / 2
    normal = np.array([direction[1], -direction[0]])
    probe = shapely.Point(*(middle + PROBE_M * normal))
    faced = next((room for room, floor in rooms.items() if floor.contains(probe)), EXTERIOR)
    room_id = EXTERIOR if wall.is_exterior else wall.room_id or faced
    # The normal is towards the panel's room or, if it has none, away from all rooms.
    is_towards = rooms[room_id].contains(probe) if room_id in rooms else faced == EXTERIOR
    x, z = normal if is_towards else -normal
    return WallPanel(
        id=wall.id,
        room_id=room_id,
        start=start,
        end=end,
        bottom=min(heights),
        height=max(heights) - min(heights),
        normal=(float(x), float(z)),
        material=MaterialRef.model_validate(wall.material.model_dump()),
        holes=tuple(sorted(holes, key=lambda hole: hole.left)),
    )
