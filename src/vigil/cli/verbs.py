"""The verbs of `vigil`, each loaded when it is called, so that `vigil --help` does not load simulators and figures."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from vigil.cli.options import with_options


@dataclass(frozen=True, slots=True)
class Verb:
    """Location of a verb's function, and its line in the help; the function's docstring completes the help."""

    place: str
    """Module of this package and function, e.g. "runs:run"."""
    help: str
    is_hidden: bool = False
    takes_more: bool = False
    """Whether unknown options are left in the context's `args` instead of being an error."""


@dataclass(frozen=True, slots=True)
class Group:
    """Verbs about one kind of thing, e.g. `vigil pack info`."""

    help: str
    verbs: Mapping[str, Verb]


_PACK_VERIFY = "Checks every rule and replays every solution, in worker processes; exits with 2 when one fails."
HOUSES = {
    "generate": Verb("houses:generate_house", "Generates a house and writes it to a file."),
    "check": Verb(
        "houses:check",
        "Loads houses, counts their objects and names their faults; exits with 2 when one cannot be loaded.",
    ),
    "show": Verb(
        "houses:show",
        "Draws a house from above: a labelled floor plan next to a bird's-eye view without ceilings.",
    ),
    "sweep": Verb(
        "houses:sweep_houses",
        "Generates houses, checks each, and prints times and rare categories; exits with 2 on a fault.",
    ),
    "export": Verb(
        "houses:export", "Writes a house with AI2-THOR's assets: for each object the asset nearest in type and size."
    ),
}
PACK = {
    "list": Verb("packs:list_packs", "Lists the packs that come with the package."),
    "info": Verb("packs:info", "Verifies every hash and prints what the pack holds."),
    "verify": Verb("packs:verify", _PACK_VERIFY),
    "validate": Verb("packs:verify", _PACK_VERIFY, is_hidden=True),
    "diff": Verb(
        "packs:diff",
        "Lists the episodes that were added, removed or changed between two packs; exits with 1 when they differ.",
    ),
    "build-starter": Verb(
        "packs:build_starter_pack", "Builds the starter pack from scratch: houses, drafts, validation, solutions."
    ),
    "propose": Verb(
        "pack_making:propose",
        "Proposes episodes, validates and solves each, and keeps the valid ones; the rest is counted by rule.",
    ),
    "build": Verb(
        "pack_making:build",
        "Selects equal numbers of each kind, approved drafts first, replays each, and freezes a pack with its card.",
    ),
    "make": Verb(
        "pack_making:make",
        "Makes a pack in one go: houses, drafts, validation, solutions, selection. The same command continues it.",
    ),
    "remake": Verb(
        "pack_making:remake",
        "Makes the pack of a recipe and checks that its bytes are the same; exits with 2 when they are not.",
    ),
    "stream": Verb(
        "training.streams:stream",
        "Writes the first episodes of an endless stream for training: new houses, validated episodes, solutions.",
    ),
    "baselines": Verb(
        "pack_measuring:baselines",
        "Plays a pack with agents without skill or vision, and with the solver; exits with 2 when a limit is broken.",
    ),
    "levels": Verb(
        "pack_measuring:levels",
        "Measures how difficult each episode is, and grades it: easy, medium, hard, extreme.",
    ),
    "difficulty": Verb(
        "pack_measuring:difficulty",
        "Fits episodes' difficulties and models' abilities to runs (item response); compares with the levels' index.",
    ),
    "sheet": Verb(
        "pack_measuring:sheet",
        "Draws contact sheets: episodes with the frame that they start with and their instruction.",
    ),
}
VERBS: dict[str, Verb | Group] = {
    "run": Verb("runs:run", "Plays a pack with a model or an agent, and prints the table."),
    "merge": Verb("runs:merge", "Joins the shards of a run, which were played separately, into one run."),
    "models": Verb(
        "models:models",
        "Lists the providers of models: names, keys (set or not), extras (installed or not), addresses, thinking.",
    ),
    "calibrate": Verb(
        "models:calibrate",
        "Asks a model to point at a spot in eight pictures; prints which coordinates it uses and its median error.",
    ),
    "prompt": Verb("models:prompt", "Prints the exact messages that a model gets for the first step of an episode."),
    "score": Verb(
        "scores:score",
        "Scores saved records and prints W, B, Delta, FR, NR, IL per family; several runs side by side.",
    ),
    "verify": Verb(
        "runs:verify",
        "Plays the recorded actions again and compares every hidden state; exits with 1 when one differs.",
    ),
    "report": Verb("reports:report", "Writes tables and figures of one or more runs, every rate with its interval."),
    "figure": Verb(
        "reports:figure",
        "Draws one figure of saved runs, or a diagram of the protocol; saved frames are used, others drawn again.",
    ),
    "view": Verb("web:view", "Shows runs, episodes step by step, and houses in the browser."),
    "play": Verb(
        "web:play", "Lets a person play episodes in the browser as an agent does; the record is a run like any other."
    ),
    "review": Verb(
        "web:review",
        "Reviews the episodes of a pack, or drafts, in the browser; each verdict is immediately a line of the review "
        "file.",
    ),
    "export": Verb(
        "exports.verb:export",
        "Writes a run as a static site, an episode as a page or film, runs as Parquet, a dataset or results to share.",
    ),
    "demos": Verb(
        "training.demos:demos",
        "Writes demonstrations of a stream for training: a model's requests, the solver's answers, false reports.",
    ),
    "render": Verb(
        "render:render",
        "Draws an agent's view, one asset in a plain room, or single objects in a typical place.",
    ),
    "compare-backends": Verb(
        "packs:compare_back_ends",
        "Plays a pack's solutions on two simulators and lists the differences; exits with 1 on an unexplained one.",
    ),
    "thor-engine": Verb(
        "doctor:thor_engine",
        "Serves AI2-THOR's client instead of Unity; the client starts it.",
        takes_more=True,
    ),
    "doctor": Verb(
        "doctor:doctor", "Draws one frame and prints what is installed; exits with 1 when something is missing."
    ),
    "houses": Group("Generate, check and show houses (ProcTHOR's JSON).", HOUSES),
    "pack": Group("Inspect, verify and make packs of episodes.", PACK),
}


_MORE = {"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": ["--help"]}
"""Context settings without `-h`, which would match options with one dash, e.g. Unity's `-screen-height`."""


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
    """Return a stub of a verb for the list of commands; a group is returned complete."""
    if isinstance(verb, Group):
        return Verbs(name=name, help=verb.help, verbs=verb.verbs, no_args_is_help=True)
    return TyperCommand(name, help=verb.help, hidden=verb.is_hidden)


def load(verb: Verb) -> Any:
    """Return the command of a verb."""
    module, _, function = verb.place.partition(":")
    found = getattr(import_module(f"vigil.cli.{module}"), function)
    holder = typer.Typer(add_completion=False)
    more = _MORE if verb.takes_more else None
    holder.command(help=f"{verb.help}\n\n{inspect.getdoc(found)}", context_settings=more)(with_options(found))
    return get_command(holder)
