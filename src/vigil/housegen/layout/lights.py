"""Lights: a low sun outside, and one point light under each room's ceiling."""

from copy import deepcopy
from typing import Any

import numpy as np

from vigil.housegen.base.randomness import pick
from vigil.housegen.base.tables import TABLES
from vigil.housegen.layout.floorplan import RoomLayout

WARMTH = ((1.0, 0.855, 0.722), (1.0, 0.93, 0.84), (1.0, 0.96, 0.92))
"""Colours of lamps. Each house uses one of these colours for all its lamps."""
DROP_M = 0.2
"""How far (m) a light is below the ceiling."""
LAYERS = 4
"""Number of THOR's render layers that are used. The rooms get these layers in turn."""


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
