"""Conversion of vectors and poses between this project's form and AI2-THOR's."""

from collections.abc import Mapping
from typing import Any

from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3, wrap_deg

EYE_ABOVE_BODY_M = 0.675
"""Height (m) of THOR's camera above the agent's position while the agent stands. It is 0 for a crouching agent."""
BODY_HEIGHT_M = EYE_HEIGHT_M - EYE_ABOVE_BODY_M
"""Height (m) above the floor of the position that THOR reports for the agent."""
OFF_FLOOR_M = 0.05
"""An agent counts as standing on the floor if its height differs from `BODY_HEIGHT_M` by at most this (m)."""


def to_thor(vector: Vec3) -> dict[str, float]:
    """Return a vector in THOR's form, a dict with x, y and z."""
    return {"x": float(vector.x), "y": float(vector.y), "z": float(vector.z)}


def from_thor(entry: Mapping[str, Any]) -> Vec3:
    """Return the vector that THOR gives as a dict with x, y and z."""
    return Vec3(float(entry["x"]), float(entry["y"]), float(entry["z"]))


def pose_from_thor(agent: Mapping[str, Any]) -> Pose:
    """Return the pose in the agent's metadata; a height near the floor (`OFF_FLOOR_M`) becomes 0."""
    x, y, z = from_thor(agent["position"])
    height, horizon = y - BODY_HEIGHT_M, float(agent["cameraHorizon"])
    return Pose(
        position=Vec3(x, 0.0 if abs(height) <= OFF_FLOOR_M else height, z),
        rotation=wrap_deg(float(agent["rotation"]["y"])),
        horizon=horizon - 360.0 if horizon > 180.0 else horizon,
        standing=bool(agent["isStanding"]),
    )


def teleport_arguments(pose: Pose) -> dict[str, Any]:
    """Return the arguments with which TeleportFull puts the agent at a pose."""
    x, y, z = pose.position
    return {
        "position": to_thor(Vec3(x, y + BODY_HEIGHT_M, z)),
        "rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
        "horizon": pose.horizon,
        "standing": pose.standing,
    }
