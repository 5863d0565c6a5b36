"""What servers and providers do that OpenAI's reference does not say, each tried on a real HTTP server on loopback.

Collected from public reports and references: how they end an answer, where they put the sentence of an error, what
they refuse. `docs/models.md` says what is done about each.
"""

import asyncio
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from inspect_ai.model import ModelOutput, ModelUsage, get_model

from tests.support.inspect_marks import INSPECT
from tests.support.wire_server import ENDPOINTS, ModelMessage, RawAnswer, WireServer, body_of
from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import encode_frame
from vigil.errors import ModelAPIError
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.finish_reasons import FINISH_REASONS, MEANINGS, REFERENCES, stop_cause
from vigil.protocol.replies import read_reply
from vigil.runner.models.access import Endpoint, ModelAccess
from vigil.runner.models.ask import Ask, RequestRejected, with_retries
from vigil.runner.models.inspect_model import new_model, sender
from vigil.runner.models.preflight import advice, check_sight
from vigil.runner.retries import RetryPolicy

pytestmark = INSPECT
LOOK = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
PICTURE = encode_frame(np.zeros((480, 640, 3), np.uint8))
TOO_LONG = "The prompt is longer than the context length of 4096 tokens"


async def see(ask: Ask) -> Any:
    return await ask([Message("user", "look", PICTURE)])


def asked(
    wire: str,
    brain: Callable[[str, bytes], ModelMessage | RawAnswer],
    question: Callable[[Ask], Any] = see,
    **sampling: Any,
) -> tuple[Reply, int]:
    """Return the reply and the number of requests. Raises ModelAPIError."""
    name, path, arguments = ENDPOINTS[wire]
    with WireServer(brain) as server:
        endpoint = Endpoint(ModelAccess(name, server.url + path, "key", tuple(arguments.items())), sampling)

        async def main() -> Reply:
            model = new_model(endpoint)
            try:
                return await question(with_retries(sender(model), RetryPolicy(retries=1, first_wait_s=0.001)))
            finally:
                await model.api.aclose()

        return asyncio.run(main()), server.asked


def always(document: Any, status: int = 200) -> Callable[[str, bytes], RawAnswer]:
    return lambda wire, data: RawAnswer(json.dumps(document).encode(), status=status)


def then_look(document: Any, status: int = 200) -> Callable[[str, bytes], ModelMessage | RawAnswer]:
    """Answers so the first time, with a look from then on."""
    waiting = [RawAnswer(json.dumps(document).encode(), status=status)]
    return lambda wire, data: waiting.pop() if waiting else ModelMessage((LOOK,))


def chat(content: Any, finish_reason: Any, **more: Any) -> dict[str, Any]:
    choice = {"index": 0, "message": {"role": "assistant", "content": content}, "finish_reason": finish_reason}
    return {"id": "1", "object": "chat.completion", "created": 1, "model": "m", "choices": [choice | more]}


def anthropic(stop_reason: str) -> dict[str, Any]:
    document = json.loads(body_of("anthropic", ModelMessage(), is_streamed=False).data)
    return document | {"stop_reason": stop_reason}


def google(finish_reason: str, parts: list[Any] | None = None) -> dict[str, Any]:
    content = {"role": "model", "parts": parts} if parts else {}
    return {"candidates": [{"content": content, "finishReason": finish_reason, "index": 0}], "modelVersion": "m"}


# --- how an answer ends ---


def test_every_finish_reason_has_a_meaning_and_somebody_who_lists_it() -> None:
    for word, one in FINISH_REASONS.items():
        assert word == word.casefold()
        assert one.ending in MEANINGS
        assert set(one.senders.split(", ")) <= REFERENCES.keys(), word
    assert {one.ending for one in FINISH_REASONS.values()} == MEANINGS.keys()
    assert stop_cause("MAX_TOKENS") == stop_cause("max-tokens") == "cut"
    assert stop_cause(None) is None
    assert stop_cause("a new word") is None


FAILURES = [word for word, one in FINISH_REASONS.items() if one.ending == "failed"]


@pytest.mark.parametrize("word", [*FAILURES, "a_word_of_tomorrow", "", None])
def test_an_empty_answer_of_a_server_that_failed_is_asked_for_again(word: str | None) -> None:
    assert asked("chat", then_look(chat("", word)))[0].text == LOOK


@pytest.mark.parametrize("word", FAILURES)
def test_the_text_of_a_server_that_failed_does_not_count(word: str) -> None:
    reply, times = asked("chat", then_look(chat(LOOK[:20], word)))
    assert (reply.text, times) == (LOOK, 2)


def test_what_stays_so_is_an_error_that_names_the_word() -> None:
    with pytest.raises(
        ModelAPIError, match=r"ended with the finish reason 'network_error'.*after 2 attempts"
    ) as raised:
        asked("chat", always(chat("", "network_error")))
    assert not isinstance(raised.value, RequestRejected)
    with pytest.raises(ModelAPIError, match="has no text, with the finish reason 'gremlins'"):
        asked("chat", always(chat("<think>hm</think>", "gremlins")))


@pytest.mark.parametrize(
    ("wire", "document"),
    [
        ("anthropic", anthropic("pause_turn")),
        ("anthropic", anthropic("a_word_of_tomorrow")),
        ("google", google("OTHER")),
        ("google", google("MALFORMED_RESPONSE")),
        ("google", google("A_WORD_OF_TOMORROW")),
    ],
)
def test_other_formats_have_such_words_too(wire: str, document: dict[str, Any]) -> None:
    assert asked(wire, then_look(document), max_tokens=1000)[0].text == LOOK


@pytest.mark.parametrize("word", ["gremlins", None])
def test_an_unknown_word_beside_a_text_leaves_it_to_be_judged(word: str | None) -> None:
    reply, times = asked("chat", always(chat("I would turn left.", word)))
    assert (reply.text, reply.finish_reason, times) == ("I would turn left.", word, 1)


@pytest.mark.parametrize("word", [word for word, one in FINISH_REASONS.items() if one.ending == "filtered"])
def test_a_stop_for_content_is_a_rejection(word: str) -> None:
    with pytest.raises(RequestRejected, match=f"3 times: {word}"):
        asked("chat", always(chat("", word)))


@pytest.mark.parametrize(
    "more",
    [
        {"native_finish_reason": "network_error"},
        {"provider_specific_fields": {"native_finish_reason": "insufficient_system_resource"}},
    ],
)
def test_a_router_that_calls_a_failure_a_stop_is_not_believed(more: dict[str, Any]) -> None:
    assert asked("chat", then_look(chat("", "stop", **more)))[0].text == LOOK
    assert asked("chat", always(chat(LOOK, "stop", native_finish_reason="STOP")))[0].finish_reason == "stop"


def test_a_finish_reason_that_is_an_object_is_read() -> None:
    """As SGLang's own are."""
    assert asked("chat", always(chat(LOOK, {"type": "stop", "matched": 2})))[0].finish_reason == "stop"
    assert asked("chat", always(chat(LOOK, 7)))[0].finish_reason == "7"


@pytest.mark.parametrize(
    ("wire", "document"),
    [
        (
            "chat",
            chat(None, "tool_calls", message={"content": None, "tool_calls": [{"function": {"name": "navigate"}}]}),
        ),
        ("chat", chat(None, "stop", message={"content": None, "function_call": {"name": "navigate", "arguments": ""}})),
        ("chat", chat(None, "gremlins", message={"content": "", "tool_calls": [{"function": {"name": "navigate"}}]})),
        (
            "anthropic",
            anthropic("tool_use") | {"content": [{"type": "tool_use", "id": "a", "name": "navigate", "input": {}}]},
        ),
        ("google", google("STOP", [{"functionCall": {"name": "navigate", "args": {}}}])),
    ],
)
def test_a_tool_call_in_the_place_of_a_text_is_an_invalid_reply_that_says_so(wire: str, document: Any) -> None:
    reply, times = asked(wire, always(document), max_tokens=1000)
    invalid = read_reply(reply).parsed
    assert isinstance(invalid, InvalidAction)
    assert (invalid.reason, times) == ("empty", 1)
    assert invalid.detail == "the server sent a tool call ('navigate') in the place of text"
    assert "start it without its tool parser" in advice(invalid, reply)


# --- where an error's sentence stands ---

RAW = json.dumps({"error": {"message": TOO_LONG, "type": "invalid_request_error"}})
OVERFLOWS: dict[str, tuple[int, Any]] = {
    "LM Studio: a string": (400, {"error": TOO_LONG}),
    "OpenAI: an object": (400, {"error": {"message": TOO_LONG, "type": "invalid_request_error", "code": None}}),
    "Google: a list": (400, [{"error": {"code": 400, "message": TOO_LONG, "status": "INVALID_ARGUMENT"}}]),
    "TGI": (422, {"error": "Input validation error: `inputs` must have less than 4096 tokens", "error_type": "x"}),
    "FastAPI: detail": (400, {"detail": TOO_LONG}),
    "FastAPI: a list of details": (422, {"detail": [{"loc": ["body"], "msg": TOO_LONG, "type": "value_error"}]}),
    "vLLM: a message beside": (400, {"object": "error", "message": TOO_LONG, "type": "BadRequestError", "code": 400}),
    "OpenRouter: JSON in a string": (400, {"error": {"message": "Provider returned error", "metadata": {"raw": RAW}}}),
    "OpenRouter: a text": (400, {"error": {"message": "Provider returned error", "metadata": {"raw": TOO_LONG}}}),
    "Cloudflare: errors": (400, {"success": False, "errors": [{"code": 5021, "message": TOO_LONG}], "result": None}),
    "Bedrock: message": (400, {"message": "Input is too long for requested model."}),
    "DashScope": (
        400,
        {"error": {"code": "invalid_parameter_error", "message": "Range of input length should be [1, 9]"}},
    ),
    "Moonshot": (400, {"error": {"message": "Your request exceeded model token limit: 8192", "type": "x"}}),
    "Zhipu": (400, {"error": {"code": "1261", "message": "Prompt exceeds max length"}}),
    "llama.cpp": (500, {"error": {"code": 500, "message": "the request exceeds the available context size"}}),
    "an object in a string": (400, {"error": json.dumps({"error": {"message": TOO_LONG}})}),
    "text": (400, TOO_LONG),
    "MiniMax: HTTP 200": (200, {"base_resp": {"status_code": 2013, "status_msg": "context window exceeds limit"}}),
    "HTTP 200, a string": (200, {"error": TOO_LONG}),
}


@pytest.mark.parametrize("name", OVERFLOWS)
def test_a_context_overflow_is_a_rejection_that_shows_the_sentence(name: str) -> None:
    status, document = OVERFLOWS[name]
    with pytest.raises(RequestRejected) as raised:
        asked("chat", always(document, status))
    said = str(raised.value)
    assert "rejected the request 3 times: " in said
    assert any(words in said for words in ("4096 tokens", "too long", "[1, 9]", "8192", "max length", "context"))


def test_what_is_no_overflow_is_shown_and_no_rejection() -> None:
    document = [{"error": {"code": 400, "message": "Unable to process input image.", "status": "INVALID_ARGUMENT"}}]
    for shown in (document, document[0], {"detail": "Unable to process input image."}):
        with pytest.raises(ModelAPIError, match=r"HTTP 400: Unable to process input image\.") as raised:
            asked("chat", always(shown, 400))
        assert not isinstance(raised.value, RequestRejected)


@pytest.mark.parametrize("status", [200, 400])
def test_an_error_of_a_thousand_levels_is_an_error(status: int) -> None:
    for deep in ('{"error":' * 700 + "1" + "}" * 700, '{"error":' + "[" * 700 + "1" + "]" * 700 + "}"):
        with pytest.raises(ModelAPIError, match=r"after [12] attempts"):
            asked("chat", lambda wire, data, deep=deep: RawAnswer(deep.encode(), status=status))


def test_what_minimax_calls_sensitive_is_a_rejection() -> None:
    document = chat("", "stop") | {"base_resp": {"status_code": 1027, "status_msg": "output new_sensitive"}}
    document["base_resp"]["status_msg"] = "output is sensitive"
    with pytest.raises(RequestRejected, match="output is sensitive"):
        asked("chat", always(document))
    fine = chat(LOOK, "stop") | {"base_resp": {"status_code": 0, "status_msg": ""}}
    assert asked("chat", always(fine))[0].text == LOOK


# --- what servers refuse ---

REFUSALS: dict[str, tuple[int, str, str]] = {
    "vLLM, text": (400, "facebook/opt-125m is not a multimodal model None", "not accept images"),
    "vLLM, no image": (400, "At most 0 image(s) may be provided in one prompt.", "not accept images"),
    "Ollama, text": (400, "this model does not support image input (ref: b8bd)", "not accept images"),
    "llama.cpp, text": (500, "image input is not supported - hint: you may need to provide the mmproj", "--mmproj"),
    "OpenRouter, text": (404, "No endpoints found that support image input", "not accept images"),
    "OpenAI, text": (400, "Invalid content type. image_url is only supported by certain models.", "not accept images"),
    "DeepSeek, text": (400, "messages[0]: unknown variant `image_url`, expected `text`", "not accept images"),
    "DashScope, stream": (400, "This model only support stream mode, please enable the stream parameter", "stream"),
    "DashScope, thinking": (400, "enable_thinking must be set to false for non-streaming calls", '{"stream": true}'),
    "Gemma on vLLM": (400, "System role not supported", "--system-role user"),
    "Gemma 3 on vLLM": (
        400,
        "Conversation roles must alternate user/assistant/user/assistant/...",
        "--system-role user",
    ),
    "Google, Gemma": (400, "Developer instruction is not enabled for models/gemma-3-27b-it", "--system-role user"),
    "OpenAI, o1": (
        400,
        "Unsupported value: 'messages[0].role' does not support 'system' with this model.",
        "-role user",
    ),
    "LM Studio, address": (200, "Unexpected endpoint or method. (POST /chat/completions)", "HOST:PORT/v1"),
    "OpenAI, limit": (400, "'max_tokens' is not supported. Use 'max_completion_tokens' instead.", "--extra-body"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_comes_with_what_to_do_in_the_place_of_name_and_key(name: str) -> None:
    status, sentence, expected = REFUSALS[name]
    document = {"error": {"message": sentence}}
    times: list[bytes] = []

    def brain(wire: str, data: bytes) -> RawAnswer:
        times.append(data)
        return RawAnswer(json.dumps(document).encode(), status=status)

    with pytest.raises(ModelAPIError) as raised:
        asked("chat", brain, question=lambda ask: check_sight(ask, "m", "png"))
    said = str(raised.value)
    assert sentence.rstrip(".") in said
    assert expected in said
    assert "the key in the environment" not in said
    assert len(times) == (2 if status == 200 else 1), "what never gets better is not tried again"


def test_a_server_that_only_streams_answers_with_the_option_that_is_named() -> None:
    def brain(wire: str, data: bytes) -> ModelMessage | RawAnswer:
        if json.loads(data).get("stream") is True:
            return ModelMessage((LOOK,), reasoning="hm")
        return RawAnswer(b'{"error": {"message": "This model only support stream mode"}}', status=400)

    reply, times = asked("chat", brain, extra_body={"stream": True})
    assert (reply.text, reply.finish_reason, reply.reasoning_chars, times) == (LOOK, "stop", 2, 1)


# --- how an answer is sent ---


def stream(*chunks: Any, head: str = "", is_ended: bool = True) -> RawAnswer:
    text = head + "".join(f"data: {json.dumps(chunk)}\n\n" for chunk in chunks) + "data: [DONE]\n\n" * is_ended
    return RawAnswer(text.encode(), content_type="text/event-stream")


def piece(content: str | None, finish_reason: Any = None, **more: Any) -> dict[str, Any]:
    return {
        "model": "m",
        "choices": [{"index": 0, "delta": {"content": content}, "finish_reason": finish_reason, **more}],
    }


SENT: dict[str, tuple[RawAnswer, str | None]] = {
    "Ollama: an empty reason in every piece": (
        stream(piece(LOOK[:9], ""), piece(LOOK[9:], ""), piece("", "stop")),
        "stop",
    ),
    "OpenRouter: comments while it waits": (
        stream(piece(LOOK), piece("", "stop"), head=": OPENROUTER PROCESSING\n\n: OPENROUTER PROCESSING\n\n"),
        "stop",
    ),
    "OpenRouter: blank lines before JSON": (RawAnswer(b"\n \n\n" + json.dumps(chat(LOOK, "stop")).encode()), "stop"),
    "Azure: a first piece without choices": (
        stream({"model": "", "choices": [], "prompt_filter_results": []}, piece(LOOK), piece(None, "stop")),
        "stop",
    ),
    "HTTP 201": (RawAnswer(json.dumps(chat(LOOK, "stop")).encode(), status=201), "stop"),
    "no finish reason": (RawAnswer(json.dumps(chat(LOOK, None)).encode()), None),
    "SGLang: an object as the reason, streamed": (stream(piece(LOOK), piece("", {"type": "stop"})), "stop"),
    "vLLM: a token as stop_reason": (RawAnswer(json.dumps(chat(LOOK, "stop", stop_reason=151645)).encode()), "stop"),
}


@pytest.mark.parametrize("name", SENT)
def test_an_answer_is_read_however_it_is_sent(name: str) -> None:
    raw, reason = SENT[name]
    reply, times = asked("chat", lambda wire, data: raw)
    assert (reply.text, reply.finish_reason, reply.reply_source, times) == (LOOK, reason, "server", 1)


UNSENT: dict[str, RawAnswer] = {
    "vLLM: aborted, as if it were whole": stream(piece(LOOK[:9]), piece("", "abort")),
    "OpenRouter: an error in the middle": stream(
        piece(LOOK[:9]), {"error": {"code": 502, "message": "Provider disconnected"}, **piece("", "error")}
    ),
    "FastChat: an error that says so only in its kind": RawAnswer(
        b'{"object": "error", "message": "busy", "code": 50002}'
    ),
    "LiteLLM: a stop for what was no stop": stream(
        piece(LOOK[:9]), piece("", "stop", provider_specific_fields={"native_finish_reason": "network_error"})
    ),
    "Ollama: the model is only loaded": stream(piece("", "load")),
}


@pytest.mark.parametrize("name", UNSENT)
def test_an_answer_that_broke_off_is_asked_for_again(name: str) -> None:
    waiting = [UNSENT[name]]
    reply, times = asked("chat", lambda wire, data: waiting.pop() if waiting else ModelMessage((LOOK,)))
    assert (reply.text, times) == (LOOK, 2)


def test_a_message_without_content_that_the_limit_cut_is_the_models() -> None:
    """As Gemini sends it in OpenAI's style when thinking has used up the limit."""
    reply, times = asked("chat", always(chat(None, "length", message={"role": "assistant"})))
    invalid = read_reply(reply).parsed
    assert isinstance(invalid, InvalidAction)
    assert (invalid.reason, times) == ("truncated", 1)


@pytest.mark.parametrize(
    ("stop_reason", "expected"),
    [("unknown", "has no text, with the finish reason 'unknown'"), ("content_filter", "rejected the request 3 times")],
)
def test_of_a_provider_that_cannot_be_listened_to_the_same_holds(stop_reason: Any, expected: str) -> None:
    said = ModelOutput.from_content("m", "", stop_reason=stop_reason)
    said.usage = ModelUsage(input_tokens=1, output_tokens=1)  # else Inspect counts, with a table that it downloads
    model = get_model("mockllm/model", custom_outputs=[said] * 3, memoize=False)

    async def main() -> Reply:
        return await see(with_retries(sender(model), RetryPolicy(retries=1, first_wait_s=0.001)))

    with pytest.raises(ModelAPIError, match=expected):
        asyncio.run(main())
