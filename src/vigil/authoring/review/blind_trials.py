"""Blind trials: an episode that an agent without sight completes does not measure sight, so no pack holds it."""

from vigil.actions import Action, Navigate, Report
from vigil.episode import FAMILIES, Episode
from vigil.goals import AgentNearTarget, ObjectInState

TURNING = tuple(Navigate(mode="turn_right", magnitude=90.0) for _ in range(4))
WALKING = tuple(Navigate(mode="forward", magnitude=3.0) for _ in range(4))
BLIND: tuple[tuple[Navigate, ...], ...] = (TURNING, WALKING, ())
"""What agents without sight do before they claim success."""


def blind_trials(episode: Episode) -> list[tuple[Action, ...]]:
    """Returns what agents without sight would play, none of which may complete the episode.

    State verification is judged by its label instead, and what is found by turning is found by turning blindly.
    """
    if "report_status" in FAMILIES[episode.family].goal_kinds:
        return []
    closing = Report(status="success", summary="")
    tries = [moves for moves in BLIND if not (episode.provenance.template == "turn" and moves is TURNING)]
    return [(*moves, closing) for moves in tries if not moves or _depends_on_the_body(episode)]


def _depends_on_the_body(episode: Episode) -> bool:
    """Whether the goal is about where the agent is or looks; the others hold or not however it walks and turns."""
    goal = episode.goal
    return isinstance(goal, AgentNearTarget) or (isinstance(goal, ObjectInState) and goal.state == "is_visible")
