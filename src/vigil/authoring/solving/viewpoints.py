"""Viewpoints: poses from which a thing can be seen or clicked, those with the shortest walk first.

They are estimated from a few dozen rays per place, so callers must check the viewpoint that they use.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from vigil.authoring.solving.look_targets import in_frame, pitch_to
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3, turn_between, yaw_towards
from vigil.protocol.actions import HORIZON_DOWN_DEG, HORIZON_UP_DEG
from vigil.scene.floor import Point2, ShortestPaths
from vigil.sim.core.sight import project

BORDER_PX = 12.0
"""A point counts as seen if it is at least this far (px) from the frame's border."""
LATTICE_M = 0.15
"""Approximate distance (m) between the places that are tried."""
MAX_PLACES = 400
FACED_DEG = 1.0
"""Difference of headings (deg) below which the agent does not turn."""

PositionCost = Callable[[np.ndarray], np.ndarray]
"""Function that takes places (n, 2) in x, z and returns additional costs (n,) in metres; inf for forbidden places."""


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """A pose to go to, and what is visible of a thing from this pose."""

    pose: Pose
    corners: tuple[Point2, ...]
    """Corners (x, z) of the walk to the pose; empty if the agent is already at the place."""
    pixels: np.ndarray
    """Estimated pixels (n, 2) of the visible points, the nearest to their middle first."""
    seen: int
    """Number of the sampled points that are visible in the frame."""


@dataclass(frozen=True, slots=True, eq=False)
class ViewpointQuery:
    """What viewpoints of a thing must satisfy."""

    thing_id: str
    points: np.ndarray
    """Points (n, 3) of the thing that should be visible."""
    places: PositionCost
    """Cost function of the places at which the agent may stand."""
    may_tilt: bool = False
    """Whether the camera may be tilted."""
    least_seen: int = 3
    """Minimum number of points that must be visible in the frame."""
    through_glass: bool = False
    """Whether points behind glass count as visible."""


def viewpoints(view: PrivilegedView, walks: ShortestPaths, query: ViewpointQuery) -> Iterator[Viewpoint]:
    """Yield the viewpoints that satisfy a query: first the agent's current place, then others by cost."""
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
    """Return the viewpoint at the agent's current pose, even if it does not satisfy the query."""
    here = view.agent
    seen = query.points[view.sees(here.eye, query.points, query.thing_id, through_glass=query.through_glass)]
    pixels = _in_frame(here, seen)
    return Viewpoint(here, (), pixels, len(pixels))


def _cells(walks: ShortestPaths, query: ViewpointQuery) -> np.ndarray:
    """Return the indices of cells that may be used, in order of cost, about `LATTICE_M` apart, at most `MAX_PLACES`."""
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
    """Return the pixels (n, 2) of those points (m, 3) that lie in the frame, the nearest to their middle first."""
    found = project(pose, points)
    pixels = found[(found[:, 2] > 0.0) & in_frame(found, BORDER_PX), :2]
    if not len(pixels):
        return pixels
    middle = np.median(pixels, axis=0)
    return pixels[np.argsort(np.linalg.norm(pixels - middle, axis=1), kind="stable")]


def _turned(pose: Pose, seen: np.ndarray, may_tilt: bool) -> Iterator[Pose]:
    """Yield the pose, turned towards the middle of the seen points (n, 3); if `may_tilt`, also with a tilted camera."""
    middle = np.median(seen, axis=0)
    middle = seen[int(np.argmin(np.linalg.norm(seen - middle, axis=1)))]
    yaw = yaw_towards(pose.position, Vec3(*(float(value) for value in middle)))
    if abs(turn_between(pose.rotation, yaw)) < FACED_DEG:
        yaw = pose.rotation
    turned = pose.model_copy(update={"rotation": yaw})
    yield turned
    if may_tilt:
        horizon = min(max(pitch_to(pose.eye, middle), HORIZON_UP_DEG), HORIZON_DOWN_DEG)
        yield turned.model_copy(update={"horizon": round(horizon, 1)})
