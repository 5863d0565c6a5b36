"""Each provider's name against a server on loopback: what it is asked, where, with which key, told how to think."""

import asyncio
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick
from tests.support.reasoning_forms import REASONING_FORMS, FormsInTurn, check_reply, shared_simulator
from tests.support.wire_server import ModelMessage, RawAnswer, Request, WireServer, body_of
from vigil.agents.conversation import Message
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.runner.models.access import Endpoint, ModelAccess, hiding_other_keys, model_access
from vigil.runner.models.ask import with_retries
from vigil.runner.models.inspect_model import new_model, sender
from vigil.runner.models.providers import PROVIDERS, parse_model_name, with_thinking
from vigil.runner.retries import RetryPolicy
from vigil.runner.run import run_pack

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


def in_table(model: str) -> str:
    """Return the name in the table of providers that a model's name begins with."""
    return max((name for name in PROVIDERS if model.startswith(f"{name}/")), key=len)


def endpoint(model: str, url: str, **sampling: Any) -> Endpoint:
    return Endpoint(model_access(model, url, {}, "MY_KEY"), sampling, retry_policy=RetryPolicy(retries=0))


def ask(one: Endpoint, times: int = 1) -> list[Reply]:
    async def main() -> list[Reply]:
        model = new_model(one)
        try:
            send = with_retries(sender(model), one.retry_policy)
            return [await send([Message("user", "hello")]) for _ in range(times)]
        finally:
            await model.api.aclose()

    with hiding_other_keys(one.access):
        return asyncio.run(main())


def asked(model: str, path: str, **sampling: Any) -> Request:
    """Return the last request that is sent for a model's name."""
    with WireServer(lambda wire, data: ModelMessage((REPORT,))) as server:
        (reply,) = ask(endpoint(model, server.url + path, **sampling))
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
    sampling = with_thinking({}, thinking, parse_model_name(model))
    body = asked(model, "/v1", **sampling).body
    wanted = {**sampling, **sampling.get("extra_body", {})}
    wanted.pop("extra_body", None)
    assert {name: body.get(name) for name in wanted} == wanted


OTHERS = {
    "anthropic/some-model": ("", "authorization", "/v1/messages"),
    "google/gemini-3.1-pro-preview": ("", "x-goog-api-key", "models/gemini-3.1-pro-preview:generateContent"),
    "openai/azure/gpt-5.4": ("", "api-key", "/openai/responses"),
    "perplexity/sonar": ("/v1", "authorization", "/v1/responses"),
}


@pytest.mark.parametrize(
    ("model", "path", "header", "served_name"),
    [
        *((model, *told) for model, told in OTHERS.items()),
        ("openai-api/mine/m", "/v1", "authorization", "/v1/chat/completions"),
    ],
)
def test_other_formats_are_asked_in_their_own_way(model: str, path: str, header: str, served_name: str) -> None:
    request = asked(model, path)
    assert KEY in request.headers[header]
    assert request.path.partition("?")[0].endswith(served_name)


@dataclass(frozen=True)
class Cloud:
    """A provider that is asked with an account's credentials."""

    model: str
    asked_at: str
    header: str
    """Which one holds the credential, and how that begins."""
    answer: str = "anthropic"
    """The format of the answer."""
    arguments: tuple[tuple[str, Any], ...] = ()
    source: str = "server"


AWS = "AWS4-HMAC-SHA256 Credential=an-account"
CLOUDS = (
    Cloud("openai/bedrock/openai.gpt-5.4", "/responses", f"authorization: Bearer {KEY}", "responses"),
    Cloud("anthropic/azure/claude-sonnet-4", "/v1/messages", f"api-key: {KEY}"),
    Cloud("anthropic/bedrock/some.claude", "/model/some.claude/invoke", f"authorization: {AWS}"),
    Cloud(
        "anthropic/vertex/claude-sonnet-4",
        "/projects/mine/locations/us-east5/publishers/anthropic/models/claude-sonnet-4:rawPredict",
        f"authorization: Bearer {KEY}",
        arguments=(("access_token", KEY),),
    ),
    Cloud("google/vertex/gemini-3.1-pro-preview", ":generateContent", f"x-goog-api-key: {KEY}", "google"),
    Cloud("cloudflare/org/m", "/chat/completions", f"authorization: Bearer {KEY}", "chat"),
    Cloud("bedrock/some.model", "/model/some.model/converse", f"authorization: {AWS}", "converse", source="library"),
    Cloud("sagemaker/m", "/endpoints/m/invocations", f"authorization: {AWS}", "chat", source="library"),
)
CONVERSED = {
    "output": {"message": {"role": "assistant", "content": [{"text": REPORT}]}},
    "stopReason": "end_turn",
    "usage": {"inputTokens": 100, "outputTokens": 10, "totalTokens": 110},
    "metrics": {"latencyMs": 1},
}


@pytest.mark.parametrize("cloud", CLOUDS, ids=lambda cloud: cloud.model)
def test_a_cloud_is_asked_with_its_credentials_in_its_own_format(cloud: Cloud, monkeypatch: pytest.MonkeyPatch) -> None:
    account = {
        "AWS_ACCESS_KEY_ID": "an-account",
        "AWS_SECRET_ACCESS_KEY": KEY,
        "AWS_DEFAULT_REGION": "us-east-1",
        "ANTHROPIC_VERTEX_PROJECT_ID": "mine",
        "ANTHROPIC_VERTEX_REGION": "us-east5",
        "VERTEX_API_KEY": KEY,
        "CLOUDFLARE_ACCOUNT_ID": "mine",
    }
    for name, value in account.items():
        monkeypatch.setenv(name, value)

    def brain(wire: str, data: bytes) -> RawAnswer:
        if cloud.answer == "converse":
            return RawAnswer(json.dumps(CONVERSED).encode())
        return body_of(cloud.answer, ModelMessage((REPORT,)), is_streamed=False)

    with WireServer(brain) as server:
        found = ModelAccess(cloud.model, server.url, None if "vertex" in cloud.model else KEY, cloud.arguments)
        if cloud.model.startswith("sagemaker/"):  # it takes its address as an argument alone
            found = ModelAccess(cloud.model, arguments=(("endpoint_url", server.url),))
        (reply,) = ask(Endpoint(found, {"max_tokens": 100}, retry_policy=RetryPolicy(retries=0)))
    assert (reply.text, reply.reply_source) == (REPORT, cloud.source)
    name, _, value = cloud.header.partition(": ")
    assert server.requests[0].path.partition("?")[0].endswith(cloud.asked_at)
    assert server.requests[0].headers[name].startswith(value)


def test_the_table_says_which_providers_are_played_against_a_stand_in() -> None:
    tried = {*CHAT, *(in_table(one) for one in (*OTHERS, *(cloud.model for cloud in CLOUDS)))}
    assert {name for name, one in PROVIDERS.items() if one.is_in_tests} - {"mockllm"} == tried


@pytest.mark.parametrize("provider", CHAT)
def test_a_name_reads_every_form_of_reasoning(provider: str) -> None:
    forms = iter(REASONING_FORMS.values())
    with WireServer(lambda wire, data: next(forms).said) as server:
        replies = ask(endpoint(f"{provider}/{NAME}", f"{server.url}/v1"), len(REASONING_FORMS))
    for name, reply in zip(REASONING_FORMS, replies, strict=True):
        check_reply(name, reply)


def test_every_openai_style_name_plays_the_smoke_pack(tmp_path: Path) -> None:
    """A run for each name, of a quarter of the pack, in forms of reasoning that change from name to name."""
    pack = Pack.load("vigil_smoke")
    model, played = FormsInTurn(pack), set[str]()
    with WireServer(model) as server, shared_simulator(pack):
        wanted = {"base_url": f"{server.url}/v1", "api_key_env": "MY_KEY", "preflight": False, "limit": 2}
        wanted["max_connections"] = 1  # as `FormsInTurn` needs
        for time, provider in enumerate(CHAT):
            settings = quick(pack.folder, tmp_path / provider, model=f"{provider}/{NAME}", **wanted)
            records = run_pack(settings).records
            assert len(records) == 2, provider
            played |= {model.check(record, time) for record in records}
    assert played == set(REASONING_FORMS)


def test_every_name_asked_in_openais_style_is_played() -> None:
    assert {name for name, one in PROVIDERS.items() if one.is_openai_style} <= set(CHAT)
