"""One reply at a time from a real HTTP server that misbehaves in every way."""

import asyncio
import threading
import time

import numpy as np
import pytest
from inspect_ai.model import ModelOutput, ModelUsage, get_model

from tests.support.chat_server import REPORT, ChatAnswer, ChatRequest, ChatResponder, ChatServer, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.narrowing import present
from tests.support.waiting import HANGS_AFTER_S
from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import encode_frame
from vigil.errors import ModelAPIError, SettingError
from vigil.protocol.actions import ParsedReply, Reply
from vigil.protocol.replies import read_reply
from vigil.runner.models.access import Endpoint, ModelAccess, model_access
from vigil.runner.models.ask import RequestRejected, with_retries
from vigil.runner.models.inspect_model import new_model, sender
from vigil.runner.retries import RetryPolicy

pytestmark = INSPECT
PICTURE = encode_frame(np.zeros((480, 640, 3), np.uint8))
MESSAGES = [
    Message("system", "prompt"),
    Message("assistant", "  past <think>x</think>\n"),
    Message("user", "s", PICTURE),
]
SHORT_WAITS = RetryPolicy(retries=3, first_wait_s=0.01)


def ask(brain: ChatResponder, reply_seconds: int = 600, **sampling: object) -> tuple[Reply, ChatServer]:
    with serving(brain) as server:
        endpoint = Endpoint(model_access("openai/m", server.url, {}), sampling, 4, reply_seconds)

        async def main() -> Reply:
            model = new_model(endpoint)
            try:
                return await with_retries(sender(model), SHORT_WAITS)(MESSAGES)
            finally:
                await model.api.aclose()

        return asyncio.run(main()), server


def after(*first: ChatAnswer) -> ChatResponder:
    """Answers with each of `first`, then with a report."""
    waiting = list(first)
    return lambda asked: waiting.pop(0) if waiting else ChatAnswer(REPORT)


def reason(reply: Reply) -> str | None:
    parsed = read_reply(reply).parsed
    return None if isinstance(parsed, ParsedReply) else parsed.reason


def test_a_good_reply_comes_back_verbatim_with_what_it_took() -> None:
    reply, server = ask(after())
    assert (reply.text, reply.finish_reason, reply.reasoning_chars) == (REPORT, "stop", 0)
    usage = present(reply.usage)
    assert (usage.input_tokens, usage.output_tokens) == (100, 10)
    assert reply.seconds > 0
    assert len(server.asked) == 1


def test_the_messages_arrive_verbatim_and_nothing_unset_is_sent() -> None:
    _, server = ask(after())
    asked = server.asked[0]
    assert [message["role"] for message in asked.messages] == ["system", "assistant", "user"]
    assert asked.texts == [message.text for message in MESSAGES]
    assert asked.pictures == [PICTURE.data]
    assert asked.body.keys() == {"model", "messages"}
    assert asked.body["model"] == "m"


def test_what_is_set_is_sent() -> None:
    _, server = ask(after(), temperature=0.5, top_p=0.9, max_tokens=77, reasoning_effort="low", extra_body={"top_k": 4})
    body = {name: value for name, value in server.asked[0].body.items() if name not in ("messages", "model")}
    assert body == {"temperature": 0.5, "top_p": 0.9, "max_tokens": 77, "reasoning_effort": "low", "top_k": 4}


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (ChatAnswer("I would turn left."), "no_object"),
        (ChatAnswer(f"```json\n{REPORT}\n```"), "code_fence"),
        (ChatAnswer(f"Sure: {REPORT}"), "text_around_object"),
        (ChatAnswer(f"{REPORT}\n<think>was that right?</think>"), "text_around_object"),
        (ChatAnswer(f"{REPORT}{REPORT}"), "several_objects"),
        (ChatAnswer(REPORT[:30], finish_reason="length"), "truncated"),
        (ChatAnswer("<think>so much to think", finish_reason="length"), "truncated"),
        (ChatAnswer(None, refusal="I cannot help with that."), "no_object"),
        (ChatAnswer(None), "empty"),
        (ChatAnswer(""), "empty"),
        (ChatAnswer("\ud800"), "not_utf8"),
        (ChatAnswer("   " + REPORT + "\n"), None),
        (ChatAnswer(f"<think>{REPORT}</think>\n{REPORT}"), None),
        (ChatAnswer(REPORT, reasoning="Let me see."), None),
    ],
)
def test_what_the_model_writes_is_the_agents_doing(answer: ChatAnswer, expected: str | None) -> None:
    reply, server = ask(after(answer))
    assert reason(reply) == expected
    assert len(server.asked) == 1
    assert (answer.text != "\ud800" and reply.text == (answer.text or answer.refusal or "")) or not reply.is_utf8


def test_a_provider_that_cannot_be_listened_to_is_recorded_as_the_librarys() -> None:
    said = ModelOutput.from_content("m", REPORT)
    said.usage = ModelUsage(input_tokens=1, output_tokens=1)  # else Inspect counts, with a table that it downloads
    model = get_model("mockllm/model", custom_outputs=[said], memoize=False)
    reply = asyncio.run(with_retries(sender(model), SHORT_WAITS)(MESSAGES))
    assert (reply.text, reply.reply_source) == (REPORT, "library")


def test_a_thought_may_speak_of_thinking() -> None:
    text = REPORT[:-1] + ', "thought": "<think>hm</think> yes"}'
    reply, _ = ask(after(ChatAnswer(text)))
    assert reply.text == text


@pytest.mark.parametrize(
    ("answer", "chars"),
    [(ChatAnswer(f"<think>four</think>{REPORT}"), 4), (ChatAnswer(REPORT, reasoning="Let me see."), 11)],
)
def test_the_length_of_the_reasoning_is_noted(answer: ChatAnswer, chars: int) -> None:
    assert ask(after(answer))[0].reasoning_chars == chars


@pytest.mark.parametrize(
    "trouble",
    [
        [failure(429, "slow down")] * 3,
        [failure(429, "slow down", code="rate_limit_exceeded")] * 2,
        [failure(500), failure(502), failure(503)],
        [ChatAnswer(REPORT, breaks=True)] * 2,
        [ChatAnswer(is_garbage=True)],
        [ChatAnswer(is_garbage=True, status=502)],
        [failure(408)],
    ],
)
def test_trouble_with_transport_and_server_is_tried_again(trouble: list[ChatAnswer]) -> None:
    reply, server = ask(after(*trouble))
    assert reply.text == REPORT
    assert len(server.asked) == len(trouble) + 1


def test_the_provider_says_how_long_to_wait() -> None:
    started = time.monotonic()
    ask(after(ChatAnswer(status=429, error={"message": "slow down"}, headers={"Retry-After": "1"})))
    assert time.monotonic() - started > 1.0


def test_a_slow_answer_is_given_up_and_asked_for_again() -> None:
    first, is_given_up = [REPORT], threading.Event()

    def brain(_: ChatRequest) -> ChatAnswer:
        if first:
            first.pop()
            is_given_up.wait(HANGS_AFTER_S)
        is_given_up.set()
        return ChatAnswer(REPORT)

    reply, server = ask(brain, reply_seconds=3)
    assert reply.text == REPORT
    assert len(server.asked) > 1


def test_an_outage_is_an_infrastructure_failure() -> None:
    with pytest.raises(ModelAPIError, match=r"out of order.*after 4 attempts"):
        ask(lambda asked: failure(503))


@pytest.mark.parametrize(
    "answer", [failure(401, "wrong key"), failure(404, "no such model"), failure(400, "unknown parameter")]
)
def test_a_request_that_can_never_work_is_not_repeated(answer: ChatAnswer) -> None:
    seen: list[ChatRequest] = []

    def brain(asked: ChatRequest) -> ChatAnswer:
        seen.append(asked)
        return answer

    with pytest.raises(ModelAPIError, match=present(answer.error)["message"]):
        ask(brain)
    assert len(seen) == 1


def test_nobody_at_the_address_is_an_infrastructure_failure() -> None:
    async def main() -> Reply:
        model = new_model(Endpoint(model_access("openai/m", "http://127.0.0.1:9/v1", {})))
        return await with_retries(sender(model), RetryPolicy(retries=1, first_wait_s=0.01))(MESSAGES)

    with pytest.raises(ModelAPIError, match="Connection error"):
        asyncio.run(main())


REJECTIONS = [
    failure(400, "Your request was flagged by our safety system", code="content_policy_violation"),
    failure(400, "maximum context length is 4096 tokens", code="context_length_exceeded"),
    failure(400, "This model's maximum context length is 4096 tokens. Please reduce the length", code=400),
    ChatAnswer("", finish_reason="content_filter"),
]


@pytest.mark.parametrize("answer", REJECTIONS)
def test_a_rejection_that_repeats_three_times_is_final(answer: ChatAnswer) -> None:
    asked: list[ChatRequest] = []
    with pytest.raises(RequestRejected, match="rejected the request 3 times: "):
        ask(lambda one: asked.append(one) or answer)
    assert len(asked) == 3


@pytest.mark.parametrize("answer", REJECTIONS)
def test_a_rejection_that_goes_away_is_not(answer: ChatAnswer) -> None:
    reply, server = ask(after(answer, answer))
    assert reply.text == REPORT
    assert len(server.asked) == 3


def test_a_provider_that_does_not_exist_is_a_setting_error() -> None:
    with pytest.raises(SettingError, match=r"'opnai/m' cannot be used: .*\. Did you mean 'openai'\?$"):
        new_model(Endpoint(ModelAccess("opnai/m")))


def test_a_key_that_is_missing_is_named_in_one_plain_line(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "AZUREAI_OPENAI_API_KEY", "AZURE_OPENAI_API_KEY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SettingError, match=r"'openai/m' cannot be used: .*No OPENAI_API_KEY.*\.$") as raised:
        new_model(Endpoint(ModelAccess("openai/m")))
    said = str(raised.value)
    assert not {"[", "\n", "ERROR"} & {said[index : index + size] for index in range(len(said)) for size in (1, 5)}
