"""Arguments and options that several verbs share and that are not declared as settings."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.authoring.drafting.procthor import DATASET
from vigil.base.imports import ENVIRONMENT_VARIABLE, import_modules
from vigil.base.settings import Setting
from vigil.packs.private import REVEAL, REVEAL_HELP


def _import_modules(names: list[str] | None) -> list[str] | None:
    """Import the modules immediately, because later options may name what the modules register."""
    import_modules(names or ())
    return names


def _find_runs(folders: list[Path]) -> list[Path]:
    from vigil.scoring.saved_run import find_runs

    return find_runs(folders)


PackArgument = Annotated[
    str, typer.Argument(help="Pack to use: its folder, or the name of a pack that comes with VIGIL, e.g. starter.")
]
RunArgument = Annotated[Path, typer.Argument(help="Folder in which the run is recorded.")]
RunArguments = Annotated[
    list[Path],
    typer.Argument(
        help="Folders of the runs to use. A folder that contains several runs stands for all of them.",
        callback=_find_runs,
    ),
]
HouseArgument = Annotated[
    str,
    typer.Argument(
        metavar="HOUSE",
        help=f"House to use: a JSON file, or {DATASET}:SPLIT:INDEX for a house of the dataset ProcTHOR-10K.",
    ),
]
Robust = Annotated[
    bool,
    Setting(
        "Also require that the scripted solver succeeds with small random errors in its movements and clicks. "
        "This takes a few seconds per episode."
    ),
]
Imports = Annotated[
    list[str] | None,
    typer.Option(
        "--import",
        metavar="MODULE",
        help="Python module to import first, because it registers families or objects; may be repeated. "
        f"For commands without this option, name the modules in the variable {ENVIRONMENT_VARIABLE}.",
        is_eager=True,
        callback=_import_modules,
        show_default=False,
    ),
]
AsJson = Annotated[bool, Setting("Print the result as JSON instead of as text.", name="json")]
OpenBrowser = Annotated[bool, typer.Option("--open/--no-open", help="Whether to open the page in a browser.")]
WithPaper = Annotated[
    bool,
    typer.Option(
        "--paper/--no-paper", help="Whether to show the results published in the paper next to those of the runs."
    ),
]
EngineBackend = Annotated[
    str, Setting("Simulator that computes the world behind the engine: mujoco, or fake (coarse pictures, no OpenGL).")
]
Epoch = Annotated[
    int, Setting("Which play of the episode to use, if the run played it several times: 1 is the first.", minimum=1)
]
SeedFile = Annotated[
    Path | None,
    Setting(
        "File with a secret seed, a whole number of 2^64 or more. A seed in a file does not appear in "
        "the shell's history, unlike a seed on the command line."
    ),
]
Reveal = Annotated[bool, typer.Option(REVEAL, help=REVEAL_HELP)]
LevelsFile = Annotated[
    Path | None,
    Setting("File with the difficulty level of each episode, written by `vigil pack levels`.", unset="the pack's own"),
]
