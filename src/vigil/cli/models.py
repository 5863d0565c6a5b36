"""`vigil models`."""

import json
import os
from typing import Annotated

from rich.table import Table

from vigil.cli.arguments import AsJson
from vigil.cli.text import console
from vigil.errors import SettingError
from vigil.profile import coordinates_for
from vigil.runner.models.providers import PROVIDERS, Provider, named
from vigil.runner.models.serving import serving
from vigil.runner.models.thinking import how_set, leaves_of
from vigil.runner.shared_settings import ApiKeyEnv, BaseUrl
from vigil.setting import Setting

OneModel = Annotated[str | None, Setting("Say of this model alone how it would be asked.", metavar="MODEL")]
ACCOUNT = "the account's"
LISTED = tuple(name for name in PROVIDERS if name != "mockllm")
"""Providers that answer by themselves."""


def models(
    model: OneModel = None, base_url: BaseUrl = None, api_key_env: ApiKeyEnv = None, as_json: AsJson = False
) -> None:
    """Examples:
    vigil models
    vigil models --model qwen/qwen3-vl-plus
    """
    if model is not None:
        _print_facts(facts_of(model, base_url, api_key_env), as_json)
    elif base_url is not None or api_key_env is not None:
        raise SettingError("--base-url and --api-key-env are for one model: add --model.")
    elif as_json:
        print(json.dumps({name: _facts(name) for name in LISTED}))
    else:
        console().print(_table())


def facts_of(model: str, base_url: str | None = None, api_key_env: str | None = None) -> dict[str, str]:
    """Returns how a model would be asked. Raises SettingError when its name makes no sense."""
    found = serving(model, base_url, {}, api_key_env)
    return {
        "model": model,
        "asked": found.described,
        "coordinates": coordinates_for(model),
        "thinking on": how_set("on", named(model)) or "no way known",
        "thinking off": how_set("off", named(model)) or "no way known",
        "missing": found.missing or "nothing",
    }


def keys_of(name: str) -> tuple[str, ...]:
    """Returns the variables that may hold a provider's key."""
    provider = named(f"{name}/m").provider
    return provider.keys if provider.hosts else ()


def address_of(provider: Provider) -> str:
    """Returns where a provider is asked unless told otherwise."""
    if provider.address or not provider.hosts:
        return provider.address
    return ACCOUNT if provider.hosts[0].startswith(".") else f"https://{provider.hosts[0]}"


def switch_of(provider: Provider) -> str:
    """Returns the field that turns thinking on and off, with both values; empty where none is known."""
    if provider.thinking is None:
        return ""
    on, off = (leaves_of(fields)[0] for fields in (provider.thinking.on, provider.thinking.off))
    return f"{on.removeprefix('extra_body.').replace('=', ' ')} / {off.partition('=')[2]}"


def _print_facts(facts: dict[str, str], as_json: bool) -> None:
    if as_json:
        print(json.dumps(facts))
        return
    for name, value in facts.items():
        print(f"{name:14} {value}")


def _facts(name: str) -> dict[str, str]:
    provider = named(f"{name}/m").provider
    key = "the machine's account" if provider.signs_in else ""
    if provider.hosts and provider.key_variable and (not key or os.environ.get(provider.key_variable)):
        key = f"{provider.key_variable} ({'set' if os.environ.get(provider.key_variable) else 'not set'})"
    installed = "installed" if provider.is_installed else "not installed"
    return {
        "name": f"{name}/...",
        "key": key,
        "extra": f"{provider.extra} ({installed})" if provider.extra else "",
        "address": address_of(provider),
        "thinking on / off": switch_of(provider),
    }


def _table() -> Table:
    rows = [_facts(name) for name in LISTED]
    table = Table(*rows[0], box=None, pad_edge=False)
    for column in table.columns:
        column.overflow = "fold"
    for facts in rows:
        table.add_row(*facts.values())
    return table
