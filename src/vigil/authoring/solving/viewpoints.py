"""Views: from which places one could see or click a thing, nearest walk first.

A first estimate by a few dozen rays per place; the caller makes sure of the one that it takes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from vigil.authoring.solving.aim import in_frame, pitch_to
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.solving.paths import Point2, ShortestPaths
from vigil.base.geometry import Pose, Vec3, turn_between, yaw_towards
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG
from vigil.sim.core.sight import project

BORDER_PX = 12.0
THIN_M = 0.15
MOST_PLACES = 400

Places = Callable[[np.ndarray], np.ndarray]
"""Which of (n, 2) places x, z are acceptable, and how much each is disliked (m); inf for never."""


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """A pose to go to, with what can be seen of the thing from there."""

    pose: Pose
    corners: tuple[Point2, ...]
    pixels: np.ndarray
    """(n, 2) estimated pixels of seen points, those nearest to their middle first."""
    seen: int
    """How many of the sampled points are seen in the frame."""


@dataclass(frozen=True, slots=True, eq=False)
class ViewpointQuery:
    """What to look for: a thing, the points of it that matter, where to stand, whether the camera may be tilted."""

    thing_id: str
    points: np.ndarray
    places: Places
    may_tilt: bool = False
    least_seen: int = 3
    through_glass: bool = False


def viewpoints(oracle: Oracle, walks: ShortestPaths, query: ViewpointQuery) -> Iterator[Viewpoint]:
    """Yields views of a thing that meet the query, the shortest walk first, the present place before all others."""
    here = oracle.agent
    spot = np.array([[here.position.x, here.position.z]])
    if np.isfinite(query.places(spot)).all():
        view = _view_from(oracle, query, here, ())
        if view is not None:
            yield view
    for cell in _cells(walks, query):
        x, z = (float(value) for value in walks.plan.cells[cell])
        pose = here.model_copy(update={"position": Vec3(x, here.position.y, z)})
        view = _view_from(oracle, query, pose, None)
        if view is None:
            continue
        corners = walks.corners_to(cell)
        if corners:
            yield Viewpoint(view.pose, tuple(corners), view.pixels, view.seen)


def view_ahead(oracle: Oracle, query: ViewpointQuery) -> Viewpoint:
    """Returns what is seen of a thing from where the agent stands and looks now; perhaps nothing."""
    here = oracle.agent
    seen = query.points[oracle.sees(here.eye, query.points, query.thing_id, through_glass=query.through_glass)]
    pixels = _in_frame(here, seen)
    return Viewpoint(here, (), pixels, len(pixels))


def _cells(walks: ShortestPaths, query: ViewpointQuery) -> np.ndarray:
    """Returns the acceptable cells in order of cost, thinned out."""
    cells = walks.plan.cells
    if not len(cells):
        return np.empty(0, dtype=np.int64)
    costs = walks.lengths + query.places(cells)
    lattice = np.round(cells / THIN_M).astype(np.int64)
    order = np.lexsort((np.arange(len(cells)), costs))
    order = order[np.isfinite(costs[order])]
    _, first = np.unique(lattice[order], axis=0, return_index=True)
    return order[np.sort(first)][:MOST_PLACES]


def _view_from(
    oracle: Oracle, query: ViewpointQuery, pose: Pose, corners: tuple[Point2, ...] | None
) -> Viewpoint | None:
    seen = query.points[oracle.sees(pose.eye, query.points, query.thing_id, through_glass=query.through_glass)]
    if len(seen) < query.least_seen:
        return None
    for turned in _turned(pose, seen, query.may_tilt):
        pixels = _in_frame(turned, seen)
        if len(pixels) >= query.least_seen:
            return Viewpoint(turned, corners or (), pixels, len(pixels))
    return None


def _in_frame(pose: Pose, points: np.ndarray) -> np.ndarray:
    """Returns the pixels (n, 2) of those points (m, 3) that lie in the frame, those nearest to their middle first."""
    found = project(pose, points)
    pixels = found[(found[:, 2] > 0.0) & in_frame(found, BORDER_PX), :2]
    if not len(pixels):
        return pixels
    middle = np.median(pixels, axis=0)
    return pixels[np.argsort(np.linalg.norm(pixels - middle, axis=1), kind="stable")]


def _turned(pose: Pose, seen: np.ndarray, may_tilt: bool) -> Iterator[Pose]:
    """Yields the pose turned to the middle of what is seen, with the camera as it is, then tilted."""
    middle = np.median(seen, axis=0)
    middle = seen[int(np.argmin(np.linalg.norm(seen - middle, axis=1)))]
    yaw = yaw_towards(pose.position, Vec3(*(float(value) for value in middle)))
    if abs(turn_between(pose.rotation, yaw)) < 1.0:
        yaw = pose.rotation
    turned = pose.model_copy(update={"rotation": yaw})
    yield turned
    if may_tilt:
        horizon = min(max(pitch_to(pose.eye, middle), HORIZON_UP_DEG), HORIZON_DOWN_DEG)
        yield turned.model_copy(update={"horizon": round(horizon, 1)})
