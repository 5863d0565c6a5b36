"""The triangles of a scene's structure, divided by room and place, so that only those in view are drawn.

The structure of a room or of a whole house is a few geoms (e.g. all skirting boards), of which a picture shows little.
"""

import numpy as np

from vigil.protocol.house import EXTERIOR
from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import RenderScene
from vigil.scene.portals import OUTSIDE

PART_M = 2.0
"""Size (m) of the cells of the plan by which triangles are divided."""
MARGIN_M = 0.01
"""Width (m) of the margin around what is tested for being in view."""
_ANYWHERE = -2
"""Number that stands for the room of a surface that may be visible from anywhere."""


class StructureParts:
    """Parts of the structure. It never moves, so everything here is in the world's frame and never changes."""

    def __init__(self, geometry: Geometry) -> None:
        scene = geometry.scene
        self.faces: list[np.ndarray] = []
        """Numbers (k,) int32 of each part's triangles."""
        geoms, rooms, boxes = [], [], []
        for geom in range(len(scene.structure_kinds)):
            first = geometry.vertex_slices[geom].start
            numbers = np.arange(len(geometry.faces), dtype=np.int32)[geometry.face_slices[geom]]
            corners = geometry.world(scene.initial, geom)[0][geometry.faces[numbers] - first]
            middles = corners.mean(axis=1)
            keys = np.column_stack([_rooms_of(scene, geom, middles), np.floor(middles[:, :2] / PART_M)]).astype(int)
            for key in np.unique(keys, axis=0):
                is_own = (keys == key).all(axis=1)
                points = corners[is_own].reshape(-1, 3)
                self.faces.append(numbers[is_own])
                geoms.append(geom)
                rooms.append(key[0])
                boxes.append((points.min(axis=0), points.max(axis=0)))
        self.geoms = np.array(geoms, dtype=int)
        """Geom (parts,) of each part."""
        low, high = np.array(boxes, np.float64).reshape(-1, 2, 3).swapaxes(0, 1)
        self.middles = (low + high) / 2
        """Middles (parts, 3) of the boxes around the parts."""
        self.halves = ((high - low) / 2 + MARGIN_M) * np.eye(3)[:, None]
        """Vectors (3, parts, 3) from each box's middle to the middles of three of its sides, with a margin."""
        self.touches = np.array(rooms, dtype=int)[:, None] == np.array([*range(len(scene.lamps)), OUTSIDE])
        """Whether (parts, rooms + 1) each part can be seen only from each room or, in the last column, from outside. It
        is False in all columns for a part that may be visible from anywhere."""


def _rooms_of(scene: RenderScene, geom: int, middles: np.ndarray) -> np.ndarray:
    """Return the room's number (k,), `OUTSIDE` or `_ANYWHERE` for each triangle of a geom, whose middles are (k, 3)."""
    kind, room = scene.structure_kinds[geom], int(scene.structure_rooms[geom])
    if kind == "skirting":
        return np.asarray(scene.portals.distances(middles[:, :2]).argmin(axis=1))
    return np.full(len(middles), OUTSIDE if kind == EXTERIOR else room if room >= 0 else _ANYWHERE)
