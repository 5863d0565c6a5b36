"""Smoothing of the light that was cast on the vertices of a surface, along its edges.

Few rays are cast from a vertex, and the light of a face comes from its corners. Without smoothing, one corner with a
partly hidden lamp would darken half a door.
"""

import numpy as np

from vigil.rendering.light.irradiance import Samples

ROUNDS = 3
NEAR_M = 0.15
"""Length (m) of an edge at which the neighbour at its end has half the weight."""
SAME_SURFACE_COSINE = 0.7
"""Least cosine between the normals of neighbouring corners of one smooth surface."""
INSET_SHARE, INSET_M = 0.3, 0.05
"""How far inward from a corner the light on it is computed: a share of the way to its neighbours, and the greatest
distance (m)."""


def smooth_edges(normals: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the distinct edges (k, 2) among `edges` (m, 2) whose corners with normals (n, 3) are of one surface."""
    count = len(normals)
    once = np.unique(edges.min(axis=1).astype(np.int64) * count + edges.max(axis=1))
    first, last = np.divmod(once, count)
    is_one = (first != last) & (np.einsum("ij,ij->i", normals[first], normals[last]) > SAME_SURFACE_COSINE)
    return np.stack([first[is_one], last[is_one]], axis=1)


def move_inward(samples: Samples, edges: np.ndarray) -> Samples:
    """Return samples moved inward from the rims of their surfaces, along edges (k, 2) of one surface each.

    The corner of a rim gets little light, which would darken the whole of a large face.
    """
    first, last = edges.T
    count = len(samples.points)
    ways = samples.points[last] - samples.points[first]
    known = np.maximum(np.bincount(first, minlength=count) + np.bincount(last, minlength=count), 1)
    sums = np.stack([np.bincount(first, way, count) - np.bincount(last, way, count) for way in ways.T], axis=1)
    inward = sums / known[:, None]
    inward -= np.einsum("ij,ij->i", inward, samples.normals)[:, None] * samples.normals
    length = np.maximum(np.linalg.norm(inward, axis=1), 1e-6)
    steps = np.minimum(INSET_SHARE * length, INSET_M) / length
    return Samples((samples.points + steps[:, None] * inward).astype(np.float32), samples.normals)


def smoothed(light: np.ndarray, is_known: np.ndarray, points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the light (n, k) on corners at points (n, 3), averaged along edges (m, 2) of one surface each.

    Unknown light (n,) is taken from corners nearby whose light is known; it is nan if there is none.
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
