"""How a model is reached: through which of Inspect's providers, at which address and with which key.

A model is named `provider/model`; `vigil.runner.models.providers` lists the providers. With a base URL, any
OpenAI-style server works without a key. If a name such as `Qwen/Qwen3-VL-8B-Instruct` does not begin with a known
provider, the whole name is the model's name.
"""

import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from vigil.agents.agent import REPLY_SECONDS
from vigil.errors import SettingError
from vigil.runner.models.network import check_network, without_proxies
from vigil.runner.models.providers import ANY_SERVICE, ModelName, Provider, parse_model_name, provider_hint
from vigil.runner.models.redaction import is_secret_name, without_key_patterns, without_login
from vigil.runner.retries import RetryPolicy

NO_KEY = "EMPTY"
"""Placeholder that is sent instead of a key."""
KEY_HINT = (
    "A provider's key is sent only to that provider's hosts; for any other address, name the variable with its key by "
    "--api-key-env VAR"
)
_GENERAL_ADDRESS = "INSPECT_EVAL_MODEL_BASE_URL"
_ACCOUNTS = frozenset(
    {"OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_CUSTOM_HEADERS", "ANTHROPIC_CUSTOM_HEADERS", "GOOGLE_USE_ADC"}
)
"""Variables that set an account or headers. They are hidden like secrets, although their names do not look secret."""


@dataclass(frozen=True, slots=True)
class ModelAccess:
    """How a model is reached: the arguments for Inspect's `get_model`, with address and key."""

    name: str
    base_url: str | None = field(default=None, repr=False)
    api_key: str | None = field(default=None, repr=False)
    arguments: tuple[tuple[str, Any], ...] = field(default=(), repr=False)
    """Further arguments, as pairs of name and value, sorted by name."""
    is_foreign: bool = False
    """Whether the model is served from an address that is not the provider's."""
    model_name: ModelName | None = None
    """Parsed name of the model; None when a model was not given by name."""
    key_variable: str = ""
    """Variable with the key that is sent; empty when no key is sent."""

    @property
    def served_name(self) -> str:
        """Name of the model that is sent to the server."""
        return self.model_name.name if self.model_name else self.name

    @property
    def display_name(self) -> str:
        """Name of the model for the user, with its provider."""
        return f"{self.model_name.prefix}/{self.model_name.name}".lstrip("/") if self.model_name else self.name

    @property
    def description(self) -> str:
        """Text without secrets that says which model is asked, at which address, and which variable has the key."""
        provider = self.model_name.provider if self.model_name else None
        where = (
            without_login(self.base_url or "") or (provider and provider.default_address) or "its client's own address"
        )
        is_set = bool(os.environ.get(self.key_variable))
        if provider and provider.signs_in and not is_set:
            key = "signed in with this machine's account"
        elif self.key_variable:
            key = f"with the key in {self.key_variable}{'' if is_set else ', which is not set'}"
        else:
            key = "without a key"
        return f"{self.served_name!r} at {where}, {key}"

    def check(self) -> None:
        """Raise SettingError when the provider's client or key is missing, or when the network is misconfigured."""
        if self.missing:
            raise SettingError(self.missing)
        check_network(self.base_url or "")

    @property
    def missing(self) -> str:
        """Message that says whether the provider's client or key is missing; empty when neither is missing."""
        if self.model_name is None:
            return ""
        provider = self.model_name.provider
        if not provider.is_installed:
            return (
                f"Model {self.display_name!r} needs the client of {provider.title}, which is not installed: pip "
                f"install 'vigil-bench[{provider.extra}]' (in a checkout: make setup EXTRAS={provider.extra})"
            )
        if not provider.can_sign_in and not os.environ.get(self.key_variable):
            return (
                f"Model {self.display_name!r} signs in with this machine's account, which needs a client that is not "
                f"installed: pip install 'vigil-bench[azure]' (in a checkout: make setup EXTRAS=azure). Or export "
                f"{self.key_variable}=..."
            )
        if provider.needs_key and not self.is_foreign and not os.environ.get(self.key_variable):
            return (
                f"Model {self.display_name!r} needs a key of {provider.title}: export {self.key_variable}=..., or name "
                "the variable with the key by --api-key-env."
            )
        return ""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A model with the settings of its calls: sampling settings, time limits, retries, and number of connections."""

    access: ModelAccess
    sampling: dict[str, Any] = field(default_factory=dict[str, Any])
    """Fields of Inspect's GenerateConfig that the user set."""
    max_connections: int = 16
    reply_seconds: int = REPLY_SECONDS
    retry_policy: RetryPolicy = field(default_factory=RetryPolicy)
    keep_reasoning: bool = False
    """Whether replies include the reasoning that the server sends in a separate field."""


def model_access(
    model: str, base_url: str | None, model_args: Mapping[str, Any], api_key_env: str | None = None
) -> ModelAccess:
    """Return how `model` is reached, and with which key.

    The key in a provider's usual variable is sent only to the provider's hosts. Any other address gets the value of the
    variable that `api_key_env` names, or no key. Raises SettingError on an invalid name, address or variable.
    """
    found = parse_model_name(model)
    provider = found.provider
    address = base_url or _from_environment(found) or provider.address or None
    if not found.is_known and address is None:
        prefix, sign, _ = model.partition("/")
        what = f"names the provider {prefix!r}, which is not known" if sign else "does not name a provider"
        raise SettingError(
            f"Model {model!r} {what}.{provider_hint(model)} Write provider/model (`vigil models` lists the providers), "
            "or add --base-url for your own server."
        )
    if not found.name:
        raise SettingError(
            f"Model {model!r} names only a provider. Write e.g. openai/NAME; `vigil models` lists providers."
        )
    key, arguments = _key_in(api_key_env), tuple(sorted(model_args.items()))
    if address is None and provider.is_openai_style and not model.startswith("openai/"):
        raise SettingError(
            f"Model {model!r} has no address. Add --base-url, or set the variable {provider.addresses[0]} to the "
            "address, e.g. http://localhost:8000/v1."
        )
    if address is None:
        variable = api_key_env or provider.key_variable
        return ModelAccess(model, api_key=key, arguments=arguments, model_name=found, key_variable=variable)
    if not _is_address(address):
        shown = without_key_patterns(address)
        raise SettingError(f"Base URL {shown!r} is not an http(s) address. Give e.g. http://localhost:8000/v1.")
    is_at_home = is_own_address(address, provider)
    variable = api_key_env or (provider.key_variable if is_at_home else "")
    if not provider.is_openai_style:
        if provider.signs_in and not is_at_home and key is None:
            raise SettingError(
                f"Model {model!r} signs in with this machine's account. Only the provider gets this sign-in, not "
                f"{without_login(address)!r}. Give --api-key-env with the variable that holds a key for that address."
            )
        own = None if is_at_home else NO_KEY
        return ModelAccess(model, address, key or own, arguments, not is_at_home, found, variable)
    own = os.environ.get(variable) if is_at_home else None
    arguments = tuple(sorted({"max_retries": 0, **model_args}.items()))
    name = f"{ANY_SERVICE}/{found.prefix or 'local'}/{found.name}"
    return ModelAccess(name, address, key or own or NO_KEY, arguments, not is_at_home, found, variable)


@contextmanager
def hiding_other_keys(found: ModelAccess) -> Generator[None, None, None]:
    """If a model is served from an address that is not its provider's, hide all secrets of the environment inside the
    context.

    Several clients read a key from the environment even when they are given another key. Proxies are hidden, too, if
    the server is on this machine.
    """
    hidden = [name for name in os.environ if is_secret_name(name) or name in _ACCOUNTS] if found.is_foreign else []
    kept = {name: os.environ.pop(name) for name in hidden}
    try:
        with without_proxies(found.base_url or ""):
            yield
    finally:
        os.environ.update(kept)


def _from_environment(found: ModelName) -> str | None:
    """Return the address that the environment sets for this provider or for all providers; None if unset."""
    variables = (*found.provider.addresses, _GENERAL_ADDRESS) if found.provider.addresses else (_GENERAL_ADDRESS,)
    return next(filter(None, map(os.environ.get, variables)), None) if found.prefix != "mockllm" else None


def _key_in(variable: str | None) -> str | None:
    if variable is None:
        return None
    key = os.environ.get(variable)
    if not key:
        raise SettingError(
            f"--api-key-env names {without_key_patterns(variable)!r}, which is not set in the environment. Give the "
            f"name of the variable with the key, e.g. `export MY_KEY=...` and --api-key-env MY_KEY."
        )
    return key


def is_own_address(address: str, home: Provider) -> bool:
    """Return whether an address is on a provider's hosts and uses https, so that nobody can read the key on the way."""
    parts = urlsplit(address)
    host = (parts.hostname or "").rstrip(".")
    ours = any(host.endswith(known) if known.startswith(".") else host == known for known in home.hosts)
    return ours and parts.scheme == "https"


def _is_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        is_clean = all("!" <= char <= "~" and char != "\\" for char in url)  # parsers read other characters differently
        return is_clean and parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is not a number, or an open bracket
        return False
