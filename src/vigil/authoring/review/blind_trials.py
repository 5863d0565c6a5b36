"""Blind trials: plays of agents without sight. If one of these agents completes an episode, the episode is not used."""

from vigil.agents.scripted import (
    BLIND_WALKS,
    CENTRE_ACTIONS,
    EXPLORE_ACTIONS,
    POINT_ACTIONS,
    TURN_ACTIONS,
    WALK_ACTIONS,
    click_actions,
)
from vigil.protocol.actions import Action, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import AgentNearTarget, ObjectHeld, ObjectInState, TargetGrounded


def blind_trials(episode: Episode) -> list[tuple[Action, ...]]:
    """Return the actions of each agent without sight. None of these agents may complete the episode.

    They are the strongest blind agents known. Baselines of packs are measured with these agents, but with only one of
    the walks, `explore`. The list is empty for state verification, because a guessed label may be correct. If the task
    is to find the target by turning, agents that turn around are not in the list. If the goal is to be near the target,
    what counts is where a walk ends: of the walks, only `explore` is tried, and `centre`, which only clicks, is left
    out.
    """
    goal, is_turned_to = episode.goal, episode.provenance.template == "turn"
    if "report_status" in FAMILIES[episode.family].goal_kinds:
        return []
    tries: list[tuple[Action, ...]] = [()] if isinstance(goal, AgentNearTarget) else [(), CENTRE_ACTIONS]
    if isinstance(goal, AgentNearTarget):
        tries += [WALK_ACTIONS, TURN_ACTIONS, EXPLORE_ACTIONS]
    elif isinstance(goal, ObjectInState) and goal.state == "is_visible":
        tries += [WALK_ACTIONS] if is_turned_to else [WALK_ACTIONS, TURN_ACTIONS, *BLIND_WALKS]
    elif isinstance(goal, TargetGrounded):
        tries.append(POINT_ACTIONS)
    elif isinstance(goal, ObjectHeld | ObjectInState) and goal.constraint is None:
        tries += [click_actions(episode.instruction)] if FAMILIES[episode.family].visible_at_start else []
    return [(*moves[: episode.max_steps - 1], Report(status="success", summary="")) for moves in tries]
