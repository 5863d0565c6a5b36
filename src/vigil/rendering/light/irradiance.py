"""The light that reaches points of a scene: from the room around them, through the windows, and from the lamps.

Each ray from a point brings the light of the surface that it meets. The nearer a wall is, the less light it gives, so
corners are dark. Through a window, a ray meets the sky. A lamp is a small disc; all of it, a part of it or nothing of
it is visible from a point.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vigil.rendering.geometry import Geometry
from vigil.rendering.scene import CastRays, RenderState

FAR_M = 100.0
"""Length (m) of a ray that meets nothing."""
DIRECTIONS = 32
"""Number of directions of rays over the whole sphere. A point uses only those in the half that it faces."""
BATCHES = 4
"""Rays are cast in this many parts, one after the other, to limit memory."""
LEAST_FACING = 0.05
"""Least cosine between a point's normal and a direction of rays that the point uses."""
LAMP_RAYS = 4
LIFT_M = 0.012
"""Rays start this far (m) in front of a surface."""
BURIED_M, BURIED_SHARE = 0.03, 0.6
"""A point is buried if more than BURIED_SHARE of its rays are shorter than BURIED_M."""
HALF_M = 0.3
"""A wall at this distance (m) from a point gives half of its light to the point."""
FROM_ABOVE, FROM_SIDES, FROM_BELOW = 1.0, 0.85, 0.75
"""Relative strengths of the light that ceilings, walls and floors reflect."""
SKY, LAWN = (2.65, 2.9, 3.2), (0.95, 1.0, 0.95)
"""Colours of the light through a window: from above the horizon, and from below it."""
AMBIENT, LAMP = 0.33, 1.07
"""Strengths of the light from all around and of the lamps' light. Lamps give more, because a room that is lit evenly
from all sides looks flat."""
ASIDE = np.array([0.6, 0.12, -0.25], np.float32)
"""Vector (3,) whose dot product with a normal adds to a surface's light, so that adjacent walls differ and ceilings are
lit."""
LAMP_ASIDE = np.array([0.1, 0.02, 0.0], np.float32)
"""Vector (3,) whose dot product with a normal adds to a surface's share of a lamp's light, because lamps are not
points."""
LAMP_RADIUS_M = 0.2
FALLOFF = 0.06
WRAP = 0.15
"""A lamp lights a surface if the cosine between the surface's normal and the direction to the lamp is above minus this.

So surfaces that are turned away a little are lit, too, because rooms reflect light.
"""
CEILING, ON_CEILING = 0.9, 0.1
"""A surface counts as a ceiling if the downward component of its normal is above CEILING. ON_CEILING is the greatest
cosine to a lamp that is used for a ceiling."""
LIGHT_REACH_M = 9.0
SPILL_M = 0.5
"""At this distance (m) from a lamp's room, half of the lamp's light remains."""
LEAST_SHARE = 0.02
"""Share of a lamp's light below which the light is not visible."""
BOUNCED_SHARE, OWN_SHARE = 0.35, 0.99
"""Share of a lamp's light that points in shadow still get if they are in the lamp's room, and share of light above
which a point counts as in that room.

Darker shadows of things outside the picture would look like patches without a cause.
"""
_SHORT_M = 1e-3
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


class Occluders:
    """Triangles that block light."""

    def __init__(self, cast: CastRays) -> None:
        self._cast = cast

    def distances(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the length (n,) in metres of rays from `origins` (n, 3) along unit directions; `FAR_M` for a miss."""
        if not len(origins):
            return np.zeros(0, np.float32)
        met = self._cast(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32))
        return np.minimum(met, np.float32(FAR_M))

    def are_blocked(self, origins: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return a mask (k, n) of the lines that are blocked. The lines run from n origins (n, 3) to k ends (k, 3)."""
        way = (ends[:, None] - origins).reshape(-1, 3)
        length = np.sqrt(np.einsum("ij,ij->i", way, way))
        far = self.distances(np.tile(origins, (len(ends), 1)), way / length[:, None])
        return (far < length - _SHORT_M).reshape(len(ends), len(origins))


def occluders_of(geometry: Geometry, state: RenderState, geoms: np.ndarray) -> Occluders:
    """Return the triangles of geoms in the poses of a state."""
    vertices = np.concatenate([geometry.world(state, geom)[0] for geom in geoms])
    counts = [geometry.vertex_slices[geom].stop - geometry.vertex_slices[geom].start for geom in geoms]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    faces = [
        geometry.faces[geometry.face_slices[geom]] - geometry.vertex_slices[geom].start + start
        for geom, start in zip(geoms, starts, strict=True)
    ]
    return Occluders(geometry.scene.caster(vertices, np.concatenate(faces)))


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Points on surfaces at which light is computed."""

    points: np.ndarray
    """Positions (n, 3) float32 in metres."""
    normals: np.ndarray
    """Unit normals (n, 3) float32."""

    def part(self, chosen: slice) -> "Samples":
        """Return the samples in a slice."""
        return Samples(self.points[chosen], self.normals[chosen])

    @property
    def origins(self) -> np.ndarray:
        """Points (n, 3) at which rays start."""
        return self.points + np.float32(LIFT_M) * self.normals


def ambient(scene: Occluders, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Return the light (n, 3) float32 from all around, without lamps, and a mask (n,) of the buried samples.

    A sample is buried if it is inside another object that its own object overlaps.
    """
    total = np.zeros((3, len(samples.points)), np.float32)
    weights, stopped = np.zeros((2, len(samples.points)), np.float32)
    for directions in np.split(_sphere(), BATCHES):
        faced = [_along(samples.normals, way) for way in directions]
        for share in faced:
            share[share <= LEAST_FACING] = 0.0
        for way, share, far in zip(
            directions, faced, _distances(scene, samples.origins, directions, faced), strict=True
        ):
            _add_brought(total, share, far, float(way[2]))
            weights += share
            stopped += share * (far < BURIED_M)
    weights = np.maximum(weights, 1e-6)
    return np.ascontiguousarray((total * (AMBIENT / weights)).T), stopped > BURIED_SHARE * weights


def _distances(
    scene: Occluders, origins: np.ndarray, directions: np.ndarray, shares: list[np.ndarray]
) -> Iterator[np.ndarray]:
    """Yield, for each direction, the distance (n,) from each point to what its ray hits.

    The distance is 0 for points on which light from the direction does not fall (`shares` is 0).
    """
    chosen = [np.flatnonzero(share) for share in shares]
    counts = [len(each) for each in chosen]
    met = scene.distances(origins[np.concatenate(chosen)], np.repeat(directions, counts, axis=0))
    for each, found in zip(chosen, np.split(met, np.cumsum(counts[:-1])), strict=True):
        far = np.zeros(len(origins), np.float32)
        far[each] = found
        yield far


def ambient_facing_shares(samples: Samples) -> np.ndarray:
    """Return factors (n,) float32 for the light from all around; they depend on the directions of the normals."""
    return 1.0 + _along(samples.normals, ASIDE)


def _along(normals: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the dot product (n,) of each normal (n, 3) with a direction (3,).

    No matrix product is used, because its last digit would depend on the number of normals.
    """
    return normals[:, 0] * way[0] + normals[:, 1] * way[1] + normals[:, 2] * way[2]


def _sphere() -> np.ndarray:
    """Return unit directions (n, 3) that are spread evenly over the sphere."""
    number = np.arange(DIRECTIONS)
    up = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    across = np.sqrt(1.0 - up * up)
    return np.stack([across * np.cos(number * _GOLDEN), across * np.sin(number * _GOLDEN), up], 1).astype(np.float32)


def _add_brought(total: np.ndarray, share: np.ndarray, far: np.ndarray, up: float) -> None:
    """Add to `total` (3, n) the light that the rays of one direction bring.

    `share` (n,) are the rays' weights, `far` (n,) their lengths, and `up` is the direction's upward component.
    """
    room = FROM_SIDES + up * (FROM_ABOVE - FROM_SIDES) if up > 0 else FROM_SIDES - up * (FROM_BELOW - FROM_SIDES)
    brought = share * (np.float32(room) * far / (far + np.float32(HALF_M)))
    outside = np.flatnonzero(far >= FAR_M)
    for light, colour in zip(total, SKY if up > 0 else LAWN, strict=True):
        brought[outside] = share[outside] * np.float32(colour)
        light += brought


def from_lamp(scene: Occluders, lamp: np.ndarray, samples: Samples, shares: np.ndarray) -> np.ndarray:
    """Return the light (n,) float32 that a lamp of strength 1 sends to the points, ignoring the points' normals.

    The light is multiplied by `shares` (n,), and is 0 where the share is too small to be visible.
    """
    far, cosines = _distances_and_cosines(lamp, samples)
    total = np.zeros(len(far), np.float32)
    reached = np.flatnonzero((cosines > -WRAP) & (far < LIGHT_REACH_M) & (shares > LEAST_SHARE))
    seen = np.count_nonzero(~scene.are_blocked(samples.origins[reached], _disc_about(lamp)), axis=0)
    least = BOUNCED_SHARE * (shares[reached] > OWN_SHARE)
    came = least + (1.0 - least) * seen / LAMP_RAYS
    total[reached] = LAMP * shares[reached] * came / (1.0 + FALLOFF * far[reached] ** 2)
    return total


def _disc_about(lamp: np.ndarray) -> np.ndarray:
    """Return the points (n, 3) float32 of a lamp's disc to which rays are cast."""
    number = np.arange(LAMP_RAYS)
    radius, angle = LAMP_RADIUS_M * np.sqrt((number + 0.5) / LAMP_RAYS), number * _GOLDEN
    disc = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(LAMP_RAYS)], axis=1)
    return (lamp + disc).astype(np.float32)


def spill_shares(outside: np.ndarray) -> np.ndarray:
    """Return the share of a lamp's light that remains at distances (m) `outside` the lamp's room; 1 inside the room.

    Without this loss, light through a doorway would make a bright patch on a wall far from any visible lamp.
    """
    return (1.0 / (1.0 + (outside / SPILL_M) ** 2)).astype(np.float32)


def lamp_facing_shares(lamp: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the share (n,) float32 of a lamp's light that each point gets, depending on the angle to its normal.

    Ceilings are lit evenly; otherwise there would be a bright spot above a lamp.
    """
    cosines = _distances_and_cosines(lamp, samples)[1]
    cosines = np.where(samples.normals[:, 2] < -CEILING, np.minimum(cosines, ON_CEILING), cosines)
    return np.maximum(cosines + WRAP, 0.0) / (1.0 + WRAP) * (1.0 + _along(samples.normals, LAMP_ASIDE))


def _distances_and_cosines(lamp: np.ndarray, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Return each point's distance (n,) to a lamp, and the cosine (n,) between its normal and the lamp's direction."""
    way = lamp.astype(np.float32) - samples.points
    far = np.sqrt(np.einsum("ij,ij->i", way, way))
    return far, np.einsum("ij,ij->i", way, samples.normals) / np.maximum(far, 1e-6)
