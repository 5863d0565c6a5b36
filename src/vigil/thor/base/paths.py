"""Shortest walks on a grid of places where the body fits. Corners are removed where the straight line is free."""

import numpy as np

from vigil.base.geometry import Vec3
from vigil.scene.floor import grid_graph
from vigil.thor.base.errors import ActionFailed, bad_argument
from vigil.thor.base.world import World

GRID_M = 0.125
"""Step (m) of the grid. It is finer than the agent's steps, because a path need not consist of steps."""
NEAR_M = 0.2
"""Default greatest distance (m) between a path's target and the nearest place that can be reached."""


def shortest_walk(world: World, start: Vec3, end: Vec3, within_m: float = NEAR_M) -> list[Vec3]:
    """Return the corners of the shortest walk between two places on the floor.

    The walk ends at the reachable place nearest to `end`. Raises ActionFailed when the body does not fit at `start`, or
    when no reachable place is within `within_m` of `end`.
    """
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415 - loads over 200 modules

    if not world.can_be_at(start):
        raise bad_argument(f"The agent cannot stand at ({start.x:.4f}, {start.z:.4f}), where the path should start")
    places = world.editor.reachable(start, GRID_M)
    goal = int(np.argmin(np.hypot(places[:, 0] - end.x, places[:, 1] - end.z)))
    if np.hypot(*(places[goal] - [end.x, end.z])) > within_m:
        raise ActionFailed(
            f"Path to target could not be found: no path comes within {within_m:g} m of ({end.x:.4f}, {end.z:.4f})"
        )
    cells = np.round((places - [start.x, start.z]) / GRID_M).astype(int)
    first = int(np.flatnonzero((cells == 0).all(axis=1))[0])
    cells -= cells.min(axis=0)
    is_open = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    is_open[tuple(cells.T)] = True
    nodes = np.ravel_multi_index(tuple(cells.T), is_open.shape)
    graph = grid_graph(is_open, GRID_M, cuts_corners=True)[nodes][:, nodes]
    _, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    steps = [goal]
    while steps[-1] != first:
        steps.append(int(before[steps[-1]]))
    corners = [Vec3(float(places[step, 0]), start.y, float(places[step, 1])) for step in reversed(steps)]
    return _straightened(world, [start, *corners[1:]])


def _straightened(world: World, corners: list[Vec3]) -> list[Vec3]:
    """Return the corners of the walk; a corner is left out if the body can walk straight from the corner before it to
    the corner after it."""
    kept, here = [corners[0]], 0
    while here < len(corners) - 1:
        ahead = range(len(corners) - 1, here, -1)
        here = next((far for far in ahead if world.editor.blocker(corners[here], corners[far]) is None), here + 1)
        kept.append(corners[here])
    return kept
