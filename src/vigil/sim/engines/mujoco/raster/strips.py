"""Light on the narrow sides of a door's panels and frame: from afar a dark one would be a row of dashes.

A strip that is narrower than a pixel is met by some of its samples and missed by others. It is drawn there with the
light of the whole that it belongs to, on average over all sides, and with its own from near by.
"""

import numpy as np

from vigil.sim.engines.mujoco.compiled.model import CompiledModel

WIDTH_M = 0.05
"""What is narrower is a strip: doors are thinner, and most of their panels' sides lies hidden."""
SLIM = 6.0
"""How many times as long as wide its triangles are at least: those of small round things are not."""
FLAT = 0.99
"""Cosine between the normals of a flat triangle and of its corners."""


def of_doors(model: CompiledModel, geoms: np.ndarray) -> np.ndarray:
    """Returns which geoms (n,) are of things with leaves and no inside, as doors and curtains."""
    is_door = np.zeros(len(model.things) + 1, dtype=bool)
    for thing in model.things.values():
        is_door[thing.index] = len(thing.bodies) > 1 and not thing.has_inside
    return is_door[model.geom_things[geoms]]


def on_strips(points: np.ndarray, normals: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Returns which corners (n,) at points (n, 3) with normals (n, 3) belong to narrow flat triangles (m, 3) alone."""
    corners = points[faces]
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    across = np.cross(sides[:, 0], sides[:, 1])
    double = np.linalg.norm(across, axis=1)
    width = double / np.maximum(longest, 1e-6)
    facing = np.einsum("ij,ikj->ik", across, normals[faces]) >= FLAT * double[:, None]
    is_narrow = (width < WIDTH_M) & (longest > SLIM * width) & facing.all(axis=1)
    wide = np.bincount(faces[~is_narrow].ravel(), minlength=len(points))
    narrow = np.bincount(faces[is_narrow].ravel(), minlength=len(points))
    return (narrow > 0) & (wide == 0)


def lightened(light: np.ndarray, chosen: np.ndarray, owners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the light (n, k) with no less than their owner's (n,) mean on the chosen (n,), and the share of
    it (n,) that they have from near by."""
    counts = np.maximum(np.bincount(owners), 1)
    means = np.stack([np.bincount(owners, column) / counts for column in light.T], axis=1)[owners]
    afar = np.where(chosen[:, None], np.maximum(light, means), light)
    return afar, light.sum(axis=1) / np.maximum(afar.sum(axis=1), 1e-6)
