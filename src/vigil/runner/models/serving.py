"""Which of Inspect's providers serves a model, so that any OpenAI-style server works without a key.

A model is named `provider/model` as Inspect knows it. With a base URL, `openai`, `vllm`, `sglang` and the like all mean
the same: chat completions at that address; a name without a known provider (`Qwen/Qwen3-VL-8B-Instruct`) does too.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import urlsplit

from vigil.errors import SettingError, did_you_mean
from vigil.runner.models.redaction import is_secret, without_forms, without_login

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
KEY_HINT = (
    "A provider's key is sent to that provider's own hosts alone; for any other address name the variable that holds "
    "its key with --api-key-env VAR"
)


@dataclass(frozen=True, slots=True)
class ProviderDefaults:
    """Where a provider lives, and which variables of the environment lead elsewhere."""

    hosts: tuple[str, ...] = ()
    """Host names; one that begins with a dot stands for all below it."""
    addresses: tuple[str, ...] = ()
    """Variables that may hold another address."""
    key: str = ""
    """The variable that holds the key, where it is not named after the provider."""
    signs_in: bool = False
    """With a cloud account of the machine's, not with a key."""


_AZURE = (".openai.azure.com", ".services.ai.azure.com", ".models.ai.azure.com", ".cognitiveservices.azure.com")
_AWS = (".amazonaws.com",)
_GOOGLE = (".googleapis.com",)
PROVIDER_DEFAULTS = {
    "openai": ProviderDefaults(("api.openai.com", ".api.openai.com"), ("OPENAI_BASE_URL",)),
    "openai/azure": ProviderDefaults(
        _AZURE, ("AZUREAI_OPENAI_BASE_URL", "AZURE_OPENAI_BASE_URL", "AZURE_OPENAI_ENDPOINT"), signs_in=True
    ),
    "openai/bedrock": ProviderDefaults(_AWS, ("BEDROCK_OPENAI_BASE_URL", "AWS_BEDROCK_BASE_URL"), signs_in=True),
    "anthropic": ProviderDefaults(("api.anthropic.com",), ("ANTHROPIC_BASE_URL",)),
    "anthropic/azure": ProviderDefaults(
        _AZURE, ("AZUREAI_ANTHROPIC_BASE_URL", "AZURE_ANTHROPIC_BASE_URL"), signs_in=True
    ),
    "anthropic/bedrock": ProviderDefaults(
        _AWS, ("ANTHROPIC_BEDROCK_BASE_URL", "BEDROCK_ANTHROPIC_BASE_URL"), signs_in=True
    ),
    "anthropic/vertex": ProviderDefaults(
        _GOOGLE, ("ANTHROPIC_VERTEX_BASE_URL", "VERTEX_ANTHROPIC_BASE_URL"), signs_in=True
    ),
    "google": ProviderDefaults(
        ("generativelanguage.googleapis.com",), ("GOOGLE_BASE_URL", "GOOGLE_GEMINI_BASE_URL", "GEMINI_BASE_URL")
    ),
    "google/vertex": ProviderDefaults(_GOOGLE, ("GOOGLE_VERTEX_BASE_URL", "VERTEX_BASE_URL"), signs_in=True),
    "mistral": ProviderDefaults(("api.mistral.ai",), ("MISTRAL_BASE_URL",)),
    "mistral/azure": ProviderDefaults(_AZURE, ("AZUREAI_MISTRAL_BASE_URL", "AZURE_MISTRAL_BASE_URL"), signs_in=True),
    "azureai": ProviderDefaults(
        _AZURE, ("AZUREAI_BASE_URL", "AZUREAI_ENDPOINT_URL", "AZURE_ENDPOINT_URL"), signs_in=True
    ),
    "bedrock": ProviderDefaults(
        _AWS, ("BEDROCK_BASE_URL", "AWS_ENDPOINT_URL_BEDROCK_RUNTIME", "AWS_ENDPOINT_URL"), signs_in=True
    ),
    "sagemaker": ProviderDefaults(
        _AWS, ("SAGEMAKER_BASE_URL", "AWS_ENDPOINT_URL_SAGEMAKER_RUNTIME", "AWS_ENDPOINT_URL"), signs_in=True
    ),
    "cloudflare": ProviderDefaults(("api.cloudflare.com",), ("CLOUDFLARE_BASE_URL",)),
    "deepseek": ProviderDefaults(("api.deepseek.com",), ("DEEPSEEK_BASE_URL",)),
    "fireworks": ProviderDefaults(("api.fireworks.ai",), ("FIREWORKS_BASE_URL",)),
    "grok": ProviderDefaults(("api.x.ai", ".api.x.ai"), ("XAI_BASE_URL", "GROK_BASE_URL")),
    "groq": ProviderDefaults(("api.groq.com",), ("GROQ_BASE_URL",)),
    "hf-inference-providers": ProviderDefaults(
        ("router.huggingface.co",), ("HF_INFERENCE_PROVIDERS_BASE_URL",), "HF_TOKEN"
    ),
    "moonshot": ProviderDefaults(("api.moonshot.ai", "api.moonshot.cn"), ("MOONSHOT_BASE_URL",)),
    "openrouter": ProviderDefaults(("openrouter.ai",), ("OPENROUTER_BASE_URL",)),
    "perplexity": ProviderDefaults(("api.perplexity.ai",), ("PERPLEXITY_BASE_URL",)),
    "sambanova": ProviderDefaults(("api.sambanova.ai",), ("SAMBANOVA_BASE_URL",)),
    "together": ProviderDefaults(("api.together.xyz", "api.together.ai"), ("TOGETHER_BASE_URL",)),
}
"""By provider, or provider and service. One that is not here has no host of its own."""
_GENERAL_ADDRESS = "INSPECT_EVAL_MODEL_BASE_URL"
_ACCOUNTS = frozenset(
    {"OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_CUSTOM_HEADERS", "ANTHROPIC_CUSTOM_HEADERS", "GOOGLE_USE_ADC"}
)
"""Variables that name an account, or headers, without a secret's name."""


@dataclass(frozen=True, slots=True)
class Serving:
    """What Inspect's `get_model` is called with."""

    name: str
    base_url: str | None = field(default=None, repr=False)
    api_key: str | None = field(default=None, repr=False)
    arguments: tuple[tuple[str, Any], ...] = field(default=(), repr=False)
    is_foreign: bool = False
    """Served from an address that is none of the provider's own."""


def serving(model: str, base_url: str | None, model_args: Mapping[str, Any], api_key_env: str | None = None) -> Serving:
    """Returns how `model` is reached, and with which key.

    A provider's own key, from its usual variable, goes to its own hosts alone; to any other address goes the value of
    the variable `api_key_env`, or none. Raises SettingError on a name, an address or a variable that makes no sense.
    """
    provider, _, name = model.partition("/")
    home = _home(provider, name)
    address = base_url or _from_environment(provider, name, home)
    key = _key_in(api_key_env)
    if address is None:
        if not name:
            raise SettingError(f"Model {model!r} names no provider. Write provider/model, or add --base-url.")
        return Serving(model, api_key=key, arguments=_sorted(model_args))
    if not _is_address(address):
        shown = without_forms(address)
        raise SettingError(f"Base URL {shown!r} is no http(s) address. Give e.g. http://localhost:8000/v1.")
    is_at_home = _is_at_home(address, home)
    if provider in OTHER_PROVIDERS or home.signs_in:
        if home.signs_in and not is_at_home and key is None:
            raise SettingError(
                f"Model {model!r} signs in with an account of this machine's, which is not sent to "
                f"{without_login(address)!r}. Name the variable that holds a key for that address with --api-key-env."
            )
        own = None if is_at_home else NO_KEY
        return Serving(model, address, key or own, _sorted(model_args), is_foreign=not is_at_home)
    if provider == "openai-api":
        provider, _, name = name.partition("/")
    elif provider not in OPENAI_STYLE:
        provider, name = "local", model
    if not name:
        raise SettingError(f"Model {model!r} names no model. Write e.g. openai/NAME with --base-url.")
    own = os.environ.get(home.key) if is_at_home else None
    arguments = _sorted({"max_retries": 0, **model_args})
    return Serving(f"openai-api/{provider}/{name}", address, key or own or NO_KEY, arguments, not is_at_home)


@contextmanager
def only_its_key(found: Serving) -> Iterator[None]:
    """Takes all secrets out of the environment for as long as a model is served from an address not its provider's.

    Several clients take a key from there by themselves, even where they are given another.
    """
    hidden = [name for name in os.environ if is_secret(name) or name in _ACCOUNTS] if found.is_foreign else []
    kept = {name: os.environ.pop(name) for name in hidden}
    try:
        yield
    finally:
        os.environ.update(kept)


def _home(provider: str, name: str) -> ProviderDefaults:
    if provider == "openai-api":
        provider, _, name = name.partition("/")
    stem = provider.upper().replace("-", "_")
    known = (
        PROVIDER_DEFAULTS.get(f"{provider}/{name.partition('/')[0]}")
        or PROVIDER_DEFAULTS.get(provider)
        or ProviderDefaults()
    )
    return replace(known, addresses=known.addresses or (f"{stem}_BASE_URL",), key=known.key or f"{stem}_API_KEY")


def _from_environment(provider: str, name: str, home: ProviderDefaults) -> str | None:
    """Returns the address that Inspect would take from the environment for a named provider."""
    variables = (*home.addresses, _GENERAL_ADDRESS) if name and provider != "mockllm" else ()
    return next(filter(None, map(os.environ.get, variables)), None)


def _key_in(variable: str | None) -> str | None:
    if variable is None:
        return None
    key = os.environ.get(variable)
    if not key:
        raise SettingError(
            f"--api-key-env names {without_forms(variable)!r}, which is not set in the environment. Give the name of "
            f"the variable that holds the key, e.g. `export MY_KEY=...` and --api-key-env MY_KEY."
        )
    return key


def _sorted(arguments: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    return tuple(sorted(arguments.items()))


def _is_at_home(address: str, home: ProviderDefaults) -> bool:
    """Whether an address is one of a provider's own hosts, reached so that nobody on the way can read the key."""
    parts = urlsplit(address)
    host = (parts.hostname or "").rstrip(".")
    ours = any(host.endswith(known) if known.startswith(".") else host == known for known in home.hosts)
    return ours and parts.scheme == "https"


def _is_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        is_clean = all("!" <= char <= "~" and char != "\\" for char in url)  # parsers differ in what the rest means
        return is_clean and parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is no number, an open bracket
        return False


def provider_hint(model: str) -> str:
    """Returns " Did you mean 'x'?" for a provider that is nearly a known one; empty for a known one, or none near."""
    provider, known = model.partition("/")[0], OPENAI_STYLE | OTHER_PROVIDERS
    return "" if provider in known else did_you_mean(provider, known)
