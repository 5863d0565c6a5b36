"""Text for the terminal: tables, rates and lengths of time."""

import sys
from collections.abc import Callable, Iterable
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


def with_interval(rates: dict, name: str) -> str:
    """Return the rate `name` with its 95 % interval, as a text."""
    if rates[name] is None:
        return "-"
    low, high = rates["intervals"][name]
    return f"{percent_text(rates[name])} [{100 * low:.0f}, {100 * high:.0f}]"


def duration(seconds: float | None) -> str:
    """Return a length of time as h:mm:ss or m:ss; a dash for None."""
    if seconds is None:
        return "-"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
