"""Points to look at on a thing's surface, how many are visible, and the pitch of the camera towards a point.

This is only geometry. Whether something hides a point is found by rays (`vigil.authoring.solving.privileged_view`).
"""

import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

import numpy as np

from vigil.assets.kernel.asset import Asset, Part
from vigil.base.geometry import Vec3
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.scene.geometry import part_motion
from vigil.scene.things import Thing

POINTS = 64


def surface_points(thing: Thing, count: int = POINTS) -> np.ndarray:
    """Return about `count` points (n, 3) on a thing's surface in its current state; the same points at each call.

    For a thing without a surface, the only point is its position.
    """
    found = [
        part_motion(thing, joint)(points)
        for joint, points in _asset_points(thing.asset, count, thing.is_toggled).items()
    ]
    return np.concatenate(found) if found else np.array(thing.position)[None]


@lru_cache(maxsize=1024)
def _asset_points(asset: Asset, count: int, is_on: bool) -> dict[str | None, np.ndarray]:
    shown = [part for part in asset.parts if part.shown != ("off" if is_on else "on") and len(part.mesh.faces)]
    areas = [_areas(part) for part in shown]
    total = sum(float(each.sum()) for each in areas)
    rng = np.random.default_rng([zlib.crc32(asset.category.encode()), count])
    points: dict[str | None, list[np.ndarray]] = {}
    for part, area in zip(shown, areas, strict=True):
        share = math.ceil(count * float(area.sum()) / max(total, 1e-12))
        if area.sum() > 0.0:
            points.setdefault(part.joint, []).append(_spread(part, area, share, rng))
    return {joint: np.concatenate(found) for joint, found in points.items()}


def _areas(part: Part) -> np.ndarray:
    a, b, c = (part.mesh.vertices[part.mesh.faces[:, i]].astype(np.float64) for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _spread(part: Part, areas: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    faces = part.mesh.faces[rng.choice(len(areas), size=count, p=areas / areas.sum())]
    weights = rng.dirichlet((1.0, 1.0, 1.0), size=count)
    return np.einsum("ni,nij->nj", weights, part.mesh.vertices[faces].astype(np.float64))


def in_frame(pixels: np.ndarray, border_px: float = 0.0) -> np.ndarray:
    """Return a mask (n,) of the pixels (n, 2 or more columns) in the frame, at least `border_px` from its border."""
    x, y = pixels[:, 0], pixels[:, 1]
    with np.errstate(invalid="ignore"):
        return (x >= border_px) & (x <= FRAME_WIDTH - border_px) & (y >= border_px) & (y <= FRAME_HEIGHT - border_px)


def pitch_to(eye: Vec3, point: np.ndarray) -> float:
    """Return the pitch (deg, positive is down) at which a camera at `eye` looks at a point (3,) in the world."""
    return math.degrees(
        math.atan2(eye.y - float(point[1]), math.hypot(float(point[0]) - eye.x, float(point[2]) - eye.z))
    )


BATCHES = 4
"""Number of batches in which points are tested. Each batch is spread over the whole thing."""
SEEN_POINTS = 6
"""A place sees enough of a thing if at least this number of the thing's points is visible from the place."""


class PointCount:
    """The number of visible points of a thing. Until all points are tested, only a range is known.

    No more points are tested than a question needs.
    """

    def __init__(self, points: np.ndarray, sees: Callable[[np.ndarray], np.ndarray]) -> None:
        """Count points (n, 3). `sees` returns which of some points are visible; it gets each point at most once."""
        self._portions = [points[first::BATCHES] for first in range(min(BATCHES, len(points)))]
        self._sees = sees
        self._left = len(points)
        self.seen = 0
        """Number of visible points among the points tested so far."""

    def is_at_least(self, least: float) -> bool:
        """Return whether at least `least` points are visible."""
        while self.seen < least <= self.seen + self._left:
            portion = self._portions.pop()
            self.seen += int(self._sees(portion).sum())
            self._left -= len(portion)
        return self.seen >= least


def places_seeing_enough(
    places: Sequence[Vec3], count_at: Callable[[Vec3], PointCount], share: float
) -> Iterator[Vec3]:
    """Yield the places from which at least `SEEN_POINTS` points are visible, and at least `share` of the number that is
    visible from the best place.
    """
    counts = [count_at(place) for place in places]
    best = 0
    for count in counts:
        while count.is_at_least(best + 1):
            best = count.seen
    enough = max(SEEN_POINTS, share * best)
    yield from (place for place, count in zip(places, counts, strict=True) if count.is_at_least(enough))
