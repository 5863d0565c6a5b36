"""`vigil merge`."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.cli.scores import label_of, print_families
from vigil.cli.text import say
from vigil.runner.merge import MergeSettings, merge_runs
from vigil.saved_run import read_run

Out = Annotated[Path, typer.Argument(metavar="OUT", help="Folder of the joined run; a new one.")]
Shards = Annotated[list[Path], typer.Argument(metavar="SHARD...", help="Folders that `vigil run --shard I/N` made.")]


def merge(out: Out, shards: Shards, settings: MergeSettings) -> None:
    """Example: vigil merge runs/gpt-4o shards/gpt-4o/*"""
    merge_runs(out, shards, settings)
    run = read_run(out, settings.pack)
    say(run.notes)
    print_families(label_of(run.header), run.table.settlement())
    print(f"Records: {out}")
