"""The environment of verifiers: what its rows hold, what the model is sent, and what an episode is worth."""

import asyncio
import json
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, ChatResponder, ChatServer, failure, serving
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S
from vigil.agents.conversation import Message
from vigil.authoring.streaming.address import stream_version
from vigil.authoring.streaming.stream import HousePool
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.runner.models.ask import with_retries
from vigil.runner.retries import RetryPolicy
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool
from vigil.scoring.chore_answers import list_answers

vf = pytest.importorskip("verifiers.v1", reason="verifiers is not installed: docs/verifiers.md says how")

from openai import AsyncOpenAI  # noqa: E402
from verifiers.v1.serve import EnvClient, EnvServer  # noqa: E402  # pyright: ignore[reportMissingImports] - may be absent

from vigil.integrations import chat_client  # noqa: E402
from vigil.integrations import verifiers as integration  # noqa: E402
from vigil.integrations.chat_client import chat_sender  # noqa: E402
from vigil.integrations.rewards import ListRates  # noqa: E402
from vigil.integrations.verifiers.examine import examine_verifiers  # noqa: E402
from vigil.integrations.verifiers.taskset import VigilTaskConfig, VigilTasksetConfig  # noqa: E402

PAGE = (Path(__file__).parents[2] / "docs" / "verifiers.md").read_text(encoding="utf-8")
DA, SV, AI = "tiny-DA-000", "tiny-SV-002", "tiny-AI-003"
FAIL, CLOSED = (REPORT.replace("success", status) for status in ("fail", "closed"))


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("verifiers") / "pack", 8)


def environment(pack: Pack, **options: Any) -> Any:
    return integration.load_environment(pack=str(pack.folder), backend="fake", workers=1, **options)


def episodes(env: Any, brain: ChatResponder, *ids: str) -> tuple[list[Any], ChatServer]:
    """Plays the episodes of these ids at once; returns them with the server of the model."""
    tasks = [task for task in env.taskset if task.data.id in ids]

    async def play(url: str) -> list[Any]:
        context = vf.ModelContext("model", vf.EvalClientConfig(base_url=url, api_key_var="NO_KEY"))
        async with env.serving():
            slots = [slot for task in tasks for slot in env.slots(task)]
            return await asyncio.gather(*(env.run_slot(slot, context) for slot in slots))

    with serving(brain) as server:
        return asyncio.run(play(server.url)), server


def trace_of(env: Any, brain: ChatResponder, episode_id: str) -> Any:
    (played,), _ = episodes(env, brain, episode_id)
    (trace,) = played.traces
    return trace


def saying(*texts: str) -> ChatResponder:
    return lambda asked: ChatAnswer(texts[min(asked.turn, len(texts)) - 1])


def test_a_row_tells_the_episode_and_nothing_hidden(pack: Pack) -> None:
    tasks = list(environment(pack, family="SV, DA", limit=3).taskset)
    rows = [task.data.model_dump(exclude_defaults=True) for task in tasks]
    assert [row["id"] for row in rows] == ["tiny-DA-000", "tiny-DA-004", "tiny-SV-002"]
    for index, (row, task) in enumerate(zip(rows, tasks, strict=True)):
        episode = pack.episode(row["id"])
        source = f"tiny@{pack.sha256}"
        assert row == {"idx": index, "id": episode.id, "prompt": episode.instruction, "source": source}
        assert task.key == episode.id


def test_the_messages_reach_the_model_as_in_a_run_to_the_byte(pack: Pack) -> None:
    def brain(asked: ChatRequest) -> ChatAnswer:
        return ChatAnswer("<think>é</think>" + LOOK if asked.turn % 2 else "No action.")

    env = environment(pack, profile="action_feedback")
    (played,), there = episodes(env, brain, DA)

    async def play(pool: SimulatorPool, url: str) -> None:
        async with AsyncOpenAI(base_url=url, api_key="none") as client:
            ask = with_retries(chat_sender(client, "model"), RetryPolicy())
            player = ModelPlayer(pool, env.taskset.config.condition, ask, "")
            await player.play(Assignment(pack.episode(DA)))

    with serving(brain) as here, SimulatorPool(env.worker_plan(), 1) as pool:
        asyncio.run(play(pool, here.url))
    sent, wanted = ([json.dumps(asked.messages) for asked in server.asked] for server in (there, here))
    assert len(sent) > 3
    assert sent == wanted
    assert {asked.body["model"] for asked in there.asked} == {"model"}
    (trace,) = played.traces
    assert trace.num_turns == len(sent)


@pytest.mark.parametrize(
    ("episode_id", "brain", "label", "rewards"),
    [
        (SV, saying(CLOSED), "B", {"B": 1.0, "world": 0.5, "honest_fail": 0.0, "lag": 0.0}),
        (SV, saying(LOOK, REPORT), "FR", {"B": 0.0, "world": 0.5, "honest_fail": 0.0, "lag": 0.0}),
        (AI, saying(FAIL), "Other", {"B": 0.0, "world": 0.0, "honest_fail": 0.25, "lag": 0.0}),
        (SV, saying(LOOK), "NR", {"B": 0.0, "world": 0.5, "honest_fail": 0.0, "lag": 0.0}),
    ],
    ids=["true report", "false report", "honest fail", "no report"],
)
def test_an_episode_is_worth_b_and_what_is_asked_for(
    pack: Pack, episode_id: str, brain: ChatResponder, label: str, rewards: dict[str, float]
) -> None:
    env = environment(pack, world_reward=0.5, honest_fail_reward=0.25)
    trace = trace_of(env, brain, episode_id)
    assert trace.ok
    assert {name: reward.value for name, reward in trace.rewards.items()} == rewards
    assert trace.reward == sum(rewards.values())
    told = {name: value for name, value in trace.metrics.items() if name in ("FR", "NR", "IL", "Other")}
    assert told == {name: float(name == label) for name in ("FR", "NR", "IL", "Other")}
    assert trace.metrics["W"] == float(rewards["world"] > 0)
    assert trace.metrics["steps"] == trace.num_turns == trace.info["outcome"]["steps"]


def test_without_shaping_the_reward_is_b_alone(pack: Pack) -> None:
    assert trace_of(environment(pack), saying(CLOSED), SV).reward == 1.0
    assert trace_of(environment(pack), saying(REPORT), SV).reward == 0.0


def test_episodes_are_played_at_once_in_one_worker(pack: Pack) -> None:
    together = threading.Barrier(3, timeout=HANGS_AFTER_S)

    def wait(asked: ChatRequest) -> ChatAnswer:
        together.wait()
        return ChatAnswer(REPORT)

    played, _ = episodes(environment(pack), wait, DA, SV, AI)
    assert [episode.ok for episode in played] == [True] * 3


def test_a_server_of_environments_plays_rows_that_another_process_reads(pack: Pack) -> None:
    """As trainers do: what crosses to the server is the dumped row alone."""
    rows = [task.data.model_dump(mode="json") for task in environment(pack, family="SV").taskset]
    options = {"sampling": vf.SamplingConfig(), "model": "model"}

    async def play(url: str) -> list[Any]:
        server = EnvServer(environment(pack, family="SV").config, "tcp://127.0.0.1:0")
        serving_task = asyncio.create_task(server.run())
        client = EnvClient(server.address)
        await client.wait_for_server_startup()
        model = vf.EvalClientConfig(base_url=url, api_key_var="NO_KEY")
        try:
            return [await client.run(client=model, task_data=row, **options) for row in rows]
        finally:
            await client.close()
            serving_task.cancel()
            await asyncio.gather(serving_task, return_exceptions=True)

    with serving(saying(CLOSED)) as server:
        played = asyncio.run(play(server.url))
    assert [[trace.reward for trace in episode.traces] for episode in played] == [[1.0]] * len(rows)


def test_a_model_that_fails_is_an_error_and_no_reward(pack: Pack) -> None:
    trace = trace_of(environment(pack), lambda _: failure(401, "no such key"), DA)
    assert not trace.ok
    assert "no such key" in trace.errors[0].message
    assert (trace.rewards, trace.metrics) == ({}, {})


def test_an_episode_that_verifiers_stops_is_worth_nothing(pack: Pack) -> None:
    env = environment(pack, world_reward=0.5)
    env.config.agent.max_turns = 2
    trace = trace_of(env, saying(LOOK), SV)
    assert (trace.ok, trace.stop_condition, trace.reward) == (True, "max_turns", 0.0)
    assert "W" not in trace.metrics


def test_another_pack_of_the_same_episodes_is_refused(pack: Pack, tmp_path: Path) -> None:
    other = tiny_pack(tmp_path / "pack", 4)
    env = environment(other)
    (task,) = [task for task in environment(pack).taskset if task.data.id == DA]
    env.taskset.load = lambda: iter([task])
    trace = trace_of(env, saying(REPORT), DA)
    assert f"is from 'tiny@{pack.sha256}', but this machine plays 'tiny@{other.sha256}'" in trace.errors[0].message


BATHROOM = {"pack": "stream:7", "family": "PG", "houses": (15, 16), "backend": "fake", "workers": 1}
"""The cheapest house of the stream."""


def test_a_stream_is_read_in_its_order_and_played() -> None:
    env = integration.load_environment(**BATHROOM, stream_workers=0)
    assert env.taskset.bounded
    rows = [task.data for task in env.taskset]
    assert [row.idx for row in rows] == list(range(len(rows)))
    assert {(row.source, row.house) for row in rows} == {(f"stream:7@{stream_version()}", 15)}
    assert all(row.id.startswith("stream7v") for row in rows)
    assert trace_of(env, saying(FAIL), rows[0].id).metrics["Other"] == 1.0


def test_a_row_of_a_stream_is_enough_to_play_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a process that serves the environment to a trainer: it makes the house once, in the background."""
    rows = list(integration.load_environment(**BATHROOM, stream_workers=0).taskset)[:2]
    asked: list[int] = []
    ask = HousePool.ask
    monkeypatch.setattr(HousePool, "ask", lambda pool, number: asked.append(number) or ask(pool, number))
    env = integration.load_environment(**BATHROOM)
    env.taskset.load = lambda: iter(rows)
    played, server = episodes(env, saying(FAIL), *(row.data.id for row in rows))
    assert [episode.ok for episode in played] == [True, True]
    assert asked == [15]
    for row in rows:
        assert any(row.data.prompt in request.texts[0] for request in server.asked)


def test_a_stream_without_end_is_bounded_by_what_reads_it() -> None:
    endless = integration.load_environment(pack="stream:7")
    assert (endless.taskset.bounded, endless.taskset.take(3).bounded) == (False, True)
    assert integration.load_environment(pack="stream:7", limit=3).taskset.bounded


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda env: setattr(env.taskset, "system_prompt", "Be kind."), "system prompt is part of its protocol"),
        (lambda env: setattr(env, "setup", lambda agents: asyncio.sleep(0)), "need VIGIL's environment"),
    ],
)
def test_what_would_change_the_protocol_is_refused(pack: Pack, change: Callable[[Any], None], message: str) -> None:
    env = environment(pack)
    change(env)
    trace = trace_of(env, saying(REPORT), DA)
    assert message in trace.errors[0].message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"famly": "SV"}, "no option 'famly'. Did you mean 'family'?"),
        ({"family": "SB"}, "option family: Family 'SB' does not exist. The families: PG, "),
        ({"pack": "startr"}, "startr"),
        ({"profile": "base"}, "profile 'base' does not exist. Did you mean 'baseline'?"),
        ({"backend": "mujoko"}, "backend 'mujoko' does not exist. Did you mean 'mujoco'?"),
        ({"lag_penalty": -1}, "lag_penalty: Input should be greater than or equal to 0"),
        ({"pack": "stream:x"}, "option pack: Stream 'stream:x': expected stream:SEED"),
        ({"difficulty": "easy"}, "difficulty is for a stream"),
        ({"pack": "stream:7", "difficulty": "simple"}, "Difficulty 'simple' does not exist"),
        ({"pack": "stream:7", "houses": (3, 3)}, "Houses 3 to 3 of a stream: expected 0 <= FIRST < END"),
        ({"workers": 0}, "workers: Input should be greater than or equal to 1"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError) as caught:
        integration.load_environment(**options)
    assert message in str(caught.value)


def test_verifiers_finds_the_environment_by_its_name() -> None:
    assert vf.environment_class("vigil-verifiers") is integration.VigilVerifiersEnv
    config = vf.resolve_env_config({"taskset": {"id": "vigil-verifiers"}})
    assert config.agent.runtime.type == "subprocess"
    assert config.agent_harnesses()["agent"].id == "vigil-verifiers"


def test_the_page_tells_the_options() -> None:
    for kind, base in ((VigilTasksetConfig, vf.TasksetConfig), (VigilTaskConfig, vf.TaskConfig)):
        for name in kind.model_fields.keys() - base.model_fields.keys():
            field = kind.model_fields[name]
            assert f"| `{name}` | `{field.default!r}` | {field.description} |\n" in PAGE


def test_the_page_s_example_runs(pack: Pack, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert 'pack="starter"' in example
    with serving(lambda asked: ChatAnswer(REPORT if asked.turn == 3 else LOOK)) as server:
        monkeypatch.setattr(sys, "argv", ["example.py", server.url])
        exec(example.replace('pack="starter"', f'pack={str(pack.folder)!r}, backend="fake"'), {"__name__": "example"})
    ends = [line.partition(" ")[2] for line in capsys.readouterr().out.splitlines()]
    assert ends == ["3 turns, reward 0.0 {'W': 0.0, 'FR': 1.0, 'NR': 0.0, 'steps': 3.0}"] * 2
    assert ends[0] in PAGE


def test_a_list_of_chores_earns_a_reward_for_each_right_claim() -> None:
    pack = "vigil_chores_200"
    env = integration.load_environment(pack=pack, profile="itemised_report", workers=1, limit=1, claim_reward=0.5)
    (task,) = env.taskset
    chores = list_answers(Pack.load(pack).folder)[task.data.id].chores
    claims = {
        str(number): "success" if chore.is_possible and chore.kind != "question" else chore.accepted[0]
        for number, chore in enumerate(chores, start=1)
    }
    arguments = {"status": "success", "summary": "", "claims": claims}
    trace = trace_of(env, saying(json.dumps({"skill_name": "report", "arguments": arguments})), task.data.id)
    rates = ListRates(**trace.info["list"])
    assert 0 < rates.B_share < 1
    assert trace.reward == trace.rewards["claims"].value == 0.5 * rates.B_share
    assert trace.metrics["T"] == rates.T


def test_the_doctor_finds_that_all_is_right_or_that_pictures_are_dropped(
    pack: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = {"pack": str(pack.folder), "backend": "fake"}
    found = list(examine_verifiers(options, 2))
    assert len(found) == 9
    assert [finding.check for finding in found if not finding.is_right] == []

    def without_picture(message: Message) -> dict[str, Any]:
        return {"role": message.role, "content": message.text}

    monkeypatch.setattr(chat_client, "chat_message", without_picture)
    found = list(examine_verifiers(options, 2))
    assert [finding.check for finding in found if not finding.is_right] == ["frames, member 1", "frames, member 2"]
