"""The trial house with its kitchen cut in two, but for a gap between a bed and a desk."""

import copy
from typing import Any

from vigil.base.geometry import Pose, Vec3
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectInState
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.sim.conformance.reference_house import reference_house

LAMP = "FloorLamp|1"
BED_M, DESK_M, DRESSER_M = 2.0162, 1.3444, 1.0009
"""Lengths."""


def house_with_gap(gap_m: float) -> House:
    """Return the house, in which the only way from the west of the bed to the lamp is the gap."""
    data = copy.deepcopy(reference_house().data)
    bed_end = BED_M
    desk_end = bed_end + gap_m + DESK_M
    _move(data, LAMP, (5.6, 0.6), 0.0)
    _move(data, "Bed|1", (4.0, bed_end - BED_M / 2), 180.0)
    _move(data, "Desk|1", (4.3, desk_end - DESK_M / 2), 270.0)
    _move(data, "Dresser|1", (4.15, desk_end + DRESSER_M / 2), 270.0)
    return House("pocket", data)


def to_the_lamp(like: Episode, house: House) -> Episode:
    """Return the episode in which the lamp must be turned on from the other side of the gap."""
    ref = like.house.model_copy(update={"name": house.name, "sha256": house.sha256})
    start = Pose(position=Vec3(2.9, 0.0, 2.9), rotation=90.0, horizon=30.0)
    goal = ObjectInState(object_id=LAMP, state="is_toggled")
    setup = Setup(objects={LAMP: ObjectSetup(is_toggled=False)})
    facts = {"house": ref, "start": start, "goal": goal, "setup": setup, "bindings": {"target": LAMP}}
    return like.model_copy(update=facts)


def _move(data: dict[str, Any], object_id: str, place: tuple[float, float], yaw: float) -> None:
    """Moves an object without what lies on it, which stays behind nowhere: it is left out."""
    node = next(node for node in data["objects"] if node["id"] == object_id)
    node["children"] = []
    node["position"] = {**node["position"], "x": place[0], "z": place[1]}
    node["rotation"] = {"x": 0, "y": yaw, "z": 0}
