"""Lights.

One lamp hangs in every room. The agent's room's casts shadows; the nearest others shine without, so that the next
room seen through a door is neither black nor changes abruptly on entering. Lamps of the house that are on add a
little light of their own. A room whose light switches are all off is dim, not dark: there is daylight.
"""

import itertools
from dataclasses import dataclass

import numpy as np
import shapely

from vigil.pose import Vec3, heading
from vigil.scene.outlines import room_floor
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim.engines.mujoco import frames
from vigil.sim.engines.mujoco.binding import NativeModel, NativeSpec, mujoco

SWITCH = "LightSwitch"
ARM_M = 0.3
"""A switch belongs to the room this far in front of it."""
MAX_ROOM_LAMPS = 3
MAX_GLOWS = 2
"""OpenGL's fixed pipeline has eight lights: the headlight, the fills, these."""
GLOW = 0.55
AMBIENT = (0.42, 0.42, 0.42)
HEADLIGHT = (0.07, 0.07, 0.07)
FILLS = (((0.33, 0.2, 0.92), 0.32), ((-0.33, -0.40, -0.86), 0.22))
"""(direction that the light travels in, strength): light from floor and walls, which nobody else computes."""
LAMP, OTHER_LAMP = 0.48, 0.32
FALLOFF, OTHER_FALLOFF = (1.0, 0.0, 0.02), (1.0, 0.0, 0.16)
"""The lamp of the agent's room, and those of other rooms: weaker, since no wall stops their light."""
UNLIT = 0.25
"""What is left of a lamp whose switches are off."""
USUAL_HEIGHT_M = 2.6
RISE_M = 0.02
"""Lamps hang this far over the ceiling, which stops no light: behind a lamp the shadow map would be read backwards."""
KERNEL_EDGE_M = 0.3
SHADOW_UP_TO_M, WIDEST_SHADOW_DEG = 0.7, 74.0
"""Height up to which shadows are wanted in a room's corners; half the widest angle that a shadow map may span."""


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """Light from one side, for pictures that no agent sees; in MuJoCo's frame."""

    direction: tuple[float, float, float]
    """The way that the light travels."""
    middle: np.ndarray
    reach_m: float
    """Shadows fall this far around the middle."""


@dataclass(slots=True, eq=False)
class Lamps:
    """The lights of a model, and the rooms that they belong to."""

    rooms: list[shapely.Polygon]
    centers: np.ndarray
    colors: np.ndarray
    shadow_scales: list[float]
    """Share of half a turn that each room's shadows need."""
    room_lights: list[int]
    glow_lights: list[int]
    sun: int
    switches: dict[str, int]
    """Light switch -> its room."""
    unlit: frozenset[int] = frozenset()
    """Rooms whose switches are all off."""

    def heed(self, scene: Scene) -> None:
        """Takes over how the light switches stand."""
        off, on = set[int](), set[int]()
        for thing_id, room in self.switches.items():
            thing = scene.things[thing_id]
            (on if thing.is_toggled or not thing.is_present else off).add(room)
        self.unlit = frozenset(off - on)

    def select(self, native: NativeModel, eye: Vec3, glowing: list[Thing]) -> float:
        """Switches the lights for an agent at `eye`; `glowing` are the things that give light.

        Returns the shadow scale of the room's lamp.
        """
        self._darken(native)
        here = int(np.argmin(shapely.distance(self.rooms, shapely.Point(eye.x, eye.z))))
        order = np.argsort(np.linalg.norm(self.centers - (eye.x, eye.z), axis=1), kind="stable")
        near = [here, *(int(room) for room in order if room != here)][:MAX_ROOM_LAMPS]
        for room in near:
            light, is_here = self.room_lights[room], room == here
            native.light_active[light] = 1
            native.light_castshadow[light] = is_here
            strength = (LAMP if is_here else OTHER_LAMP) * (UNLIT if room in self.unlit else 1.0)
            native.light_diffuse[light] = self.colors[room] * strength
            native.light_attenuation[light] = FALLOFF if is_here else OTHER_FALLOFF
        nearest = sorted(glowing, key=lambda thing: (thing.position.x - eye.x) ** 2 + (thing.position.z - eye.z) ** 2)
        for light, thing in zip(self.glow_lights, nearest, strict=False):
            _aim_glow(native, light, thing)
        return self.shadow_scales[here]

    def daylight(self, native: NativeModel, sun: Sun) -> None:
        """Lights everything from above, through the ceilings, for pictures that no agent sees."""
        self._darken(native)
        direction = np.array(sun.direction) / np.linalg.norm(sun.direction)
        native.light_dir[self.sun] = direction
        native.light_pos[self.sun] = np.array(sun.middle) - 2.0 * sun.reach_m * direction
        native.light_active[self.sun] = 1
        native.light_castshadow[self.sun] = 1

    def _darken(self, native: NativeModel) -> None:
        native.light_active[[*self.room_lights, *self.glow_lights, self.sun]] = 0
        native.light_castshadow[:] = 0


def _aim_glow(native: NativeModel, light: int, thing: Thing) -> None:
    glow = thing.asset.glow
    if glow is None:
        return
    position, matrix = frames.thing_place(thing)
    native.light_active[light] = 1
    native.light_pos[light] = position + matrix @ frames.points(np.array(glow.position))
    native.light_diffuse[light] = np.array(glow.rgb) * min(glow.intensity, 1.0) * GLOW


def settings(spec: NativeSpec) -> None:
    """Sets what is the same in every scene."""
    headlight = spec.visual.headlight
    headlight.ambient, headlight.diffuse, headlight.specular = AMBIENT, HEADLIGHT, (0.0, 0.0, 0.0)
    spec.visual.map.znear, spec.visual.map.zfar = 0.03, 90.0
    spec.visual.map.shadowclip = 8.0
    spec.visual.map.shadowscale = 1.0


def add_lamps(spec: NativeSpec, scene: Scene) -> Lamps:
    """Adds one lamp to every room, and the lights that lamps of the house may need."""
    places = [_place(room) for room in scene.rooms]
    for room, (x, z) in zip(scene.rooms, places, strict=True):
        spec.worldbody.add_light(
            pos=[x, z, room.height + RISE_M],
            dir=[0.0, 0.0, -1.0],
            type=mujoco.mjtLightType.mjLIGHT_SPOT,
            cutoff=180.0,
            exponent=0.0,
            specular=(0.25, 0.25, 0.25),
            ambient=[0.0, 0.0, 0.0],
            castshadow=False,
        )
    _add_glows(spec)
    _add_sun(spec)
    for direction, strength in FILLS:
        spec.worldbody.add_light(
            dir=direction,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            diffuse=[strength] * 3,
            specular=[0.0] * 3,
            castshadow=False,
        )
    count = len(scene.rooms)
    rooms = [room_floor(room) for room in scene.rooms]
    return Lamps(
        rooms,
        np.array(places),
        np.array([_color(room) for room in scene.rooms]),
        [_shadow_scale(room, place) for room, place in zip(scene.rooms, places, strict=True)],
        list(range(count)),
        list(range(count, count + MAX_GLOWS)),
        count + MAX_GLOWS,
        {thing.id: _room_of(thing, rooms) for thing in scene.things.values() if thing.category == SWITCH},
    )


def _room_of(thing: Thing, rooms: list[shapely.Polygon]) -> int:
    """Returns the room that a thing on the wall looks into."""
    x, z = heading(thing.rotation.y)
    front = shapely.Point(thing.position.x + ARM_M * x, thing.position.z + ARM_M * z)
    return int(np.argmin(shapely.distance(rooms, front)))


def _color(room: RoomShape) -> np.ndarray:
    """Returns the lamp's colour, half way to white, and stronger the higher it hangs."""
    further = FALLOFF[2] * (room.height**2 - USUAL_HEIGHT_M**2)
    return (0.5 + 0.5 * np.array(room.light_rgb)) * (1.0 + max(further, 0.0))


def _place(room: RoomShape) -> tuple[float, float]:
    """Returns where (x, z) the lamp hangs: the room's light, moved to where it reaches every corner if one can."""
    light, seen_from = shapely.Point(room.light.x, room.light.z), _kernel(room_floor(room))
    inner = shapely.buffer(seen_from, -min(KERNEL_EDGE_M, np.sqrt(shapely.area(seen_from)) / 4))
    if inner.is_empty or inner.contains(light):
        return room.light.x, room.light.z
    middle = shapely.centroid(inner)
    return float(shapely.get_x(middle)), float(shapely.get_y(middle))


def _kernel(polygon: shapely.Polygon) -> shapely.Geometry:
    """Returns the part of a room from which all of it is seen; empty when there is none."""
    corners = np.array(shapely.geometry.polygon.orient(polygon).exterior.coords)
    reach = 4.0 * float(np.hypot(*(corners.max(axis=0) - corners.min(axis=0))))
    kernel: shapely.Geometry = polygon
    for start, end in itertools.pairwise(corners):
        along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
        inward = np.array([-along[1], along[0]])
        first, last = start - reach * along, start + reach * along
        kernel = kernel.intersection(shapely.Polygon([first, last, last + reach * inward, first + reach * inward]))
    return kernel


def _shadow_scale(room: RoomShape, lamp: tuple[float, float]) -> float:
    """Returns the share of half a turn that the shadow map spans, so that furniture in the corners lies in it."""
    farthest = float(np.linalg.norm(room.polygon - lamp, axis=1).max())
    height = room.height - SHADOW_UP_TO_M
    return min(float(np.degrees(np.arctan2(farthest, max(height, 0.1)))), WIDEST_SHADOW_DEG) / 180.0


def _add_glows(spec: NativeSpec) -> None:
    for _ in range(MAX_GLOWS):
        spec.worldbody.add_light(
            dir=[0.0, 0.0, -1.0],
            type=mujoco.mjtLightType.mjLIGHT_SPOT,
            cutoff=180.0,
            exponent=0.0,
            attenuation=[1.0, 0.3, 1.2],
            diffuse=[0.0, 0.0, 0.0],
            specular=[0.0, 0.0, 0.0],
            castshadow=False,
        )


def _add_sun(spec: NativeSpec) -> None:
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.42, 0.42, 0.42],
        specular=[0.15, 0.15, 0.15],
        castshadow=False,
        active=False,
    )
