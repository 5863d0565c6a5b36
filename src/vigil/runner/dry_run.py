"""Cost of a run: bounds on calls and tokens, without sending a request.

Tokens are estimates (`vigil.runner.models.context`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import declared_thinking
from vigil.records.costs import Prices
from vigil.records.probe import QUESTIONS
from vigil.records.record import RunSpec
from vigil.runner.models.context import CHARS_PER_TOKEN, PICTURE_TOKENS, REASONING_TOKENS, REPLY_TOKENS
from vigil.runner.plan import RunPlan

REASONING_NOT_COUNTED = (
    f"A reply is assumed to have at most {REPLY_TOKENS[1]} tokens, without reasoning. If the model thinks unless its "
    "settings say otherwise, add --thinking on, or --max-tokens."
)


@dataclass(frozen=True, slots=True)
class CostEstimate:
    """Bounds (least, most) on the calls and tokens of a run. An agent that reports early stays far below the upper
    bounds."""

    episodes: int
    """Number of plays: episodes times epochs."""
    calls: tuple[int, int]
    """Number of calls: at least one for each play, and at most the episode's budget of steps for each play."""
    probes: tuple[int, int]
    """Number of calls that are probes, i.e. questions about what the model believes."""
    input_tokens: tuple[int, int]
    output_tokens: tuple[int, int]

    def cost(self, prices: Prices) -> tuple[float, float]:
        """Return the lowest and the highest cost of the run at these prices."""
        low, high = (
            prices.cost_of(taken, given) for taken, given in zip(self.input_tokens, self.output_tokens, strict=True)
        )
        return low, high


def estimate(plan: RunPlan) -> CostEstimate:
    """Return bounds on the calls and tokens of a planned run."""
    profile, epochs, outputs = plan.spec.profile, plan.spec.epochs, _output_tokens(plan.spec)
    answers = min(REPLY_TOKENS[0], outputs[0]), min(REPLY_TOKENS[1], outputs[1])
    calls, probes, inputs = [0, 0], [0, 0], [0.0, 0.0]
    framings = plan.execution.probes.framings if plan.execution.probes else ()
    questions = sum(len(QUESTIONS[framing]) for framing in framings) / CHARS_PER_TOKEN
    for episode in plan.episodes:
        asked = plan.execution.probes.schedule.bounds(episode.max_steps) if plan.execution.probes else ((), ())
        for bound, steps in enumerate((1, episode.max_steps)):
            tokens = _input_tokens(episode, profile, steps, (answers[bound], PICTURE_TOKENS[bound]))
            calls[bound] += steps
            probes[bound] += len(asked[bound]) * len(framings)
            inputs[bound] += sum(tokens)
            inputs[bound] += sum(tokens[step - 1] * len(framings) + questions for step in asked[bound])
    everything = [epochs * (call + probe) for call, probe in zip(calls, probes, strict=True)]
    return CostEstimate(
        episodes=len(plan.episodes) * epochs,
        calls=(everything[0], everything[1]),
        probes=(probes[0] * epochs, probes[1] * epochs),
        input_tokens=(round(inputs[0]) * epochs, round(inputs[1]) * epochs),
        output_tokens=(everything[0] * outputs[0], everything[1] * outputs[1]),
    )


def max_tokens_of(spec: RunSpec) -> int | None:
    """Return the maximum number of tokens of a reply that the run's settings give; None if they do not give one."""
    body: Mapping[str, Any] = spec.sampling.get("extra_body") or {}
    limits = (body.get("max_completion_tokens"), body.get("max_tokens"), spec.sampling.get("max_tokens"))
    return next((each for each in limits if isinstance(each, int)), None)


def _output_tokens(spec: RunSpec) -> tuple[int, int]:
    """Return (least, most) tokens of one reply, including reasoning."""
    least, most = REPLY_TOKENS
    if declared_thinking(spec.agent, spec.thinking, spec.sampling):
        least, most = least + REASONING_TOKENS[0], most + REASONING_TOKENS[1]
    limit = max_tokens_of(spec)
    return (least, most) if limit is None else (min(least, limit), limit)


def _input_tokens(episode: Episode, profile: Profile, calls: int, sizes: tuple[int, int]) -> list[float]:
    """Return the tokens sent in each of the first `calls` calls of an episode.

    `sizes` has the tokens of an answer and of a frame. Reasoning is not counted, because later calls do not repeat it.
    """
    conversation = Conversation(profile, episode.instruction)
    reply = "x" * int(sizes[0] * CHARS_PER_TOKEN)
    found: list[float] = []
    for _ in range(calls):
        picture = EncodedFrame(b"", profile.image_format)
        messages = conversation.messages(picture, None)
        pictures = sum(message.picture is not None for message in messages)
        found.append(sum(len(message.text) for message in messages) / CHARS_PER_TOKEN + pictures * sizes[1])
        conversation.add(None, reply, picture=picture)
    return found
