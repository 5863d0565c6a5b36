import asyncio
import json
from collections.abc import Sequence

import numpy as np
import pytest

from tests.support.chat_server import read_number
from tests.support.narrowing import present
from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import encode_frame
from vigil.errors import ModelAPIError
from vigil.protocol.actions import InvalidAction, Reply, Usage
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.runner.models.ask import RequestRejected
from vigil.runner.models.preflight import (
    EXAMPLE_INSTRUCTION,
    advice,
    check_contract,
    check_sight,
    draw_example,
    draw_number,
    number_for,
)


def check(text: str, name: str = "some/model") -> None:
    async def ask(messages: Sequence[Message]) -> Reply:
        return Reply(text=text)

    asyncio.run(check_sight(ask, name, "png"))


def test_a_model_that_reads_the_number_passes() -> None:
    check(f" It says **{number_for('some/model')}**.")


@pytest.mark.parametrize("text", ["", "I cannot see pictures.", "1234567", "12"])
def test_a_blind_model_does_not(text: str) -> None:
    with pytest.raises(ModelAPIError, match="images do not seem to reach the model"):
        check(text)


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (Reply(text="", tool_call="navigate"), "start it without its tool parser"),
        (Reply(text="", finish_reason="length", reasoning_chars=900), "give a larger --max-tokens"),
        (Reply(text="", reasoning_chars=900), "reasoning parser"),
    ],
)
def test_an_answer_without_text_is_not_called_blind(reply: Reply, expected: str) -> None:
    async def ask(messages: Sequence[Message]) -> Reply:
        return reply

    with pytest.raises(ModelAPIError, match=expected) as raised:
        asyncio.run(check_sight(ask, "some/model", "png"))
    assert "images do not seem to reach the model" not in str(raised.value)


@pytest.mark.parametrize(("address", "where"), [("http://host/v1", " at http://host/v1"), ("", "")])
def test_a_model_that_does_not_answer_is_named_with_its_address_and_what_to_do(address: str, where: str) -> None:
    async def ask(messages: Sequence[Message]) -> Reply:
        raise ModelAPIError("Connection error. (after 3 attempts)")

    with pytest.raises(ModelAPIError) as raised:
        asyncio.run(check_sight(ask, "some/model", "png", address))
    said = str(raised.value)
    assert said.startswith(f"Model 'some/model'{where} did not answer the check before the run: Connection error.")
    assert "Check that it is served there under that name, and check the key" in said


def test_a_rejected_request_does_not_pass() -> None:
    async def ask(messages: Sequence[Message]) -> Reply:
        raise RequestRejected("The provider rejected the request 3 times: no images")

    with pytest.raises(ModelAPIError, match=r"3 times: no images\. Check that the model takes images"):
        asyncio.run(check_sight(ask, "some/model", "png"))


def test_the_number_is_drawn_legibly_and_depends_on_the_model() -> None:
    numbers = {number_for(f"model-{index}") for index in range(50)}
    assert len(numbers) > 45
    picture = draw_number("4711")
    assert picture.shape == (480, 640, 3)
    assert 0.02 < np.mean(picture < 128) < 0.3
    for number in sorted(numbers)[:5]:
        assert read_number(encode_frame(draw_number(number)).data) == number


REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'


def example(*replies: Reply, force: bool = False, profile: Profile | None = None) -> tuple[str, list[list[Message]]]:
    """Return the result of the example, and what was asked."""
    asked: list[list[Message]] = []

    async def ask(messages: Sequence[Message]) -> Reply:
        asked.append(list(messages))
        return replies[min(len(asked), len(replies)) - 1]

    return asyncio.run(check_contract(ask, "some/model", profile or Profile(), force=force)), asked


def test_an_answer_in_form_passes_at_once() -> None:
    result, asked = example(Reply(text=f"thinking</think>{REPORT}"))
    assert (result, len(asked)) == ("passed", 1)
    system, user = asked[0]
    assert EXAMPLE_INSTRUCTION in system.text
    assert user.picture is not None


def test_one_bad_answer_of_two_passes() -> None:
    result, asked = example(Reply(text="Well."), Reply(text=REPORT))
    assert (result, len(asked)) == ("passed", 2)


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        (Reply(text="I go there."), ["no_object", "chat template passes on the system prompt", "'I go there.'"]),
        (Reply(text=f"```json\n{REPORT}\n```"), ["code_fence", "--reply-policy lenient"]),
        (Reply(text=f"<think>hm {REPORT}"), ["unclosed_reasoning", "--reasoning-parser qwen3", "--thinking off"]),
        (Reply(text="", reasoning_chars=70), ["empty all 70 characters came as reasoning", "--reasoning-parser"]),
        (Reply(text="so much", finish_reason="length"), ["truncated no_object", "--max-tokens", "--max-model-len"]),
        (
            Reply(text="so", finish_reason="length", usage=Usage(input_tokens=2250, output_tokens=3)),
            ["cut it after 3 tokens, 2,250 of input before it", "larger context", "OLLAMA_CONTEXT_LENGTH"],
        ),
        (Reply(text="<|channel|>analysis<|message|>hm"), ["not part of the protocol", "--reasoning-parser"]),
        (Reply(text='{"skill_name": "jump", "arguments": {}}'), ["unknown_skill", "`vigil prompt` shows"]),
    ],
)
def test_a_model_that_answers_in_another_form_is_stopped_and_told_what_may_help(reply: Reply, said: list[str]) -> None:
    with pytest.raises(ModelAPIError) as stopped:
        example(reply)
    for words in (*said, "Model 'some/model'", "--force"):
        assert words in str(stopped.value)
    result, asked = example(reply, force=True)
    assert result.startswith("failed: ")
    assert len(asked) == 2


def test_a_long_answer_is_shown_in_part() -> None:
    with pytest.raises(ModelAPIError) as stopped:
        example(Reply(text="a" * 5000 + "z" * 5000))
    assert "aaa ... zzz" in str(stopped.value)
    assert len(str(stopped.value)) < 1500


def test_the_example_is_asked_under_the_runs_own_conditions() -> None:
    lenient = Profile(reply_policy="lenient", coordinates="normalized_1000", image_format="jpeg")
    result, asked = example(Reply(text=f"Sure: {REPORT}"), profile=lenient)
    assert result == "passed"
    assert "normalized_1000" in asked[0][0].text
    assert present(asked[0][1].picture).format == "jpeg"
    click = '{"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": 900, "y": 900}}'
    assert example(Reply(text=click), profile=lenient)[0] == "passed"
    with pytest.raises(ModelAPIError, match="pixel_outside_frame"):
        example(Reply(text=click))


def test_a_context_that_is_too_small_is_named_with_the_size_that_is_needed() -> None:
    async def ask(messages: Sequence[Message]) -> Reply:
        raise RequestRejected("The provider rejected the request 3 times: maximum context length is 1024 tokens")

    with pytest.raises(ModelAPIError, match=r"takes about 2,\d{3} tokens. Start the server with a context of 16,384"):
        asyncio.run(check_contract(ask, "some/model", Profile()))


def test_the_example_has_something_to_walk_to() -> None:
    picture = draw_example()
    assert picture.shape == (480, 640, 3)
    red = (picture[..., 0] > 150) & (picture[..., 1] < 80)
    assert 0.02 < red.mean() < 0.1


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.25), (900, 300), (300, 700)])
def test_a_model_that_points_in_other_coordinates_is_told_how_to_find_them(x: float, y: float) -> None:
    text = json.dumps({"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": x, "y": y}})
    reply = Reply(text=text)
    invalid = read_reply(reply).parsed
    assert isinstance(invalid, InvalidAction)
    assert "other coordinates" in advice(invalid, reply)
    assert "vigil calibrate --model NAME" in advice(invalid, reply)
    assert "--coordinates" in advice(invalid, reply)
