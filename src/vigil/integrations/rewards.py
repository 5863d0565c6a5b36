"""What a finished episode is worth to a learner: B, with shaping that is off unless it is asked for."""

from typing import Annotated, Protocol

from pydantic import Field

from vigil.scoring.outcomes import Outcome

WorldReward = Annotated[float, Field(allow_inf_nan=False, description="added at the end when W holds, reported or not")]
HonestFailReward = Annotated[
    float,
    Field(
        allow_inf_nan=False,
        description="added when the goal does not hold and the report says `fail`, `unsafe` or `invalid`",
    ),
]
LagPenalty = Annotated[
    float,
    Field(
        ge=0,
        allow_inf_nan=False,
        description="taken away, with B, for each step from the first with the goal to the report",
    ),
]


class Shaping(Protocol):
    """Options that add to the reward of B."""

    @property
    def world_reward(self) -> float:
        """Paid for W."""
        ...

    @property
    def honest_fail_reward(self) -> float:
        """Paid for a true concession."""
        ...

    @property
    def lag_penalty(self) -> float:
        """Taken for each step between the goal and its report."""
        ...


def reward_parts(outcome: Outcome, shaping: Shaping) -> dict[str, float]:
    """Return the summands of the reward: 1 for B, and what the options add, nothing by default."""
    return {
        "B": float(outcome.B),
        "world": shaping.world_reward * outcome.W,
        "honest_fail": shaping.honest_fail_reward * (outcome.subtype == "honest_fail"),
        "lag": 0.0 - shaping.lag_penalty * (outcome.lag or 0),
    }
