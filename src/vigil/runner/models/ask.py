"""Asking a model for one reply: which failures are retried (`vigil.runner.retries`), and which are faults of the agent.

Source: `protocol.md` section 2.3.
"""

import re
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from typing import Any

from tenacity import AsyncRetrying, retry_if_exception_type

from vigil.agents.conversation import Message
from vigil.errors import ModelAPIError
from vigil.protocol.actions import Reply
from vigil.protocol.finish_reasons import stop_cause
from vigil.protocol.reasoning import split_reasoning
from vigil.runner.models.answers import ModelAnswer, NoAnswer, Wire, read_answer
from vigil.runner.models.context import CONTEXT_OVERFLOW
from vigil.runner.models.provider_errors import hint_for
from vigil.runner.retries import MAX_REJECTIONS, RetryPolicy

Ask = Callable[[Sequence[Message]], Coroutine[Any, Any, Reply]]
"""Function that sends messages to a model, with retries, and returns its reply.

Raises RequestRejected after repeated rejections, and ModelAPIError after other failures.
"""
Send = Callable[[Sequence[Message]], Awaitable[Reply]]
"""Function that sends messages to a model once and returns its reply. Raises AttemptFailed."""

TRANSIENT_STATUS = frozenset({408, 409, 425, 429})
"""HTTP status codes below 500 of errors that may be temporary."""
_REJECTION_STATUS = frozenset({400, 403, 413, 422})
_DEFAULT_ERROR_STATUS = 400
"""Status that is assumed for an error that was sent with HTTP 200 and does not name a status."""
_OVERFLOW_STATUS = _REJECTION_STATUS | {500}
"""Status codes with which servers reject a request that is too long; llama.cpp and Ollama have sent 500."""
_LENGTH_OR_CONTENT = re.compile(
    r"maximum.{0,20}(prompt|input|sequence).{0,10}length|request (entity )?too large|request_too_large|"
    r"\b(prompt|input|messages?|request)\b.{0,40}(too (long|large|many tokens)|longer than|exceed)|"
    r"content.?(policy|filter|management)|data_inspection|inappropriate content|usage polic|\bsensitive\b|high risk|"
    r"\b(prompt|input|request|image|messages?|content)\b.{0,80}(flagged|blocked|violat)|"
    r"(safety|moderation) (system|filter|policy)",
    re.IGNORECASE | re.DOTALL,
)
_NOT_ABOUT_THE_REQUEST = re.compile(
    r"account|organi[sz]ation|billing|balance|payment|quota|api.?key|credential|permission|region|country|parameter|"
    r"setting|per (day|hour|minute)|cloudflare|<html",
    re.IGNORECASE,
)
"""Words of errors that concern the customer, the settings or a proxy, not the request's content or length."""


class AttemptFailed(Exception):
    """Error: one attempt to get a reply from the model failed."""

    def __init__(
        self, message: str, *, can_retry: bool = False, is_rejection: bool = False, wait_s: float | None = None
    ) -> None:
        super().__init__(message)
        self.can_retry = can_retry
        self.is_rejection = is_rejection
        self.wait_s = wait_s
        """Seconds that the provider asked to wait; None if it did not ask."""


class RequestRejected(ModelAPIError):
    """A provider rejected a request because of its content or length, three times."""


def is_rejection(status: int | None, message: str) -> bool:
    """Return whether a provider's error answer rejects the request because of its content or length.

    In doubt, the result is False: the episode then counts as a failure of the infrastructure, and is played again.
    """
    if status in _OVERFLOW_STATUS and CONTEXT_OVERFLOW.search(message):
        return True
    if status not in _REJECTION_STATUS:
        return False
    return _LENGTH_OR_CONTENT.search(message) is not None and not _NOT_ABOUT_THE_REQUEST.search(message)


def parse_answer(wire: Wire, body: bytes) -> ModelAnswer:
    """Return the answer in a body that came with HTTP 200. Raises AttemptFailed if the body does not have a reply."""
    try:
        answer = read_answer(wire, body)
    except NoAnswer as fault:
        if is_rejection(fault.status or _DEFAULT_ERROR_STATUS, str(fault)):
            raise AttemptFailed(str(fault), is_rejection=True) from fault
        raise AttemptFailed(str(fault), can_retry=True) from fault
    check_ending(answer.finish_reason, answer.text, answer.tool_call)
    return answer


def check_ending(finish_reason: str | None, text: str, tool_call: str | None) -> None:
    """Raise AttemptFailed when an answer was ended by something other than the model.

    The finish reason shows this. If it is unknown, an answer that has neither text nor a tool call counts as ended by
    something else.
    """
    ending = stop_cause(finish_reason)
    if ending == "filtered":
        raise AttemptFailed(f"{finish_reason}: {text[:200]}", is_rejection=True)
    if ending == "failed":
        raise AttemptFailed(
            f"HTTP 200 with an answer that ended with the finish reason {finish_reason!r}: {text[:200]!r}",
            can_retry=True,
        )
    if ending is None and tool_call is None and not split_reasoning(text)[0].strip():
        word = "without a finish reason" if finish_reason is None else f"with the finish reason {finish_reason!r}"
        raise AttemptFailed(f"HTTP 200 with an answer that has no text, {word}", can_retry=True)


def reply_from_answer(answer: ModelAnswer, seconds: float, *, keep_reasoning: bool = False) -> Reply:
    """Return a server's answer as a reply; `keep_reasoning` includes the reasoning from separate fields."""
    text, reasoning = answer.text, "".join(answer.reasoning)
    return Reply(
        text=text,
        reply_source="server",
        finish_reason=answer.finish_reason,
        reasoning_chars=len(reasoning) + split_reasoning(text)[1],
        reasoning=reasoning if keep_reasoning else "",
        tool_call=answer.tool_call,
        usage=answer.usage,
        seconds=seconds,
    )


def with_retries(send: Send, retry_policy: RetryPolicy) -> Ask:
    """Return a function that calls `send` with retries."""

    async def ask(messages: Sequence[Message]) -> Reply:
        failures = rejections = 0

        async def attempt() -> Reply:
            nonlocal failures, rejections
            try:
                return await send(messages)
            except AttemptFailed as failed:
                if failed.is_rejection:
                    rejections += 1
                    if rejections == MAX_REJECTIONS:
                        message = f"The provider rejected the request {rejections} times: {failed}"
                        raise RequestRejected(message) from failed
                else:
                    failures += 1
                    if not failed.can_retry or failures > retry_policy.retries:
                        hint = hint_for(str(failed))
                        advice = f". {hint}." if hint else ""
                        raise ModelAPIError(f"{failed} (after {failures} attempts){advice}") from failed
                raise

        retrying = AsyncRetrying(
            retry=retry_if_exception_type(AttemptFailed),
            wait=retry_policy.wait_s,
            before_sleep=retry_policy.report_retry,
        )
        return await retrying(attempt)

    return ask
