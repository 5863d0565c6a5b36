"""From where a picture is taken, and what is held in front of it."""

from dataclasses import dataclass, replace

import numpy as np

NEAR_M, FAR_M = 0.03, 90.0


@dataclass(frozen=True, slots=True, eq=False)
class Viewer:
    """A camera, in MuJoCo's frame."""

    eye: np.ndarray
    """(3,) metres."""
    axes: np.ndarray
    """(3, 3), columns right, up and backward."""
    fovy_deg: float
    width: int
    height: int
    clip: np.ndarray | None = None
    """(4,): only points with clip · (x, y, z, 1) > 0 are drawn, by a camera behind a mirror."""

    @property
    def slopes(self) -> tuple[float, float]:
        """Half of what is seen across and up, at one metre."""
        up = float(np.tan(np.radians(self.fovy_deg) / 2))
        return up * self.width / self.height, up

    def matrix(self) -> np.ndarray:
        """Returns the matrix (4, 4) from the world to the clip space of OpenGL."""
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

    def behind(self, point: np.ndarray, normal: np.ndarray) -> "Viewer":
        """Returns the camera as a mirror through a point shows it; what it sees is turned left to right."""
        turned = np.eye(3) - 2.0 * np.outer(normal, normal)
        eye = self.eye - 2.0 * float((self.eye - point) @ normal) * normal
        return replace(self, eye=eye, axes=turned @ self.axes, clip=np.array([*normal, -float(normal @ point)]))


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """What is in the hand: geoms, each point of which is drawn at `scale` times its place plus `shift`."""

    geoms: np.ndarray
    scale: float
    shift: np.ndarray
    gripper: np.ndarray
    """(boxes, 3, 4): where the boxes of the hand are, from their own places to the world's."""
