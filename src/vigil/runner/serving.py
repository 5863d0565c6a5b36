"""Which of Inspect's providers serves a model, so that any OpenAI-style server works without a key.

A model is named `provider/model` as Inspect knows it. With a base URL, `openai`, `vllm`, `sglang` and the like all mean
the same: chat completions at that address; a name without a known provider (`Qwen/Qwen3-VL-8B-Instruct`) does too.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from vigil.errors import SettingError, did_you_mean

OPENAI_STYLE = frozenset({"openai", "openai-api", "vllm", "sglang", "ollama", "lmstudio", "llama-cpp", "local"})
OTHER_PROVIDERS = frozenset(
    {
        "anthropic",
        "azureai",
        "bedrock",
        "cloudflare",
        "deepseek",
        "fireworks",
        "google",
        "grok",
        "groq",
        "hf",
        "hf-inference-providers",
        "mistral",
        "mockllm",
        "moonshot",
        "openrouter",
        "perplexity",
        "sagemaker",
        "sambanova",
        "together",
    }
)
NO_KEY = "EMPTY"
_SECRET_WORDS = ("key", "token", "secret", "password", "authorization")
REDACTED = "(not recorded)"


@dataclass(frozen=True, slots=True)
class Serving:
    """What Inspect's `get_model` is called with."""

    name: str
    base_url: str | None = None
    api_key: str | None = None
    arguments: tuple[tuple[str, Any], ...] = ()


def serving(model: str, base_url: str | None, model_args: Mapping[str, Any]) -> Serving:
    """Returns how `model` is reached. Raises SettingError on a name or address that makes no sense."""
    if base_url is None and os.environ.get("OPENAI_BASE_URL") and model.startswith("openai/"):
        base_url = os.environ["OPENAI_BASE_URL"]
    provider, _, name = model.partition("/")
    if base_url is None:
        if not name:
            raise SettingError(f"Model {model!r} names no provider. Write provider/model, or add --base-url.")
        return Serving(model, arguments=tuple(sorted(model_args.items())))
    if not _is_address(base_url):
        raise SettingError(f"Base URL {base_url!r} is no http(s) address. Give e.g. http://localhost:8000/v1.")
    if provider in OTHER_PROVIDERS:
        return Serving(model, base_url, arguments=tuple(sorted(model_args.items())))
    if provider == "openai-api":
        provider, _, name = name.partition("/")
    elif provider not in OPENAI_STYLE:
        provider, name = "local", model
    if not name:
        raise SettingError(f"Model {model!r} names no model. Write e.g. openai/NAME with --base-url.")
    own_key = os.environ.get(f"{provider.upper().replace('-', '_')}_API_KEY")
    key = own_key or os.environ.get("OPENAI_API_KEY") or NO_KEY
    arguments = {"max_retries": 0, **model_args}
    return Serving(f"openai-api/{provider}/{name}", base_url, key, tuple(sorted(arguments.items())))


def _is_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is no number, an open bracket
        return False


def provider_hint(model: str) -> str:
    """Returns " Did you mean 'x'?" for a provider that is nearly a known one; empty for a known one, or none near."""
    provider, known = model.partition("/")[0], OPENAI_STYLE | OTHER_PROVIDERS
    return "" if provider in known else did_you_mean(provider, known)


def without_login(url: str) -> str:
    """Returns an address without user name, password and query, fit for a run header."""
    parts = urlsplit(url)
    return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))


def without_secrets(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Returns `settings` with keys, tokens and passwords blanked, fit for a run header."""

    def clean(name: str, value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: clean(str(key), item) for key, item in value.items()}
        return REDACTED if _is_secret(name) and isinstance(value, str) else value

    return {name: clean(name, value) for name, value in sorted(settings.items())}


def _is_secret(name: str) -> bool:
    words = name.casefold().replace("-", "_").split("_")
    return any(word in _SECRET_WORDS or word.removesuffix("s") in _SECRET_WORDS for word in words) or "apikey" in words
