"""Asking a model for one reply: what is tried again, how long to wait, and what counts as the agent's own doing.

Source: `protocol.md` section 2.3. Transport failures, rate limits, outages and time-outs are tried again and then raise
ModelAPIError, which ends an episode as `error`. So does a rejection because of content or length that repeats three
times, when the agent has said nothing yet; later on it is the agent's own doing, a protocol failure
(`vigil.runner.workers.live`).
"""

import asyncio
import re
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from vigil.actions import Reply
from vigil.agents.model import Message
from vigil.errors import ModelAPIError

Ask = Callable[[Sequence[Message]], Awaitable[Reply]]
"""Sends messages to a model and returns its reply. Raises ModelAPIError; of a rejection, RequestRejected."""
Send = Callable[[Sequence[Message]], Awaitable[Reply]]
"""The same, one attempt. Raises ModelTrouble."""

MAX_REJECTIONS = 3
_REJECTION_STATUS = frozenset({400, 403, 413, 422})
_CONTEXT = re.compile(r"context.?(length|window)|max_model_len", re.IGNORECASE)
_LENGTH_OR_CONTENT = re.compile(
    r"maximum.{0,20}(prompt|input|sequence).{0,10}length|request (entity )?too large|request_too_large|"
    r"\b(prompt|input|messages?|request)\b.{0,40}(too (long|large|many tokens)|longer than|exceed)|"
    r"content.?(policy|filter|management)|data_inspection|inappropriate content|usage polic|"
    r"\b(prompt|input|request|image|messages?|content)\b.{0,80}(flagged|blocked|violat)|"
    r"(safety|moderation) (system|filter|policy)",
    re.IGNORECASE | re.DOTALL,
)
_NOT_THE_AGENTS = re.compile(
    r"account|organi[sz]ation|billing|balance|payment|quota|api.?key|credential|permission|region|country|parameter|"
    r"setting|per (day|hour|minute)|cloudflare|<html",
    re.IGNORECASE,
)
"""What a provider says of its customer, its settings or a proxy."""


class AttemptFailed(Exception):
    """One attempt to get a reply failed."""

    def __init__(
        self, message: str, *, can_retry: bool = False, is_rejection: bool = False, wait_s: float | None = None
    ) -> None:
        super().__init__(message)
        self.can_retry = can_retry
        self.is_rejection = is_rejection
        self.wait_s = wait_s
        """What the provider asked to wait."""


class RequestRejected(ModelAPIError):
    """A provider rejected a request because of its content or length, three times."""


def is_rejection(status: int | None, message: str) -> bool:
    """Whether a provider's error answer rejects the request because of its content or length.

    In doubt it does not: what is taken for the infrastructure's failure is played again, and scored then.
    """
    if status not in _REJECTION_STATUS:
        return False
    if _CONTEXT.search(message):
        return True
    return _LENGTH_OR_CONTENT.search(message) is not None and not _NOT_THE_AGENTS.search(message)


@dataclass(slots=True)
class RetryPolicy:
    """How often to try again and how long to wait: doubling, with jitter, unless the provider says otherwise."""

    retries: int = 8
    first_wait_s: float = 1.0
    longest_wait_s: float = 60.0
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    """For jitter alone: nothing that is scored depends on it."""
    tell: Callable[[str], None] = lambda _: None
    """Takes in what goes wrong and is tried again, in a line."""

    def wait_s(self, attempt: int, asked_s: float | None) -> float:
        """Returns how long to wait after failed attempt number `attempt` (from 1)."""
        longest = min(self.longest_wait_s, self.first_wait_s * 2.0 ** (attempt - 1))
        own = longest * (0.5 + 0.5 * float(self.rng.random()))
        return own if asked_s is None else max(own, min(asked_s, self.longest_wait_s))


def with_retries(send: Send, retry_policy: RetryPolicy) -> Ask:
    """Returns `send` with retries."""

    async def ask(messages: Sequence[Message]) -> Reply:
        failures = rejections = 0
        while True:
            try:
                return await send(messages)
            except AttemptFailed as trouble:
                said = str(trouble)
                if trouble.is_rejection:
                    rejections += 1
                    if rejections == MAX_REJECTIONS:
                        message = f"The provider rejected the request {rejections} times: {said}"
                        raise RequestRejected(message) from trouble
                    wait = retry_policy.wait_s(rejections, trouble.wait_s)
                else:
                    failures += 1
                    if not trouble.can_retry or failures > retry_policy.retries:
                        raise ModelAPIError(f"{trouble} (after {failures} attempts)") from trouble
                    wait = retry_policy.wait_s(failures, trouble.wait_s)
            retry_policy.tell(f"try {failures + rejections + 1} in {wait:.0f} s after {said}")
            await asyncio.sleep(wait)

    return ask
