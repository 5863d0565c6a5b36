"""Each provider's name against a server on loopback: what it is asked, where, with which key, told how to think."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from inspect_marks import INSPECT
from quick_runs import quick
from tiny_pack import loose_pack, tiny_episode, tiny_house
from wire_server import Raw, Request, Said, WireServer

from vigil.actions import Reply
from vigil.agents.model import Message
from vigil.pack import Pack
from vigil.profile import Profile
from vigil.record import EpisodeRecord
from vigil.runner.models.ask import RetryPolicy, with_retries
from vigil.runner.models.inspect_model import Endpoint, sender
from vigil.runner.models.providers import PROVIDERS, named
from vigil.runner.models.serving import Serving, only_its_key, serving
from vigil.runner.models.thinking import with_thinking
from vigil.runner.settings import worker_plan
from vigil.runner.workers.live import play_live
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool

pytestmark = INSPECT
REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
CHAT = (
    *("openai", "doubao", "qwen", "zhipu", "minimax", "moonshot", "deepseek", "openrouter", "together", "vllm"),
    *("sglang", "ollama", "lmstudio", "llama-cpp", "local", "fireworks", "sambanova", "mistral", "grok"),
    *("groq", "hf-inference-providers"),
)
"""Those that are asked for chat completions with a bearer's key."""
NAME = "org/some-model"
KEY = "the-key-that-was-chosen"


@pytest.fixture(autouse=True)
def _key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MY_KEY", KEY)


def endpoint(model: str, url: str, **sampling: Any) -> Endpoint:
    return Endpoint(serving(model, url, {}, "MY_KEY"), sampling, retry_policy=RetryPolicy(retries=0))


def ask(one: Endpoint) -> Reply:
    async def main() -> Reply:
        model = one.model()
        try:
            return await with_retries(sender(model), one.retry_policy)([Message("user", "hello")])
        finally:
            await model.api.aclose()

    with only_its_key(one.serving):
        return asyncio.run(main())


def asked(model: str, path: str, **sampling: Any) -> Request:
    """Returns the one request that a model's name leads to."""
    with WireServer(lambda wire, data: Said((REPORT,))) as server:
        reply = ask(endpoint(model, server.url + path, **sampling))
    assert (reply.text, reply.reply_source) == (REPORT, "server")
    return server.requests[-1]


@pytest.mark.parametrize("provider", CHAT)
def test_a_name_is_asked_for_chat_completions_with_the_chosen_key(provider: str) -> None:
    request = asked(f"{provider}/{NAME}", "/api/v3")
    assert request.path == "/api/v3/chat/completions"
    assert request.headers["authorization"] == f"Bearer {KEY}"
    assert request.body["model"] == NAME


@pytest.mark.parametrize("thinking", ["on", "off"])
@pytest.mark.parametrize("provider", [name for name in CHAT if PROVIDERS[name].thinking is not None])
def test_a_switch_of_thinking_arrives(provider: str, thinking: Any) -> None:
    model = f"{provider}/{NAME}"
    sampling = with_thinking({}, thinking, named(model))
    body = asked(model, "/v1", **sampling).body
    wanted = {**sampling, **sampling.get("extra_body", {})}
    wanted.pop("extra_body", None)
    assert {name: body.get(name) for name in wanted} == wanted


@pytest.mark.parametrize(
    ("model", "path", "header", "asked_for"),
    [
        ("anthropic/some-model", "", "authorization", "/v1/messages"),
        ("google/gemini-3.1-pro-preview", "", "x-goog-api-key", "models/gemini-3.1-pro-preview:generateContent"),
        ("openai/azure/gpt-5.4", "", "api-key", "/openai/responses"),
        ("perplexity/sonar", "/v1", "authorization", "/v1/responses"),
        ("openai-api/mine/m", "/v1", "authorization", "/v1/chat/completions"),
    ],
)
def test_other_formats_are_asked_in_their_own_way(model: str, path: str, header: str, asked_for: str) -> None:
    request = asked(model, path)
    assert KEY in request.headers[header]
    assert request.path.partition("?")[0].endswith(asked_for)


def test_bedrock_is_asked_in_amazons_format_and_recorded_as_the_librarys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, KEY)
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    answer = {
        "output": {"message": {"role": "assistant", "content": [{"text": REPORT}]}},
        "stopReason": "end_turn",
        "usage": {"inputTokens": 100, "outputTokens": 10, "totalTokens": 110},
        "metrics": {"latencyMs": 1},
    }
    with WireServer(lambda wire, data: Raw(json.dumps(answer).encode())) as server:
        reply = ask(Endpoint(Serving("bedrock/some.model", server.url), retry_policy=RetryPolicy(retries=0)))
    assert (reply.text, reply.reply_source) == (REPORT, "library")
    assert server.requests[0].path == "/model/some.model/converse"
    assert server.requests[0].headers["authorization"].startswith("AWS4-HMAC-SHA256 ")


def test_every_openai_style_name_plays_a_smoke_pack(tmp_path: Path) -> None:
    count = 2
    loose_pack(tmp_path / "pack", [tiny_episode(number, "DA", max_steps=3) for number in range(count)], [tiny_house()])
    pack = Pack.load(tmp_path / "pack")
    settings = quick(pack.folder, None, model="openai/m")
    look = json.dumps({"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}})

    def brain(wire: str, data: bytes) -> Said:
        return Said((f"I see.</think>\n{REPORT if data.count(b'past') else look}",))

    async def play(url: str, pool: SimulatorPool) -> dict[str, list[EpisodeRecord]]:
        records: dict[str, list[EpisodeRecord]] = {}
        for provider in CHAT:
            model = endpoint(f"{provider}/{NAME}", url).model()
            one = with_retries(sender(model), RetryPolicy(retries=0))
            games = [play_live(pool.live(Assignment(episode)), Profile(), one, "r") for episode in pack.episodes]
            records[provider] = [await game for game in games]
            await model.api.aclose()
        return records

    with (
        WireServer(brain) as server,
        SimulatorPool(worker_plan(settings, pack, Profile(), run_id="r"), 1) as pool,
    ):
        records = asyncio.run(play(f"{server.url}/v1", pool))
    for provider in CHAT:
        ends = [(record.end, len(record.steps), record.error) for record in records[provider]]
        assert ends == [("report", 2, None)] * count, provider
    assert len(server.requests) == len(CHAT) * count * 2
