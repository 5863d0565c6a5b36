"""Primitive actions: exact turns, straight walks and camera tilts, in as few actions as possible.

One `navigate` action walks at most MAX_STEPS_PER_ACTION steps, or turns by any angle.
"""

import json
import math
from collections.abc import Iterator

from vigil.base.geometry import Pose, Vec3, turn_between, yaw_towards
from vigil.protocol.actions import (
    HORIZON_DOWN_DEG,
    HORIZON_UP_DEG,
    MAX_STEPS_PER_ACTION,
    STEP_M,
    Action,
    Intent,
    InteractPixel,
    Look,
    Navigate,
    Reply,
)

TURN_DECIMALS = 2
STEP_DECIMALS = 3
MIN_TURN_DEG = 0.05
MIN_WALK_M = 0.005


def turn_by_steps(from_yaw: float, to_yaw: float) -> Iterator[Navigate]:
    """Yield the shorter turn from one heading (deg) to another; nothing if they are equal."""
    angle = round(turn_between(from_yaw, to_yaw), TURN_DECIMALS)
    if abs(angle) >= MIN_TURN_DEG:
        yield Navigate(mode="turn_right" if angle > 0 else "turn_left", magnitude=abs(angle))


def advance(distance_m: float) -> Iterator[Navigate]:
    """Yield the walk of `distance_m` straight ahead (backward if negative); nothing if it is too short."""
    mode = "forward" if distance_m > 0 else "backward"
    steps = abs(distance_m) / STEP_M
    while steps > MAX_STEPS_PER_ACTION:
        yield Navigate(mode=mode, magnitude=float(MAX_STEPS_PER_ACTION))
        steps -= MAX_STEPS_PER_ACTION
    if steps * STEP_M >= MIN_WALK_M:
        yield Navigate(mode=mode, magnitude=round(steps, STEP_DECIMALS))


def towards(pose: Pose, corner: tuple[float, float]) -> Iterator[Navigate]:
    """Yield the turn and the walk from `pose` straight to a corner (x, z; m)."""
    target = Vec3(corner[0], pose.position.y, corner[1])
    yaw = yaw_towards(pose.position, target)
    yield from turn_by_steps(pose.rotation, yaw)
    yield from advance(math.dist((pose.position.x, pose.position.z), corner))


def tilt(from_horizon: float, to_horizon: float) -> Iterator[Look]:
    """Yield the camera tilt from one pitch (deg) to another, within the limits; nothing if they are equal."""
    wanted = min(max(to_horizon, HORIZON_UP_DEG), HORIZON_DOWN_DEG)
    angle = round(wanted - from_horizon, TURN_DECIMALS)
    if abs(angle) >= MIN_TURN_DEG:
        yield Look(direction="down" if angle > 0 else "up", magnitude=abs(angle))


def click(intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
    """Return the interaction `intent` with what is at a pixel (x, y)."""
    return InteractPixel(intent=intent, x=pixel[0], y=pixel[1])


def reply_of(action: Action) -> Reply:
    """Return the reply with an action, as an agent would write it, in pixel coordinates."""
    arguments = action.model_dump(exclude={"skill_name", "raw_status"}, exclude_none=True)
    return Reply(text=json.dumps({"skill_name": action.skill_name, "arguments": arguments}))
