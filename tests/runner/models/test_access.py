import os
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from vigil.errors import SettingError
from vigil.runner.models.access import NO_KEY, hiding_other_keys, model_access
from vigil.runner.models.providers import PROVIDERS, parse_model_name, provider_hint
from vigil.runner.models.redaction import without_login

URL = "http://localhost:8000/v1"


@pytest.fixture(autouse=True)
def _no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(os.environ):
        if name.endswith(("_API_KEY", "_BASE_URL", "_TOKEN")):
            monkeypatch.delenv(name)


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
    found = model_access(model, URL, {})
    assert (found.name, found.base_url, found.api_key) == (name, URL, NO_KEY)
    assert dict(found.arguments)["max_retries"] == 0


@pytest.mark.parametrize(
    ("model", "url", "key"),
    [
        ("openai/m", "https://api.openai.com/v1", "general"),
        ("openai/m", "https://EU.api.openai.com:443/v1", "general"),
        ("openai-api/openai/m", "https://api.openai.com./v1", "general"),
        ("openai-api/deepseek/m", "https://api.deepseek.com/v1", "deep"),
        ("openai/m", "http://api.openai.com/v1", NO_KEY),
        ("openai/m", "https://api.openai.com.evil.org/v1", NO_KEY),
        ("openai/m", "https://evilapi.openai.com/v1", NO_KEY),
        ("openai/m", "https://api.openai.com@evil.org/v1", NO_KEY),
        ("openai/m", "https://evil.org/api.openai.com/v1", NO_KEY),
        ("openai/m", URL, NO_KEY),
        ("vllm/m", URL, NO_KEY),
        ("vllm/m", "https://api.openai.com/v1", NO_KEY),
        ("openai-api/deepseek/m", URL, NO_KEY),
        ("m", "https://api.openai.com/v1", NO_KEY),
        ("anthropic/m", URL, NO_KEY),
        ("groq/m", "https://api.deepseek.com", NO_KEY),
        ("deepseek/m", "https://api.deepseek.com", None),
        ("anthropic/m", "https://api.anthropic.com", None),
    ],
)
def test_a_key_goes_to_its_providers_own_hosts_alone(
    monkeypatch: pytest.MonkeyPatch, model: str, url: str, key: str | None
) -> None:
    for name, value in {"OPENAI": "general", "VLLM": "own", "DEEPSEEK": "deep", "LOCAL": "local"}.items():
        monkeypatch.setenv(f"{name}_API_KEY", value)
    found = model_access(model, url, {})
    assert found.api_key == key
    assert found.is_foreign == (key == NO_KEY)
    monkeypatch.setenv("MY_KEY", "chosen")
    assert model_access(model, url, {}, "MY_KEY").api_key == "chosen"
    assert "chosen" not in repr(model_access(model, url, {}, "MY_KEY"))


def test_a_variable_that_is_not_set_is_named() -> None:
    with pytest.raises(SettingError, match=r"--api-key-env names 'NO_SUCH_KEY', which is not set"):
        model_access("openai/m", URL, {}, "NO_SUCH_KEY")


@pytest.mark.parametrize(
    "provider", [name for name, one in PROVIDERS.items() if not one.signs_in and name not in ("mockllm", "local")]
)
def test_an_address_in_the_environment_is_foreign_too(monkeypatch: pytest.MonkeyPatch, provider: str) -> None:
    for variable in (*parse_model_name(f"{provider}/m").provider.addresses, "INSPECT_EVAL_MODEL_BASE_URL"):
        monkeypatch.setenv(variable, URL)
        found = model_access(f"{provider}/m", None, {})
        assert (found.base_url, found.api_key, found.is_foreign) == (URL, NO_KEY, True)
        monkeypatch.delenv(variable)
    assert model_access(f"{provider}/m", None, {}).base_url == (PROVIDERS[provider].address or None)


@pytest.mark.parametrize("model", ["openai-api/mine/m", "vllm/m"])
def test_a_service_without_hosts_of_its_own_gets_no_key_unasked(monkeypatch: pytest.MonkeyPatch, model: str) -> None:
    for variable in ("MINE_BASE_URL", "VLLM_BASE_URL"):
        monkeypatch.setenv(variable, "https://mine.org/v1")
    monkeypatch.setenv("MINE_API_KEY", "own")
    assert model_access(model, None, {}).api_key == NO_KEY


@pytest.mark.parametrize("model", [f"{name}/m" for name, one in PROVIDERS.items() if one.signs_in])
def test_an_account_of_the_machine_is_not_taken_elsewhere(monkeypatch: pytest.MonkeyPatch, model: str) -> None:
    with pytest.raises(SettingError, match=r"signs in with this machine's account.*--api-key-env"):
        model_access(model, "https://me:loginword@host.org/v1", {})
    monkeypatch.setenv("MY_KEY", "chosen")
    assert model_access(model, URL, {}, "MY_KEY").api_key == "chosen"


def test_no_other_secret_is_in_the_environment_while_a_foreign_server_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("ANTHROPIC_AUTH_TOKEN", "AWS_SECRET_ACCESS_KEY", "OPENAI_ORG_ID", "OPENAI_API_KEY")
    for name in names:
        monkeypatch.setenv(name, "a-secret")
    before = dict(os.environ)
    with hiding_other_keys(model_access("anthropic/m", URL, {})):
        assert not set(names) & set(os.environ)
        assert "PATH" in os.environ
    with hiding_other_keys(model_access("anthropic/m", "https://api.anthropic.com", {})):
        assert set(names) <= set(os.environ)
    assert dict(os.environ) == before


def test_without_a_base_url_inspect_decides() -> None:
    found = model_access("anthropic/claude", None, {"a": 1})
    assert (found.name, found.base_url, found.api_key, found.arguments) == ("anthropic/claude", None, None, (("a", 1),))


def test_other_providers_keep_their_own_protocol_at_another_address() -> None:
    assert model_access("anthropic/claude", URL, {}).name == "anthropic/claude"


def test_the_environment_may_give_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_BASE_URL", URL)
    assert model_access("openai/m", None, {}).base_url == URL


@pytest.mark.parametrize(
    ("model", "url"),
    [
        ("nameless", None),
        ("local/m", None),
        ("openai-api/mine/m", None),
        ("openai/", URL),
        ("vllm", URL),
        ("openai/m", "localhost:8000"),
        ("m", "file:///etc"),
        ("m", "http://"),
        ("m", "http://:8000/v1"),
        ("m", "http://host:port/v1"),
        ("m", "http://[::1/v1"),
        ("openai/m", "https://evil.org\\@api.openai.com/v1"),
        ("openai/m", "https://api.openai.com/v1\n"),
    ],
)
def test_what_makes_no_sense_is_refused(model: str, url: str | None) -> None:
    with pytest.raises(SettingError):
        model_access(model, url, {})


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


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("Qwen/Qwen3-VL-8B-Instruct", "'Qwen', which is not known. Did you mean 'qwen'?"),
        ("Doubao/seed", "Did you mean 'doubao'?"),
        ("dubao/seed", "Did you mean 'doubao'?"),
        ("OpenAI/gpt-4o", "Did you mean 'openai'?"),
        ("nobody-knows/m", "'nobody-knows', which is not known. Write provider/model"),
        ("gpt-4o", "does not name a provider. Write provider/model"),
    ],
)
def test_a_name_without_a_known_provider_and_address_is_refused(model: str, said: str) -> None:
    with pytest.raises(SettingError) as refused:
        model_access(model, None, {})
    assert said in str(refused.value)
    assert "--base-url" in str(refused.value)


@pytest.mark.parametrize(
    ("model", "served_name"),
    [
        ("qwen/qwen3-vl-plus", "qwen3-vl-plus"),
        ("Qwen/Qwen3-VL-8B-Instruct", "Qwen/Qwen3-VL-8B-Instruct"),
        ("local/qwen/qwen3-vl-8b", "qwen/qwen3-vl-8b"),
        ("vllm/Qwen/Qwen3-VL-8B-Instruct", "Qwen/Qwen3-VL-8B-Instruct"),
    ],
)
def test_a_prefix_is_a_provider_in_its_exact_case_alone(model: str, served_name: str) -> None:
    assert model_access(model, URL, {}).served_name == served_name


OPENAI_STYLE_AT_HOME = [name for name, one in PROVIDERS.items() if one.is_openai_style and one.hosts and one.address]


@pytest.mark.parametrize("provider", OPENAI_STYLE_AT_HOME)
def test_a_providers_key_goes_to_its_address_and_to_its_other_hosts(
    monkeypatch: pytest.MonkeyPatch, provider: str
) -> None:
    one = PROVIDERS[provider]
    monkeypatch.setenv(one.keys[0], "its-own-key")
    for address in (None, *(f"https://{host.lstrip('.')}/v1" for host in one.hosts)):
        found = model_access(f"{provider}/m", address, {})
        assert (found.api_key, found.key_variable, found.is_foreign) == ("its-own-key", one.keys[0], False)
        found.check()
    assert model_access(f"{provider}/m", URL, {}).api_key == NO_KEY
    monkeypatch.delenv(one.keys[0])
    with pytest.raises(SettingError, match=f"needs a key of .*export {one.keys[0]}=.*--api-key-env"):
        model_access(f"{provider}/m", None, {}).check()


def test_a_client_that_is_not_installed_is_named_with_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GOOGLE_API_KEY", "a-key")
    model_access("google/gemini-3.1-pro-preview", None, {}).check()
    gone = replace(PROVIDERS["google"], client="google.no_such_client")
    monkeypatch.setitem(PROVIDERS, "google", gone)
    with pytest.raises(SettingError, match=r"pip install 'vigil-bench\[google\]'.*make setup EXTRAS=google"):
        model_access("google/gemini-3.1-pro-preview", None, {}).check()


def test_every_extra_of_the_table_is_one_of_the_distribution() -> None:
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {one.extra for one in PROVIDERS.values() if one.extra}
    assert extras <= set(project["optional-dependencies"])
    assert {one.extra for one in PROVIDERS.values() if one.client} == extras
