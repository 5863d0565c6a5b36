"""Text for the terminal: tables, rates and lengths of time."""

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

PIPED_WIDTH = 160
UNBOUNDED_WIDTH = 10_000
COLUMNS = ("W", "W_strict", "B", "Delta", "FR", "NR", "IL", "Other")


def console(stderr: bool = False) -> "Console":
    """Return a console that shows text unchanged. It does not wrap tables when the output is not a terminal."""
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else PIPED_WIDTH
    return Console(stderr=stderr, width=width, highlight=False, markup=False, emoji=False)


def print_notes(notes: Iterable[str]) -> None:
    """Print, on standard error, notes that a reader must see before any result; each note only once."""
    for note in dict.fromkeys(notes):
        print(f"note: {note}", file=sys.stderr, flush=True)


def print_note(note: str) -> None:
    """Print one note on standard error."""
    print_notes([note])


def print_facts(facts: Mapping[str, object], as_json: bool, width: int = 20) -> None:
    """Print facts, each on a line with its name in a column of `width` characters, or all as JSON."""
    if as_json:
        print(json.dumps(facts))
        return
    for name, value in facts.items():
        words = {None: "none", True: "yes", False: "no"}.get(value) if isinstance(value, bool | None) else None
        print(f"{name:{width}} {words or (f'{value:.3f}' if isinstance(value, float) else value)}")


def print_fitting(build: "Callable[[bool], Table]") -> None:
    """Print the full table, `build(True)`, if it fits the terminal's width; otherwise the narrow `build(False)`."""
    from rich.measure import Measurement

    output = console()
    full = build(True)
    width = Measurement.get(output, output.options.update(max_width=UNBOUNDED_WIDTH), full).maximum
    output.print(full if width <= output.width else build(False))


def percent_text(rate: float | None) -> str:
    """Return a rate as a percentage; a dash for None."""
    return "-" if rate is None else f"{100 * rate:.1f}"


def rate_text(rates: dict, name: str, has_interval: bool) -> str:
    """Return the rate `name` as a text, with its 95 % interval if this is asked for and known."""
    interval = rates["intervals"].get(name) if has_interval else None
    if interval is None:
        return percent_text(rates[name])
    low, high = interval
    return f"{percent_text(rates[name])} [{100 * low:.0f}, {100 * high:.0f}]"


def duration(seconds: float | None) -> str:
    """Return a length of time as h:mm:ss or m:ss; a dash for None."""
    if seconds is None:
        return "-"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
