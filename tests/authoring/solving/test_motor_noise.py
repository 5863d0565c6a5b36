"""Errors of the body stay within their bounds, and reach them."""

import math

import numpy as np
import pytest

from vigil.authoring.solving.noisy_actions import CLICK_ERROR_PX, DISTANCE_ERROR, TURN_ERROR_DEG, MotorNoise
from vigil.base.geometry import turn_between
from vigil.protocol.actions import STEP_M, InteractPixel

DRAWS = 400


@pytest.fixture
def body() -> MotorNoise:
    return MotorNoise(np.random.default_rng(0))


def test_turns_are_whole_degrees_off_by_at_most_five(body: MotorNoise) -> None:
    ends = []
    for _ in range(DRAWS):
        (turn,) = body.turn(350.0, 50.0)
        assert turn.mode == "turn_right"
        assert turn.magnitude == int(turn.magnitude)
        ends.append(turn_between(50.0, 350.0 + turn.magnitude))
    assert max(map(abs, ends)) <= TURN_ERROR_DEG + 0.5
    assert min(ends) < -TURN_ERROR_DEG / 2 < TURN_ERROR_DEG / 2 < max(ends)


def test_walks_are_whole_steps_over_misjudged_distances(body: MotorNoise) -> None:
    steps = {body.walk(2.5).magnitude for _ in range(DRAWS)}
    assert steps == {9.0, 10.0, 11.0}
    assert max(steps) * STEP_M <= 2.5 * (1 + DISTANCE_ERROR)
    assert body.walk(0.05).magnitude == 1.0
    assert body.walk(100.0).magnitude == 40.0


def test_clicks_are_off_by_at_most_six_pixels_and_in_the_frame(body: MotorNoise) -> None:
    clicks = [body.click("pick", (300, 200)) for _ in range(DRAWS)]
    away = [math.dist((300, 200), (click.x or 0, click.y or 0)) for click in clicks]
    assert CLICK_ERROR_PX - 1 < max(away) <= CLICK_ERROR_PX + 1
    assert min(away) <= 1
    for _ in range(DRAWS):
        corner = body.click("ground", (0, 479))
        assert InteractPixel.model_validate(corner.model_dump()) == corner
        assert (corner.x or 0) >= 0
        assert (corner.y or 0) <= 479


def test_the_same_seed_errs_the_same() -> None:
    first, second = (MotorNoise(np.random.default_rng(7)) for _ in range(2))
    assert [first.perceived_distance(1.0) for _ in range(5)] == [second.perceived_distance(1.0) for _ in range(5)]
