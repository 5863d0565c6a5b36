"""Views: from which places one could see or click a thing, nearest walk first.

A first estimate by a few dozen rays per place; the caller makes sure of the one that it takes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from vigil.authoring.solving.look_targets import in_frame, pitch_to
from vigil.authoring.solving.paths import Point2, ShortestPaths
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3, turn_between, yaw_towards
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG
from vigil.sim.core.sight import project

BORDER_PX = 12.0
LATTICE_M = 0.15
MAX_PLACES = 400

PositionCost = Callable[[np.ndarray], np.ndarray]
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
    places: PositionCost
    may_tilt: bool = False
    least_seen: int = 3
    through_glass: bool = False


def viewpoints(view: PrivilegedView, walks: ShortestPaths, query: ViewpointQuery) -> Iterator[Viewpoint]:
    """Yield views of a thing that meet the query, the shortest walk first, the present place before all others."""
    here = view.agent
    spot = np.array([[here.position.x, here.position.z]])
    if np.isfinite(query.places(spot)).all():
        viewpoint = _viewpoint_from(view, query, here, ())
        if viewpoint is not None:
            yield viewpoint
    for cell in _cells(walks, query):
        x, z = (float(value) for value in walks.plan.cells[cell])
        pose = here.model_copy(update={"position": Vec3(x, here.position.y, z)})
        viewpoint = _viewpoint_from(view, query, pose, None)
        if viewpoint is None:
            continue
        corners = walks.corners_to(cell)
        if corners:
            yield Viewpoint(viewpoint.pose, tuple(corners), viewpoint.pixels, viewpoint.seen)


def current_viewpoint(view: PrivilegedView, query: ViewpointQuery) -> Viewpoint:
    """Return what is seen of a thing from where the agent stands and looks now; perhaps nothing."""
    here = view.agent
    seen = query.points[view.sees(here.eye, query.points, query.thing_id, through_glass=query.through_glass)]
    pixels = _in_frame(here, seen)
    return Viewpoint(here, (), pixels, len(pixels))


def _cells(walks: ShortestPaths, query: ViewpointQuery) -> np.ndarray:
    """Return the acceptable cells in order of cost, thinned out."""
    cells = walks.plan.cells
    if not len(cells):
        return np.empty(0, dtype=np.int64)
    costs = walks.lengths + query.places(cells)
    lattice = np.round(cells / LATTICE_M).astype(np.int64)
    order = np.lexsort((np.arange(len(cells)), costs))
    order = order[np.isfinite(costs[order])]
    _, first = np.unique(lattice[order], axis=0, return_index=True)
    return order[np.sort(first)][:MAX_PLACES]


def _viewpoint_from(
    view: PrivilegedView, query: ViewpointQuery, pose: Pose, corners: tuple[Point2, ...] | None
) -> Viewpoint | None:
    seen = query.points[view.sees(pose.eye, query.points, query.thing_id, through_glass=query.through_glass)]
    if len(seen) < query.least_seen:
        return None
    for turned in _turned(pose, seen, query.may_tilt):
        pixels = _in_frame(turned, seen)
        if len(pixels) >= query.least_seen:
            return Viewpoint(turned, corners or (), pixels, len(pixels))
    return None


def _in_frame(pose: Pose, points: np.ndarray) -> np.ndarray:
    """Return the pixels (n, 2) of those points (m, 3) that lie in the frame, those nearest to their middle first."""
    found = project(pose, points)
    pixels = found[(found[:, 2] > 0.0) & in_frame(found, BORDER_PX), :2]
    if not len(pixels):
        return pixels
    middle = np.median(pixels, axis=0)
    return pixels[np.argsort(np.linalg.norm(pixels - middle, axis=1), kind="stable")]


def _turned(pose: Pose, seen: np.ndarray, may_tilt: bool) -> Iterator[Pose]:
    """Yield the pose turned to the middle of what is seen, with the camera as it is, then tilted."""
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
