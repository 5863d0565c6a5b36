import asyncio

import numpy as np
import pytest
from chat_server import read_number

from vigil.actions import Reply
from vigil.agents.model import Message
from vigil.agents.picture import encode
from vigil.errors import ModelAPIError
from vigil.runner.models.ask import RequestRejected
from vigil.runner.models.preflight import check_sight, draw_number, number_for


def check(text: str, name: str = "some/model") -> None:
    async def ask(messages: list[Message]) -> Reply:
        return Reply(text=text)

    asyncio.run(check_sight(ask, name, "png"))


def test_a_model_that_reads_the_number_passes() -> None:
    check(f" It says **{number_for('some/model')}**.")


@pytest.mark.parametrize("text", ["", "I cannot see pictures.", "1234567", "12"])
def test_a_blind_model_does_not(text: str) -> None:
    with pytest.raises(ModelAPIError, match="pictures do not seem to reach it"):
        check(text)


@pytest.mark.parametrize(("address", "where"), [("http://host/v1", " at http://host/v1"), ("", "")])
def test_a_model_that_does_not_answer_is_named_with_its_address_and_what_to_do(address: str, where: str) -> None:
    async def ask(messages: list[Message]) -> Reply:
        raise ModelAPIError("Connection error. (after 3 attempts)")

    with pytest.raises(ModelAPIError) as raised:
        asyncio.run(check_sight(ask, "some/model", "png", address))
    said = str(raised.value)
    assert said.startswith(f"Model 'some/model'{where} did not answer the call before the run: Connection error.")
    assert "Check that it is served there under that name, and the key" in said


def test_a_rejected_request_does_not_pass() -> None:
    async def ask(messages: list[Message]) -> Reply:
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
        assert read_number(encode(draw_number(number)).data) == number
