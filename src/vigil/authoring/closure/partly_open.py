"""Doors and drawers that stand ajar: a little open, visible from close by and easily missed from afar."""

import math
from dataclasses import replace

import numpy as np

from vigil.authoring.closure.tasks import EVIDENCE_PX
from vigil.authoring.solving.look_targets import surface_points
from vigil.base.geometry import Vec3
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence

PARTLY_OPEN = (0.12, 0.25)
"""Openness range of "ajar", above the 0.1 below which the protocol calls a thing closed."""
MIN_GAP_M = 0.04
"""The least distance that a part of a thing that stands ajar has moved."""
SPREAD = 0.05
"""How much the openness of a thing that stands ajar may exceed the least visible one."""
FREE_SHARE = 0.8
"""Share of the farthest movement above which a point counts as evidence: such points are at the free edge of a door."""
DRAWERS_AND_DOORS = frozenset(
    {"Cabinet", "ClothesDryer", "Drawer", "Fridge", "Microwave", "Safe", "Stove", "WashingMachine"}
)
"""Things whose drawer or door stays ajar by itself; lids, laptops, curtains and books do not count."""
GAP_FROM_M = 2.0
"""Distance from the camera at which a gap is reliably visible."""


def can_be_partly_open(thing: Thing) -> bool:
    """Return whether a thing can be left ajar so that it visibly differs from a closed one."""
    return thing.category in DRAWERS_AND_DOORS and _min_partial_openness(thing) + SPREAD <= PARTLY_OPEN[1]


def is_partly_open(openness: float) -> bool:
    """Return whether an openness lies in the range in which things are left ajar."""
    return PARTLY_OPEN[0] <= openness <= PARTLY_OPEN[1]


def random_partial_openness(thing: Thing, rng: np.random.Generator) -> float:
    """Return a randomly drawn openness at which a thing stands ajar, little above the least visible one."""
    least = _min_partial_openness(thing)
    return round(float(rng.uniform(least, least + SPREAD)), 2)


def _min_partial_openness(thing: Thing) -> float:
    """Return the least openness, in hundredths, at which a thing stands ajar with a visible gap."""
    return max(PARTLY_OPEN[0], math.ceil(100 * PARTLY_OPEN[0] * MIN_GAP_M / gap_m(thing)) / 100)


def gap_m(thing: Thing) -> float:
    """Return the farthest movement of a thing's moving parts at the least openness of "ajar"."""
    return float(np.linalg.norm(_displacements(thing), axis=1).max())


def gap_evidence(thing: Thing, openness: float) -> Evidence:
    """Return the evidence of whether a thing stands ajar: where its outermost point lies at an openness."""
    moved = _displacements(thing)
    came_out = surface_points(replace(thing, openness=PARTLY_OPEN[0])) @ moved.sum(axis=0)
    came_out[np.linalg.norm(moved, axis=1) < FREE_SHARE * gap_m(thing)] = -np.inf
    spot = surface_points(replace(thing, openness=openness))[int(came_out.argmax())]
    place = Vec3(*(round(float(value), 3) for value in spot))
    return Evidence(object_id=thing.id, spot=place, within_m=GAP_FROM_M, min_px=EVIDENCE_PX)


def _displacements(thing: Thing) -> np.ndarray:
    """Return (n, 3) how far each point of a thing's surface has moved at that openness, in metres."""
    return surface_points(replace(thing, openness=PARTLY_OPEN[0])) - surface_points(replace(thing, openness=0.0))
