"""Other starts near the original, and other light in the same house."""

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3, wrap_deg
from vigil.protocol.house import House
from vigil.scene.floor import has_room_to_move

NEAR_M = (0.25, 1.0)
"""Minimum and maximum walk (m) from the original start to a near one."""
TURN_DEG = 30.0
"""Maximum difference (deg) between the headings of the two starts."""
WARM, COOL = np.array([1.0, 0.62, 0.36]), np.array([0.62, 0.80, 1.0])
"""Colours of the warmest and the coolest light."""
DIMMEST = 0.45
"""Strength of the dimmest light, as a share of full light."""
LEAST_CHANGE = 0.25
"""A lamp's red, green or blue (0..1) must change by at least this."""


def near_starts(view: PrivilegedView, start: Pose, rng: np.random.Generator) -> Iterator[Pose]:
    """Yield starts near `start`, where the agent is now, in random order.

    Each can be reached from `start` by a short walk, so there is no wall between them.
    """
    walks = view.walks()
    cells = walks.plan.cells
    near = cells[(walks.lengths >= NEAR_M[0]) & (walks.lengths <= NEAR_M[1])] if len(cells) else cells
    for index in rng.permutation(len(near)):
        x, z = (round(float(value), 3) for value in near[index])
        turn = float(round(wrap_deg(start.rotation + rng.uniform(-TURN_DEG, TURN_DEG))) % 360)
        pose = start.model_copy(update={"position": Vec3(x, 0.0, z), "rotation": turn})
        if has_room_to_move(view.plan().tight, pose):
            yield pose


def relit(house: House, rng: np.random.Generator) -> House | None:
    """Return a house whose lamps all have another colour and strength; None if no room has a lamp."""
    data: dict[str, Any] = copy.deepcopy(house.data)
    lamps = [each for each in data.get("proceduralParameters", {}).get("lights", ()) if each.get("type") == "point"]
    if not lamps:
        return None
    before = np.array([lamps[0].get("rgb", {}).get(name, 1.0) for name in "rgb"])
    colour = before
    while np.abs(colour - before).max() < LEAST_CHANGE:
        strength = rng.uniform(DIMMEST, 1.0)
        colour = strength * (WARM + rng.uniform() * (COOL - WARM))
    for lamp in lamps:
        lamp["rgb"] = {name: round(float(value), 4) for name, value in zip("rgb", colour, strict=True)}
    return House(house.name, data)
