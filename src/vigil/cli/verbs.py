"""The verbs of `vigil`. A verb is loaded only when it is called, so `vigil --help` does not load simulators and
figures."""

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
    """A verb: the place of its function, and its line in the help. The function's docstring is the rest of its help."""

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


_PACK_VERIFY = "Checks the rules for every episode of a pack, and replays its solution; exits with 2 if one fails."
TRAIN = {
    "doctor": Verb(
        "training.doctor:doctor",
        "Plays one episode in several environments of a trainer, and compares what the trainer gets with the record.",
    ),
}
HOUSES = {
    "generate": Verb("houses:generate_house", "Generates a house and writes it to a file."),
    "check": Verb(
        "houses:check",
        "Loads houses and prints their numbers of objects and their faults; exits with 2 if a house cannot be loaded.",
    ),
    "show": Verb(
        "houses:show",
        "Draws a house from above: a labelled floor plan next to a bird's-eye view without ceilings.",
    ),
    "sweep": Verb(
        "houses:sweep_houses",
        "Generates many houses and checks each; prints times and rare categories of objects; exits "
        "with 2 if a house has a fault.",
    ),
    "export": Verb(
        "houses:export", "Writes a house for AI2-THOR; each object gets the AI2-THOR asset nearest in type and size."
    ),
}
PACK = {
    "list": Verb("packs:list_packs", "Lists the packs that come with the package."),
    "info": Verb("packs:info", "Prints the contents of a pack, after verifying the hash of every file."),
    "verify": Verb("packs:verify", _PACK_VERIFY),
    "validate": Verb("packs:verify", _PACK_VERIFY, is_hidden=True),
    "diff": Verb(
        "packs:diff",
        "Lists the episodes in which two packs differ: added, removed or changed; exits with 1 if there are any.",
    ),
    "build-starter": Verb(
        "packs:build_starter_pack",
        "Builds the starter pack again from scratch: its houses, drafts, validation and solutions.",
    ),
    "propose": Verb(
        "pack_making:propose",
        "Proposes drafts of episodes, checks and solves each, and saves the valid ones; prints how "
        "many broke each rule.",
    ),
    "build": Verb(
        "pack_making:build",
        "Makes a frozen pack from drafts: chooses equal numbers of each kind, approved drafts first, and replays each.",
    ),
    "make": Verb(
        "pack_making:make",
        "Makes a pack in one command: houses, drafts, validation, solutions and selection. The same "
        "command continues it.",
    ),
    "remake": Verb(
        "pack_making:remake",
        "Makes a pack again from its recipe and checks that the bytes are the same; exits with 2 if they are not.",
    ),
    "perturb": Verb(
        "making.perturb:perturb",
        "Makes a pack whose episodes differ from those of another in words, start or light; certifies each again.",
    ),
    "stream": Verb(
        "training.streams:stream",
        "Writes the first episodes of an endless stream for training, with new houses and a solution for each episode.",
    ),
    "baselines": Verb(
        "pack_measuring:baselines",
        "Plays a pack with the solver, and with simple agents that should score low; exits with 2 if "
        "a score breaks its limit.",
    ),
    "levels": Verb(
        "pack_measuring:levels",
        "Measures how difficult each episode of a pack is and gives it a level: easy, medium, hard or extreme.",
    ),
    "difficulty": Verb(
        "pack_measuring:difficulty",
        "Estimates from runs how difficult each episode is and how able each model is; compares this "
        "with the episodes' levels.",
    ),
    "sheet": Verb(
        "pack_measuring:sheet",
        "Draws contact sheets of a pack: for each episode its first frame and its instruction.",
    ),
}
STUDY = {
    "run": Verb("study:run", "Plays the runs that a study's file names, as far as they are not yet played."),
    "status": Verb("study:status", "Prints how many plays of each run of a study are done."),
    "report": Verb(
        "study:report", "Writes one report of a study's runs, with a place for every table and figure of the paper."
    ),
}
CHALLENGE = {
    "new": Verb(
        "sharing.challenge:new", "Makes a pack from a secret seed, and a file of hashes and a deadline to publish."
    ),
    "reveal": Verb("sharing.challenge:reveal", "Adds the seed to the file of a challenge, after its deadline."),
    "check": Verb(
        "sharing.challenge:check",
        "Makes the pack of a revealed challenge again and compares the bytes; exits with 2 if they differ.",
    ),
}
THOR = {
    "install": Verb(
        "thor:install", "Installs VIGIL's engine where AI2-THOR's client looks for its own build; prints the folders."
    ),
    "run": Verb("thor:run", "Runs a program that uses AI2-THOR's client, on VIGIL's engine.", takes_more=True),
    "uninstall": Verb("thor:uninstall", "Removes what `vigil thor install` wrote; prints the folders."),
}
LEADERBOARD = {
    "build": Verb(
        "sharing.leaderboard:build",
        "Plays every submitted run again, computes its figures again, and writes a static site of the runs that pass.",
    ),
}
VERBS: dict[str, Verb | Group] = {
    "run": Verb("runs:run", "Plays a pack with a model or an agent, and prints the scores."),
    "probe": Verb(
        "runs:probe",
        "Asks the model of a finished run what it believed at the run's steps, without playing the run again.",
    ),
    "merge": Verb("runs:merge", "Joins the parts of a run that were played separately (--shard) into one run."),
    "models": Verb(
        "models:models",
        "Lists the providers of models: name, key (set or not), extra to install, address, thinking switch.",
    ),
    "calibrate": Verb(
        "models:calibrate",
        "Finds out in which coordinates a model points: asks it to point at a spot in eight pictures; "
        "prints its median error.",
    ),
    "prompt": Verb("models:prompt", "Prints the exact messages that a model gets for the first step of an episode."),
    "score": Verb(
        "scores:score",
        "Scores recorded runs and prints W, B, Delta, FR, NR and IL by family; several runs are shown side by side.",
    ),
    "verify": Verb(
        "runs:verify",
        "Plays the recorded actions of a run again and compares every hidden state; exits with 1 if one differs.",
    ),
    "report": Verb(
        "reports:report",
        "Writes a report of one or more runs: tables and figures, with a confidence interval for every rate.",
    ),
    "figure": Verb(
        "reports:figure",
        "Draws one figure of recorded runs, or a diagram of the protocol; frames that were not saved are drawn again.",
    ),
    "view": Verb("web:view", "Shows runs, their episodes step by step, and houses in the browser."),
    "play": Verb(
        "web:play",
        "Lets a person play episodes in the browser as an agent does; this is recorded as a run like any other.",
    ),
    "serve": Verb(
        "sharing.serving:serve",
        "Serves a pack over HTTP and WebSocket: house, goal and records stay here, clients get frames; records a run.",
    ),
    "review": Verb(
        "web:review",
        "Lets a person review the episodes of a pack, or drafts, in the browser; each verdict is immediately saved.",
    ),
    "export": Verb(
        "exports.verb:export",
        "Writes a run as a static site, an episode as a page or a film, or runs as Parquet, a dataset "
        "or results to share.",
    ),
    "submit": Verb(
        "sharing.leaderboard:submit",
        "Plays a run again to check it, and writes the run with its metadata as a bundle for a leaderboard.",
    ),
    "demos": Verb(
        "training.demos:demos",
        "Writes demonstrations for training, from a stream of episodes: requests to a model, with the "
        "solver's answers.",
    ),
    "render": Verb(
        "render:render",
        "Draws an agent's view of a house, one object in a plain room, or a catalogue of all categories of objects.",
    ),
    "compare-backends": Verb(
        "packs:compare_back_ends",
        "Plays a pack's solutions on two simulators and lists the differences; exits with 1 if a difference is "
        "not explained.",
    ),
    "thor-engine": Verb(
        "doctor:thor_engine",
        "Runs VIGIL's engine for AI2-THOR's client, in place of Unity; the client starts this command itself.",
        takes_more=True,
    ),
    "thor": Group("Run AI2-THOR programs on VIGIL's engine.", THOR),
    "train": Group("Check what a trainer will see.", TRAIN),
    "doctor": Verb(
        "doctor:doctor", "Draws one frame and prints what is installed; exits with 1 if something is missing."
    ),
    "study": Group("Play and report a whole study: many models, conditions and repeats, named in one file.", STUDY),
    "leaderboard": Group("Build the site of a leaderboard from submitted runs.", LEADERBOARD),
    "houses": Group("Generate, check and show houses (ProcTHOR's JSON).", HOUSES),
    "challenge": Group(
        "Make, reveal and check packs from a secret seed that is published after a deadline.", CHALLENGE
    ),
    "pack": Group("Inspect, verify and make packs of episodes.", PACK),
}


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
