"""Arguments and options that several verbs share and that are not declared as settings."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.authoring.drafting.procthor import DATASET
from vigil.base.imports import ENVIRONMENT_VARIABLE, import_modules
from vigil.base.settings import Setting
from vigil.packs.private import REVEAL, REVEAL_HELP
from vigil.scoring.saved_run import find_runs


def _import_modules(names: list[str] | None) -> list[str] | None:
    """Import immediately, because later options may name what the modules register."""
    import_modules(names or ())
    return names


PackArgument = Annotated[str, typer.Argument(help="A pack's folder, or the name of a packaged one, e.g. starter.")]
RunArgument = Annotated[Path, typer.Argument(help="Folder of a run.")]
RunArguments = Annotated[
    list[Path], typer.Argument(help="Folders of runs, or folders with runs in them.", callback=find_runs)
]
HouseArgument = Annotated[str, typer.Argument(metavar="HOUSE", help=f"A house file, or {DATASET}:SPLIT:INDEX.")]
Robust = Annotated[bool, Setting("Also require that the solver succeeds with motor noise; takes seconds per episode.")]
Imports = Annotated[
    list[str] | None,
    typer.Option(
        "--import",
        metavar="MODULE",
        help="Import this module first, for families and objects that it registers; may be repeated. Other commands: "
        f"{ENVIRONMENT_VARIABLE}.",
        is_eager=True,
        callback=_import_modules,
        show_default=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
OpenBrowser = Annotated[bool, typer.Option("--open/--no-open", help="Open a browser.")]
WithPaper = Annotated[bool, typer.Option("--paper/--no-paper", help="Also show the published rows.")]
Epoch = Annotated[int, typer.Option(min=1, help="Number of the play of the episode.")]
SeedFile = Annotated[Path | None, Setting("File with a secret seed, 2^64 or more; shells keep a history of commands.")]
Reveal = Annotated[bool, typer.Option(REVEAL, help=REVEAL_HELP)]
LevelsFile = Annotated[
    Path | None,
    typer.Option(help="Levels of the episodes, as `vigil pack levels` writes them.", show_default="the pack's own"),
]
