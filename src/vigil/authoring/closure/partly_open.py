"""Partly open doors and drawers. Their gap is visible from close by but easily missed from afar."""

import math
from dataclasses import replace

import numpy as np

from vigil.authoring.closure.tasks import EVIDENCE_PX
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Vec3
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

PARTLY_OPEN = (0.12, 0.25)
"""Minimum and maximum openness of partly open things. In the protocol, a thing counts as closed below 0.1."""
MIN_GAP_M = 0.04
"""Minimum distance (m) by which the free edge of a partly open thing has moved from its closed position."""
SPREAD = 0.05
"""Greatest amount by which a random openness exceeds the smallest openness at which the gap is visible."""
FREE_SHARE = 0.8
"""Minimum movement of a point that may serve as evidence, as a share of the largest movement of any point. At a door,
these points are at its free edge."""
DRAWERS_AND_DOORS = frozenset(
    {"Cabinet", "ClothesDryer", "Drawer", "Fridge", "Microwave", "Safe", "Stove", "WashingMachine"}
)
"""Categories whose drawer or door can be partly open, unlike lids, laptops, curtains and books."""
GAP_FROM_M = 2.0
"""Maximum distance (m) from the camera at which a gap is reliably visible."""


def can_be_partly_open(thing: Thing) -> bool:
    """Return whether a thing, when it is partly open, visibly differs from a closed thing."""
    return thing.category in DRAWERS_AND_DOORS and _min_partial_openness(thing) + SPREAD <= PARTLY_OPEN[1]


def is_partly_open(openness: float) -> bool:
    """Return whether a thing with this openness counts as partly open."""
    return PARTLY_OPEN[0] <= openness <= PARTLY_OPEN[1]


def random_partial_openness(thing: Thing, rng: np.random.Generator) -> float:
    """Return a random openness (in hundredths), slightly above the smallest at which the thing's gap is visible."""
    least = _min_partial_openness(thing)
    return round(float(rng.uniform(least, least + SPREAD)), 2)


def _min_partial_openness(thing: Thing) -> float:
    """Return the smallest openness (in hundredths) at which a partly open thing has a visible gap."""
    return max(PARTLY_OPEN[0], math.ceil(100 * PARTLY_OPEN[0] * MIN_GAP_M / gap_m(thing)) / 100)


def gap_m(thing: Thing) -> float:
    """Return the largest movement (m) of any point of a thing when it opens from 0 to `PARTLY_OPEN[0]`."""
    return float(np.linalg.norm(_displacements(thing), axis=1).max())


def gap_evidence(thing: Thing, openness: float) -> Evidence:
    """Return the evidence of whether a thing is partly open: where its outermost point is at this openness."""
    moved = _displacements(thing)
    came_out = surface_points(replace(thing, openness=PARTLY_OPEN[0])) @ moved.sum(axis=0)
    came_out[np.linalg.norm(moved, axis=1) < FREE_SHARE * gap_m(thing)] = -np.inf
    spot = surface_points(replace(thing, openness=openness))[int(came_out.argmax())]
    place = Vec3(*(round(float(value), 3) for value in spot))
    return Evidence(object_id=thing.id, spot=place, within_m=GAP_FROM_M, min_px=EVIDENCE_PX)


def _displacements(thing: Thing) -> np.ndarray:
    """Return the movements (n, 3) in metres of points on a thing's surface when it opens from 0 to `PARTLY_OPEN[0]`."""
    return surface_points(replace(thing, openness=PARTLY_OPEN[0])) - surface_points(replace(thing, openness=0.0))
