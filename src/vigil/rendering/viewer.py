"""The camera of a picture, and the geoms in the hand. Coordinates are those of `vigil.rendering.scene`."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

NEAR_M, FAR_M = 0.03, 90.0


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """A flat surface that mirrors."""

    geom: int
    point: np.ndarray
    """A point (3,) of the mirror's plane."""
    normal: np.ndarray
    """Unit normal (3,) of the plane."""
    box: tuple[int, int, int, int]
    """Left, lower edge, width and height (pixels) of the part of the frame that contains the mirror."""
    points: np.ndarray
    """Vertices (n, 3); the mirror is inside their convex hull."""

    @property
    def face(self) -> np.ndarray:
        """The vertices (n, 3), projected onto the mirror's plane."""
        return self.points - self._heights() * self.normal

    @property
    def reach(self) -> np.ndarray:
        """The vertices and their mirror images (2n, 3). Every line of sight in the mirror passes through their hull."""
        return np.concatenate([self.points, self.points - 2.0 * self._heights() * self.normal])

    def _heights(self) -> np.ndarray:
        """Return how far (n, 1; metres) each vertex is in front of the plane."""
        return ((self.points - self.point) @ self.normal)[:, None]


@dataclass(frozen=True, eq=False)
class Viewer:
    """The camera of a picture: position, axes, field of view and size."""

    eye: np.ndarray
    """Position (3,) of the camera in metres."""
    axes: np.ndarray
    """Matrix (3, 3) with the camera's axes right, up and backward as columns."""
    fovy_deg: float
    width: int
    height: int
    mirror: Mirror | None = None
    """Mirror behind which the camera is; only things in front of the mirror are drawn. None for a usual camera."""

    @property
    def slopes(self) -> tuple[float, float]:
        """Half the width and half the height (m) of the view at a distance of one metre."""
        up = float(np.tan(np.radians(self.fovy_deg) / 2))
        return up * self.width / self.height, up

    @cached_property
    def matrix(self) -> np.ndarray:
        """Matrix (4, 4) that maps the world to OpenGL's clip space."""
        across, up = self.slopes
        depth = FAR_M - NEAR_M
        lens = np.array(
            [
                [1.0 / across, 0.0, 0.0, 0.0],
                [0.0, 1.0 / up, 0.0, 0.0],
                [0.0, 0.0, -(FAR_M + NEAR_M) / depth, -2.0 * FAR_M * NEAR_M / depth],
                [0.0, 0.0, -1.0, 0.0],
            ]
        )
        place = np.eye(4)
        place[:3, :3], place[:3, 3] = self.axes.T, -self.axes.T @ self.eye
        return lens @ place

    @property
    def clip(self) -> np.ndarray | None:
        """Plane (4,) of the mirror: only points with clip · (x, y, z, 1) > 0 are drawn. None without a mirror."""
        if self.mirror is None:
            return None
        return np.array([*self.mirror.normal, -float(self.mirror.normal @ self.mirror.point)])

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Part of the picture that is used: left, lower edge, width and height (pixels)."""
        return (0, 0, self.width, self.height) if self.mirror is None else self.mirror.box

    def sides(self) -> np.ndarray:
        """Return the planes (n, 4) around the view; side · (x, y, z, 1) is a point's distance (m), positive inside."""
        right, up, backward = self.axes.T
        size, box = np.array([self.width, self.height]), np.array(self.box)
        low, high = ((2.0 * at / size - 1.0) * self.slopes for at in (box[:2], box[:2] + box[2:]))
        inward = np.array(
            [
                -backward,
                right + low[0] * backward,
                -right - high[0] * backward,
                up + low[1] * backward,
                -up - high[1] * backward,
            ]
        )
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        planes = np.column_stack([inward, -inward @ self.eye])
        return planes if self.clip is None else np.vstack([planes, self.clip])

    def behind(self, mirror: Mirror) -> "Viewer":
        """Return the camera mirrored to the other side of a mirror; its picture is flipped left to right."""
        turned = np.eye(3) - 2.0 * np.outer(mirror.normal, mirror.normal)
        eye = self.eye - 2.0 * float((self.eye - mirror.point) @ mirror.normal) * mirror.normal
        return replace(self, eye=eye, axes=turned @ self.axes, mirror=mirror)


@dataclass(frozen=True, slots=True, eq=False)
class HeldGeoms:
    """The geoms in the hand. Each of their points is drawn at `scale` times the point's position plus `shift`."""

    geoms: np.ndarray
    scale: float
    shift: np.ndarray
    gripper: np.ndarray
    """Matrices (boxes, 3, 4) from the frame of each box of the hand to the world."""
