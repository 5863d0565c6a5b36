"""Negative controls: outcomes that look like success but must not count as success.

Examples are: on top instead of inside; the look-alike or a neighbour instead of the target; done and then undone. To
plan the walks would take too long, so the simulator sets up each outcome. Scoring then works as in any run.
"""

from dataclasses import dataclass

from vigil.authoring.review.control_worlds import ControlWorlds
from vigil.authoring.review.goal_controls import controls_of_goal
from vigil.authoring.review.synthetic_records import SyntheticWorlds
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score


@dataclass(frozen=True, slots=True)
class NegativeControl:
    """A negative control with its record."""

    name: str
    record: EpisodeRecord | None
    """Record of the outcome; None if the outcome is impossible in this house."""


def scores_as_success(episode: Episode, control: NegativeControl) -> bool:
    """Return whether scoring wrongly counts a negative control as success (W or B)."""
    if control.record is None:
        return False
    outcome = score(episode, control.record)
    return outcome.W or outcome.B


def negative_controls(scenes: SyntheticWorlds, view: PrivilegedView, record: EpisodeRecord) -> list[NegativeControl]:
    """Return an episode's negative controls; `record` is of its solution. The simulator may be left in any state."""
    worlds = ControlWorlds(scenes, view, record)
    return [NegativeControl(name, made) for name, made in controls_of_goal(worlds.episode.goal, worlds)]
