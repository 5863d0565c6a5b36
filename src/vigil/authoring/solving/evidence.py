"""Evidence: what an agent must see of a thing to know a fact about it, and viewpoints that show it clearly.

Partly open doors and drawers are here, too: their gap is visible from close by and easily missed from afar.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from vigil.assets.notice import notice_centre, notice_parts
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.macro_actions import Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.viewpoints import Viewpoint, ViewpointQuery, viewpoints
from vigil.base.geometry import EYE_HEIGHT_M, Pose, Vec3
from vigil.protocol.goals import is_observable, is_state_observable
from vigil.protocol.world import StateQuery
from vigil.scene.geometry import body_box, box_distances, place_of
from vigil.scene.supports import level_surfaces
from vigil.scene.things import Thing
from vigil.scoring.closure import Evidence, is_in_picture

EVIDENCE_PX = 300
"""Minimum visible pixels at which an agent clearly sees the state of a thing, or sees that the thing blocks a door."""
EVIDENCE_MARGIN_PX = 20
"""Number of visible pixels beyond the minimum that a view must show when views are searched for."""
EVIDENCE_DISTANCE_M = (0.5, 4.0)
"""Minimum and maximum distance (m) between a thing and the places from which its evidence may be viewed."""
FAR_COST = 4.0
"""Cost, as a length of walk (m), of each metre between a view and the thing, if views from close by are preferred."""
CLEAR_STATE_PX, STATE_WITHIN_M = 200, 3.5
"""Minimum pixels that clearly show a state, and maximum distance (m) between the thing and the views that are tried."""
MAX_LOOKS = 80
"""Greatest number of views tried for evidence."""
NOTICE_READABLE_M = 2.0
"""Greatest distance (m) from the camera at which a notice can be read."""
BELOW_EYES_M = 0.2
"""Least height (m) of the eyes above a surface that can be seen from above."""
SPOT_SHARES, SPOT_ABOVE_M = (-0.3, 0.3), 0.002
"""Offsets from a surface's middle (shares of its size), and height (m) above it, of points that serve as evidence."""
PARTLY_OPEN = (0.12, 0.25)
"""Least and greatest openness of partly open things; the protocol calls a thing closed below 0.1."""
MIN_GAP_M = 0.04
"""Minimum distance (m) by which the free edge of a partly open thing must have moved."""
SPREAD = 0.05
"""Greatest amount by which the openness of a partly open thing exceeds the least openness with a visible gap."""
FREE_SHARE = 0.8
"""Points that are evidence move at least this share of the largest movement, so they are at a door's free edge."""
DRAWERS_AND_DOORS = frozenset(
    {"Cabinet", "ClothesDryer", "Drawer", "Fridge", "Microwave", "Safe", "Stove", "WashingMachine"}
)
"""Categories whose drawer or door can remain partly open, unlike lids, laptops, curtains and books."""
GAP_FROM_M = 2.0
"""Greatest distance (m) from the camera at which a gap is reliably visible."""


def object_evidence(thing_id: str) -> Evidence:
    """Return the evidence that consists in clearly seeing a thing."""
    return Evidence(object_id=thing_id, min_px=EVIDENCE_PX)


def notice_evidence(machine: Thing) -> Evidence | None:
    """Return the evidence that a machine is out of order; None if a notice cannot hang on it."""
    spot = notice_centre(machine.asset) if notice_parts(machine.asset) else None
    if spot is None:
        return None
    middle = place_of(machine)(np.array(spot)[None])[0]
    place = Vec3(*(round(float(value), 3) for value in middle))
    return Evidence(object_id=machine.id, spot=place, within_m=NOTICE_READABLE_M)


def surface_evidence(support: Thing, surface_name: str | None) -> tuple[Evidence, ...]:
    """Return the evidence of what lies on a surface: points spread over it; empty if it cannot be seen from above."""
    for surface, frame in level_surfaces(support):
        if surface.name == surface_name:
            shares = [(x * surface.size_x, SPOT_ABOVE_M, z * surface.size_z) for x in SPOT_SHARES for z in SPOT_SHARES]
            found = [Vec3(*(round(float(value), 3) for value in point)) for point in frame(np.array(shares))]
            is_low = all(spot.y <= EYE_HEIGHT_M - BELOW_EYES_M for spot in found)
            if is_low and not surface.needs_opening:
                return tuple(Evidence(object_id=support.id, spot=spot) for spot in found)
    return ()


def viewpoint_showing(view: PrivilegedView, evidence: Sequence[Evidence], far_cost: float = 0.0) -> Viewpoint:
    """Return the nearest viewpoint that clearly shows all evidence at once.

    If `far_cost` is set, views from close by are preferred: it is the cost, as a length of walk (m), of each metre
    between the viewpoint and the thing. Raises Unsolvable if no viewpoint is found.
    """
    thing = view.scene.things[evidence[0].object_id]
    spots = [each.spot for each in evidence if each.object_id == thing.id and each.spot is not None]
    points = np.array(spots) if spots else surface_points(thing)
    most_m = min(EVIDENCE_DISTANCE_M[1], *(each.within_m for each in evidence))
    query = _query(thing, points, most_m, far_cost)
    found = _viewpoint_where(view, query, lambda pose: shows_all(view, pose, evidence))
    if found is None:
        raise Unsolvable("There is no reachable place from which all evidence is seen at once.")
    return found


def viewpoint_showing_state(view: PrivilegedView, thing_id: str, query: StateQuery) -> Viewpoint:
    """Return a near viewpoint that clearly shows a thing's state. Raises Unsolvable if there is none."""
    thing = view.scene.things[thing_id]

    def shows(pose: Pose) -> bool:
        with view.at_pose(pose):
            state = view.state_of(thing_id)
        return state.visible and state.state_px(query) >= CLEAR_STATE_PX and is_state_observable(state, query)

    found = _viewpoint_where(view, _query(thing, surface_points(thing), STATE_WITHIN_M, FAR_COST), shows)
    if found is None:
        raise Unsolvable(f"There is no reachable place from which the state of {thing_id!r} is clearly seen.")
    return found


def _query(thing: Thing, points: np.ndarray, most_m: float, far_cost: float) -> ViewpointQuery:
    """Return the query for viewpoints that show points (n, 3) of a thing from at most `most_m` metres."""
    box = body_box(thing)

    def near(places: np.ndarray) -> np.ndarray:
        away = box_distances(box, places)
        return np.where((away >= EVIDENCE_DISTANCE_M[0]) & (away <= most_m), far_cost * away, np.inf)

    return ViewpointQuery(thing.id, points, near, may_tilt=True, least_seen=1, through_glass=True)


def _viewpoint_where(view: PrivilegedView, query: ViewpointQuery, is_good: Callable[[Pose], bool]) -> Viewpoint | None:
    """Return the first good viewpoint of a query; None if none is good."""
    tried = islice(viewpoints(view, view.walks(), query), MAX_LOOKS)
    return next((viewpoint for viewpoint in tried if is_good(viewpoint.pose)), None)


def shows_all(view: PrivilegedView, pose: Pose, evidence: Sequence[Evidence]) -> bool:
    """Return whether all evidence is clearly seen from a pose."""
    with view.at_pose(pose):
        states = view.world({each.object_id for each in evidence}).objects
    clear = [
        is_observable(states[each.object_id]) and states[each.object_id].visible_px >= each.min_px + EVIDENCE_MARGIN_PX
        for each in evidence
    ]
    places = [(each.spot, each.within_m) for each in evidence if each.spot is not None]
    return all(clear) and all(is_in_picture(pose, *place) for place in places)


def can_be_partly_open(thing: Thing) -> bool:
    """Return whether a thing can be partly open so that it visibly differs from a closed thing."""
    return thing.category in DRAWERS_AND_DOORS and _min_partial_openness(thing) + SPREAD <= PARTLY_OPEN[1]


def is_partly_open(openness: float) -> bool:
    """Return whether an openness is that of a partly open thing."""
    return PARTLY_OPEN[0] <= openness <= PARTLY_OPEN[1]


def random_partial_openness(thing: Thing, rng: np.random.Generator) -> float:
    """Return a random openness, in whole hundredths, at which a thing is partly open and its gap is just visible."""
    least = _min_partial_openness(thing)
    return round(float(rng.uniform(least, least + SPREAD)), 2)


def _min_partial_openness(thing: Thing) -> float:
    """Return the smallest openness, in whole hundredths, at which a partly open thing has a visible gap."""
    return max(PARTLY_OPEN[0], math.ceil(100 * PARTLY_OPEN[0] * MIN_GAP_M / opening_gap_m(thing)) / 100)


def opening_gap_m(thing: Thing) -> float:
    """Return the farthest movement (m) of a point on a thing at openness `PARTLY_OPEN[0]`."""
    return float(np.linalg.norm(_displacements(thing), axis=1).max())


def gap_evidence(thing: Thing, openness: float) -> Evidence:
    """Return the evidence of whether a thing is partly open: the position of its outermost point at an openness."""
    moved = _displacements(thing)
    came_out = surface_points(replace(thing, openness=PARTLY_OPEN[0])) @ moved.sum(axis=0)
    came_out[np.linalg.norm(moved, axis=1) < FREE_SHARE * opening_gap_m(thing)] = -np.inf
    spot = surface_points(replace(thing, openness=openness))[int(came_out.argmax())]
    place = Vec3(*(round(float(value), 3) for value in spot))
    return Evidence(object_id=thing.id, spot=place, within_m=GAP_FROM_M, min_px=EVIDENCE_PX)


def _displacements(thing: Thing) -> np.ndarray:
    """Return the movements (n, 3) in metres of points on a thing's surface at openness `PARTLY_OPEN[0]`."""
    return surface_points(replace(thing, openness=PARTLY_OPEN[0])) - surface_points(replace(thing, openness=0.0))
