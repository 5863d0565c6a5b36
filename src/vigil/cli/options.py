"""Options that several verbs share."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.assets.sizes import AssetDatabase

Assets = Annotated[
    Path | None,
    typer.Option(
        envvar="VIGIL_ASSETS",
        metavar="FILE",
        help="AI2-THOR's asset database, for houses that use THOR's assets. Without it: typical sizes.",
    ),
]
API_KEY_ENV = "Variable with the key for this model, e.g. at an address not its provider's own."
PackName = Annotated[str, typer.Option("--pack", help="A pack's folder, or the name of a packaged one.")]


def database(assets: Path | None) -> AssetDatabase:
    """Returns the database in a file, or the project's own table of typical sizes. Raises InputError."""
    return AssetDatabase.load(assets) if assets else AssetDatabase.default()
