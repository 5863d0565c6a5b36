"""Obvious wrong ways: outcomes that look like success and must not count as it.

On top instead of inside, within instead of on, the look-alike, the wrong neighbour, done and undone again. Planning the
walks would take too long, so each is brought about by the simulator's own set-up, and judged by the scoring of any run.
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
    """One wrong way, with its record; None where the house does not allow it."""

    name: str
    record: EpisodeRecord | None


def scores_as_success(episode: Episode, control: NegativeControl) -> bool:
    """Whether a wrong way counts as success."""
    if control.record is None:
        return False
    outcome = score(episode, control.record)
    return outcome.W or outcome.B


def negative_controls(scenes: SyntheticWorlds, view: PrivilegedView, record: EpisodeRecord) -> list[NegativeControl]:
    """Return the wrong ways of an episode whose solution's record is given. The simulator is left anywhere."""
    worlds = ControlWorlds(scenes, view, record)
    return [NegativeControl(name, made) for name, made in controls_of_goal(worlds.episode.goal, worlds)]
