"""The held object: it is drawn at the bottom centre of the frame, near the camera and in front of everything."""

from dataclasses import dataclass

import numpy as np

from vigil.base.geometry import Pose
from vigil.scene.things import Thing
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.model import CompiledModel

AHEAD_M = 0.5
"""The held object looks as large as at this distance (m) from the eye; an object too large for that looks smaller."""
WIDTH, HEIGHT = 0.23, 0.32
"""The held object covers at most these shares of the frame's width and height. The protocol promises at most a quarter
of the width."""
MARGIN = 0.02
NEARER = 0.24
"""The held object is drawn both nearer and smaller by this factor. It looks the same, but cannot reach into a wall."""
FINGER_M, PAD_M = 0.02, 0.035
"""Width (m) of a finger, and length (m) of the pad at the finger's tip."""
GRIP = 0.25
"""The fingers reach this far above the object's middle, as a share of half the object's height."""
TURN_DEG, TILT_DEG = 20.0, 18.0
_ASPECT = 640 / 480
_SIGNS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


@dataclass(frozen=True, slots=True, eq=False)
class InHand:
    """The pose of a held object at arm's length, in MuJoCo's frame."""

    center: np.ndarray
    matrix: np.ndarray
    smaller: float
    """Factor (at most 1) by which the object's real size is multiplied to draw it."""
    half: np.ndarray
    """Half sizes (3,) in metres of the object's box: across, up and away from the camera."""


def pose_in_hand(thing: Thing, agent: Pose) -> InHand:
    """Return the pose in which the agent holds a thing."""
    facing_the_eye = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    tilt, turn = frames.turn(np.array([1.0, 0.0, 0.0]), TILT_DEG), frames.turn(np.array([0.0, 0.0, 1.0]), TURN_DEG)
    local = tilt @ facing_the_eye @ turn
    width, height, depth = np.abs(local) @ frames.points(np.array(thing.asset.size))
    limits = [(WIDTH * 2 * _ASPECT, width), (HEIGHT * 2, height)]
    smaller = min([1.0, *(share * AHEAD_M / (length + share * depth / 2) for share, length in limits)])
    corners = (frames.points(np.array(thing.asset.size)) / 2 * _SIGNS) @ local.T * smaller
    drop = float(np.min((1.0 - 2 * MARGIN) * (AHEAD_M - corners[:, 2]) + corners[:, 1]))
    axes = frames.mujoco_camera_axes(agent)
    center = frames.points(np.array(agent.eye)) + axes @ np.array([0.0, -drop, -AHEAD_M])
    return InHand(center, axes @ local, smaller, np.abs(corners).max(axis=0))


def gripper(eye: np.ndarray, axes: np.ndarray, in_hand: InHand) -> np.ndarray:
    """Return matrices (boxes, 3, 4), one for each box of the hand, which has a finger on each side and a pad on each
    finger.

    A matrix turns a unit box into a box of the hand. The fingers reach down to the frame's lower edge, so that the
    object does not seem to lie on the ground.
    """
    across, up, _ = in_hand.half
    _, level, _ = axes.T @ (in_hand.center - eye)
    top, foot = level + GRIP * up, -1.2 * AHEAD_M
    boxes = []
    for length, end in ((top - foot, foot), (PAD_M, top - PAD_M)):
        for side in (-1.0, 1.0):
            wide = FINGER_M if length > PAD_M else FINGER_M * 1.3
            middle = np.array([side * (across + FINGER_M / 2), end + length / 2, -AHEAD_M])
            turned = axes * np.array([wide, length, 2 * wide])
            boxes.append(np.column_stack([NEARER * turned, eye + NEARER * (axes @ middle)]))
    return np.array(boxes)


def put_in_hand(model: CompiledModel, things: list[Thing], center: np.ndarray, matrix: np.ndarray) -> None:
    """Move the bodies of the first of `things` to the hand, and move the bodies of the other things along."""
    first_position, first_matrix = frames.thing_place(things[0])
    relative = matrix @ first_matrix.T
    for thing in things:
        for mocap, joint in model.things[thing.id].bodies:
            position, joint_matrix = frames.thing_place(thing, joint)
            model.data.mocap_pos[mocap] = center + relative @ (position - first_position)
            model.data.mocap_quat[mocap] = frames.quaternion(relative @ joint_matrix)
    model.update_kinematics()
