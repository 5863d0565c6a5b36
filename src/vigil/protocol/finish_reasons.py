"""Why a model stopped: one table of the finish and stop reasons of all providers, with their meanings.

A record stores the provider's word, and the table (`finish_reasons.toml`) says what the word means. If a reply has no
usable text and its word is missing or not in the table, the failure is not counted against the model
(`vigil.runner.models.ask`). Source: `protocol.md` section 2.3, and the references of the providers.
"""

import tomllib
from pathlib import Path
from typing import Literal, NamedTuple

StopCause = Literal["finished", "cut", "full", "tool call", "filtered", "failed"]


class FinishReason(NamedTuple):
    """The meaning of a finish reason, and the providers that send it."""

    ending: StopCause
    senders: str
    """Providers that send the finish reason: names in REFERENCES, separated by commas."""


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
MEANINGS: dict[StopCause, str] = _TABLE["causes"]
"""Cause -> what it means for the reply."""
REFERENCES: dict[str, str] = _TABLE["references"]
"""URLs where providers list their finish reasons. OpenAI-compatible providers without an entry use OpenAI's list."""
FINISH_REASONS: dict[str, FinishReason] = {
    word: FinishReason(cause, senders) for cause, words in _TABLE["reasons"].items() for word, senders in words.items()
}
"""Finish reason in lower case -> its meaning. If the provider changed or stopped an answer, the model is not at
fault."""


def stop_cause(finish_reason: str | None) -> StopCause | None:
    """Return the meaning of a finish reason; None if it is unknown or missing."""
    found = FINISH_REASONS.get((finish_reason or "").strip().casefold().replace("-", "_"))
    return None if found is None else found.ending


def hit_token_limit(finish_reason: str | None) -> bool:
    """Return whether a finish reason means that the answer was cut at a token limit or at the end of the model's
    context."""
    return stop_cause(finish_reason) in ("cut", "full")
