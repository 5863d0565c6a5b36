"""The thing in the hand: drawn at the bottom centre of the frame, near the camera, in front of everything."""

import numpy as np

from vigil.pose import Pose
from vigil.scene.things import Thing
from vigil.sim.engines.mujoco import frames
from vigil.sim.engines.mujoco.model import CompiledModel

AHEAD_M = 0.5
"""Where its size is taken from: as large as it looks at arm's length, unless that is too large."""
WIDTH = 0.23
"""Share of the frame's width that it takes at most; a quarter is promised."""
HEIGHT = 0.32
MARGIN = 0.02
NEARER = 0.24
"""It is then drawn this much nearer and smaller, which looks the same and never touches a wall."""
TURN_DEG, TILT_DEG = 20.0, 18.0
_ASPECT = 640 / 480
_SIGNS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def pose_in_hand(thing: Thing, agent: Pose) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns (centre, rotation matrix) in MuJoCo's frame at arm's length, and the factor to draw it smaller by."""
    right, up, back = frames.camera_axes(agent).T
    facing_the_eye = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    tilt, turn = frames.turn(np.array([1.0, 0.0, 0.0]), TILT_DEG), frames.turn(np.array([0.0, 0.0, 1.0]), TURN_DEG)
    local = tilt @ facing_the_eye @ turn
    width, height, depth = np.abs(local) @ frames.points(np.array(thing.asset.size))
    limits = [(WIDTH * 2 * _ASPECT, width), (HEIGHT * 2, height)]
    smaller = min([1.0, *(share * AHEAD_M / (length + share * depth / 2) for share, length in limits)])
    corners = (frames.points(np.array(thing.asset.size)) / 2 * _SIGNS) @ local.T * smaller
    drop = float(np.min((1.0 - 2 * MARGIN) * (AHEAD_M - corners[:, 2]) + corners[:, 1]))
    eye = frames.points(np.array(agent.eye))
    axes = np.stack([right, up, back], axis=1)
    return eye + axes @ np.array([0.0, -drop, -AHEAD_M]), axes @ local, smaller


def bring_near(geoms: list, eye: np.ndarray, center: np.ndarray, smaller: float) -> None:
    """Scales drawn geoms about the thing's centre, then about the eye."""
    for geom in geoms:
        place = center + smaller * (geom.pos - center)
        geom.pos[:] = eye + NEARER * (place - eye)
        geom.mat[:] *= NEARER * smaller


def put_in_hand(model: CompiledModel, things: list[Thing], center: np.ndarray, matrix: np.ndarray) -> None:
    """Moves the bodies of the first thing to the hand, and those of what it carries along with it."""
    first_position, first_matrix = frames.thing_place(things[0])
    relative = matrix @ first_matrix.T
    for thing in things:
        for mocap, joint in model.things[thing.id].bodies:
            position, joint_matrix = frames.thing_place(thing, joint)
            model.data.mocap_pos[mocap] = center + relative @ (position - first_position)
            model.data.mocap_quat[mocap] = frames.quaternion(relative @ joint_matrix)
    model.settle()
