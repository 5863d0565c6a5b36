"""Where little light comes while things are shut: inside of them, and between their parts.

Leaves stop no light, so what lies behind one is lit as if it were open, and would shine through the gap between two.
What has no inside, as a curtain or a door between rooms, has nothing to shine.
"""

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.light.irradiance import Samples
from vigil.rendering.light.occluders import Occluders, occluders_of
from vigil.rendering.scene import RenderScene, RenderState

LIFT_M = 0.0005
GAP_M, INSIDE_M = 0.05, 0.6
"""What a leaf faces nearer than this is beside it; what a case has nearer than this before it shuts it."""
STRIP_M = 0.03
"""What a leaf covers lies behind the gap to the next part when that is nearer than this."""
CLOSED_SHARE, LIP_SHARE = 0.1, 0.5
"""Shares of the light that reach what is shut, and the sides of a gap from which one looks straight out. A line much
darker than the leaf beside it would be seen as a row of dots from where it is narrower than a pixel.
"""
DISTANT_SHARE = 0.75
"""Share of the light of the leaf beside it that a gap keeps where it is narrower than a pixel: a dark one would be a
row of dots.
"""
LARGE = 0.5
"""Share of the reach of the largest part of a thing's leaves from which on a part is a front, not a handle."""
WIDTH_M = 0.001
"""Of a gap as it is mostly seen, from aside."""
FRONT, BESIDE = 1, (0, 2)
"""The axis of a body's frame that points to its thing's front, and those that point to its sides, top and bottom."""
FADE_M = 0.03
"""Along no more than this does the dark fade into the light."""
FACES_FRONT = 0.3
"""Cosine between the front and the normal of what is seen from there."""
FARTHEST_SIDE_M = 3.0
"""What has parts of its thing this near on all four sides lies inside of it: no case is larger. Frames of doors have
no sill.
"""


def light_shares(geometry: Geometry, state: RenderState, geoms: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the share of its light (n,) that reaches each of the samples (n,) on geoms (n,).

    It is less than 1 for those that face another part of the same thing near by, or lie inside it.
    """
    scene = geometry.scene
    shares = np.ones(len(geoms))
    wholes: dict[int, Occluders] = {}
    is_solid = scene.initial.is_visible & ~scene.is_glass
    for body in np.unique(scene.bodies[geoms[scene.is_in_case[geoms]]]).tolist():
        chosen = np.flatnonzero(scene.bodies[geoms] == body)
        number = int(scene.furniture[geoms[chosen[0]]])
        # A chest comes before its drawers; what is no chest is all there is to it.
        pieces = np.flatnonzero(scene.furniture == number)
        case, parts = scene.bodies[pieces[0]], pieces[is_solid[pieces]]
        others = parts[scene.bodies[parts] != body]
        if not len(others):
            continue
        if number not in wholes:
            wholes[number] = occluders_of(geometry, state, parts)
        beside, whole = occluders_of(geometry, state, others), wholes[number]
        axes = state.body_rotations[case].astype(np.float32)
        normals = samples.normals[chosen]
        origins = samples.points[chosen] + np.float32(LIFT_M) * normals
        ahead = np.broadcast_to(axes[:, FRONT], normals.shape)
        faced, before = beside.distances(origins, normals), whole.distances(origins, ahead)
        is_shut = faced < GAP_M
        if body == case:
            is_behind = (faced < INSIDE_M) | (beside.distances(origins, ahead) < INSIDE_M)
        else:
            # The corners of a front's panel lie inside its frame, but it faces the room.
            is_front = normals @ axes[:, FRONT] >= FACES_FRONT
            is_behind = (before < INSIDE_M) & ~is_front
            asked = np.flatnonzero(is_front & ~is_shut & (before < GAP_M))
            is_shut[asked] = _touches(beside, origins[asked], axes[:, BESIDE].T)
            asked = np.flatnonzero(is_behind & ~is_shut & (before < GAP_M))
            is_shut[asked] = _is_next(beside, whole, origins[asked], -ahead[asked])
        is_lip = is_shut & (before >= INSIDE_M)
        asked = np.flatnonzero(is_behind & ~is_shut)
        is_shut[asked] = _enclosed(whole if body == case else beside, origins[asked], axes[:, BESIDE].T)
        shares[chosen] = np.where(is_lip, LIP_SHARE, np.where(is_shut, CLOSED_SHARE, 1.0))
    return shares


def distant_light_shares(scene: RenderScene, geoms: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the share of its light (n,) that each of geoms (n,) is drawn with where gaps are narrower than a pixel.

    It is no less than `shares` (n,), and such that what is pale in a gap looks no brighter than the leaf beside it.
    What is seen through glass stays as dark as it is near by.
    """
    afar = shares.copy()
    dim = np.flatnonzero(shares < 1.0)
    for whole in np.unique(scene.furniture[geoms[dim]]).tolist():
        chosen = dim[scene.furniture[geoms[dim]] == whole]
        parts = np.flatnonzero(scene.furniture == whole)
        is_leaf = (scene.bodies[parts] != scene.bodies[parts[0]]) & scene.initial.is_visible[parts]
        leaves = parts[is_leaf]
        if (scene.is_glass & scene.initial.is_visible)[parts].any() or not len(leaves):
            continue
        reach = scene.radii[leaves]
        # Boxes of drawers are as large as their fronts, and often paler.
        beside = _albedo(scene, leaves[reach >= LARGE * reach.max()]).min()
        afar[chosen] = np.clip(DISTANT_SHARE * beside / _albedo(scene, geoms[chosen]), shares[chosen], 1.0)
    return afar


def _albedo(scene: RenderScene, geoms: np.ndarray) -> np.ndarray:
    """Return how much light the materials of geoms (n,) send back, on average over the colours."""
    roots = np.array([scene.materials[number].rgba[:3] for number in scene.initial.materials[geoms]])
    return np.maximum((roots**2).mean(axis=1), 1e-3)


def _is_next(others: Occluders, whole: Occluders, origins: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Return from which points (n, 3) the others are what lies next on the way (n, 3), as a case behind a seal."""
    far = others.distances(origins, ways)
    return (far < GAP_M) & (far <= whole.distances(origins, ways))


def _touches(others: Occluders, origins: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) have the others close by, along any direction of the axes (k, 3).

    A strip that covers the gap between two leaves from behind belongs to one of them and reaches behind the other.
    """
    touches = np.zeros(len(origins), dtype=bool)
    for way in (*axes, *-axes):
        touches |= others.distances(origins, np.broadcast_to(way, origins.shape)) < STRIP_M
    return touches


def without_long_gradients(is_shut: np.ndarray, points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return which of points (n, 3) are shut away (n,), but none from which the dark would run out into the open.

    Light is blended along edges (m, 2): a long one from a dark point to a light one darkens what is plainly seen, as
    the front of a machine does round its door.
    """
    firsts, lasts = edges.T
    length = np.linalg.norm(points[firsts] - points[lasts], axis=1)
    runs_out = (is_shut[firsts] != is_shut[lasts]) & (length > FADE_M)
    found = is_shut.copy()
    found[edges[runs_out]] = False
    return found


def _enclosed(case: Occluders, origins: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) have the case beside them, along both directions of each axis (k, 3)."""
    enclosed = np.ones(len(origins), dtype=bool)
    for way in (*axes, *-axes):
        enclosed &= case.distances(origins, np.broadcast_to(way, origins.shape)) < FARTHEST_SIDE_M
    return enclosed
