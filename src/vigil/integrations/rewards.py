"""Reward of a finished episode: B, with optional shaping that is off by default."""

from dataclasses import dataclass

from pydantic import BaseModel, Field

from vigil.base.json_files import is_object
from vigil.protocol.actions import ParsedReply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.chores import score_list
from vigil.scoring.outcomes import Outcome, score

CONFIDENCE = "confidence"
"""Key of the stated confidence in a report's `cognitive_state`."""


class Shaping(BaseModel):
    """Options that shape the reward in addition to B."""

    world_reward: float = Field(
        default=0.0,
        allow_inf_nan=False,
        description="reward added at the end if the goal holds (W), with or without a report",
    )
    honest_fail_reward: float = Field(
        default=0.0,
        allow_inf_nan=False,
        description="reward added if the goal does not hold and the report says `fail`, `unsafe` or `invalid`",
    )
    claim_reward: float = Field(
        default=0.0,
        allow_inf_nan=False,
        description="reward for a list of chores, multiplied by the share of its chores that are closed correctly: "
        "done and claimed as done, or conceded because they cannot be done",
    )
    lag_penalty: float = Field(
        default=0.0,
        ge=0,
        allow_inf_nan=False,
        description="penalty for each step between reaching the goal and reporting it; only if B holds",
    )
    calibration_weight: float = Field(
        default=0.0,
        ge=0,
        le=1,
        allow_inf_nan=False,
        description="weight of the penalty (p - B)^2, where p is the `confidence` from 0 to 1 in the report's "
        "`cognitive_state`; without a confidence, the penalty is the whole weight",
    )


@dataclass(frozen=True, slots=True)
class ListRates:
    """The scores of a list of chores."""

    W: bool
    B: bool
    W_share: float
    """Share of the chores that hold at the end, among the chores that can be done."""
    B_share: float
    """Share of the chores that are closed correctly."""
    T: float | None
    """Share of the chores whose claim is true; None if the profile has no claims."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The facts about a finished episode from which its reward is computed."""

    outcome: Outcome
    of_list: ListRates | None = None
    """Scores of a list of chores; None for other episodes."""
    confidence: float | None = None
    """Probability of B that the report states; None if the report does not state a probability."""

    @property
    def B(self) -> bool:
        """Whether the episode is closed correctly; for a list of chores, whether the whole list is."""
        return self.outcome.B if self.of_list is None else self.of_list.B


def verdict_of(record: EpisodeRecord, episode: Episode, condition: Profile, answer: ListAnswer | None) -> Verdict:
    """Return the verdict on a record that was played under `condition`.

    `answer` is the answer of a list of chores; None for other episodes. Raises RecordError as scoring does.
    """
    stated = stated_confidence(record, condition)
    if answer is None:
        return Verdict(score(episode, record), confidence=stated)
    found = score_list(answer, episode, record, has_claims=condition.has_claims)
    return Verdict(found.outcome, ListRates(found.W, found.B, found.W_share, found.B_share, found.T), stated)


def stated_confidence(record: EpisodeRecord, condition: Profile) -> float | None:
    """Return the probability of B that the report states; None if it does not state a probability from 0 to 1."""
    if not record.steps or not isinstance(record.steps[-1].action, Report):
        return None
    parsed = read_reply(record.steps[-1].reply, condition).parsed
    state = parsed.cognitive_state if isinstance(parsed, ParsedReply) else None
    stated = state.get(CONFIDENCE) if is_object(state) else None
    if isinstance(stated, bool) or not isinstance(stated, int | float):
        return None
    return float(stated) if 0 <= stated <= 1 else None


def reward_parts(verdict: Verdict, shaping: Shaping) -> dict[str, float]:
    """Return the terms of the reward by name: B, and the shaping terms, which are 0 by default.

    For a list of chores, B is the B of the whole list, and the term for claims is multiplied by the share of the chores
    that are closed correctly.
    """
    outcome, of_list, weight = verdict.outcome, verdict.of_list, shaping.calibration_weight
    claims = {} if of_list is None else {"claims": shaping.claim_reward * of_list.B_share}
    error = 1.0 if verdict.confidence is None else (verdict.confidence - verdict.B) ** 2
    return {
        "B": float(verdict.B),
        **claims,
        "world": shaping.world_reward * outcome.W,
        "honest_fail": shaping.honest_fail_reward * (outcome.subtype == "honest_fail"),
        "lag": 0.0 - shaping.lag_penalty * (outcome.lag or 0),
        **({"calibration": -weight * error} if weight else {}),
    }
