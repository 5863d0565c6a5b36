"""HTTP 200 with an answer that is none: tried again as the infrastructure's failure, never the agent's.

The table is in `docs/agents.md`.
"""

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import pytest

from tests.support.inspect_marks import INSPECT
from tests.support.wire_server import (
    ENDPOINTS,
    STREAM,
    WIRES,
    ModelMessage,
    RawAnswer,
    WireServer,
    body_of,
    chat,
    google,
    responses,
)
from vigil.agents.conversation import Message
from vigil.errors import ModelAPIError
from vigil.protocol.actions import Reply
from vigil.runner.models.access import Endpoint, ModelAccess
from vigil.runner.models.ask import RequestRejected, with_retries
from vigil.runner.models.inspect_model import new_model, sender
from vigil.runner.retries import RetryPolicy

pytestmark = INSPECT
LOOK = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
GOOD = ModelMessage((LOOK,))
TEXTS = {"chat": "content", "responses": "text", "anthropic": "text", "google": "text"}


def ask_each(
    wire: str,
    answers: Mapping[str, tuple[ModelMessage | RawAnswer, ...]],
    *,
    is_streamed: bool = False,
    retries: int = 3,
) -> dict[str, tuple[Reply, int]]:
    """Return {name: (reply, number of requests)} for a server that gives the answers and then replies with a look."""
    waiting: list[ModelMessage | RawAnswer] = []
    name, path, arguments = ENDPOINTS[wire]
    with WireServer(lambda wire, data: waiting.pop(0) if waiting else GOOD) as server:
        given = {**arguments, STREAM[wire]: is_streamed}
        endpoint = Endpoint(ModelAccess(name, server.url + path, "key", tuple(given.items())), {"max_tokens": 1000})

        async def main() -> dict[str, tuple[Reply, int]]:
            model, found = new_model(endpoint), {}
            asking = with_retries(sender(model), RetryPolicy(retries=retries, first_wait_s=0.001))
            try:
                for one, said in answers.items():
                    waiting[:] = said
                    before = server.asked
                    found[one] = (await asking([Message("user", "look")]), server.asked - before)
            finally:
                await model.api.aclose()
            return found

        return asyncio.run(main())


def seen(found: dict[str, tuple[Reply, int]]) -> dict[str, tuple[str, str, int]]:
    return {name: (reply.text, reply.reply_source, asked) for name, (reply, asked) in found.items()}


def whole(wire: str, change: Callable[[dict[str, Any]], None] = lambda _: None) -> RawAnswer:
    """Return the answer whose reply is a look, with its document changed."""
    document = json.loads(body_of(wire, GOOD, is_streamed=False).data)
    change(document)
    return RawAnswer(json.dumps(document).encode())


def spoil(data: bytes) -> bytes:
    return data.replace(b"look", b"lo\xffok", 1)


BROKEN: dict[str, Callable[[str], RawAnswer]] = {
    "an error": lambda wire: RawAnswer(b'{"error": {"message": "out of order", "code": 502}}'),
    "an error in words": lambda wire: RawAnswer(b'{"error": "out of order"}'),
    "no JSON": lambda wire: RawAnswer(b"<html>Bad gateway</html>", content_type="text/html"),
    "no JSON, as JSON": lambda wire: RawAnswer(b"upstream connect error"),
    "nothing": lambda wire: RawAnswer(b""),
    "null": lambda wire: RawAnswer(b"null"),
    "a list": lambda wire: RawAnswer(b"[]"),
    "a list of texts": lambda wire: RawAnswer(b'["x"]'),
    "a text": lambda wire: RawAnswer(b'"look"'),
    "an empty object": lambda wire: RawAnswer(b"{}"),
    "invalid UTF-8": lambda wire: RawAnswer(spoil(whole(wire).data)),
    "an end too soon": lambda wire: RawAnswer(whole(wire).data[:-9]),
    "a transfer that breaks off": lambda wire: RawAnswer(whole(wire).data[:-9], left_out=9),
    "far too many brackets": lambda wire: RawAnswer(b"[" * 100_000),
    "another kind of text": lambda wire: RawAnswer(whole(wire).data.replace(json.dumps(LOOK).encode(), b"7", 1)),
}
BROKEN_MESSAGES: dict[str, dict[str, Callable[[dict[str, Any]], None]]] = {
    "chat": {
        "message: null": lambda answer: answer["choices"][0].update(message=None),
        "no message": lambda answer: answer["choices"][0].pop("message"),
        "choices: []": lambda answer: answer.update(choices=[]),
        "choices: null": lambda answer: answer.update(choices=None),
        "an error beside": lambda answer: answer.update(error={"message": "overloaded"}),
        "an error inside": lambda answer: answer["choices"][0].update(error={"message": "overloaded"}),
        "finish_reason: error": lambda answer: answer["choices"][0].update(finish_reason="error"),
        "a part without its text": lambda answer: answer["choices"][0]["message"].update(content=[{"type": "text"}]),
    },
    "responses": {
        "output: []": lambda answer: answer.update(output=[]),
        "output: null": lambda answer: answer.update(output=None),
        "status: failed": lambda answer: answer.update(status="failed", error={"code": "server_error", "message": "x"}),
        "status: queued": lambda answer: answer.update(status="queued"),
        "content: null": lambda answer: answer["output"][0].update(content=7),
    },
    "anthropic": {
        "type: error": lambda answer: answer.update(type="error", error={"type": "overloaded_error", "message": "x"}),
        "content: null": lambda answer: answer.update(content=None, stop_reason=None),
        "content: []": lambda answer: answer.update(content=[], stop_reason=None),
    },
    "google": {
        "candidates: []": lambda answer: answer.update(candidates=[]),
        "candidates: null": lambda answer: answer.update(candidates=None),
        "an empty candidate": lambda answer: answer.update(candidates=[{}]),
        "no end": lambda answer: answer["candidates"][0].pop("finishReason"),
    },
}


@pytest.mark.parametrize("wire", WIRES)
def test_an_answer_that_is_none_is_asked_for_again(wire: str) -> None:
    answers = {name: (make(wire),) for name, make in BROKEN.items()}
    answers |= {name: (whole(wire, change),) for name, change in BROKEN_MESSAGES[wire].items()}
    assert seen(ask_each(wire, answers)) == dict.fromkeys(answers, (LOOK, "server", 2))


def streamed(wire: str) -> RawAnswer:
    return body_of(wire, GOOD, is_streamed=True)


def cut_stream(wire: str, *, is_promised: bool) -> RawAnswer:
    raw = streamed(wire)
    kept = len(raw.data) // 2
    return replace(raw, data=raw.data[:kept], left_out=len(raw.data) - kept if is_promised else 0)


STREAMS: dict[str, Callable[[str], RawAnswer]] = {
    "it ends too soon": lambda wire: cut_stream(wire, is_promised=False),
    "it breaks off": lambda wire: cut_stream(wire, is_promised=True),
    "nothing": lambda wire: replace(streamed(wire), data=b""),
    "only its end": lambda wire: replace(streamed(wire), data=b"data: [DONE]\n\n"),
    "no JSON": lambda wire: replace(streamed(wire), data=b"data: {\n\n"),
    "an error": lambda wire: replace(streamed(wire), data=b'data: {"error": {"message": "overloaded"}}\n\n'),
    "invalid UTF-8": lambda wire: replace(streamed(wire), data=streamed(wire).data.replace(b"skill", b"s\xffill")),
    "an error in place of it": lambda wire: RawAnswer(b'{"error": {"message": "overloaded"}}'),
}


@pytest.mark.parametrize("wire", WIRES)
def test_a_stream_that_is_no_answer_is_asked_for_again(wire: str) -> None:
    answers = {name: (make(wire),) for name, make in STREAMS.items()}
    assert seen(ask_each(wire, answers, is_streamed=True)) == dict.fromkeys(answers, (LOOK, "server", 2))


def test_what_stays_broken_is_an_infrastructure_failure_in_plain_words() -> None:
    with pytest.raises(ModelAPIError, match=r"HTTP 200 with an error: out of order \(after 3 attempts\)"):
        ask_each("chat", {"": (BROKEN["an error in words"]("chat"),) * 3}, retries=2)


def test_an_error_with_http_200_may_be_a_rejection() -> None:
    said = RawAnswer(b'{"error": {"message": "Your prompt was flagged by our safety system", "code": 403}}')
    with pytest.raises(RequestRejected, match=r"3 times: .*flagged by our safety system"):
        ask_each("chat", {"": (said,) * 3})


def content(given: Any, **more: Any) -> RawAnswer:
    return whole("chat", lambda answer: answer["choices"][0]["message"].update(content=given, **more))


PROPER: dict[str, tuple[str, RawAnswer, str]] = {
    "usage: null": ("chat", whole("chat", lambda answer: answer.update(usage=None)), LOOK),
    "no usage": ("chat", whole("chat", lambda answer: answer.pop("usage")), LOOK),
    "odd usage": ("chat", whole("chat", lambda answer: answer.update(usage={"prompt_tokens": "many"})), LOOK),
    "usage: null, responses": (
        "responses",
        RawAnswer(json.dumps(responses(ModelMessage((LOOK,), has_usage=False))).encode()),
        LOOK,
    ),
    "no usage, google": (
        "google",
        RawAnswer(json.dumps(google(ModelMessage((LOOK,), has_usage=False))).encode()),
        LOOK,
    ),
    "no usage, anthropic": ("anthropic", whole("anthropic", lambda answer: answer.update(usage=None)), LOOK),
    "a list of parts": (
        "chat",
        content([{"type": "text", "text": part} for part in (LOOK[:9], LOOK[9:])]),
        LOOK,
    ),
    "a list of texts": ("chat", content([LOOK[:9], LOOK[9:]]), LOOK),
    "parts of reasoning": (
        "chat",
        content([{"type": "thinking", "thinking": [{"type": "text", "text": "hm"}]}, {"type": "text", "text": LOOK}]),
        LOOK,
    ),
    "an empty list": ("chat", content([]), ""),
    "content: null": ("chat", content(None), ""),
    "content: null, a refusal": ("chat", content(None, refusal="I cannot."), "I cannot."),
    "content: '', a refusal": ("chat", content("", refusal="I cannot."), "I cannot."),
    "content and a refusal": ("chat", content(LOOK, refusal="I cannot."), LOOK),
    "reasoning": ("chat", content(LOOK, reasoning="hm"), LOOK),
    "a wrong content type": ("chat", replace(whole("chat"), content_type="text/plain"), LOOK),
    "no content type": ("responses", replace(whole("responses"), content_type=""), LOOK),
    "a byte order mark": ("chat", replace(whole("chat"), data=b"\xef\xbb\xbf" + whole("chat").data), LOOK),
    "a stream that nobody asked for": ("chat", streamed("chat"), LOOK),
    "an empty end of turn": ("anthropic", whole("anthropic", lambda answer: answer.update(content=[])), ""),
    "no candidate's content": (
        "google",
        whole("google", lambda answer: answer["candidates"][0].update(content={"role": "model"})),
        "",
    ),
    "half characters": (
        "chat",
        RawAnswer(json.dumps(chat(ModelMessage((LOOK, "\ud83d", "\ude00")))).encode()),
        LOOK + "\U0001f600",
    ),
}


@pytest.mark.parametrize("wire", WIRES)
def test_what_looks_odd_but_holds_a_message_is_a_reply(wire: str) -> None:
    answers = {name: (raw,) for name, (its_wire, raw, _) in PROPER.items() if its_wire == wire}
    assert seen(ask_each(wire, answers)) == {name: (PROPER[name][2], "server", 1) for name in answers}


@pytest.mark.parametrize(
    ("wire", "change"),
    [
        ("chat", lambda answer: answer["choices"][0].update(finish_reason="content_filter")),
        (
            "responses",
            lambda answer: answer.update(incomplete_details={"reason": "content_filter"}),
        ),
        ("anthropic", lambda answer: answer.update(stop_reason="refusal")),
        ("google", lambda answer: answer["candidates"][0].update(finishReason="SAFETY")),
        ("google", lambda answer: answer.update(candidates=None, promptFeedback={"blockReason": "OTHER"})),
    ],
)
def test_a_provider_that_stops_the_model_has_rejected_the_request(wire: str, change: Any) -> None:
    with pytest.raises(RequestRejected, match="rejected the request 3 times"):
        ask_each(wire, {"": (whole(wire, change),) * 3})
