"""Light on the narrow sides of a door's panels and frame: from afar a dark one would be a row of dashes.

A strip that is narrower than a pixel is met by some of its samples and missed by others. It is drawn there with the
light of the whole that it belongs to, on average over all sides, and with its own from near by.
"""

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import CompiledModel

WIDTH_M, LENGTH_M = 0.05, 0.25
"""A flat side that is narrower and longer is a strip: doors are thinner, and their panels hide most of it."""
FLAT = 0.99
"""Cosine between the normal of such a side and an axis of its part."""
PLANE_M = 0.001
"""Corners no farther apart across are on one side."""


def of_doors(model: CompiledModel, geoms: np.ndarray) -> np.ndarray:
    """Returns which geoms (n,) are of things with leaves and no inside, as doors and curtains."""
    is_door = np.zeros(len(model.things) + 1, dtype=bool)
    for thing in model.things.values():
        is_door[thing.index] = len(thing.bodies) > 1 and not thing.has_inside
    return is_door[model.geom_things[geoms]]


def on_strips(points: np.ndarray, normals: np.ndarray, owners: np.ndarray) -> np.ndarray:
    """Returns which corners (n,) at points (n, 3) with normals (n, 3), both in the frame of their owner (n,), belong to
    a long and narrow flat side of it."""
    axis = np.abs(normals).argmax(axis=1)
    rows = np.arange(len(points))
    facing, depth = normals[rows, axis], np.round(points[rows, axis] / PLANE_M).astype(np.int64)
    keys = np.stack([owners, 2 * axis + (facing > 0), depth], axis=1)
    _, side = np.unique(keys, axis=0, return_inverse=True)
    side = side.reshape(-1)
    count = int(side.max(initial=-1)) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, side, points)
    np.maximum.at(high, side, points)
    extents = np.sort(high - low, axis=1)  # the least of them is across
    is_strip = (extents[:, 1] < WIDTH_M) & (extents[:, 2] > LENGTH_M)
    return is_strip[side] & (np.abs(facing) >= FLAT)


def lightened(light: np.ndarray, chosen: np.ndarray, owners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the light (n, k) with no less than their owner's (n,) mean on the chosen (n,), and the share of
    it (n,) that they have from near by."""
    counts = np.maximum(np.bincount(owners), 1)
    means = np.stack([np.bincount(owners, column) / counts for column in light.T], axis=1)[owners]
    afar = np.where(chosen[:, None], np.maximum(light, means), light)
    return afar, light.sum(axis=1) / np.maximum(afar.sum(axis=1), 1e-6)
