"""A model of motor noise: turns, walks and clicks that are slightly wrong."""

import math
from collections.abc import Iterator

import numpy as np

from vigil.authoring.solving import primitive_actions
from vigil.base.geometry import turn_between
from vigil.protocol.actions import MAX_STEPS_PER_ACTION, STEP_M, Intent, InteractPixel, Navigate
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH

TURN_ERROR_DEG = 5.0
CLICK_ERROR_PX = 6.0
DISTANCE_ERROR = 0.15


class MotorNoise:
    """Makes actions (turns in whole degrees, walks in whole steps) with random errors, uniform up to a bound."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def turn(self, from_yaw: float, to_yaw: float) -> Iterator[Navigate]:
        """Yield a turn to a heading with an error of at most `TURN_ERROR_DEG`; nothing if it rounds to 0 degrees."""
        angle = round(turn_between(from_yaw, to_yaw) + self._rng.uniform(-TURN_ERROR_DEG, TURN_ERROR_DEG))
        yield from primitive_actions.turn(0.0, float(angle))

    def walk(self, distance_m: float) -> Navigate:
        """Return a walk of about `distance_m`, with an error, in whole steps (at least one)."""
        steps = max(1, round(self.perceived_distance(distance_m) / STEP_M))
        return Navigate(mode="forward", magnitude=float(min(steps, MAX_STEPS_PER_ACTION)))

    def perceived_distance(self, distance_m: float) -> float:
        """Return a distance (m), changed by a relative error of at most `DISTANCE_ERROR`."""
        return distance_m * (1.0 + self._rng.uniform(-DISTANCE_ERROR, DISTANCE_ERROR))

    def click(self, intent: Intent, pixel: tuple[int, int]) -> InteractPixel:
        """Return a click at most `CLICK_ERROR_PX` away from a pixel, but within the frame."""
        away, direction = self._rng.uniform(0.0, CLICK_ERROR_PX), self._rng.uniform(0.0, 2 * math.pi)
        x, y = pixel[0] + away * math.cos(direction), pixel[1] + away * math.sin(direction)
        inside = min(max(round(x), 0), FRAME_WIDTH - 1), min(max(round(y), 0), FRAME_HEIGHT - 1)
        return primitive_actions.click(intent, inside)
