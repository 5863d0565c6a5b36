import numpy as np
import pytest

from vigil.assets.kernel.asset import Asset, Joint
from vigil.base.geometry import Pose, Vec3, heading
from vigil.scene.things import Thing
from vigil.sim.engines.mujoco.compiled import frames

UPRIGHT = Vec3(0.0, 0.0, 0.0)


def a_thing(joint: Joint, openness: float, rotation: Vec3 = UPRIGHT) -> Thing:
    asset = Asset("Box", Vec3(1.0, 1.0, 1.0), (), (), (joint,))
    return Thing("it", "Box", asset, Vec3(1.0, 2.0, 3.0), rotation, openness=openness)


def from_matrix(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_points_there_and_back() -> None:
    points = np.random.default_rng(1).normal(size=(5, 3))
    assert np.array_equal(frames.points(frames.points(points)), points)
    assert frames.points(np.array([1.0, 2.0, 3.0])).tolist() == [1.0, 3.0, 2.0]


def test_faces_keep_facing_outward() -> None:
    corners = np.random.default_rng(2).normal(size=(3, 3))
    outward = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    moved, order = frames.points(corners), frames.faces(np.array([[0, 1, 2]]))[0]
    a, b, c = moved[order]
    assert np.allclose(np.cross(b - a, c - a), frames.points(outward))


@pytest.mark.parametrize("euler", [(0.0, 90.0, 0.0), (20.0, 130.0, -40.0), (0.0, 180.0, 0.0), (180.0, 0.0, 0.0)])
def test_rotation_and_quaternion_say_the_same(euler: tuple[float, float, float]) -> None:
    matrix = frames.thor_rotation(Vec3(*euler))
    ours = frames.rotation(matrix)
    point = np.array([0.3, -0.7, 1.1])
    assert np.allclose(ours @ frames.points(point), frames.points(matrix @ point))
    assert np.isclose(np.linalg.det(ours), 1.0)
    assert np.allclose(from_matrix(frames.quaternion(ours)), ours)


def test_yaw_turns_the_front_clockwise_from_above() -> None:
    front = frames.thor_rotation(Vec3(0.0, 90.0, 0.0)) @ np.array([0.0, 0.0, 1.0])
    assert np.allclose(front, [1.0, 0.0, 0.0])


def test_euler_angles_apply_z_then_x_then_y() -> None:
    turned = frames.thor_rotation(Vec3(90.0, 90.0, 90.0)) @ np.array([1.0, 0.0, 0.0])
    # About z, +x goes to +y; about x, +y goes to +z; about y, +z goes to +x.
    assert np.allclose(turned, [1.0, 0.0, 0.0])


def test_hinge_carries_the_front_to_the_right() -> None:
    hinge = Joint("leaf", "hinge", Vec3(0.0, 1.0, 0.0), Vec3(0.5, 0.0, 0.0), 90.0)
    matrix, shift = frames.joint_transform(a_thing(hinge, 1.0), "leaf")
    assert np.allclose(matrix @ np.array([0.5, 0.0, 1.0]) + shift, [1.5, 0.0, 0.0])
    assert np.allclose(matrix @ np.array([0.5, 0.7, 0.0]) + shift, [0.5, 0.7, 0.0])


def test_slide_moves_in_proportion_along_the_turned_axis() -> None:
    slide = Joint("drawer", "slide", Vec3(0.0, 0.0, 1.0), Vec3(0.0, 0.0, 0.0), 0.4)
    position, _ = frames.thing_place(a_thing(slide, 0.5, Vec3(0.0, 90.0, 0.0)), "drawer")
    assert np.allclose(frames.points(position), [1.2, 2.0, 3.0])


@pytest.mark.parametrize("yaw", [0.0, 37.0, 90.0, 222.0])
def test_camera_looks_where_the_agent_heads(yaw: float) -> None:
    pose = Pose(position=Vec3(0.0, 0.0, 0.0), rotation=yaw, horizon=30.0)
    right, up, back = frames.mujoco_camera_axes(pose).T
    x, z = heading(yaw)
    level = np.cos(np.radians(30.0))
    assert np.allclose(frames.points(-back), [x * level, -0.5, z * level])
    assert np.allclose(np.cross(right, up), back)
    assert up[2] > 0
    assert np.allclose(frames.points(right), [z, 0.0, -x])
