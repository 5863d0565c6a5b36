"""Appearance of a house: materials of floors, walls, ceilings and facades, named as in AI2-THOR, and lights.

The lights are a low sun outside, and one point light under each room's ceiling.
"""

from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.assets.kernel.palette import Rgb
from vigil.housegen.base.randomness import chance, pick
from vigil.housegen.base.tables import TABLES, names_in
from vigil.housegen.layout.floorplan import RoomLayout

FLOORS = names_in(TABLES["floors"])
"""Kind of room -> materials of its floor."""
TILED_WALLS: dict[str, list[str]] = TABLES["walls"]["tiled"]
"""Kind of room -> materials of its walls if they are not painted."""
TILED_SHARE = {"Kitchen": 0.2, "Bathroom": 0.5, "LivingRoom": 0.08, "Bedroom": 0.1}
PAINTS: list[Rgb] = [(red, green, blue) for red, green, blue in TABLES["walls"]["paints"]]
FACADES = ("WhiteGraniteClean", "RedBricks", "ConcreteBoards1", "Walldrywall4")
SKIES = ("SkyTropical", "Sky1", "Sky2", "SkyAlbany")

WARMTH = ((1.0, 0.855, 0.722), (1.0, 0.93, 0.84), (1.0, 0.96, 0.92))
"""Colours of lamps. Each house uses one of these colours for all its lamps."""
DROP_M = 0.2
"""How far (m) a light is below the ceiling."""
LAYERS = 4
"""Number of THOR's render layers that are used. The rooms get these layers in turn."""


@dataclass(frozen=True, slots=True)
class RoomFinish:
    """The materials of a room's floor and walls."""

    floor: str
    wall: str
    paint: Rgb | None
    """Tint of the walls; None if their material has its own colour."""


def finishes(kinds: dict[int, str], rng: np.random.Generator) -> dict[int, RoomFinish]:
    """Return the finish of each room, by room number. Rooms other than bathrooms mostly share one floor material."""
    common = pick(rng, FLOORS["LivingRoom"])
    found: dict[int, RoomFinish] = {}
    for number, kind in kinds.items():
        shares = kind != "Bathroom" and chance(rng, 0.4 if kind == "Kitchen" else 0.75)
        floor = common if shares else pick(rng, FLOORS[kind])
        if chance(rng, TILED_SHARE[kind]):
            found[number] = RoomFinish(floor, pick(rng, TILED_WALLS[kind]), None)
        else:
            found[number] = RoomFinish(floor, "PureWhite", pick(rng, PAINTS))
    return found


def material_reference(name: str, tint: Rgb | None = None) -> dict[str, object]:
    """Return a reference to a material, as written in the house document."""
    if tint is None:
        return {"name": name}
    return {"name": name, "color": {"r": tint[0], "g": tint[1], "b": tint[2]}}


def layer_of(room: int) -> str:
    """Return the render layer that THOR uses for a room."""
    return f"Procedural{room % LAYERS}"


def lights_of(plan: RoomLayout, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Return the lights as entries of the house document."""
    red, green, blue = pick(rng, WARMTH)
    sun_at = {"x": round(float(rng.uniform(5, 60)), 1), "y": round(float(rng.uniform(-180, 180)), 1), "z": 0}
    lights: list[dict[str, Any]] = [{**deepcopy(TABLES["lights"]["sun"]), "rotation": sun_at}]
    for room in plan.rooms:
        middle, layer = room.middle, layer_of(room.number)
        own = {
            "id": f"light_{room.number}",
            "position": {"x": round(middle.x, 4), "y": round(plan.height_m - DROP_M, 4), "z": round(middle.y, 4)},
            "rgb": {"r": red, "g": green, "b": blue},
            "layer": layer,
            "cullingMaskOff": [f"Procedural{index}" for index in range(LAYERS) if f"Procedural{index}" != layer],
        }
        lights.append({**deepcopy(TABLES["lights"]["lamp"]), **own})
    return lights
