"""Cost of a run: bounds on calls and tokens, without sending a request.

Tokens are estimates (`vigil.runner.models.context`).
"""

from dataclasses import dataclass

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.records.costs import Prices
from vigil.records.record import RunSpec
from vigil.runner.models.context import CHARS_PER_TOKEN, PICTURE_TOKENS, REASONING_TOKENS, REPLY_TOKENS
from vigil.runner.models.thinking import may_think
from vigil.runner.plan import RunPlan


@dataclass(frozen=True, slots=True)
class CostEstimate:
    """Bounds (least, most) on the calls and tokens of a run. An agent that reports early stays far below the upper
    bounds."""

    episodes: int
    """Number of plays: episodes times epochs."""
    calls: tuple[int, int]
    """Number of calls: at least one for each play of an episode, and at most its budget of steps."""
    input_tokens: tuple[int, int]
    output_tokens: tuple[int, int]

    def cost(self, prices: Prices) -> tuple[float, float]:
        """Return the lowest and the highest cost."""
        low, high = (
            prices.cost_of(taken, given) for taken, given in zip(self.input_tokens, self.output_tokens, strict=True)
        )
        return low, high


def estimate(plan: RunPlan) -> CostEstimate:
    """Return the bounds for a planned run."""
    profile, epochs, outputs = plan.spec.profile, plan.spec.epochs, _output_tokens(plan.spec)
    answers = min(REPLY_TOKENS[0], outputs[0]), min(REPLY_TOKENS[1], outputs[1])
    least_input = sum(_input_tokens(episode, profile, 1, (answers[0], PICTURE_TOKENS[0])) for episode in plan.episodes)
    most_input = sum(
        _input_tokens(episode, profile, episode.max_steps, (answers[1], PICTURE_TOKENS[1])) for episode in plan.episodes
    )
    steps = sum(episode.max_steps for episode in plan.episodes)
    count = len(plan.episodes)
    return CostEstimate(
        episodes=count * epochs,
        calls=(count * epochs, steps * epochs),
        input_tokens=(least_input * epochs, most_input * epochs),
        output_tokens=(count * epochs * outputs[0], steps * epochs * outputs[1]),
    )


def _output_tokens(spec: RunSpec) -> tuple[int, int]:
    """Return (least, most) tokens of one reply, including reasoning."""
    least, most = REPLY_TOKENS
    if may_think(spec.thinking, spec.sampling.get("reasoning_effort"), spec.agent):
        least, most = least + REASONING_TOKENS[0], most + REASONING_TOKENS[1]
    limit = spec.sampling.get("max_tokens")
    return (least, most) if limit is None else (min(least, limit), limit)


def _input_tokens(episode: Episode, profile: Profile, calls: int, sizes: tuple[int, int]) -> int:
    """Return the tokens sent in the first `calls` calls of an episode.

    `sizes` has the tokens of an answer and of a frame. Reasoning is not counted, because later calls do not repeat it.
    """
    conversation = Conversation(profile, episode.instruction)
    reply = "x" * int(sizes[0] * CHARS_PER_TOKEN)
    total = 0.0
    for _ in range(calls):
        messages = conversation.messages(EncodedFrame(b"", profile.image_format), None)
        total += sum(len(message.text) for message in messages) / CHARS_PER_TOKEN + sizes[1]
        conversation.add(None, reply)
    return round(total)
