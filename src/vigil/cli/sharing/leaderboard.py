"""`vigil submit` and `vigil leaderboard`: a run becomes an entry, and bundles of entries become a site."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from pydantic import ValidationError

from vigil.base.settings import Setting
from vigil.cli.arguments import Reveal, RunArgument
from vigil.cli.progress import progress
from vigil.cli.text import print_notes
from vigil.errors import SettingError
from vigil.runner.shared_settings import PackLocation
from vigil.web.leaderboard.settings import BuildSettings, CheckSettings

if TYPE_CHECKING:
    from vigil.web.leaderboard.metadata import EntryMetadata


def submit(
    run: RunArgument,
    out: Annotated[Path, Setting("Bundle to write, ending in .zip.")],
    metadata: Annotated[
        Path | None, Setting("YAML file with what readers must know about the entry.", unset="asked for here")
    ] = None,
    pack: PackLocation = None,
    reveal: Reveal = False,
    *,
    settings: CheckSettings,
) -> None:
    """Example: vigil submit runs/gpt-4o --metadata entry.yaml --out gpt-4o.zip"""
    from vigil.web.leaderboard.measures import figure_text
    from vigil.web.leaderboard.metadata import read_metadata
    from vigil.web.leaderboard.submit import check_places, submit_run

    check_places(run, out)  # before the questions
    said = _ask() if metadata is None else read_metadata(metadata)
    with progress("play again") as show:
        entry = submit_run(run, said, out, settings, pack=pack, reveals=reveal, on_progress=show)
    print(entry.checked)
    print_notes(entry.signs)
    shown = figure_text(entry.ranked_by, entry.figures[entry.ranked_by])
    print(f"Entry {entry.id}: {shown} %, division {entry.division}.")
    print(f"Bundle: {out}. It contains every reply and hidden state of the run, and messages of its errors.")


def _ask() -> "EntryMetadata":
    """Ask for an entry's metadata in the terminal. Raises SettingError."""
    from vigil.web.leaderboard.metadata import EntryMetadata, fields_of, needed_values

    if not sys.stdin.isatty():
        raise SettingError(
            "The entry's metadata is missing: give a YAML file with --metadata. docs/leaderboard.md shows an example. "
            f"{needed_values()}"
        )
    found: dict[str, Any] = {}
    for place, description in fields_of(EntryMetadata):
        question = f"{place} ({description})"
        answer = typer.prompt(question, default="", show_default=False, value_proc=partial(_value, place))
        *above, name = place.split(".")
        group = found
        for part in above:
            group = group.setdefault(part, {})
        group[name] = answer
    return EntryMetadata.model_validate(found)


def _value(place: str, answer: str) -> list[str] | str | None:
    """Return the value that an answer gives. Raises BadParameter, after which the question is asked again."""
    from vigil.web.leaderboard.metadata import check_value, reason

    value = answer.split() if place == "references" else answer.strip() or None
    try:
        check_value(place, value)
    except ValidationError as error:
        raise typer.BadParameter(reason(error)) from None
    return value


def build(
    bundles: Annotated[
        list[Path],
        typer.Argument(
            metavar="BUNDLE...",
            help="Bundles of entries, in order of arrival. If two bundles are equal, the later one counts as a copy.",
        ),
    ],
    out: Annotated[Path, Setting("Folder of the site: a new one, or a site to build again.")],
    settings: BuildSettings,
) -> None:
    """Example: vigil leaderboard build bundles/*.zip --decisions decisions.yaml --out site"""
    from vigil.web.leaderboard.build import build_site

    with progress("play again") as show:
        built = build_site(bundles, out, settings, show)
    for line in built.log:
        print(" · ".join(part for part in (line.bundle, line.entry, line.status, line.why) if part))
    print(f"Bundles: {len(bundles)}, of which {built.checked} new. Entries: {len(built.entries)}.")
    print(out / "index.html")
