"""Lights: one lamp in every room, and the objects that give light while they are on.

A room whose light switches are off is dim rather than dark, because of daylight. The module `light_sources` decides
which objects and switches affect a picture.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from vigil.base.geometry import heading
from vigil.rendering.scene import PointLight
from vigil.scene.outlines import room_floor
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim.engines.mujoco.compiled import frames

SWITCH = "LightSwitch"
ARM_M = 0.3
"""A light switch belongs to the room that contains the point at this distance (m) in front of the switch."""
POINT_LIGHT_STRENGTH = 0.5
PALER = 0.2
"""Share of white that is mixed into the colour of a room's light."""
DIM_SHARE = 0.4
"""Share of its full light that a room's lamp still gives while the room's light switches are off."""
USUAL_HEIGHT_M, GAIN_PER_M2 = 2.6, 0.02
"""Usual room height h0 (m), and gain g: in a room of greater height h, lamps are stronger by g * (h * h - h0 * h0)."""
DROP_M = 0.06
"""How far (m) a lamp is below the ceiling."""
KERNEL_EDGE_M = 0.3
"""Least distance (m) of a lamp from the edge of the area from which all of the room is visible."""


@dataclass(slots=True, eq=False)
class Lamps:
    """The lamps of a model's rooms."""

    rooms: list[shapely.Polygon]
    places: np.ndarray
    """Positions of the lamps (rooms, 3) in metres, in MuJoCo's frame."""
    colors: np.ndarray
    """Colours of the lamps (rooms, 3); (1, 1, 1) is white light of the usual strength."""
    switches: dict[str, int]
    """Id of a light switch -> number of its room."""
    dim_rooms: frozenset[int] = frozenset()
    """Numbers of the rooms whose light switches are all off."""

    def update_switches(self, switches: Sequence[Thing], is_seen: Callable[[Thing], bool]) -> None:
        """Set which rooms are dim, from those of the given light switches that are seen.

        A switch that is on is tested only if one that is off is seen in its room: without it, the room is not dim.
        """
        off = {self.switches[each.id] for each in switches if not each.is_toggled and is_seen(each)}
        asked = [each for each in switches if each.is_toggled and self.switches[each.id] in off]
        self.dim_rooms = frozenset(off - {self.switches[each.id] for each in asked if is_seen(each)})

    def strengths(self) -> np.ndarray:
        """Return the colour (rooms, 3) of each room's lamp; the colour is dim if the room's light switches are off."""
        dimmed = [DIM_SHARE if room in self.dim_rooms else 1.0 for room in range(len(self.rooms))]
        return self.colors * np.array(dimmed)[:, None]

    def place_over(self, eye: np.ndarray) -> np.ndarray:
        """Return the position (3,), in MuJoCo's frame, of the lamp in the room nearest to an eye."""
        return self.places[int(np.argmin(shapely.distance(self.rooms, shapely.Point(eye[0], eye[1]))))]


def lamps_of(scene: Scene) -> Lamps:
    """Return the lamps of a scene's rooms."""
    rooms = [room_floor(room) for room in scene.rooms]
    return Lamps(
        rooms,
        np.array([(*_place(room), room.height - DROP_M) for room in scene.rooms]),
        np.array([_color(room) for room in scene.rooms]),
        {thing.id: _room_of(thing, rooms) for thing in scene.things.values() if thing.category == SWITCH},
    )


def point_light_of(thing: Thing) -> PointLight:
    """Return the light that a thing gives while it is on. Raises ValueError if the thing is not a lamp."""
    glow = thing.asset.glow
    if glow is None:
        raise ValueError(f"{thing.id} is not a lamp.")
    position, matrix = frames.thing_place(thing)
    place = position + matrix @ frames.points(np.array(glow.position))
    return PointLight(place, np.array(glow.rgb) * min(glow.intensity, 1.0) * POINT_LIGHT_STRENGTH)


def _room_of(thing: Thing, rooms: list[shapely.Polygon]) -> int:
    """Return the number of the room that a thing on a wall faces."""
    x, z = heading(thing.rotation.y)
    front = shapely.Point(thing.position.x + ARM_M * x, thing.position.z + ARM_M * z)
    return int(np.argmin(shapely.distance(rooms, front)))


def _color(room: RoomShape) -> np.ndarray:
    """Return the colour of a room's lamp: that of the room's light in the house, but paler, and stronger in a high
    room."""
    further = GAIN_PER_M2 * (room.height**2 - USUAL_HEIGHT_M**2)
    return (PALER + (1.0 - PALER) * np.array(room.light_rgb)) * (1.0 + max(further, 0.0))


def _place(room: RoomShape) -> tuple[float, float]:
    """Return the position (x, z) of a room's lamp.

    This is the position of the room's light in the house. If light from there does not reach every corner of the room,
    the lamp is moved to a place from which all corners are lit, if there is such a place.
    """
    light, seen_from = shapely.Point(room.light.x, room.light.z), _kernel(room_floor(room))
    inner = shapely.buffer(seen_from, -min(KERNEL_EDGE_M, np.sqrt(shapely.area(seen_from)) / 4))
    if inner.is_empty or inner.contains(light):
        return room.light.x, room.light.z
    middle = shapely.centroid(inner)
    return float(shapely.get_x(middle)), float(shapely.get_y(middle))


def _kernel(polygon: shapely.Polygon) -> shapely.Geometry:
    """Return the area of a room from which the whole room is visible; it may be empty."""
    corners = np.array(shapely.geometry.polygon.orient(polygon).exterior.coords)
    reach = 4.0 * float(np.hypot(*(corners.max(axis=0) - corners.min(axis=0))))
    kernel: shapely.Geometry = polygon
    for start, end in itertools.pairwise(corners):
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
        inward = np.array([-along[1], along[0]])
        first, last = start - reach * along, start + reach * along
        kernel = kernel.intersection(shapely.Polygon([first, last, last + reach * inward, first + reach * inward]))
    return kernel
