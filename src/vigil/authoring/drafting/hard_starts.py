"""Estimates of difficulty before an episode is solved: how hard an object is to name, and how hard a start is.

They are used to draft episodes of the upper levels (`vigil.scoring.levels`): of several starts the hardest is used, and
objects with many look-alikes and long names come first. The level itself is measured later, on the solution.
"""

import math
from collections.abc import Iterable

import numpy as np

from vigil.authoring.language.disambiguation import confusable
from vigil.authoring.language.referring import DescribedThing, phrase_for
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose
from vigil.protocol.actions import REACH_M
from vigil.protocol.goals import OBSERVABLE_PX
from vigil.scene.geometry import body_box, box_distances
from vigil.scene.things import Thing
from vigil.scoring.levels import COSTS, LevelMeasures, index_of

_NO_DIFFICULTY = LevelMeasures(
    path_m=0.0, turns=0, doors=0, rooms=1, look_alikes=0, target_px=0, containers=0, occlusion=0.0, slack=1.0,
    reference_words=0,
)  # fmt: skip
"""Measures of an imaginary episode whose difficulty index is 0."""


def naming_cost(item: DescribedThing, items: Iterable[DescribedThing]) -> float:
    """Return the most that an object's look-alikes and the words of its phrase can add to the difficulty index."""
    every = list(items)
    phrase = phrase_for(item, every)
    words = 0 if phrase is None else len(str(phrase).split()) - 1
    figures = {"look_alikes": len(confusable(item, every)), "reference_words": words}
    measures = _NO_DIFFICULTY.model_copy(update=figures)
    return sum(COSTS[name].of(measures) for name in figures)


def start_cost(view: PrivilegedView, thing: Thing, others: Iterable[str], pose: Pose) -> float:
    """Return the estimated difficulty index of an episode that is about a thing and starts at a pose.

    `others` are the ids of the thing's look-alikes. The walk is the shortest path to a place from which the thing can
    be reached. If there is no such place, the straight line counts as the walk.
    """
    names = [thing.id, *others]
    with view.at_pose(pose):
        states = view.world(names).objects
        seen = view.sees(pose.eye, surface_points(thing), thing.id, through_glass=True)
        walks = view.walks()
    cells = walks.plan.cells
    lengths = walks.lengths[box_distances(body_box(thing), cells) <= REACH_M] if len(cells) else np.empty(0)
    lengths = lengths[np.isfinite(lengths)]
    straight_m = math.dist((pose.position.x, pose.position.z), (thing.position.x, thing.position.z))
    is_elsewhere = view.room_at(pose.position) != view.room_at(thing.position)
    return index_of(
        _NO_DIFFICULTY.model_copy(
            update={
                "path_m": float(lengths.min()) if len(lengths) else straight_m,
                "doors": int(is_elsewhere),
                "look_alikes": sum(states[name].visible_px >= OBSERVABLE_PX for name in names[1:]),
                "target_px": states[thing.id].visible_px,
                "occlusion": 1.0 - float(np.mean(seen)),
            }
        )
    )
