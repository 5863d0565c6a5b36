"""The verbs of `vigil`. A verb is loaded only when it is called, so `vigil --help` does not load simulators and
figures."""

import inspect
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from vigil.cli.options import with_options


@dataclass(frozen=True, slots=True)
class Verb:
    """A row of `verbs.toml`: the place of a verb's function, and its line in the help.

    The function's docstring is the rest of the help.
    """

    place: str
    """Module of this package, colon, name of the function, e.g. "runs:run"."""
    help: str
    is_hidden: bool = False
    takes_more: bool = False
    """Whether unknown options are not an error, but are put into the context's `args`."""


@dataclass(frozen=True, slots=True)
class Group:
    """Verbs about one subject, under one name, e.g. `vigil pack info`."""

    help: str
    verbs: Mapping[str, Verb]


def _read(row: dict[str, Any]) -> Verb | Group:
    if "verbs" not in row:
        return Verb(**row)
    return Group(row["help"], {name: Verb(**each) for name, each in row["verbs"].items()})


_ROWS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
VERBS: dict[str, Verb | Group] = {name: _read(row) for name, row in _ROWS.items()}
_MORE = {"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": ["--help"]}
"""Context settings without the help option `-h`, which Unity's options such as `-screen-height` would trigger."""


class Verbs(TyperGroup):
    """Command group that lists all commands, and loads only the one that is called."""

    def __init__(self, *, verbs: Mapping[str, Verb | Group] = VERBS, **settings: Any) -> None:
        commands = {name: _listed(name, verb) for name, verb in verbs.items()}
        super().__init__(**{**settings, "commands": commands})
        self._verbs = verbs

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Return the called name, its command and the remaining arguments."""
        name, command, rest = super().resolve_command(ctx, args)
        verb = self._verbs.get(name or "")
        return name, load(verb) if isinstance(verb, Verb) else command, rest


def _listed(name: str, verb: Verb | Group) -> TyperCommand | TyperGroup:
    """Return a stand-in that shows a verb in the list of commands without loading it; a group is returned as it is."""
    if isinstance(verb, Group):
        return Verbs(name=name, help=verb.help, verbs=verb.verbs, no_args_is_help=True)
    return TyperCommand(name, help=verb.help, hidden=verb.is_hidden)


def load(verb: Verb) -> Any:
    """Import the function of a verb, and return the verb's command."""
    module, _, function = verb.place.partition(":")
    found = getattr(import_module(f"vigil.cli.{module}"), function)
    holder = typer.Typer(add_completion=False)
    more = _MORE if verb.takes_more else None
    holder.command(help=f"{verb.help}\n\n{inspect.getdoc(found)}", context_settings=more)(with_options(found))
    return get_command(holder)
