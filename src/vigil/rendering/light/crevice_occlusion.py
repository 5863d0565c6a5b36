"""Shares of light inside closed furniture, and in the gaps between its doors and drawers.

Doors do not stop light, so the inside is lit as if they were open, and would shine through the gap between two doors.
Objects without an inside, such as curtains and doors between rooms, do not need this.
"""

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.light.irradiance import Samples
from vigil.rendering.light.occluders import Occluders, occluders_of
from vigil.rendering.scene import RenderScene, RenderState

LIFT_M = 0.0005
GAP_M, INSIDE_M = 0.05, 0.6
"""Greatest distance between neighbouring doors; greatest distance of a door before the inside that it closes."""
STRIP_M = 0.03
"""Greatest distance of the next part from a point in the gap before it."""
CLOSED_SHARE, LIP_SHARE = 0.1, 0.5
"""Shares of light that reach a closed inside, and the outer sides of a gap. A line much darker than the doors would
look like a row of dots where it is narrower than a pixel.
"""
DISTANT_SHARE = 0.75
"""Share of the doors' light that a gap has where it is narrower than a pixel; a dark gap would be a row of dots."""
LARGE = 0.5
"""Least size of a front, as a share of the largest moving part; smaller parts are handles."""
WIDTH_M = 0.001
"""Typical width of a gap, as seen from the side."""
FRONT, SIDES = 1, (0, 2)
"""Axes of a body's frame: the one to the front, and those to the sides, top and bottom."""
FADE_M = 0.03
"""Longest edge along which dark may fade into light."""
FACES_FRONT = 0.3
"""Least cosine between the front and the normal of a surface that faces it."""
FARTHEST_SIDE_M = 3.0
"""Greatest distance of a case's sides from a point inside it. The frame of a door does not have a lower side."""


def light_shares(geometry: Geometry, state: RenderState, geoms: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the share of light (n,) that reaches each of the samples (n,) on geoms (n,).

    It is less than 1 near another part of the same object that a sample faces, and inside the object.
    """
    scene = geometry.scene
    shares = np.ones(len(geoms))
    wholes: dict[int, Occluders] = {}
    is_solid = scene.initial.is_visible & ~scene.is_glass
    for body in np.unique(scene.bodies[geoms[scene.is_in_case[geoms]]]).tolist():
        chosen = np.flatnonzero(scene.bodies[geoms] == body)
        number = int(scene.furniture[geoms[chosen[0]]])
        # The first body is the case: a chest comes before its drawers.
        pieces = np.flatnonzero(scene.furniture == number)
        case, parts = scene.bodies[pieces[0]], pieces[is_solid[pieces]]
        others = parts[scene.bodies[parts] != body]
        if not len(others):
            continue
        if number not in wholes:
            wholes[number] = occluders_of(geometry, state, parts)
        rest, whole = occluders_of(geometry, state, others), wholes[number]
        axes = state.body_rotations[case].astype(np.float32)
        sides = axes[:, SIDES].T
        normals = samples.normals[chosen]
        origins = samples.points[chosen] + np.float32(LIFT_M) * normals
        ahead = np.broadcast_to(axes[:, FRONT], normals.shape)
        faced, before = rest.distances(origins, normals), whole.distances(origins, ahead)
        is_shut = faced < GAP_M
        if body == case:
            is_behind = (faced < INSIDE_M) | (rest.distances(origins, ahead) < INSIDE_M)
        else:
            # The corners of a panel lie inside its frame, but the panel faces the room.
            is_front = normals @ axes[:, FRONT] >= FACES_FRONT
            is_behind = (before < INSIDE_M) & ~is_front
            asked = np.flatnonzero(is_front & ~is_shut & (before < GAP_M))
            # A strip that covers the gap between two doors from behind belongs to one and reaches behind the other.
            is_shut[asked] = (_distances_along(rest, origins[asked], sides) < STRIP_M).any(axis=0)
            asked = np.flatnonzero(is_behind & ~is_shut & (before < GAP_M))
            is_shut[asked] = _is_next(rest, whole, origins[asked], -ahead[asked])
        is_lip = is_shut & (before >= INSIDE_M)
        asked = np.flatnonzero(is_behind & ~is_shut)
        around = _distances_along(whole if body == case else rest, origins[asked], sides)
        is_shut[asked] = (around < FARTHEST_SIDE_M).all(axis=0)
        shares[chosen] = np.where(is_lip, LIP_SHARE, np.where(is_shut, CLOSED_SHARE, 1.0))
    return shares


def distant_light_shares(scene: RenderScene, geoms: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the share of light (n,) on each of geoms (n,) where gaps are narrower than a pixel.

    It is at least `shares` (n,), and no pale surface in a gap looks brighter than the doors. Objects with glass keep
    `shares`.
    """
    afar = shares.copy()
    dim = np.flatnonzero(shares < 1.0)
    for whole in np.unique(scene.furniture[geoms[dim]]).tolist():
        chosen = dim[scene.furniture[geoms[dim]] == whole]
        parts = np.flatnonzero(scene.furniture == whole)
        case = scene.bodies[parts[0]]
        parts = parts[scene.initial.is_visible[parts]]
        moving = parts[scene.bodies[parts] != case]
        if scene.is_glass[parts].any() or not len(moving):
            continue
        radii = scene.radii[moving]
        # Boxes of drawers are as large as their fronts, and often paler.
        fronts = _albedo(scene, moving[radii >= LARGE * radii.max()]).min()
        afar[chosen] = np.clip(DISTANT_SHARE * fronts / _albedo(scene, geoms[chosen]), shares[chosen], 1.0)
    return afar


def _albedo(scene: RenderScene, geoms: np.ndarray) -> np.ndarray:
    """Return the albedo of geoms (n,), on average over the colours."""
    roots = np.array([scene.materials[number].rgba[:3] for number in scene.initial.materials[geoms]])
    return np.maximum((roots**2).mean(axis=1), 1e-3)


def _is_next(others: Occluders, whole: Occluders, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return whether rays from points (n, 3) first meet one of the others, and soon, such as a case behind a seal."""
    far = others.distances(origins, directions)
    return (far < GAP_M) & (far <= whole.distances(origins, directions))


def without_long_gradients(is_shut: np.ndarray, points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return `is_shut` (n,) without the points (n, 3) at an end of a long edge (m, 2) to a point that is not shut.

    Light is blended along edges, so a long edge from a dark point would darken surfaces in plain view, such as the
    front of a machine around its door.
    """
    firsts, lasts = edges.T
    length = np.linalg.norm(points[firsts] - points[lasts], axis=1)
    runs_out = (is_shut[firsts] != is_shut[lasts]) & (length > FADE_M)
    found = is_shut.copy()
    found[edges[runs_out]] = False
    return found


def _distances_along(others: Occluders, origins: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the distances (2k, n) of the others from points (n, 3), along both directions of each axis (k, 3)."""
    ways = [np.broadcast_to(way, origins.shape) for way in (*axes, *-axes)]
    return np.stack([others.distances(origins, way) for way in ways])
