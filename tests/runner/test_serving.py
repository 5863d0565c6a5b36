import pytest

from vigil.errors import SettingError
from vigil.runner.serving import NO_KEY, provider_hint, serving, without_login, without_secrets

URL = "http://localhost:8000/v1"


@pytest.fixture(autouse=True)
def _no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "OPENAI_BASE_URL", "VLLM_API_KEY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("model", "name"),
    [
        ("openai/my-model", "openai-api/openai/my-model"),
        ("vllm/Qwen/Qwen3-VL-8B-Instruct", "openai-api/vllm/Qwen/Qwen3-VL-8B-Instruct"),
        ("Qwen/Qwen3-VL-8B-Instruct", "openai-api/local/Qwen/Qwen3-VL-8B-Instruct"),
        ("my-model", "openai-api/local/my-model"),
        ("openai-api/mine/my-model", "openai-api/mine/my-model"),
    ],
)
def test_with_a_base_url_any_openai_style_server_works_without_a_key(model: str, name: str) -> None:
    found = serving(model, URL, {})
    assert (found.name, found.base_url, found.api_key) == (name, URL, NO_KEY)
    assert dict(found.arguments)["max_retries"] == 0


def test_a_key_in_the_environment_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "general")
    assert serving("vllm/m", URL, {}).api_key == "general"
    monkeypatch.setenv("VLLM_API_KEY", "own")
    assert serving("vllm/m", URL, {}).api_key == "own"


def test_without_a_base_url_inspect_decides() -> None:
    found = serving("anthropic/claude", None, {"a": 1})
    assert (found.name, found.base_url, found.api_key, found.arguments) == ("anthropic/claude", None, None, (("a", 1),))


def test_other_providers_keep_their_own_protocol_at_another_address() -> None:
    assert serving("anthropic/claude", URL, {}).name == "anthropic/claude"


def test_the_environment_may_give_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_BASE_URL", URL)
    assert serving("openai/m", None, {}).base_url == URL


@pytest.mark.parametrize(
    ("model", "url"),
    [
        ("nameless", None),
        ("openai/", URL),
        ("openai/m", "localhost:8000"),
        ("m", "file:///etc"),
        ("m", "http://"),
        ("m", "http://:8000/v1"),
        ("m", "http://host:port/v1"),
        ("m", "http://[::1/v1"),
    ],
)
def test_what_makes_no_sense_is_refused(model: str, url: str | None) -> None:
    with pytest.raises(SettingError):
        serving(model, url, {})


def test_secrets_are_blanked() -> None:
    settings = {"api_key": "k", "top_k": 5, "max_tokens": 10, "headers": {"Authorization": "Bearer x", "A": "b"}}
    assert without_secrets(settings) == {
        "api_key": "(not recorded)",
        "headers": {"Authorization": "(not recorded)", "A": "b"},
        "max_tokens": 10,
        "top_k": 5,
    }


@pytest.mark.parametrize(
    ("model", "hint"),
    [
        ("opnai/gpt-4o", " Did you mean 'openai'?"),
        ("antropic/claude", " Did you mean 'anthropic'?"),
        ("openai/gpt-4o", ""),
        ("openai-api/mine/m", ""),
        ("somebody/m", ""),
    ],
)
def test_a_mistyped_provider_is_recognised_and_a_known_one_left_alone(model: str, hint: str) -> None:
    assert provider_hint(model) == hint


@pytest.mark.parametrize(
    ("url", "kept"),
    [
        ("http://me:p@ss@host:8000/v1?key=k#x", "http://host:8000/v1"),
        ("https://[::1]:8000/v1", "https://[::1]:8000/v1"),
        (URL, URL),
        ("", ""),
    ],
)
def test_an_address_is_kept_without_what_logs_in(url: str, kept: str) -> None:
    assert without_login(url) == kept
