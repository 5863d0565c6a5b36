"""Estimates of a request's tokens: from the characters of texts, and from the large providers' formulas for images."""

import re
from collections.abc import Sequence
from itertools import pairwise

from vigil.agents.conversation import Message
from vigil.protocol.families import FAMILIES
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord

CHARS_PER_TOKEN = 4.0
LONGEST_EPISODE = max(spec.max_steps for spec in FAMILIES.values())
"""Greatest budget of steps of the families."""
PICTURE_TOKENS = (300, 1300)
"""Minimum and maximum number of tokens of a frame of 640 x 480 pixels."""
REPLY_TOKENS = (40, 400)
"""Minimum and maximum number of tokens of a reply, which is one JSON object with a thought."""
REASONING_TOKENS = (100, 8_000)
"""Minimum and maximum number of tokens that a thinking model writes before an answer, for runs without --max-tokens."""
CONTEXT_OPTIONS = "vLLM: --max-model-len, SGLang: --context-length, llama.cpp: -c, Ollama: OLLAMA_CONTEXT_LENGTH"
CONTEXT_OVERFLOW = re.compile(
    r"context.?(length|window|size)|max_model_len|maximum model length|exceed_context|context limit|"
    r"must have less than \d+ tokens|max_new_tokens` must be <=|model token limit|tokens_limit_reached|"
    r"range of input length|max(imum)? (message|prompt|input) (tokens|length)|when context the overflows",
    re.IGNORECASE,
)
"""Words in errors that servers send only if a request is longer than the context."""
CONTEXT_ERROR = re.compile(
    rf"{CONTEXT_OVERFLOW.pattern}|tokens?\b.{{0,40}}(exceed|maximum|limit)|exceed.{{0,60}}(tokens?|length)\b|"
    r"longer than|too (long|many tokens)",
    re.IGNORECASE | re.DOTALL,
)


def estimated_tokens(messages: Sequence[Message]) -> int:
    """Return an upper estimate of a request's tokens."""
    text = sum(len(message.text) for message in messages) / CHARS_PER_TOKEN
    return round(text) + PICTURE_TOKENS[1] * sum(message.picture is not None for message in messages)


def size_hint(messages: Sequence[Message], profile: Profile) -> str:
    """Return a sentence on the context that the server of a model needs, for an episode that begins with `messages`."""
    turns = min(profile.past_turns, LONGEST_EPISODE)
    tokens = estimated_tokens(messages) + (turns + 1) * (REPLY_TOKENS[1] + 20)
    tokens += min(profile.row.images, turns) * PICTURE_TOKENS[1]
    context = 1 << (tokens - 1).bit_length()  # a power of two
    return (
        "The server's context is too small: the first request of this episode takes about "
        f"{estimated_tokens(messages):,} tokens. Start the server with a context of "
        f"{context:,} tokens or more ({CONTEXT_OPTIONS}), and more for a model that thinks."
    )


def find_shrunk_request(record: EpisodeRecord, profile: Profile) -> tuple[int, int] | None:
    """Return the input tokens of two consecutive requests if the later one has fewer; None if no request shrank.

    Only requests before the history is full are compared. Their tokens can only grow, unless the server cuts the
    dialogue.
    """
    usages = [step.reply.usage for step in record.steps[: profile.past_turns + 1]]
    inputs = [usage.input_tokens for usage in usages if usage is not None]
    return next(((before, after) for before, after in pairwise(inputs) if after < before), None)
