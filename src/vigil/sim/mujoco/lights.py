"""Lights, sky and ground.

One lamp hangs in every room. The agent's room's casts shadows; the nearest others shine without, so that the next
room seen through a door is neither black nor changes abruptly on entering. Lamps of the house that are on add a
little light of their own.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from vigil.pose import Vec3
from vigil.sim.mujoco import frames
from vigil.sim.mujoco.binding import mujoco
from vigil.sim.scene import Scene, Thing

MAX_ROOM_LAMPS = 5
MAX_GLOWS = 2
"""OpenGL's fixed pipeline has eight lights; the headlight is one."""
AMBIENT = (0.43, 0.43, 0.425)
HEADLIGHT = (0.14, 0.14, 0.14)
LAMP = 0.62
DROP_M = 0.05
GROUND_M = -0.12
_SKY_PIXELS = 128


@dataclass(slots=True, eq=False)
class Lamps:
    """The lights of a model, and the rooms that they belong to."""

    rooms: list[shapely.Polygon]
    centers: np.ndarray
    room_lights: list[int]
    glow_lights: list[int]

    def select(self, native: "mujoco.MjModel", eye: Vec3, glowing: list[Thing]) -> None:
        """Switches the lights for an agent at `eye`; `glowing` are the things that give light."""
        native.light_active[:] = 0
        native.light_castshadow[:] = 0
        here = int(np.argmin(shapely.distance(self.rooms, shapely.Point(eye.x, eye.z))))
        order = np.argsort(np.linalg.norm(self.centers - (eye.x, eye.z), axis=1), kind="stable")
        near = [here, *(int(room) for room in order if room != here)][:MAX_ROOM_LAMPS]
        for room in near:
            native.light_active[self.room_lights[room]] = 1
        native.light_castshadow[self.room_lights[here]] = 1
        nearest = sorted(glowing, key=lambda thing: (thing.position.x - eye.x) ** 2 + (thing.position.z - eye.z) ** 2)
        for light, thing in zip(self.glow_lights, nearest, strict=False):
            _aim_glow(native, light, thing)


def _aim_glow(native: "mujoco.MjModel", light: int, thing: Thing) -> None:
    glow = thing.asset.glow
    if glow is None:
        return
    position, matrix = frames.thing_place(thing)
    native.light_active[light] = 1
    native.light_pos[light] = position + matrix @ frames.points(np.array(glow.position))
    native.light_diffuse[light] = np.array(glow.rgb) * min(glow.intensity, 1.0) * 0.35


def settings(spec: "mujoco.MjSpec") -> None:
    """Sets what is the same in every scene."""
    headlight = spec.visual.headlight
    headlight.ambient, headlight.diffuse, headlight.specular = AMBIENT, HEADLIGHT, (0.0, 0.0, 0.0)
    spec.visual.map.znear, spec.visual.map.zfar = 0.03, 90.0
    spec.visual.map.shadowclip = 8.0
    spec.visual.map.shadowscale = 1.0


def add_lamps(spec: "mujoco.MjSpec", scene: Scene) -> Lamps:
    """Adds one lamp to every room, and the lights that lamps of the house may need."""
    for room in scene.rooms:
        rgb = 0.5 + 0.5 * np.array(room.light_rgb)
        x, y, z = room.light
        spec.worldbody.add_light(
            pos=frames.points(np.array([x, min(y, room.height) - DROP_M, z])),
            dir=[0.0, 0.0, -1.0],
            type=mujoco.mjtLightType.mjLIGHT_SPOT,
            cutoff=89.0,
            exponent=0.3,
            attenuation=[1.0, 0.0, 0.02],
            diffuse=rgb * LAMP,
            specular=rgb * 0.3,
            ambient=[0.0, 0.0, 0.0],
            castshadow=False,
        )
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
    count = len(scene.rooms)
    return Lamps(
        [shapely.Polygon(room.polygon) for room in scene.rooms],
        np.array([[room.light.x, room.light.z] for room in scene.rooms]),
        list(range(count)),
        list(range(count, count + MAX_GLOWS)),
    )


def add_sky(spec: "mujoco.MjSpec") -> None:
    """Adds a sky that pales towards the horizon."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.86, 0.91, 0.95],
        rgb2=[0.42, 0.62, 0.86],
        width=_SKY_PIXELS,
        height=_SKY_PIXELS * 6,
    )


def add_ground(spec: "mujoco.MjSpec") -> None:
    """Adds the lawn around the house."""
    spec.add_material(name="lawn", rgba=[0.36, 0.45, 0.27, 1.0], specular=0.0, shininess=0.0, emission=0.5)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[60.0, 60.0, 1.0],
        pos=[0.0, 0.0, GROUND_M],
        material="lawn",
        contype=0,
        conaffinity=0,
        group=0,
    )
