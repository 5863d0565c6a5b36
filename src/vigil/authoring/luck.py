"""Blind luck: episodes that an agent without sight completes say nothing about sight, so no pack holds them."""

from vigil.actions import Navigate, Report
from vigil.authoring.validate import Validator
from vigil.episode import FAMILIES, Episode
from vigil.house import House
from vigil.scoring import settle

TURNING = tuple(Navigate(mode="turn_right", magnitude=90.0) for _ in range(4))
WALKING = tuple(Navigate(mode="forward", magnitude=3.0) for _ in range(4))
BLIND: tuple[tuple[Navigate, ...], ...] = (TURNING, WALKING, ())
"""What agents without sight do before they claim success."""


def is_blind_luck(validator: Validator, episode: Episode, house: House) -> bool:
    """Whether an agent without sight completes the episode.

    State verification is judged by its label instead, and what is found by turning is found by turning blindly.
    """
    if "report_status" in FAMILIES[episode.family].goal_kinds:
        return False
    closing = Report(status="success", summary="")
    tries = [moves for moves in BLIND if not (episode.provenance.template == "turn" and moves is TURNING)]
    records = [validator.play(episode, house, (*moves, closing)) for moves in tries]
    return any(settle(episode, record).W for record in records)
