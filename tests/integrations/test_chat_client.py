"""A model asked without Inspect is sent what it is sent with it, and its failures are told apart alike."""

import asyncio
import json
from pathlib import Path

import pytest
from openai import AsyncOpenAI

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, ChatResponder, ChatServer, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick
from tests.support.tiny_pack import tiny_pack
from vigil.agents.conversation import Message
from vigil.errors import ModelAPIError
from vigil.integrations.chat_client import chat_sender
from vigil.protocol.actions import Reply
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.records.record import EpisodeRecord
from vigil.runner.models.ask import Ask, RequestRejected, with_retries
from vigil.runner.retries import RetryPolicy
from vigil.runner.run import run_pack
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool

pytestmark = INSPECT
EPISODE = "tiny-DA-000"
PROFILE = Profile(name=ACTION_FEEDBACK)
PATIENT = RetryPolicy(retries=2, first_wait_s=0.01)


def asking(server: ChatServer) -> tuple[AsyncOpenAI, Ask]:
    client = AsyncOpenAI(base_url=server.url, api_key="none", max_retries=0)
    return client, with_retries(chat_sender(client, "loopback"), PATIENT)


def played(pack_folder: Path, server: ChatServer) -> EpisodeRecord:
    """The record of the episode, its model asked without Inspect."""
    pack = tiny_pack(pack_folder)

    async def play(pool: SimulatorPool) -> EpisodeRecord:
        client, ask = asking(server)
        async with client:
            return await ModelPlayer(pool, PROFILE, ask, "").play(Assignment(pack.episode(EPISODE)))

    with SimulatorPool(WorkerPlan(pack.folder, "", PROFILE, backend="fake"), 1) as pool:
        return asyncio.run(play(pool))


def answered(brain: ChatResponder) -> tuple[Reply, int]:
    """The reply to a message, and in how many requests it was had."""

    async def ask_once(server: ChatServer) -> Reply:
        client, ask = asking(server)
        async with client:
            return await ask([Message("user", "Hello")])

    with serving(brain) as server:
        return asyncio.run(ask_once(server)), len(server.asked)


def looking_on(asked: ChatRequest) -> ChatAnswer:
    """Fills the history and cuts it; a long reply, reasoning and prose are among it."""
    if asked.turn == 2:
        return ChatAnswer("<think>up or down?</think>" + LOOK.replace("}}", '}, "thought": "é' + "x" * 5000 + '"}'))
    return ChatAnswer("No action.") if asked.turn == 4 else ChatAnswer(LOOK, reasoning="hm")


def test_the_messages_are_those_of_a_run_to_the_byte(tmp_path: Path) -> None:
    with serving(looking_on) as here:
        record = played(tmp_path / "pack", here)
    with serving(looking_on) as there:
        one = {"episode_ids": (EPISODE,), "profile": ACTION_FEEDBACK, "preflight": False}
        wanted = quick(tmp_path / "pack", tmp_path / "run", model="openai/loopback", base_url=there.url, **one)
        (of_run,) = run_pack(wanted).records
    sent, wanted_of = ([json.dumps(asked.messages) for asked in server.asked] for server in (here, there))
    assert len(sent) == len(of_run.steps) == 12
    assert sent == wanted_of
    assert [step.reply.text for step in record.steps] == [step.reply.text for step in of_run.steps]
    assert [step.reply.reasoning_chars for step in record.steps] == [s.reply.reasoning_chars for s in of_run.steps]
    assert (record.end, record.steps[-1].world) == (of_run.end, of_run.steps[-1].world)


def test_a_reply_is_the_server_s_own_text_with_its_usage() -> None:
    reply, _ = answered(lambda _: ChatAnswer("so be it", finish_reason="length", reasoning="hm", input_tokens=7))
    assert (reply.text, reply.reply_source, reply.finish_reason) == ("so be it", "server", "length")
    assert (reply.reasoning_chars, reply.usage and reply.usage.input_tokens) == (2, 7)


@pytest.mark.parametrize(
    "trouble", [failure(503), failure(429), ChatAnswer("cut", breaks=True), ChatAnswer("", is_garbage=True)], ids=repr
)
def test_what_may_be_gone_the_next_time_is_tried_again(trouble: ChatAnswer) -> None:
    answers = iter([trouble, trouble, ChatAnswer(REPORT)])
    reply, requests = answered(lambda _: next(answers))
    assert (reply.text, requests) == (REPORT, 3)


def test_other_errors_are_raised_with_what_the_server_said() -> None:
    with pytest.raises(ModelAPIError, match=r"HTTP 401: .*no such key.* \(after 1 attempts\)"):
        answered(lambda _: failure(401, "no such key"))
    with pytest.raises(ModelAPIError, match=r"HTTP 503: .*asleep.* \(after 3 attempts\)"):
        answered(lambda _: failure(503, "asleep"))


def test_a_rejection_because_of_length_is_told_apart() -> None:
    with pytest.raises(RequestRejected, match=r"rejected the request 3 times: .*context length"):
        answered(lambda _: failure(400, "This model's maximum context length is 4096 tokens."))
