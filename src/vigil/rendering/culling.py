"""What may be in a picture: what is neither out of view nor in a room that no line of sight reaches.

Drawing everything would change only single pixels along the seams between rooms. There, the edge of the next room's
wall or ceiling has the same depth as the edge of this room's wall or ceiling, and might be drawn instead.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from cachetools import LRUCache

from vigil.rendering.scene import RenderScene, RenderState
from vigil.rendering.structure_parts import MARGIN_M
from vigil.rendering.triangles import Facing, Triangles
from vigil.rendering.viewer import Viewer
from vigil.scene.portals import IN_ROOM_M, Place, Portals
from vigil.scene.sectors import ALL, Sector, Spans, overlap

KEPT_EYES = 4
"""Number of places of the eye (one for each frame and one for each mirror in it) whose results are kept."""
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    """What depends only on the poses and looks of a scene's geoms."""

    state: RenderState
    middles: np.ndarray
    """Middles (n, 3) of the boxes around all geoms, and then around all parts of the structure."""
    halves: np.ndarray
    """Vectors (3, n, 3) from each box's middle to the middles of three of its sides, with a margin."""
    corners: np.ndarray
    """Corners (8, n, 3) of the boxes."""
    touches: np.ndarray
    """Whether (n, rooms + 1) each geom or part may reach into each room; the last column stands for the outside. It is
    False in all columns for what may be visible from anywhere, such as an object in a doorway."""
    from_eyes: LRUCache[tuple[bytes, int], "FromEye"]


@dataclass(frozen=True, slots=True, eq=False)
class FromEye:
    """What may be visible from a place of the eye, in whatever direction it looks. Held geoms are not part of it."""

    geoms: np.ndarray
    """Geom (k,) of each box that may be visible."""
    middles: np.ndarray
    """Middles (k, 3) of the boxes."""
    halves: np.ndarray
    """Vectors (3, k, 3) from each box's middle to the middles of three of its sides, with a margin."""
    facing: Facing
    """The triangles of the boxes that face the eye."""


@dataclass(frozen=True, slots=True, eq=False)
class InView:
    """What of a scene may be in a picture."""

    geoms: np.ndarray
    """Numbers of the geoms, in ascending order."""
    is_near: np.ndarray
    """Whether (k,) each box of `from_eye` is not certainly outside the picture."""
    from_eye: FromEye

    def without(self, geoms: list[int]) -> "InView":
        """Return the same without some geoms."""
        if not geoms:
            return self
        is_near = self.is_near & ~np.isin(self.from_eye.geoms, geoms)
        return InView(self.geoms[~np.isin(self.geoms, geoms)], is_near, self.from_eye)

    def groups(self) -> list[np.ndarray]:
        """Return the triangles (n, 3) of each group of surfaces (`triangles.GROUPS`), without those of held geoms."""
        facing = self.from_eye.facing
        is_drawn = self.is_near[facing.owners]
        return [facing.faces[part][is_drawn[part]] for part in facing.groups]


def in_view(triangles: Triangles, state: RenderState, viewer: Viewer) -> InView:
    """Return what is visible and not certainly outside the picture."""
    found, sides = _from_eye(triangles, _placed(triangles, state), viewer), viewer.sides()
    normals = sides[:, :3].T
    farthest_in = found.middles @ normals + sides[:, 3] + sum(np.abs(half @ normals) for half in found.halves)
    is_near = np.asarray((farthest_in >= 0.0).all(axis=1))
    is_shown = state.is_held & state.is_visible
    is_shown[found.geoms[is_near]] = True
    return InView(np.flatnonzero(is_shown), is_near, found)


def _placed(triangles: Triangles, state: RenderState) -> _Placed:
    """Return what depends only on poses and looks; it is computed again only when one has changed."""
    scene, parts = triangles.geometry.scene, triangles.parts
    found: _Placed | None = scene.cache.get("placed")
    if found is None or not _is_same(found.state, state):
        middles = np.einsum("nij,nj->ni", state.rotations, scene.boxes[:, :3]) + state.positions
        halves = np.moveaxis(state.rotations * (scene.boxes[:, None, 3:] + MARGIN_M), 2, 0)
        middles, halves = np.concatenate([middles, parts.middles]), np.concatenate([halves, parts.halves], axis=1)
        corners = middles + np.tensordot(_SIGNS, halves, 1)
        touches = np.concatenate([_touches(scene, state.positions), parts.touches])
        scene.cache["placed"] = found = _Placed(state.copy(), middles, halves, corners, touches, LRUCache(KEPT_EYES))
    return found


def _is_same(before: RenderState, now: RenderState) -> bool:
    """Return whether the same geoms are drawn in the same poses and looks, not counting the poses of held geoms."""
    names = "is_visible", "is_held", "materials"
    if not all(np.array_equal(getattr(before, name), getattr(now, name)) for name in names):
        return False
    if now.is_held.any():
        return not (now.is_elsewhere(before) & ~now.is_held).any()
    return np.array_equal(before.positions, now.positions) and np.array_equal(before.rotations, now.rotations)


def _from_eye(triangles: Triangles, placed: _Placed, viewer: Viewer) -> FromEye:
    """Return what may be visible from the viewer's eye; it is computed only once for each place of the eye."""
    key = viewer.eye.tobytes(), -1 if viewer.mirror is None else viewer.mirror.geom
    if key not in placed.from_eyes:
        state, sectors = placed.state, _sectors(triangles.geometry.scene.portals, viewer)
        is_drawn = (state.is_visible & ~state.is_held)[triangles.geoms]
        is_drawn[: len(triangles.geometry.scene.structure_kinds)] = False  # their parts decide
        if sectors is not None:
            whole = [room for room, sector in sectors if sector == ALL]
            left = np.flatnonzero(is_drawn & ~placed.touches[:, whole].any(axis=1))
            spans = Spans.of(viewer.eye, placed.corners[:, left])
            is_drawn[left] = _is_in_sectors(placed.touches[left], sectors, spans)
        boxes = np.flatnonzero(is_drawn)
        middles = placed.middles[boxes]
        facing = triangles.facing(state, viewer.eye, boxes, middles)
        placed.from_eyes[key] = FromEye(triangles.geoms[boxes], middles, placed.halves[:, boxes], facing)
    return placed.from_eyes[key]


def _touches(scene: RenderScene, positions: np.ndarray) -> np.ndarray:
    """Return the rows of `_Placed.touches` for all geoms."""
    away = scene.portals.distances(positions[:, :2])
    touches = np.zeros((len(positions), away.shape[1] + 1), dtype=bool)
    touches[:, :-1] = (away <= scene.radii[:, None] + MARGIN_M) & (away.min(axis=1) <= IN_ROOM_M)[:, None]
    return touches


def _sectors(portals: Portals, viewer: Viewer) -> list[tuple[int, Sector]] | None:
    """Return (room, directions to it) for the visible rooms; None if every room may be visible."""
    mirror = viewer.mirror
    if mirror is None:
        return portals.visible_rooms(_place(viewer.eye))
    spans = Spans.of(viewer.eye, mirror.reach[:, None])
    through = Sector(*(float(each[0]) for each in (spans.start, spans.width, spans.low, spans.high)))
    before = np.unique(mirror.face + MARGIN_M * mirror.normal, axis=0)
    return portals.visible_rooms(_place(viewer.eye), map(_place, before), through)


def _place(point: np.ndarray) -> Place:
    """Return a point as x, z and height, which `Portals` uses."""
    x, z, height = point.tolist()
    return x, z, height


def _is_in_sectors(touches: np.ndarray, sectors: list[tuple[int, Sector]], spans: Spans) -> np.ndarray:
    """Return a mask (n,) of what is in a room that is visible in its direction, or in no room."""
    in_sector = touches[:, [room for room, _ in sectors]].T & overlap([sector for _, sector in sectors], spans)
    return np.asarray(in_sector.any(axis=0) | ~touches.any(axis=1))
