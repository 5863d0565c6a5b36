"""Conversions between THOR's frame and MuJoCo's frame.

THOR: x right, y up, z forward, left-handed. MuJoCo: x right, y forward, z up, right-handed. The conversion swaps y and
z, so it is a reflection: it also swaps two corners of each triangle, and changes the sign of angles.
"""

import math

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.scene.things import Thing

_SWAP = [0, 2, 1]


def points(thor: np.ndarray) -> np.ndarray:
    """Return points or directions (..., 3) of THOR's frame in MuJoCo's frame, or the reverse: swap y and z."""
    return np.asarray(thor)[..., _SWAP]


def faces(triangles: np.ndarray) -> np.ndarray:
    """Return triangles (m, 3) with reversed winding, so that they still face outward after the conversion of points."""
    return np.asarray(triangles)[:, _SWAP]


def rotation(thor: np.ndarray) -> np.ndarray:
    """Return a rotation matrix (3, 3) of THOR's frame in MuJoCo's frame; the function is its own inverse."""
    return np.asarray(thor)[_SWAP][:, _SWAP]


def thor_rotation(euler_deg: Vec3) -> np.ndarray:
    """Return the rotation matrix of Euler angles (degrees) in THOR's frame, applied z, then x, then y."""
    about_x, about_y, about_z = (turn(axis, angle) for axis, angle in zip(np.eye(3), euler_deg, strict=True))
    return about_y @ about_x @ about_z


def turn(axis: np.ndarray, angle_deg: float) -> np.ndarray:
    """Return the matrix of a rotation about a unit axis (Rodrigues' formula)."""
    x, y, z = (float(number) for number in axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = math.radians(angle_deg)
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


def joint_transform(thing: Thing, joint_name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return (rotation, shift) of the parts on a joint, in the asset's frame, at the thing's openness."""
    joint = next(joint for joint in thing.asset.joints if joint.name == joint_name)
    axis, origin = np.array(joint.axis, dtype=float), np.array(joint.origin, dtype=float)
    if joint.kind == "slide":
        return np.eye(3), axis * (joint.travel * thing.openness)
    matrix = turn(axis, joint.travel * thing.openness)
    return matrix, origin - matrix @ origin


def thing_place(thing: Thing, joint_name: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return (position, rotation matrix) of a thing's body or of one of its joints, in MuJoCo's frame."""
    matrix, position = thor_rotation(thing.rotation), np.array(thing.position, dtype=float)
    if joint_name is not None:
        inner, shift = joint_transform(thing, joint_name)
        position, matrix = position + matrix @ shift, matrix @ inner
    return points(position), rotation(matrix)


def mujoco_camera_axes(agent: Pose) -> np.ndarray:
    """Return a matrix (3, 3) whose columns are the camera's axes right, up and backward in MuJoCo's frame."""
    matrix = turn(np.array([0.0, 1.0, 0.0]), agent.rotation) @ turn(np.array([1.0, 0.0, 0.0]), agent.horizon)
    right, up, forward = points(matrix.T)
    return np.stack([right, up, -forward], axis=1)


def quaternion(matrix: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix."""
    m = matrix
    candidates = np.array(
        [
            [1 + m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 - m[0, 0] - m[1, 1] + m[2, 2]],
        ]
    )
    best = candidates[int(np.argmax(np.diagonal(candidates)))]
    return best / np.linalg.norm(best)
