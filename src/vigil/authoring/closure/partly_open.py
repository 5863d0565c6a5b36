"""Leaves and drawers that stand ajar: a little open, which is plain from near by and easily missed from afar."""

import math
from dataclasses import replace

import numpy as np

from vigil.authoring.closure.tasks import EVIDENCE_PX
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Vec3
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

PARTLY_OPEN = (0.12, 0.25)
"""Openness of what stands ajar: over the 0.1 below which the protocol calls it closed."""
MIN_GAP_M = 0.04
"""How far a part of what stands ajar has moved at least."""
SPREAD = 0.05
"""How much farther open than it must be, at most, what stands ajar is."""
FREE_SHARE = 0.8
"""Points that move at least so far, as a share of the farthest, are looked at: those at the free edge of a leaf."""
DRAWERS_AND_DOORS = frozenset(
    {"Cabinet", "ClothesDryer", "Drawer", "Fridge", "Microwave", "Safe", "Stove", "WashingMachine"}
)
"""What has a drawer or door that stays ajar by itself; nobody counts lids, laptops, curtains or books among them."""
GAP_FROM_M = 2.0
"""How far from the camera a gap is sure to be told."""


def can_be_partly_open(thing: Thing) -> bool:
    """Whether a thing can be left ajar so that it is told from a closed one."""
    return thing.category in DRAWERS_AND_DOORS and _min_partial_openness(thing) + SPREAD <= PARTLY_OPEN[1]


def is_partly_open(openness: float) -> bool:
    """Whether an openness is one of those that things are left ajar at."""
    return PARTLY_OPEN[0] <= openness <= PARTLY_OPEN[1]


def random_partial_openness(thing: Thing, rng: np.random.Generator) -> float:
    """Return a drawn openness at which a thing stands ajar, little more than can be told."""
    least = _min_partial_openness(thing)
    return round(float(rng.uniform(least, least + SPREAD)), 2)


def _min_partial_openness(thing: Thing) -> float:
    """Return the least openness at which a thing stands ajar and has a gap that can be told, in hundredths."""
    return max(PARTLY_OPEN[0], math.ceil(100 * PARTLY_OPEN[0] * MIN_GAP_M / gap_m(thing)) / 100)


def gap_m(thing: Thing) -> float:
    """Return how far the moving parts of a thing go at most at the least openness of what stands ajar."""
    return float(np.linalg.norm(_displacements(thing), axis=1).max())


def gap_evidence(thing: Thing, openness: float) -> Evidence:
    """Return the evidence of whether a thing stands ajar: where the point that comes out farthest lies at an
    openness."""
    moved = _displacements(thing)
    came_out = surface_points(replace(thing, openness=PARTLY_OPEN[0])) @ moved.sum(axis=0)
    came_out[np.linalg.norm(moved, axis=1) < FREE_SHARE * gap_m(thing)] = -np.inf
    spot = surface_points(replace(thing, openness=openness))[int(came_out.argmax())]
    place = Vec3(*(round(float(value), 3) for value in spot))
    return Evidence(object_id=thing.id, spot=place, within_m=GAP_FROM_M, least_px=EVIDENCE_PX)


def _displacements(thing: Thing) -> np.ndarray:
    """Return (n, 3) how far each point of a thing's surface has moved at that openness, m."""
    return surface_points(replace(thing, openness=PARTLY_OPEN[0])) - surface_points(replace(thing, openness=0.0))
