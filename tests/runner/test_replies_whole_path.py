"""Replies of all forms, from the server's bytes to the record: judged and kept as they were sent."""

import asyncio
from pathlib import Path
from random import Random

import pytest
from inspect_ai import eval as inspect_eval
from inspect_ai.model import get_model

from tests.support.inspect_marks import INSPECT
from tests.support.narrowing import present
from tests.support.reply_forms import FORMS, draw, joined, mistakes, reasoning_sent
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from tests.support.wire_server import CUT, ENDPOINTS, STOP, STREAM, WIRES, ModelMessage, ScriptedModel, WireServer
from vigil.agents.conversation import Message
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.replies import read_reply
from vigil.records.record import EPISODES_FILE, EpisodeRecord
from vigil.records.record_file import read_records
from vigil.runner.inspect_task import vigil
from vigil.runner.models.access import Endpoint, ModelAccess
from vigil.runner.models.ask import with_retries
from vigil.runner.models.inspect_model import new_model, sender
from vigil.runner.retries import RetryPolicy
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run

pytestmark = INSPECT
STEPS = 8


def pack_of(folder: Path, episodes: int) -> Path:
    made = [tiny_episode(number, "DA", max_steps=STEPS, max_invalid=STEPS) for number in range(episodes)]
    loose_pack(folder, made, [tiny_house()])
    return folder


def told(seed: int) -> ScriptedModel:
    return ScriptedModel(lambda episode, step: draw(Random(f"{seed} {episode} {step}"))[1])


def check(records: list[EpisodeRecord], said: dict[int, list[ModelMessage]]) -> int:
    """Asserts that `records` hold what was said, and returns the number of replies."""
    assert len(records) == len(said)
    wrong: list[str] = []
    for record in records:
        sayings = said[int(record.episode_id[-3:])]
        assert len(record.steps) == len(sayings)
        for saying, step in zip(sayings, record.steps, strict=True):
            finish = (CUT if saying.is_cut else STOP)["chat"]
            assert step.reply.finish_reason == finish
            wrong += mistakes(saying, step, finish)
    assert not wrong, f"{len(wrong)} wrong:\n" + "\n".join(wrong[:10])
    return sum(len(record.steps) for record in records)


def test_250_replies_of_one_run_are_recorded_as_they_were_sent(tmp_path: Path) -> None:
    pack = pack_of(tmp_path / "pack", 36)
    story = told(1)
    with WireServer(story) as server:
        run_pack(
            RunSettings(
                pack=pack,
                model="openai/loopback",
                base_url=f"{server.url}/v1",
                log_dir=tmp_path / "run",
                backend="fake",
                workers=1,
                max_connections=16,
                preflight=False,
            )
        )
    assert check(read_records(tmp_path / "run" / EPISODES_FILE), story.said) >= 250
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def test_replies_under_inspects_own_command_are_recorded_as_they_were_sent(tmp_path: Path) -> None:
    pack = pack_of(tmp_path / "pack", 14)
    story = told(2)
    with WireServer(story) as server:
        model = get_model("openai-api/local/m", base_url=f"{server.url}/v1", api_key="none", memoize=False)
        logs = inspect_eval(
            vigil(pack=str(pack), backend="fake", workers=1, preflight=False),
            model=model,
            log_dir=str(tmp_path / "logs"),
            display="none",
        )
    samples = logs[0].samples or []
    records = [EpisodeRecord.model_validate(sample.metadata["record"]) for sample in samples]
    assert check(records, story.said) >= 80


@pytest.mark.parametrize("is_streamed", [False, True])
@pytest.mark.parametrize("wire", WIRES)
def test_each_wire_format_brings_the_text_as_it_was_sent(wire: str, is_streamed: bool) -> None:
    """Many at once, so that a call that took another's text would be found out."""
    count = 60
    say = [draw(Random(f"{wire} {number}"), can_refuse=wire in ("chat", "responses"))[1] for number in range(count)]
    story = ScriptedModel(lambda episode, _: say[episode])
    name, path, arguments = ENDPOINTS[wire]
    with WireServer(story) as server:
        given = {**arguments, STREAM[wire]: is_streamed}
        endpoint = Endpoint(ModelAccess(name, server.url + path, "key", tuple(given.items())), {"max_tokens": 1000})
        replies = asyncio.run(ask_all(endpoint, count))
    assert server.asked == count
    for said, reply in zip(say, replies, strict=True):
        text = joined(said.text)
        finish = (CUT if said.is_cut else STOP)[wire]
        assert (reply.reply_source, reply.finish_reason) == ("server", finish)
        assert reply.raw == text.encode("utf-8", "surrogatepass")
        assert Reply.model_validate_json(reply.model_dump_json()) == reply
        assert reply.reasoning_chars == reasoning_sent(said)
        sent = Reply(text=text, finish_reason="length" if said.is_cut else "stop", reasoning_chars=reasoning_sent(said))
        assert read_reply(reply).parsed == read_reply(sent).parsed
        if said.has_usage or wire == "anthropic":
            usage = present(reply.usage)
            assert (usage.input_tokens, usage.output_tokens) == (100, 10)
        else:
            assert reply.usage is None


async def ask_all(endpoint: Endpoint, count: int) -> list[Reply]:
    model = new_model(endpoint)
    ask = with_retries(sender(model), RetryPolicy(retries=0))
    try:
        messages = [[Message("user", f"metres of it ({number})")] for number in range(count)]
        return list(await asyncio.gather(*map(ask, messages)))
    finally:
        await model.api.aclose()


def test_the_generator_draws_every_form_and_both_verdicts() -> None:
    names, verdicts = set(), {True: 0, False: 0}
    for number in range(1000):
        name, said = draw(Random(number))
        names.add(name)
        reply = Reply.model_validate({"text": joined(said.text)})
        verdicts[isinstance(read_reply(reply).parsed, InvalidAction)] += 1
    assert names == set(FORMS)
    assert min(verdicts.values()) > 250
