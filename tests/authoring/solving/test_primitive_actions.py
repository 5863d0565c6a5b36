"""Exact turns and walks in few actions."""

import math

import pytest

from vigil.authoring.solving import primitive_actions
from vigil.base.geometry import Pose, Vec3, heading
from vigil.protocol.actions import MAX_STEPS_PER_ACTION, STEP_M


def test_turn_takes_the_shorter_way() -> None:
    assert [(m.mode, m.magnitude) for m in primitive_actions.turn_by_steps(350.0, 20.0)] == [("turn_right", 30.0)]
    assert [(m.mode, m.magnitude) for m in primitive_actions.turn_by_steps(20.0, 350.0)] == [("turn_left", 30.0)]
    assert list(primitive_actions.turn_by_steps(20.0, 380.0)) == []


def test_advance_splits_at_the_cap() -> None:
    walks = list(primitive_actions.advance(12.0))
    assert [walk.magnitude for walk in walks] == [MAX_STEPS_PER_ACTION, 8.0]
    assert [(w.mode, w.magnitude) for w in primitive_actions.advance(-0.5)] == [("backward", 2.0)]
    assert list(primitive_actions.advance(0.0)) == []


@pytest.mark.parametrize("corner", [(3.0, 4.0), (-1.0, 0.3), (1.0, -2.0)])
def test_towards_arrives(corner: tuple[float, float]) -> None:
    pose = Pose(position=Vec3(1.0, 0.0, 1.0), rotation=77.0, horizon=30.0)
    x, z, yaw = 1.0, 1.0, 77.0
    for move in primitive_actions.towards(pose, corner):
        if move.mode == "forward":
            x += heading(yaw)[0] * move.magnitude * STEP_M
            z += heading(yaw)[1] * move.magnitude * STEP_M
        else:
            yaw += move.magnitude if move.mode == "turn_right" else -move.magnitude
    assert math.dist((x, z), corner) < 2e-3


def test_tilt_stays_within_the_limits() -> None:
    assert [(t.direction, t.magnitude) for t in primitive_actions.tilt(0.0, 80.0)] == [("down", 60.0)]
    assert [(t.direction, t.magnitude) for t in primitive_actions.tilt(0.0, -80.0)] == [("up", 30.0)]
    assert list(primitive_actions.tilt(30.0, 30.0)) == []
