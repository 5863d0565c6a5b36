"""`vigil score`, and the tables of runs."""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from vigil.cli.text import COLUMNS, console, percent, with_interval
from vigil.episode import FAMILIES
from vigil.pack import Selection
from vigil.record import RunHeader
from vigil.runner.run_folder import read_run
from vigil.runner.verify_run import pack_of
from vigil.summary import Settlement, settle_run, summarise

MAX_REASONS = 5
MAX_REASON_CHARS = 300


def score(
    runs: Annotated[list[Path], typer.Argument(help="Folders of runs.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON; a list for several runs.")] = False,
    pack: Annotated[str | None, typer.Option(help="Where the pack is now.", show_default="as recorded")] = None,
) -> None:
    """Settles the saved records anew and prints W, B, Delta, FR, NR, IL per family; several runs side by side.

    Example: vigil score runs/solver runs/premature
    """
    settled = [(path, *_settled(path, pack)) for path in runs]
    if as_json:
        rows = [{"run": str(path), "agent": name, **summarise(settlement)} for path, name, settlement in settled]
        print(json.dumps(rows[0] if len(rows) == 1 else rows))
        return
    if len(settled) == 1:
        print_families(settled[0][1], settled[0][2])
    else:
        _print_comparison([(name, settlement) for _, name, settlement in settled])


def _settled(path: Path, pack: str | None) -> tuple[str, Settlement]:
    header, records = read_run(path)
    episodes = pack_of(header, pack).select(Selection(ids=header.spec.episode_ids))
    return label_of(header), settle_run(episodes, records, header.spec.epochs)


def label_of(header: RunHeader) -> str:
    """Returns the name under which a run stands in tables: hidden sight is said."""
    return header.spec.agent + (" (privileged)" if header.is_privileged else "")


def print_families(name: str, settlement: Settlement) -> None:
    """Prints one run's table, a row a family."""
    _warn(name, settlement)
    summary = summarise(settlement)
    table = Table(title=f"{name}: % [95 % interval]", title_justify="left")
    for column in ("family", "episodes", *COLUMNS, "steps"):
        table.add_column(column, justify="left" if column == "family" else "right")
    rows = {**summary["families"], "all": summary["overall"]}
    for family, rates in rows.items():
        if family == "all":
            table.add_section()
        steps = "-" if rates["mean_steps"] is None else f"{rates['mean_steps']:.1f}"
        cells = [with_interval(rates, column) if column in ("W", "B") else percent(rates[column]) for column in COLUMNS]
        table.add_row(family, rates["complete"], *cells, steps)
    if "macro" in summary:
        macro = summary["macro"]
        table.add_row(
            "mean of families", "", *[percent(macro[column]) for column in COLUMNS], f"{macro['mean_steps']:.1f}"
        )
    console().print(table)


def _print_comparison(settled: list[tuple[str, Settlement]]) -> None:
    for name, settlement in settled:
        _warn(name, settlement)
    overall = Table(title="All episodes, % [95 % interval]", title_justify="left")
    for column in ("agent", "episodes", *COLUMNS, "steps"):
        overall.add_column(column, justify="left" if column == "agent" else "right")
    families = Table(title="W / B by family, %", title_justify="left")
    families.add_column("agent")
    for family in FAMILIES:
        families.add_column(family, justify="right")
    for name, settlement in settled:
        summary = summarise(settlement)
        rates = summary["overall"]
        cells = [with_interval(rates, column) if column in ("W", "B") else percent(rates[column]) for column in COLUMNS]
        steps = "-" if rates["mean_steps"] is None else f"{rates['mean_steps']:.1f}"
        overall.add_row(name, rates["complete"], *cells, steps)
        families.add_row(name, *[_pair(summary["families"].get(family)) for family in FAMILIES])
    console().print(overall)
    console().print(families)


def _pair(rates: dict | None) -> str:
    return "-" if rates is None else f"{percent(rates['W'])} / {percent(rates['B'])}"


def _warn(name: str, settlement: Settlement) -> None:
    if settlement.has_many_errors:
        print(f"{name}: {len(settlement.errors)} episodes ended as errors (more than 1 %); rates leave them out.")
    if not settlement.is_complete:
        print(f"{name}: INCOMPLETE, {len(settlement.outcomes)} of {sum(settlement.planned.values())} episodes scored.")
    reasons = Counter((error.boundary, _last_line(error.message)) for error in settlement.errors)
    for (boundary, message), count in reasons.most_common(MAX_REASONS):
        print(f"{name}: {count} x error at the {boundary}: {message}")


def _last_line(message: str) -> str:
    """Returns what a message (maybe a traceback) comes to, in one line."""
    lines = message.strip().splitlines()
    return lines[-1][:MAX_REASON_CHARS] if lines else "(no message)"
