"""Turning, joints, boxes and penetration."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vigil.assets.kernel.asset import Asset, Joint, Solid
from vigil.base.geometry import Box, Vec3, rotate_floor
from vigil.scene.geometry import (
    Prism,
    axis_turn,
    body_box,
    bounding_box,
    box_distances,
    euler_angles,
    joint_motion,
    penetration,
    prisms_of,
    rotation_matrix,
)
from vigil.scene.things import Thing

SQUARE = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
ANGLES = st.floats(-180, 180)


def thing(rotation: Vec3, **changes) -> Thing:
    leaf = Joint("leaf", "hinge", Vec3(0.0, 1.0, 0.0), Vec3(-0.5, 0.0, 0.5), 90.0)
    drawer = Joint("drawer", "slide", Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0), 0.3)
    solids = (
        Solid(SQUARE, -0.25, 0.25),
        Solid(((-0.5, 0.5), (0.5, 0.5), (0.5, 0.54), (-0.5, 0.54)), -0.25, 0.25, "leaf"),
        Solid(SQUARE, 0.0, 0.1, "drawer"),
    )
    asset = Asset("Fridge", Vec3(1.0, 0.5, 1.0), (), solids, (leaf, drawer))
    return Thing("Fridge|1", "Fridge", asset, Vec3(2.0, 0.25, 3.0), rotation, **changes)


def square(x: float, size: float = 1.0, bottom: float = 0.0, top: float = 1.0) -> Prism:
    half = size / 2
    corners = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    return Prism(corners + np.array([x, 0.0]), bottom, top)


def test_yaw_turns_as_poses_do():
    for yaw in (0.0, 37.0, 90.0, 215.0):
        x, _, z = rotation_matrix(Vec3(0.0, yaw, 0.0)) @ np.array([0.3, 0.0, 0.7])
        assert (x, z) == pytest.approx(rotate_floor(0.3, 0.7, yaw))


def test_positive_pitch_looks_down_and_is_applied_before_yaw():
    ahead = rotation_matrix(Vec3(90.0, 30.0, 0.0)) @ np.array([0.0, 0.0, 1.0])
    assert ahead == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)


@given(ANGLES, ANGLES, ANGLES)
def test_euler_angles_invert_rotation_matrix(pitch: float, yaw: float, roll: float):
    turn = rotation_matrix(Vec3(pitch, yaw, roll))
    assert rotation_matrix(euler_angles(turn)) == pytest.approx(turn, abs=1e-6)


def test_a_hinge_about_the_vertical_turns_front_to_the_right():
    joint = Joint("leaf", "hinge", Vec3(0.0, 1.0, 0.0), Vec3(-0.5, 0.0, 0.0), -90.0)
    tip = joint_motion(joint, 1.0)(np.array([[0.5, 0.0, 0.0]]))[0]
    assert tip == pytest.approx([-0.5, 0.0, 1.0])
    assert joint_motion(joint, 0.5)(np.array([[-0.5, 2.0, 0.0]]))[0] == pytest.approx([-0.5, 2.0, 0.0])


def test_solids_follow_place_and_openness():
    closed = prisms_of(thing(Vec3(0.0, 90.0, 0.0)))
    assert closed[0].bounds == pytest.approx((1.5, 2.5, 2.5, 3.5))
    assert (closed[0].bottom, closed[0].top) == pytest.approx((0.0, 0.5))
    drawer = prisms_of(thing(Vec3(0.0, 90.0, 0.0), openness=1.0))[2]
    assert drawer.bounds == pytest.approx((1.8, 2.5, 2.8, 3.5))


def test_a_tilted_solid_becomes_the_prism_around_it():
    fallen = prisms_of(thing(Vec3(90.0, 0.0, 0.0)))[0]
    assert fallen.top - fallen.bottom == pytest.approx(1.0)
    left, front, right, back = fallen.bounds
    assert (right - left, back - front) == pytest.approx((1.0, 0.5))


def test_boxes_keep_out_open_leaves_and_follow_tilt():
    body = (Vec3(-0.5, -0.25, -0.5), Vec3(0.5, 0.25, 0.4))
    fridge = thing(Vec3(0.0, 180.0, 0.0), openness=1.0)
    with_body = Thing(
        "f", "Fridge", Asset("Fridge", Vec3(1, 0.5, 1), (), (), (), (), body), fridge.position, fridge.rotation
    )
    assert body_box(with_body).size == pytest.approx(Vec3(1.0, 0.5, 0.9))
    assert body_box(with_body).center == pytest.approx(Vec3(2.0, 0.25, 3.05))
    assert bounding_box(thing(Vec3(0.0, 0.0, 90.0))).size == pytest.approx(Vec3(0.5, 1.0, 1.0))


def test_penetration_is_the_least_way_out():
    assert penetration(square(0.0), square(0.9)) == pytest.approx(0.1)
    assert penetration(square(0.0), square(1.2)) == pytest.approx(-0.2)
    assert penetration(square(0.0), square(0.0, bottom=0.95, top=2.0)) == pytest.approx(0.05)
    assert penetration(square(0.0), square(0.0, bottom=1.5, top=2.0)) < 0


def test_a_thin_leaf_counts_as_deep_as_its_edge_reaches_in():
    leaf = Prism(np.array([(-2.0, -0.005), (-0.3, -0.005), (-0.3, 0.005), (-2.0, 0.005)]), 0.0, 1.0)
    assert penetration(leaf, square(0.0)) == pytest.approx(0.2)


def test_walls_without_thickness_are_penetrated():
    wall = Prism(np.array([(0.4, -3.0), (0.4, 3.0)]), 0.0, 2.0)
    assert penetration(square(0.0), wall) == pytest.approx(0.1)
    assert penetration(square(1.0), wall) < 0


@given(ANGLES, st.floats(-1, 1), st.floats(-1, 1))
def test_penetration_is_symmetric(yaw: float, x: float, z: float):
    turn = axis_turn(Vec3(0.0, 1.0, 0.0), yaw)[np.ix_([0, 2], [0, 2])]
    moved = Prism(square(0.0).polygon @ turn.T + np.array([x, z]), 0.2, 0.9)
    there, back = penetration(square(0.0), moved), penetration(moved, square(0.0))
    assert there == pytest.approx(back)
    assert there > 0 or math.hypot(x, z) > 0.9


def test_box_distances_agree_with_the_box() -> None:
    box = Box(center=Vec3(1.0, 0.5, 2.0), size=Vec3(2.0, 1.0, 0.5), yaw=33.0)
    places = np.random.default_rng(0).uniform(-3.0, 5.0, size=(50, 2))
    expected = [box.floor_distance(Vec3(float(x), 0.0, float(z))) for x, z in places]
    assert np.allclose(box_distances(box, places), expected)
