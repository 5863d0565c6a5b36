import asyncio
import threading

import pytest

from vigil.agents.conversation import Message
from vigil.errors import ModelAPIError
from vigil.protocol.actions import Reply
from vigil.runner.models.ask import Ask, AttemptFailed, RequestRejected, is_rejection, with_retries
from vigil.runner.retries import MAX_REJECTIONS, RetryPolicy

MESSAGES = [Message("user", "hello")]
GOOD = Reply(text="good")


class Script:
    """Answers with one thing after another; what is an exception is raised."""

    def __init__(self, *answers: Reply | AttemptFailed) -> None:
        self.answers = list(answers)

    async def __call__(self, messages: object) -> Reply:
        answer = self.answers.pop(0)
        if isinstance(answer, Reply):
            return answer
        raise answer


def ask(script: Script, retries: int = 8) -> Reply:
    asking: Ask = with_retries(script, RetryPolicy(retries=retries, first_wait_s=0.0))
    return asyncio.run(asking(MESSAGES))


def test_transient_trouble_is_tried_again() -> None:
    assert ask(Script(*[AttemptFailed("429", can_retry=True)] * 8, GOOD)) == GOOD


def test_what_is_tried_again_is_told() -> None:
    told: list[str] = []
    retry_policy = RetryPolicy(first_wait_s=0.0, on_retry=told.append)
    script = Script(AttemptFailed("HTTP 500", can_retry=True), AttemptFailed("too long", is_rejection=True), GOOD)
    asking = with_retries(script, retry_policy)
    assert asyncio.run(asking(MESSAGES)) == GOOD
    assert told == ["try 2 in 0 s after HTTP 500", "try 3 in 0 s after too long"]


def test_after_the_last_retry_it_is_an_infrastructure_failure() -> None:
    script = Script(*[AttemptFailed("HTTP 503 out of order", can_retry=True)] * 9, GOOD)
    with pytest.raises(ModelAPIError, match=r"HTTP 503 out of order \(after 9 attempts\)"):
        ask(script)
    assert script.answers == [GOOD]


def test_hopeless_trouble_is_not_tried_again() -> None:
    script = Script(AttemptFailed("401 wrong key"), GOOD)
    with pytest.raises(ModelAPIError, match="wrong key"):
        ask(script)
    assert script.answers == [GOOD]


def test_three_rejections_are_final_and_say_what_the_provider_said() -> None:
    with pytest.raises(RequestRejected, match=r"rejected the request 3 times: content policy"):
        ask(Script(*[AttemptFailed("content policy", is_rejection=True)] * MAX_REJECTIONS))


def test_two_rejections_are_not() -> None:
    assert ask(Script(*[AttemptFailed("content policy", is_rejection=True)] * 2, GOOD)) == GOOD


def test_other_trouble_does_not_use_up_rejections() -> None:
    rejection, outage = AttemptFailed("too long", is_rejection=True), AttemptFailed("500", can_retry=True)
    assert ask(Script(rejection, outage, rejection, outage, GOOD)) == GOOD


def waits(monkeypatch: pytest.MonkeyPatch, *answers: Reply | AttemptFailed) -> list[float]:
    """Return the wait before each further attempt; the last attempt succeeds."""
    waited: list[float] = []
    really_sleep, thread = asyncio.sleep, threading.get_ident()

    async def sleep(seconds: float) -> None:
        if threading.get_ident() == thread:
            waited.append(seconds)
        else:  # a library's own thread, begun by an earlier test
            await really_sleep(seconds)

    monkeypatch.setattr(asyncio, "sleep", sleep)
    retry_policy = RetryPolicy(first_wait_s=1.0, longest_wait_s=10.0)
    assert asyncio.run(with_retries(Script(*answers, GOOD), retry_policy)(MESSAGES)) == GOOD
    return waited


def test_waits_double_up_to_a_limit_with_jitter(monkeypatch: pytest.MonkeyPatch) -> None:
    waited = waits(monkeypatch, *[AttemptFailed("500", can_retry=True)] * 8)
    assert len(waited) == 8
    for attempt, wait in enumerate(waited):
        assert min(10.0, 2.0**attempt) / 2 <= wait <= min(10.0, 2.0**attempt)
    assert len(set(waited)) == 8


@pytest.mark.parametrize(("asked_s", "least", "most"), [(7.0, 7.0, 7.0), (9999.0, 10.0, 10.0), (0.1, 0.5, 1.0)])
@pytest.mark.parametrize("is_rejection", [False, True])
def test_the_provider_may_ask_for_a_longer_wait(
    asked_s: float, least: float, most: float, is_rejection: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    trouble = AttemptFailed("429", can_retry=not is_rejection, is_rejection=is_rejection, wait_s=asked_s)
    (wait,) = waits(monkeypatch, trouble)
    assert least <= wait <= most


def test_an_interrupted_request_is_not_tried_again() -> None:
    async def send(messages: object) -> Reply:
        raise asyncio.CancelledError

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(with_retries(send, RetryPolicy(first_wait_s=0.0))(MESSAGES))


def test_requests_at_once_are_counted_separately() -> None:
    async def both() -> list[Reply]:
        scripts = [Script(*[AttemptFailed("500", can_retry=True)] * 3, GOOD) for _ in range(2)]
        return await asyncio.gather(*(with_retries(script, RetryPolicy(3, 0.001))(MESSAGES) for script in scripts))

    assert asyncio.run(both()) == [GOOD, GOOD]


@pytest.mark.parametrize(
    ("status", "message", "expected"),
    [
        (400, "This model's maximum context length is 4096 tokens, however you requested 5000", True),
        (400, "The response was filtered due to the prompt triggering our content management policy", True),
        (403, "Input data may contain inappropriate content (data_inspection_failed)", True),
        (413, "Request entity too large", True),
        (400, "'max_tokens' is too large: 1024. This model's maximum context length is 4096 tokens", True),
        (400, "prompt is too long: 210000 tokens > 200000 maximum", True),
        (400, "The input token count (1200000) exceeds the maximum number of tokens allowed", True),
        (400, "Output blocked by content filtering policy", True),
        (400, "Invalid prompt: your prompt was flagged as potentially violating our usage policy", True),
        (400, "Unknown parameter: reasoning_effort", False),
        (400, "Unknown parameter: safety_settings", False),
        (400, "max_tokens is too large: 100000. This model supports at most 16384 completion tokens", False),
        (400, "Your prompt tokens per day quota was exceeded", False),
        (400, "Invalid API key flagged as leaked", False),
        (403, "Your account has been blocked because of insufficient balance.", False),
        (403, "Your organization was disabled for violating our usage policies", False),
        (403, "<html><title>Attention Required! | Cloudflare</title>Sorry, your request was blocked</html>", False),
        (403, "Requests to this API are blocked.", False),
        (401, "The key is flagged", False),
        (429, "Too many tokens per minute", False),
        (500, "content policy service is down", False),
        (None, "maximum context length", False),
    ],
)
def test_rejections_are_told_from_other_errors(status: int | None, message: str, expected: bool) -> None:
    assert is_rejection(status, message) is expected
