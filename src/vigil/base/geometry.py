"""Poses and boxes in AI2-THOR's frame, with the arithmetic of angles and distances.

The frame is in metres: x right, y up, z forward (left-handed). Yaw is in degrees, clockwise seen from above; at 0 the
view is along +z, at 90 along +x. Horizon is in degrees, positive when looking down.
"""

import math
from typing import Any, NamedTuple

from vigil.base.models import FrozenModel

EYE_HEIGHT_M = 1.576
"""Height (m) of the standing agent's camera above the floor."""


class Vec3(NamedTuple):
    """A point or direction (m): x right, y up, z forward."""

    x: float
    y: float
    z: float


class Pose(FrozenModel):
    """Position and viewing direction of the agent. `position` is on the floor: its y is the height of the floor."""

    position: Vec3
    rotation: float
    horizon: float = 0.0
    standing: bool = True

    @property
    def eye(self) -> Vec3:
        """Position of the agent's camera."""
        x, y, z = self.position
        return Vec3(x, y + EYE_HEIGHT_M, z)


class Box(FrozenModel):
    """An upright box: `center`, full `size` along its local axes, and rotation by `yaw` (deg) about the vertical."""

    center: Vec3
    size: Vec3
    yaw: float = 0.0

    @property
    def bottom(self) -> float:
        """Height (m) of the lowest face of the box."""
        return self.center.y - self.size.y / 2

    @property
    def top(self) -> float:
        """Height (m) of the highest face of the box."""
        return self.center.y + self.size.y / 2

    def corners(self) -> list[Vec3]:
        """Return the eight corners, the four at the bottom first."""
        half_x, half_z = self.size.x / 2, self.size.z / 2
        local = ((-half_x, -half_z), (half_x, -half_z), (half_x, half_z), (-half_x, half_z))
        turned = [rotate_floor(x, z, self.yaw) for x, z in local]
        return [Vec3(self.center.x + x, y, self.center.z + z) for y in (self.bottom, self.top) for x, z in turned]

    def floor_distance(self, point: Vec3) -> float:
        """Return the floor-plane distance (m) from `point` to the nearest point of the box; 0 if it is inside."""
        dx, dz = point.x - self.center.x, point.z - self.center.z
        local_x, local_z = rotate_floor(dx, dz, -self.yaw)
        return math.hypot(max(abs(local_x) - self.size.x / 2, 0.0), max(abs(local_z) - self.size.z / 2, 0.0))


def rotate_floor(x: Any, z: Any, yaw: float) -> tuple[Any, Any]:
    """Return the floor vector (x, z), turned by `yaw` degrees clockwise seen from above (numbers or arrays)."""
    sin, cos = math.sin(math.radians(yaw)), math.cos(math.radians(yaw))
    return x * cos + z * sin, z * cos - x * sin


def heading(yaw: float) -> tuple[float, float]:
    """Return the unit floor vector (x, z) of the viewing direction at `yaw` (deg)."""
    return rotate_floor(0.0, 1.0, yaw)


def yaw_towards(origin: Vec3, target: Vec3) -> float:
    """Return the yaw (deg) in [0, 360) at which `target` is straight ahead of `origin`, in the floor plane."""
    return math.degrees(math.atan2(target.x - origin.x, target.z - origin.z)) % 360.0


def wrap_deg(angle: float) -> float:
    """Return the angle in [0, 360) degrees that is equal to `angle` up to full turns."""
    wrapped = angle % 360.0
    return 0.0 if wrapped == 360.0 else wrapped


def turn_between(from_yaw: float, to_yaw: float) -> float:
    """Return the turn (deg) in (-180, 180] from one yaw to the other, positive to the right."""
    turn = (to_yaw - from_yaw) % 360.0
    return turn - 360.0 if turn > 180.0 else turn


def floor_distance(a: Vec3, b: Vec3) -> float:
    """Return the floor-plane distance (m) between two points."""
    return math.hypot(a.x - b.x, a.z - b.z)


def distance(a: Vec3, b: Vec3) -> float:
    """Return the Euclidean distance (m) between two points."""
    return math.dist(a, b)
