"""Partly open doors and drawers: the gap is visible from close by and easily missed from afar."""

import math
from dataclasses import replace

import numpy as np

from vigil.authoring.solving.evidence import EVIDENCE_PX
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Vec3
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

PARTLY_OPEN = (0.12, 0.25)
"""Least and greatest openness of partly open things; the protocol calls a thing closed below 0.1."""
MIN_GAP_M = 0.04
"""Least distance (m) by which the free edge of a partly open thing has moved."""
SPREAD = 0.05
"""Greatest difference between the openness of a partly open thing and the least visible openness."""
FREE_SHARE = 0.8
"""Least movement of a point that may be evidence, as a share of the farthest; such points are at a door's free edge."""
DRAWERS_AND_DOORS = frozenset(
    {"Cabinet", "ClothesDryer", "Drawer", "Fridge", "Microwave", "Safe", "Stove", "WashingMachine"}
)
"""Categories whose drawer or door can remain partly open, unlike lids, laptops, curtains and books."""
GAP_FROM_M = 2.0
"""Greatest distance (m) from the camera at which a gap is reliably visible."""


def can_be_partly_open(thing: Thing) -> bool:
    """Return whether a thing can be partly open so that it visibly differs from a closed one."""
    return thing.category in DRAWERS_AND_DOORS and _min_partial_openness(thing) + SPREAD <= PARTLY_OPEN[1]


def is_partly_open(openness: float) -> bool:
    """Return whether an openness is that of a partly open thing."""
    return PARTLY_OPEN[0] <= openness <= PARTLY_OPEN[1]


def random_partial_openness(thing: Thing, rng: np.random.Generator) -> float:
    """Return a random openness (hundredths) at which a thing is partly open, little above the least visible one."""
    least = _min_partial_openness(thing)
    return round(float(rng.uniform(least, least + SPREAD)), 2)


def _min_partial_openness(thing: Thing) -> float:
    """Return the least openness (hundredths) at which a partly open thing has a visible gap."""
    return max(PARTLY_OPEN[0], math.ceil(100 * PARTLY_OPEN[0] * MIN_GAP_M / gap_m(thing)) / 100)


def gap_m(thing: Thing) -> float:
    """Return the farthest movement (m) of a point on a thing at openness `PARTLY_OPEN[0]`."""
    return float(np.linalg.norm(_displacements(thing), axis=1).max())


def gap_evidence(thing: Thing, openness: float) -> Evidence:
    """Return the evidence of whether a thing is partly open: the position of its outermost point at an openness."""
    moved = _displacements(thing)
    came_out = surface_points(replace(thing, openness=PARTLY_OPEN[0])) @ moved.sum(axis=0)
    came_out[np.linalg.norm(moved, axis=1) < FREE_SHARE * gap_m(thing)] = -np.inf
    spot = surface_points(replace(thing, openness=openness))[int(came_out.argmax())]
    place = Vec3(*(round(float(value), 3) for value in spot))
    return Evidence(object_id=thing.id, spot=place, within_m=GAP_FROM_M, min_px=EVIDENCE_PX)


def _displacements(thing: Thing) -> np.ndarray:
    """Return the movements (n, 3) in metres of points on a thing's surface at openness `PARTLY_OPEN[0]`."""
    return surface_points(replace(thing, openness=PARTLY_OPEN[0])) - surface_points(replace(thing, openness=0.0))
