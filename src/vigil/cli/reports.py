"""`vigil report` and `vigil figure`: what saved runs show."""

from pathlib import Path
from typing import Annotated

import typer

from vigil.analysis.metrics import run_faults
from vigil.analysis.report import FORMATS, Format, make_report, markdown_report, write_report
from vigil.analysis.rows import read_runs
from vigil.analysis.study import Study, study
from vigil.errors import SettingError, did_you_mean

Runs = Annotated[list[Path], typer.Argument(help="Folders of runs.")]
PackPlace = Annotated[str | None, typer.Option("--pack", help="Where the pack is now.", show_default="as recorded")]


def report(
    runs: Runs,
    format_: Annotated[
        list[str] | None,
        typer.Option("--format", help="md, html, latex, json, csv or all; may be repeated.", show_default="html and md"),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write into.", show_default="print Markdown")] = None,
    pack: PackPlace = None,
    with_paper: Annotated[bool, typer.Option("--paper/--no-paper", help="Show the published rows as reference.")] = True,
    use_cache: Annotated[bool, typer.Option("--cache/--no-cache", help="Take rows settled before.")] = True,
    check: Annotated[bool, typer.Option("--check", help="Settle anew, assert the identities, and stop there.")] = False,
) -> None:  # fmt: skip
    """Writes tables and figures of one or more runs, every number with its interval.

    Examples:
    vigil report runs/solver runs/gpt-4o --out report
    vigil report runs/* --format latex --format csv --out report
    vigil report runs/* --check
    """
    if check:
        _check(runs, pack)
        return
    formats = _formats(format_ or [])
    found = study(read_runs(runs, pack, use_cache=use_cache), with_paper=with_paper)
    if out is None and format_:
        raise SettingError(f"--format {' '.join(format_)} writes files: say where with --out FOLDER.")
    if out is None:
        print(markdown_report(make_report(found, ()), figures=False))
        return
    written = write_report(found, out, formats)
    _warn(found)
    for path in written if len(written) <= 3 else [*written[:2], out]:
        print(path)


def _check(runs: list[Path], pack: str | None) -> None:
    settled = read_runs(runs, pack, use_cache=False)
    faults = [fault for run in settled for fault in run_faults(run)]
    for fault in faults:
        print(fault)
    episodes = sum(run.n for run in settled)
    print(f"{len(settled)} runs, {episodes} scored episodes: {len(faults)} identities broken")
    if faults:
        raise typer.Exit(1)


def _formats(names: list[str]) -> tuple[Format, ...]:
    wanted = [name for text in names for name in text.split(",")]
    for name in wanted:
        if name not in (*FORMATS, "all"):
            raise SettingError(
                f"There is no format {name!r}.{did_you_mean(name, FORMATS)} Known: {', '.join(FORMATS)}."
            )
    if "all" in wanted:
        return FORMATS
    return tuple(name for name in FORMATS if name in wanted) or ("md", "html")


def _warn(found: Study) -> None:
    for warning in found.warnings:
        print(f"! {warning}")
