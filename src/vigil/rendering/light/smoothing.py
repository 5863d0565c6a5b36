"""Smoothing: averages the light on the vertices of a surface along the surface's edges.

Only few rays are cast from each vertex, and the light within a face is interpolated from its corners. Without
smoothing, half of a door would be dark if a lamp is partly hidden from one of the door's corners.
"""

import numpy as np

from vigil.rendering.light.irradiance import Samples

ROUNDS = 3
NEAR_M = 0.15
"""Length (m) of an edge whose other end has half the weight of the vertex itself."""
SAME_SURFACE_COSINE = 0.7
"""Neighbouring corners are on one smooth surface if the cosine between their normals is above this."""
INSET_SHARE, INSET_M = 0.3, 0.05
"""The light at a corner is computed at a point farther inward: by this share of the mean distance to the corner's
neighbours, but at most by this distance (m)."""


def smooth_edges(normals: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the edges (k, 2), each once, whose ends have similar `normals` (n, 3), so that they are on one surface."""
    count = len(normals)
    once = np.unique(edges.min(axis=1).astype(np.int64) * count + edges.max(axis=1))
    first, last = np.divmod(once, count)
    is_one = (first != last) & (np.einsum("ij,ij->i", normals[first], normals[last]) > SAME_SURFACE_COSINE)
    return np.stack([first[is_one], last[is_one]], axis=1)


def move_inward(samples: Samples, edges: np.ndarray) -> Samples:
    """Return samples moved inward from the rims of their surfaces, along `edges` (k, 2) that are each on one surface.

    A corner at a rim gets little light. If it were not moved, it would darken all of a large face.
    """
    first, last = edges.T
    count = len(samples.points)
    offsets = samples.points[last] - samples.points[first]
    known = np.maximum(np.bincount(first, minlength=count) + np.bincount(last, minlength=count), 1)
    sums = np.stack(
        [np.bincount(first, offset, count) - np.bincount(last, offset, count) for offset in offsets.T], axis=1
    )
    inward = sums / known[:, None]
    inward -= np.einsum("ij,ij->i", inward, samples.normals)[:, None] * samples.normals
    length = np.maximum(np.linalg.norm(inward, axis=1), 1e-6)
    steps = np.minimum(INSET_SHARE * length, INSET_M) / length
    return Samples((samples.points + steps[:, None] * inward).astype(np.float32), samples.normals)


def smoothed(light: np.ndarray, is_known: np.ndarray, points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the light (n, k) at `points` (n, 3) averaged along `edges` (m, 2); each edge is on one surface.

    Where `is_known` (n,) is False, the light is that of known corners nearby; nan if there are none.
    """
    count = len(light)
    first, last = edges.T
    near = 1.0 / (1.0 + (np.linalg.norm(points[first] - points[last], axis=1) / NEAR_M) ** 2)
    own = np.arange(count)
    order = np.argsort(np.concatenate([own, first, last]), kind="stable")
    sources = np.concatenate([own, last, first])[order]
    weights = np.concatenate([np.ones(count), near, near])[order, None].astype(np.float32)
    begins = np.concatenate([[0], np.cumsum(1 + np.bincount(np.append(first, last), minlength=count))[:-1]])
    shares = 1.0 / np.add.reduceat(weights, begins)
    # The last column is the known share of the average.
    sums = np.column_stack([light * is_known[:, None], is_known]).astype(np.float32)
    for _ in range(ROUNDS):
        sums = np.add.reduceat(weights * sums[sources], begins) * shares
    known = sums[:, -1:]
    return sums[:, :-1] / np.where(known > 0.0, known, np.nan)
