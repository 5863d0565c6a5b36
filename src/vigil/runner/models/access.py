"""How a model is reached: by which of Inspect's providers, at which address, with which key.

A model is named `provider/model`, as `vigil.runner.models.providers` lists them. With a base URL any OpenAI-style
server works without a key; a name without a known provider (`Qwen/Qwen3-VL-8B-Instruct`) is then the model's own.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from vigil.errors import SettingError
from vigil.runner.models.network import check_network, without_proxies
from vigil.runner.models.providers import ANY_SERVICE, ModelName, Provider, parse_model_name, provider_hint
from vigil.runner.models.redaction import is_secret_name, without_key_patterns, without_login

NO_KEY = "EMPTY"
KEY_HINT = (
    "A provider's key is sent to that provider's own hosts alone; for any other address name the variable that holds "
    "its key with --api-key-env VAR"
)
_GENERAL_ADDRESS = "INSPECT_EVAL_MODEL_BASE_URL"
_ACCOUNTS = frozenset(
    {"OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_CUSTOM_HEADERS", "ANTHROPIC_CUSTOM_HEADERS", "GOOGLE_USE_ADC"}
)
"""Variables that name an account, or headers, without a secret's name."""


@dataclass(frozen=True, slots=True)
class ModelAccess:
    """Arguments for Inspect's `get_model`."""

    name: str
    base_url: str | None = field(default=None, repr=False)
    api_key: str | None = field(default=None, repr=False)
    arguments: tuple[tuple[str, Any], ...] = field(default=(), repr=False)
    is_foreign: bool = False
    """Whether the model is served from an address that is not the provider's own."""
    model_name: ModelName | None = None
    """Parsed name of the model; None when it was not read from a name."""
    key_variable: str = ""
    """The variable that holds the key that is sent; empty when none is sent."""

    @property
    def served_name(self) -> str:
        """The model's name as the server gets it."""
        return self.model_name.name if self.model_name else self.name

    @property
    def display_name(self) -> str:
        """The model as the user may call it."""
        return f"{self.model_name.prefix}/{self.model_name.name}".lstrip("/") if self.model_name else self.name

    @property
    def description(self) -> str:
        """What is asked for, where, and with which key; no secret is in it."""
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
        """Raise SettingError when the provider's client, or the key that it wants, is not there, nor a way to it."""
        if self.missing:
            raise SettingError(self.missing)
        check_network(self.base_url or "")

    @property
    def missing(self) -> str:
        """What is not there and is needed: the provider's client, or its key; empty when nothing is."""
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
                f"Model {self.display_name!r} is signed in to with this machine's account, which needs a client that "
                f"is not installed: pip install 'vigil-bench[azure]' (in a checkout: make setup EXTRAS=azure). Or "
                f"export {self.key_variable}=..."
            )
        if provider.needs_key and not self.is_foreign and not os.environ.get(self.key_variable):
            return (
                f"Model {self.display_name!r} needs a key of {provider.title}: export {self.key_variable}=..., or name "
                "the variable that holds it with --api-key-env."
            )
        return ""


def model_access(
    model: str, base_url: str | None, model_args: Mapping[str, Any], api_key_env: str | None = None
) -> ModelAccess:
    """Return how `model` is reached, and with which key.

    A provider's own key, from its usual variable, goes to its own hosts alone; to any other address goes the value of
    the variable `api_key_env`, or none. Raises SettingError on a name, an address or a variable that makes no sense.
    """
    found = parse_model_name(model)
    provider = found.provider
    address = base_url or _from_environment(found) or provider.address or None
    if not found.is_known and address is None:
        raise SettingError(_unknown(model))
    if not found.name:
        raise SettingError(f"Model {model!r} names no model. Write e.g. openai/NAME; `vigil models` lists providers.")
    key = _key_in(api_key_env)
    if address is None and provider.is_openai_style and not model.startswith("openai/"):
        raise SettingError(
            f"Model {model!r} has no address. Add --base-url, or set {provider.addresses[0]} to it, e.g. "
            "http://localhost:8000/v1."
        )
    if address is None:
        variable = api_key_env or provider.key_variable
        return ModelAccess(model, api_key=key, arguments=_sorted(model_args), model_name=found, key_variable=variable)
    if not _is_address(address):
        shown = without_key_patterns(address)
        raise SettingError(f"Base URL {shown!r} is no http(s) address. Give e.g. http://localhost:8000/v1.")
    is_at_home = is_own_address(address, provider)
    variable = api_key_env or (provider.key_variable if is_at_home else "")
    if not provider.is_openai_style:
        if provider.signs_in and not is_at_home and key is None:
            raise SettingError(
                f"Model {model!r} signs in with an account of this machine's, which is not sent to "
                f"{without_login(address)!r}. Name the variable that holds a key for that address with --api-key-env."
            )
        own = None if is_at_home else NO_KEY
        return ModelAccess(model, address, key or own, _sorted(model_args), not is_at_home, found, variable)
    own = os.environ.get(variable) if is_at_home else None
    arguments = _sorted({"max_retries": 0, **model_args})
    name = f"{ANY_SERVICE}/{found.prefix or 'local'}/{found.name}"
    return ModelAccess(name, address, key or own or NO_KEY, arguments, not is_at_home, found, variable)


def _unknown(model: str) -> str:
    prefix, sign, _ = model.partition("/")
    what = f"names the provider {prefix!r}, which is not known" if sign else "names no provider"
    return (
        f"Model {model!r} {what}.{provider_hint(model)} Write provider/model (`vigil models` lists the providers), or "
        "add --base-url for a server of your own."
    )


@contextmanager
def hiding_other_keys(found: ModelAccess) -> Iterator[None]:
    """Take all secrets out of the environment for as long as a model is served from an address not its provider's.

    Several clients take a key from there by themselves, even where they are given another. For a server on this machine
    proxies go as well.
    """
    hidden = [name for name in os.environ if is_secret_name(name) or name in _ACCOUNTS] if found.is_foreign else []
    kept = {name: os.environ.pop(name) for name in hidden}
    try:
        with without_proxies(found.base_url or ""):
            yield
    finally:
        os.environ.update(kept)


def _from_environment(found: ModelName) -> str | None:
    """Return the address that the environment names for a provider, or for all."""
    variables = (*found.provider.addresses, _GENERAL_ADDRESS) if found.provider.addresses else (_GENERAL_ADDRESS,)
    return next(filter(None, map(os.environ.get, variables)), None) if found.prefix != "mockllm" else None


def _key_in(variable: str | None) -> str | None:
    if variable is None:
        return None
    key = os.environ.get(variable)
    if not key:
        raise SettingError(
            f"--api-key-env names {without_key_patterns(variable)!r}, which is not set in the environment. Give the "
            f"name of the variable that holds the key, e.g. `export MY_KEY=...` and --api-key-env MY_KEY."
        )
    return key


def _sorted(arguments: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    return tuple(sorted(arguments.items()))


def is_own_address(address: str, home: Provider) -> bool:
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
