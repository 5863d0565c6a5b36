"""Rays and projection for a camera at any place, with any field of view and image size (`CameraView`)."""

import math

import numpy as np

from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.sim.core.sight import Lens, camera_axes
from vigil.sim.scene_editor import CameraView


def pose_of(view: CameraView) -> Pose:
    """Return the pose of an agent whose eye is where the camera is; the agent's feet need not be on a floor."""
    x, y, z = view.eye
    return Pose(position=Vec3(x, y - EYE_HEIGHT_M, z), rotation=view.yaw, horizon=view.pitch)


def rolled(axes: np.ndarray, roll: float) -> np.ndarray:
    """Return a camera's axes right, up and forward, as rows (3, 3), after a roll (deg)."""
    if roll == 0.0:
        return axes
    cos, sin = math.cos(math.radians(roll)), math.sin(math.radians(roll))
    return np.stack([cos * axes[0] + sin * axes[1], cos * axes[1] - sin * axes[0], axes[2]])


def _axes_of(view: CameraView) -> np.ndarray:
    return rolled(camera_axes(pose_of(view)), view.roll)


def lens_of(view: CameraView) -> Lens:
    """Return the size and the focal length (pixels) of a camera's image."""
    return Lens(view.width, view.height, view.height / 2 / math.tan(math.radians(view.fovy_deg) / 2))


def directions_at(view: CameraView, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit directions (n, 3) through places (n, 2) of the image.

    Also return the cosines (n,) of their angles to the camera's axis. A place is x, y in pixels from the top left
    corner; a pixel's middle is its number plus 0.5.
    """
    focal = lens_of(view).focal_px
    right, up = (pixels[:, 0] - view.width / 2) / focal, (view.height / 2 - pixels[:, 1]) / focal
    rays = np.column_stack([right, up, np.ones(len(pixels))])
    lengths = np.linalg.norm(rays, axis=1)
    return (rays / lengths[:, None]) @ _axes_of(view), 1.0 / lengths


def rays_of(view: CameraView) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit directions (n, 3) through all pixels, row by row, and the cosines (n,) of their angles to the
    camera's axis."""
    middles = np.stack(np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5), axis=-1).reshape(-1, 2)
    return directions_at(view, middles)


def project_to_view(view: CameraView, points: np.ndarray) -> np.ndarray:
    """Return the projections (n, 3) of points: x and y from the top left (0 to 1 in the image), and the depth in metres
    along the view direction."""
    local = (points - np.array(view.eye)) @ _axes_of(view).T
    half = math.tan(math.radians(view.fovy_deg) / 2)
    depth = np.where(np.abs(local[:, 2]) < 1e-9, 1e-9, local[:, 2])
    x = 0.5 + local[:, 0] / depth / (2 * half * view.width / view.height)
    y = 0.5 - local[:, 1] / depth / (2 * half)
    return np.column_stack([x, y, local[:, 2]])
