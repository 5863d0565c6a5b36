"""Light that was cast on the vertices of a surface, averaged along its edges.

Few rays are cast from a vertex, and a face shows what its corners got: without this, one corner that happens to see
less of a lamp darkens half a door.
"""

import numpy as np

ROUNDS = 3
NEAR_M = 0.15
"""A neighbour this far away along an edge counts half."""
ALIKE = 0.7
"""Cosine between the normals of two corners that are still of one smooth surface."""


def smoothed(
    light: np.ndarray, is_known: np.ndarray, points: np.ndarray, normals: np.ndarray, edges: np.ndarray
) -> np.ndarray:
    """Returns the light (n, k) on corners at points (n, 3) with normals (n, 3), averaged along edges (m, 2).

    Where it is not known (n,), it comes from corners where it is; it is not a number where none of those is near.
    """
    count = len(light)
    first, last = np.divmod(np.unique(edges.min(axis=1).astype(np.int64) * count + edges.max(axis=1)), count)
    is_one_surface = (first != last) & (np.einsum("ij,ij->i", normals[first], normals[last]) > ALIKE)
    first, last = first[is_one_surface], last[is_one_surface]
    near = 1.0 / (1.0 + (np.linalg.norm(points[first] - points[last], axis=1) / NEAR_M) ** 2)
    own = np.arange(count)
    order = np.argsort(np.concatenate([own, first, last]), kind="stable")
    sources = np.concatenate([own, last, first])[order]
    weights = np.concatenate([np.ones(count), near, near])[order, None].astype(np.float32)
    begins = np.concatenate([[0], np.cumsum(1 + np.bincount(np.append(first, last), minlength=count))[:-1]])
    shares = 1.0 / np.add.reduceat(weights, begins)
    # The last column is how much of the average is known.
    sums = np.column_stack([light * is_known[:, None], is_known]).astype(np.float32)
    for _ in range(ROUNDS):
        sums = np.add.reduceat(weights * sums[sources], begins) * shares
    known = sums[:, -1:]
    return sums[:, :-1] / np.where(known > 0.0, known, np.nan)
