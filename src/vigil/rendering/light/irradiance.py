"""The light that falls on points of a scene: from the room around them, through the windows, and from the lamps.

Each ray from a point brings the light of what it meets: a wall, dimmer the nearer it is (corners get little light), or
the sky, through a window. Lamps are small discs, visible from a point entirely, in part or not at all.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vigil.rendering.light.occluders import FAR_M, Occluders

DIRECTIONS = 32
"""Number of directions over the whole sphere; a point uses the half that it faces."""
BATCHES = 4
"""Number of parts of the directions that are cast in turn, to limit memory."""
LEAST_FACING = 0.05
"""Least cosine between a normal and a direction that it faces."""
LAMP_RAYS = 4
LIFT_M = 0.012
"""Distance (m) from the surface at which rays start."""
BURIED_M, BURIED_SHARE = 0.03, 0.6
"""A point counts as buried if more than BURIED_SHARE of its rays are shorter than BURIED_M."""
HALF_M = 0.3
"""Distance (m) at which a wall reflects half of its light to a point."""
FROM_ABOVE, FROM_SIDES, FROM_BELOW = 1.0, 0.85, 0.75
"""Light reflected by ceilings, walls and floors."""
SKY, LAWN = (2.65, 2.9, 3.2), (0.95, 1.0, 0.95)
"""Light through a window from above and from below the horizon."""
AMBIENT, LAMP = 0.33, 1.07
"""Strengths of the light from all around and of the lamp. The lamp gives most light, because a room lit evenly from
all sides looks flat."""
ASIDE = np.array([0.6, 0.12, -0.25], np.float32)
"""Additional light by direction. It makes walls that meet look different, and lights ceilings from the floor."""
LAMP_ASIDE = np.array([0.1, 0.02, 0.0], np.float32)
"""Additional light of lamps by direction, since lamps are not points."""
LAMP_RADIUS_M = 0.2
FALLOFF = 0.06
WRAP = 0.15
"""How far a surface may turn away from a lamp and still be lit, since rooms reflect light."""
CEILING, ON_CEILING = 0.9, 0.1
"""Least downward part of a ceiling's normal; greatest cosine to a lamp with which ceilings are lit."""
REACH_M = 9.0
SPILL_M = 0.5
"""Distance from the room of a lamp at which half of its light is left."""
LEAST_SHARE = 0.02
"""Least share of a lamp's light that is visible."""
BOUNCED_SHARE, OWN_SHARE = 0.35, 0.99
"""Share of a lamp's light that its room reflects into shadows; least share of it in that room. A darker shadow of
something outside the picture would look like a patch without a cause.
"""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Points on surfaces."""

    points: np.ndarray
    """(n, 3) float32 metres."""
    normals: np.ndarray
    """(n, 3) float32, unit."""

    def part(self, chosen: slice) -> "Samples":
        """Return some of the points."""
        return Samples(self.points[chosen], self.normals[chosen])

    @property
    def origins(self) -> np.ndarray:
        """Points (n, 3) at which rays start."""
        return self.points + np.float32(LIFT_M) * self.normals


def ambient(scene: Occluders, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Return the light (n, 3) float32 from all around, without lamps, and which samples are buried (n,).

    A buried sample lies inside another object, because its object reaches into the other one.
    """
    total = np.zeros((3, len(samples.points)), np.float32)
    weights, stopped = np.zeros((2, len(samples.points)), np.float32)
    for ways in np.split(_sphere(), BATCHES):
        faced = [_along(samples.normals, way) for way in ways]
        for share in faced:
            share[share <= LEAST_FACING] = 0.0
        for way, share, far in zip(ways, faced, _distances(scene, samples.origins, ways, faced), strict=True):
            _add_brought(total, share, far, float(way[2]))
            weights += share
            stopped += share * (far < BURIED_M)
    weights = np.maximum(weights, 1e-6)
    return np.ascontiguousarray((total * (AMBIENT / weights)).T), stopped > BURIED_SHARE * weights


def _distances(
    scene: Occluders, origins: np.ndarray, ways: np.ndarray, shares: list[np.ndarray]
) -> Iterator[np.ndarray]:
    """Yield for each direction (k, 3) the length of rays from the points (n, 3) with a share; 0 for other points."""
    chosen = [np.flatnonzero(share) for share in shares]
    counts = [len(each) for each in chosen]
    met = scene.distances(origins[np.concatenate(chosen)], np.repeat(ways, counts, axis=0))
    for each, found in zip(chosen, np.split(met, np.cumsum(counts[:-1])), strict=True):
        far = np.zeros(len(origins), np.float32)
        far[each] = found
        yield far


def ambient_facing_shares(samples: Samples) -> np.ndarray:
    """Return the factors (n,) float32 of the light from all around by the direction that the points face."""
    return 1.0 + _along(samples.normals, ASIDE)


def _along(normals: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the product (n,) of each normal (n, 3) with a direction (3,).

    A matrix product is not used, because its last digit would depend on the number of normals.
    """
    return normals[:, 0] * way[0] + normals[:, 1] * way[1] + normals[:, 2] * way[2]


def _sphere() -> np.ndarray:
    """Return unit directions (n, 3), spread evenly over the sphere."""
    number = np.arange(DIRECTIONS)
    up = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    across = np.sqrt(1.0 - up * up)
    return np.stack([across * np.cos(number * _GOLDEN), across * np.sin(number * _GOLDEN), up], 1).astype(np.float32)


def _add_brought(total: np.ndarray, share: np.ndarray, far: np.ndarray, up: float) -> None:
    """Add to the light (3, n) that of rays of lengths `far` (n,) whose direction has the vertical part `up`."""
    room = FROM_SIDES + up * (FROM_ABOVE - FROM_SIDES) if up > 0 else FROM_SIDES - up * (FROM_BELOW - FROM_SIDES)
    brought = share * (np.float32(room) * far / (far + np.float32(HALF_M)))
    outside = np.flatnonzero(far >= FAR_M)
    for light, colour in zip(total, SKY if up > 0 else LAWN, strict=True):
        brought[outside] = share[outside] * np.float32(colour)
        light += brought


def from_lamp(scene: Occluders, lamp: np.ndarray, samples: Samples, shares: np.ndarray) -> np.ndarray:
    """Return the light (n,) float32 at the points from a lamp of strength 1, whichever way the points face.

    It is multiplied by `shares` (n,), and is 0 where the share is not visible.
    """
    far, cosines = _distances_and_cosines(lamp, samples)
    total = np.zeros(len(far), np.float32)
    reached = np.flatnonzero((cosines > -WRAP) & (far < REACH_M) & (shares > LEAST_SHARE))
    seen = np.count_nonzero(~scene.are_blocked(samples.origins[reached], _disc_about(lamp)), axis=0)
    least = BOUNCED_SHARE * (shares[reached] > OWN_SHARE)
    came = least + (1.0 - least) * seen / LAMP_RAYS
    total[reached] = LAMP * shares[reached] * came / (1.0 + FALLOFF * far[reached] ** 2)
    return total


def _disc_about(lamp: np.ndarray) -> np.ndarray:
    """Return the points (n, 3) float32 of a lamp at which rays are aimed."""
    number = np.arange(LAMP_RAYS)
    radius, angle = LAMP_RADIUS_M * np.sqrt((number + 0.5) / LAMP_RAYS), number * _GOLDEN
    disc = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(LAMP_RAYS)], axis=1)
    return (lamp + disc).astype(np.float32)


def spill_shares(outside: np.ndarray) -> np.ndarray:
    """Return the share of a lamp's light at distances (metres) outside its room; 1 inside.

    Otherwise light through a doorway would be a bright patch on a wall far from any lamp in view.
    """
    return (1.0 / (1.0 + (outside / SPILL_M) ** 2)).astype(np.float32)


def lamp_facing_shares(lamp: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the share (n,) float32 of a lamp's light that the points receive by how far they turn from it.

    Ceilings are lit evenly; otherwise there would be a spot above a lamp.
    """
    cosines = _distances_and_cosines(lamp, samples)[1]
    cosines = np.where(samples.normals[:, 2] < -CEILING, np.minimum(cosines, ON_CEILING), cosines)
    return np.maximum(cosines + WRAP, 0.0) / (1.0 + WRAP) * (1.0 + _along(samples.normals, LAMP_ASIDE))


def _distances_and_cosines(lamp: np.ndarray, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance (n,) of a lamp from the points, and the cosine between its direction and their normals."""
    way = lamp.astype(np.float32) - samples.points
    far = np.sqrt(np.einsum("ij,ij->i", way, way))
    return far, np.einsum("ij,ij->i", way, samples.normals) / np.maximum(far, 1e-6)
