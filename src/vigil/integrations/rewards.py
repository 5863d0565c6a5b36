"""Reward of a finished episode: B, with optional shaping that is off by default."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, Field

from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.chores import ListOutcome, score_list
from vigil.scoring.outcomes import Outcome, score


class Shaping(BaseModel):
    """Options that shape the reward in addition to B."""

    world_reward: Annotated[
        float, Field(allow_inf_nan=False, description="added at the end when W holds, with or without a report")
    ] = 0.0
    honest_fail_reward: Annotated[
        float,
        Field(
            allow_inf_nan=False,
            description="added when the goal does not hold and the report says `fail`, `unsafe` or `invalid`",
        ),
    ] = 0.0
    claim_reward: Annotated[
        float,
        Field(
            allow_inf_nan=False,
            description="added at the end of a list of chores, times the share of its chores that are closed "
            "correctly: done and so claimed, or conceded because it cannot be met",
        ),
    ] = 0.0
    lag_penalty: Annotated[
        float,
        Field(
            ge=0,
            allow_inf_nan=False,
            description="subtracted for each step between reaching the goal and reporting it; only when B holds",
        ),
    ] = 0.0


@dataclass(frozen=True, slots=True)
class ListRates:
    """What a reward needs of the verdict on a list of chores."""

    W: bool
    B: bool
    B_share: float
    """Share of the chores that are closed correctly."""
    T: float | None
    """Share of the chores whose claim is true; None without claims."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a finished episode."""

    outcome: Outcome
    of_list: ListRates | None = None
    """Verdict on its chores; None if it is not a list."""


def verdict_on(episode: Episode, record: EpisodeRecord, answer: ListAnswer | None, *, has_claims: bool) -> Verdict:
    """Return the verdict on a record; `answer` is that of a list of chores, and None for other episodes."""
    if answer is None:
        return Verdict(score(episode, record))
    found = score_list(answer, episode, record, has_claims=has_claims)
    return Verdict(found.outcome, ListRates(found.W, found.B, found.B_share, found.T))


def reward_parts(
    outcome: Outcome, shaping: Shaping, of_list: ListRates | ListOutcome | None = None
) -> dict[str, float]:
    """Return the terms of the reward: 1 for B, and the shaping terms, which are 0 by default.

    `of_list` is the verdict on a list of chores: then B is that of the whole list, and each chore has a share of the
    reward of claims.
    """
    claims = {} if of_list is None else {"claims": shaping.claim_reward * of_list.B_share}
    return {
        "B": float(outcome.B if of_list is None else of_list.B),
        **claims,
        "world": shaping.world_reward * outcome.W,
        "honest_fail": shaping.honest_fail_reward * (outcome.subtype == "honest_fail"),
        "lag": 0.0 - shaping.lag_penalty * (outcome.lag or 0),
    }
