"""The verbs of `vigil`, each loaded when it is called: `vigil --help` need not wait for simulators and figures."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_group


@dataclass(frozen=True, slots=True)
class Verb:
    """Where a verb's function, or its Typer application, is, and its line in the help."""

    module: str
    attribute: str
    help: str


VERBS = {
    "run": Verb("runs", "run", "Plays a pack with a model or an agent, and prints the table."),
    "score": Verb(
        "scores",
        "score",
        "Settles the saved records anew and prints W, B, Delta, FR, NR, IL per family; several runs side by side.",
    ),
    "verify": Verb(
        "runs",
        "verify",
        "Plays the recorded actions again and compares every hidden state; exits with 1 when one differs.",
    ),
    "report": Verb(
        "reports", "report", "Writes tables and figures of one or more runs, every number with its interval."
    ),
    "figure": Verb(
        "reports",
        "figure",
        "Draws one figure of saved runs, or a diagram of the protocol; kept frames are used, others redrawn.",
    ),
    "view": Verb("web", "view", "Shows runs, episodes step by step, and houses in the browser."),
    "play": Verb(
        "web",
        "play",
        "Lets a person play episodes in the browser as an agent does; the record is a run like any other.",
    ),
    "review": Verb(
        "web",
        "review",
        "Reviews the episodes of a pack, or drafts, in the browser; each verdict is a line of the review file at once.",
    ),
    "export": Verb(
        "web", "export", "Writes a run as a static site, or one episode as a self-contained page, GIF or MP4."
    ),
    "render": Verb(
        "render",
        "render",
        "Draws what an agent would see, one asset on a stage, or single things where such things stand.",
    ),
    "doctor": Verb(
        "doctor", "doctor", "Draws one frame and says what is installed; exits with 1 when something is missing."
    ),
    "houses": Verb("houses", "app", "Generate, check and show houses (ProcTHOR's JSON)."),
    "pack": Verb("packs", "app", "Look into and validate packs of episodes."),
}


class Verbs(TyperGroup):
    """A group of commands that lists all of them, and loads the one that is called."""

    def __init__(self, **settings: Any) -> None:
        commands = {name: TyperCommand(name, help=verb.help) for name, verb in VERBS.items()}
        super().__init__(**{**settings, "commands": commands})

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Returns the name that was called, its command and the arguments left."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command if command is None else load(name or ""), rest


def load(name: str) -> Any:
    """Returns the command of a verb."""
    verb = VERBS[name]
    found = getattr(import_module(f"vigil.cli.{verb.module}"), verb.attribute)
    holder = typer.Typer()
    if isinstance(found, typer.Typer):
        holder.add_typer(found, name=name)
    else:
        holder.command(name)(found)
    return get_group(holder).commands[name]
