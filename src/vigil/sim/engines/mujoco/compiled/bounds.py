"""Boxes, parallel to the house's axes, around all geoms. A cast of rays skips geoms whose boxes no ray can reach.

Meshes of walls and floors extend through a room or the whole house, so they have several boxes, one for each piece.
"""

from dataclasses import dataclass

import numpy as np

from vigil.sim.engines.mujoco.compiled.binding import NativeData, NativeModel

PIECE_M = 2.0
"""Edge length (m) of the cubes that divide a mesh into pieces: triangles with their centres in one cube share a box."""
SLACK_M = 0.001
"""Margin (m) that is added around a box; it is far larger than rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Boxes around geoms, in MuJoCo's frame; the boxes of a geom together contain it."""

    geoms: np.ndarray
    """Number of the geom of each box, (n,)."""
    lows: np.ndarray
    """Lower corners of the boxes, (3, n)."""
    highs: np.ndarray
    """Upper corners of the boxes, (3, n)."""

    def joined(self, others: "Bounds") -> "Bounds":
        """Return these boxes and the `others` together."""
        return Bounds(
            np.concatenate([self.geoms, others.geoms]),
            np.concatenate([self.lows, others.lows], axis=1),
            np.concatenate([self.highs, others.highs], axis=1),
        )

    def geoms_outside(self, low: np.ndarray, high: np.ndarray, count: int) -> np.ndarray:
        """Return a mask (count,) of the geoms whose boxes are all outside the box from `low` to `high`."""
        is_near = ((self.lows <= high[:, None]) & (self.highs >= low[:, None])).all(axis=0)
        is_outside = np.ones(count, dtype=bool)
        is_outside[self.geoms[is_near]] = False
        return is_outside


def geom_bounds(native: NativeModel, data: NativeData, geoms: np.ndarray) -> Bounds:
    """Return a box around each geom at its present place; the box of a plane is infinite."""
    turns, boxes = data.geom_xmat[geoms].reshape(-1, 3, 3), native.geom_aabb[geoms]
    middles = data.geom_xpos[geoms] + np.einsum("nij,nj->ni", turns, boxes[:, :3])
    halves = np.einsum("nij,nj->ni", np.abs(turns), boxes[:, 3:]) + SLACK_M
    halves[native.geom_rbound[geoms] == 0.0] = np.inf
    return Bounds(geoms, (middles - halves).T.copy(), (middles + halves).T.copy())


def structure_bounds(native: NativeModel, data: NativeData, geoms: np.ndarray) -> Bounds:
    """Return boxes around the pieces of meshes at their present places, and infinite boxes around planes."""
    is_mesh = native.geom_dataid[geoms] >= 0
    found = geom_bounds(native, data, geoms[~is_mesh])
    for geom in geoms[is_mesh]:
        corners = _triangles(native, int(native.geom_dataid[geom])) @ data.geom_xmat[geom].reshape(3, 3).T
        corners += data.geom_xpos[geom]
        cubes = np.floor(corners.mean(axis=1) / PIECE_M).astype(np.int64)
        _, piece = np.unique(cubes, axis=0, return_inverse=True)
        order = np.argsort(piece.ravel(), kind="stable")
        firsts = np.flatnonzero(np.diff(piece.ravel()[order], prepend=-1))
        lows = np.minimum.reduceat(corners.min(axis=1)[order], firsts) - SLACK_M
        highs = np.maximum.reduceat(corners.max(axis=1)[order], firsts) + SLACK_M
        found = found.joined(Bounds(np.full(len(firsts), geom), lows.T, highs.T))
    return found


def _triangles(native: NativeModel, mesh: int) -> np.ndarray:
    """Return the corners (n, 3, 3) of a mesh's triangles, in the mesh's frame."""
    vertex, face = native.mesh_vertadr[mesh], native.mesh_faceadr[mesh]
    vertices = native.mesh_vert[vertex : vertex + native.mesh_vertnum[mesh]].astype(np.float64)
    return vertices[native.mesh_face[face : face + native.mesh_facenum[mesh]]]
