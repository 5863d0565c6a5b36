"""Robustness rules: small motor errors do not matter, and the start has free floor and shows more than a wall.

They are checked only on request, because they take seconds per episode. The motor errors are those of
`vigil.authoring.solving.noisy_actions`.
"""

import math
from collections.abc import Iterator
from itertools import islice

import numpy as np
import shapely

from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.macro_actions import Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.solvers import solve_noisily
from vigil.base.geometry import heading
from vigil.env import Env
from vigil.protocol.actions import Report
from vigil.protocol.episode import Episode
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.records.record import EpisodeRecord
from vigil.scene.floor import ROOM_TO_MOVE_M, has_room_to_move
from vigil.scene.outlines import wall_shapes
from vigil.scoring.outcomes import score

TRIES, NEEDED_SUCCESSES = 10, 9
LATTICE = (32, 24)
"""Number of pixels, across and down, at which the first frame is sampled."""
MIN_SHARE = 0.01
"""Minimum share of the first frame that things must fill if the frame does not show two walls."""
COLUMNS, FARTHEST_M, SAME_WALL_M = 33, 30.0, 0.05
"""Number of rays cast to find walls, their length (m), and the step (m) to which the offset of a wall is rounded."""

ROBUST_RULES = {
    "room_at_start": "0.4 m of floor are free ahead or to a side of the start",
    "more_than_a_wall": "the first frame shows something other than one flat wall",
    "robust": "in at least 9 of 10 tries, the noisy solver completes the episode and reports it within the budget",
}
"""Rule name -> reason, in the order in which they are checked."""


def robust_faults(case: EpisodeStart, env: Env) -> Iterator[tuple[str, str]]:
    """Yield (rule, message) for each of ROBUST_RULES that an episode breaks. The simulator may be left in any state."""
    view, start = case.view, case.episode.start
    if not has_room_to_move(view.plan().tight, start):
        yield (
            "room_at_start",
            f"there are not {ROOM_TO_MOVE_M} m of free floor ahead, left or right of the start (heading "
            f"{start.rotation})",
        )
    if shows_one_wall(case):
        yield "more_than_a_wall", "the first frame shows one wall and almost nothing else"
    fault = _fault_of_tries(case.episode, view, env)
    if fault is not None:
        yield "robust", fault


def shows_one_wall(case: EpisodeStart) -> bool:
    """Return whether the first frame shows at most one flat wall and almost nothing else."""
    return not _shows_things(case.view) and len(_walls_ahead(case)) < 2


def noisy_try(episode: Episode, view: PrivilegedView, env: Env, number: int) -> EpisodeRecord:
    """Return the record of one play by the noisy solver. If the solver finds no way to continue, it reports `fail`.

    `number` is the seed of the motor errors.
    """
    actions = solve_noisily(episode, view, number)
    observation = env.reset(episode)
    while observation is not None:
        try:
            action = next(actions)
        except Unsolvable as error:
            action = Report(status="fail", summary=str(error))
        observation = env.step(primitive_actions.reply_of(action))
    return env.record()


def _fault_of_tries(episode: Episode, view: PrivilegedView, env: Env) -> str | None:
    """Return a message about the failed tries of the noisy solver; None if enough tries succeed (B).

    No further tries are made once the result is certain.
    """
    failed: list[str] = []
    for number in range(TRIES):
        if number - len(failed) >= NEEDED_SUCCESSES:
            break
        record = noisy_try(episode, view, env, number)
        outcome = score(episode, record)
        if not outcome.B:
            failed.append(f"try {number}: {outcome.label}, W={outcome.W:d} after {len(record.steps)} steps")
        if len(failed) > TRIES - NEEDED_SUCCESSES:
            limit = TRIES - NEEDED_SUCCESSES
            return (
                f"{len(failed)} of the first {number + 1} tries fail; at most {limit} of {TRIES} may fail "
                f"({'; '.join(failed)})"
            )
    return None


def _shows_things(view: PrivilegedView) -> bool:
    """Return whether things (including doors and windows) fill at least `MIN_SHARE` of the frame."""
    across, down = ((np.arange(count) + 0.5) / count for count in LATTICE)
    pixels = [(int(x * FRAME_WIDTH), int(y * FRAME_HEIGHT)) for y in down for x in across]
    hits = (pixel for pixel in pixels if view.object_at(pixel) is not None)
    enough = math.ceil(MIN_SHARE * len(pixels))
    return sum(1 for _ in islice(hits, enough)) == enough


def _walls_ahead(case: EpisodeStart) -> set[tuple[float, float, float]]:
    """Return the planes of the walls that rays in some directions hit first. A plane is the x and z of its normal and
    its offset (m), all rounded.

    The directions cover the width of the first frame.
    """
    start = case.episode.start
    panels = [panel for panel in case.view.scene.panels if wall_shapes(panel)]
    shapes = [shapely.unary_union(wall_shapes(panel)) for panel in panels]
    here = shapely.Point(start.position.x, start.position.z)
    half_deg = float(np.degrees(np.arctan(FRAME_WIDTH / FRAME_HEIGHT)))
    met: set[tuple[float, float, float]] = set()
    for turn in np.linspace(-half_deg, half_deg, COLUMNS):
        x, z = heading(start.rotation + float(turn))
        ray = shapely.LineString([(here.x, here.y), (here.x + FARTHEST_M * x, here.y + FARTHEST_M * z)])
        gaps = shapely.distance(here, shapely.intersection(ray, np.array(shapes)))
        if len(gaps) and not np.isnan(gaps).all():
            panel = panels[int(np.nanargmin(gaps))]
            normal = max(panel.normal, (-panel.normal[0], -panel.normal[1]))
            offset = normal[0] * panel.start[0] + normal[1] * panel.start[1]
            met.add((round(normal[0], 2), round(normal[1], 2), round(offset / SAME_WALL_M) * SAME_WALL_M))
    return met
