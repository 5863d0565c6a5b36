"""Text for people: tables of runs, a line of progress."""

import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from vigil.runner.progress import Progress as RunProgress

PIPED_WIDTH = 160
UNBOUNDED_WIDTH = 10_000
COLUMNS = ("W", "W_strict", "B", "Delta", "FR", "NR", "IL", "Other")
PLAIN_SECONDS = 10.0
TROUBLE_CHARS = 70


def console(stderr: bool = False) -> Console:
    """Returns a console that does not fold tables when the output is no terminal."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, width=None if stream.isatty() else PIPED_WIDTH, highlight=False)


def say(notes: Iterable[str]) -> None:
    """Tells what a reader must know before any result, beside the results: on standard error."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr, flush=True)


@contextmanager
def counting(label: str) -> Iterator[Callable[[int, int], None]]:
    """Shows how many of how many are done, once something is: yields what is told (done, total)."""
    progress = Progress(*Progress.get_default_columns(), MofNCompleteColumn(), console=console(stderr=True))
    task = progress.add_task(label, total=None)

    def tell(done: int, total: int) -> None:
        progress.start()
        progress.update(task, completed=done, total=total)

    try:
        yield tell
    finally:
        if progress.live.is_started:
            progress.stop()


def print_fitting(build: Callable[[bool], Table]) -> None:
    """Prints the full table, `build(True)`, where it fits on a line of the terminal, else the narrow one."""
    output = console()
    full = build(True)
    width = Measurement.get(output, output.options.update(max_width=UNBOUNDED_WIDTH), full).maximum
    output.print(full if width <= output.width else build(False))


def percent(rate: float | None) -> str:
    """Returns a rate as a percentage; a dash where there is none."""
    return "-" if rate is None else f"{100 * rate:.1f}"


def with_interval(rates: dict, name: str) -> str:
    """Returns a rate with its 95 % interval."""
    if rates[name] is None:
        return "-"
    low, high = rates["intervals"][name]
    return f"{percent(rates[name])} [{100 * low:.0f}, {100 * high:.0f}]"


def duration(seconds: float | None) -> str:
    """Returns a length of time as h:mm:ss or m:ss; a dash where there is none."""
    if seconds is None:
        return "-"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class ProgressLine:
    """Shows a run's progress: a bar in a terminal, else a plain line every ten seconds and at the end."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._is_terminal = sys.stderr.isatty()
        self._last_s = -PLAIN_SECONDS
        self._task: TaskID | None = None
        self._bar = Progress(
            TextColumn("{task.description}", markup=False), BarColumn(), TextColumn("{task.fields[facts]}"),
            TimeElapsedColumn(), console=console(stderr=True),
        )  # fmt: skip

    def __enter__(self) -> "ProgressLine":
        if self._is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_terminal:
            self._bar.stop()

    def show(self, progress: RunProgress) -> None:
        """Takes in where the run stands."""
        facts = line(progress)
        if not self._is_terminal:
            is_over = progress.done + progress.errors >= progress.total
            if is_over or progress.elapsed_s - self._last_s >= PLAIN_SECONDS:
                self._last_s = progress.elapsed_s
                print(f"{self._label}: {facts}", file=sys.stderr, flush=True)
            return
        if self._task is None:
            self._task = self._bar.add_task(self._label, total=progress.total, facts=facts)
        self._bar.update(self._task, completed=progress.done + progress.errors, facts=facts)


def line(progress: RunProgress) -> str:
    """Returns where a run stands, in one line."""
    facts: Sequence[str] = (
        f"{progress.done}/{progress.total}",
        f"W {percent(progress.W)}",
        f"B {percent(progress.B)}",
        *([f"errors {progress.errors}"] if progress.errors else []),
        f"ETA {duration(progress.eta_s)}",
        *([textwrap.shorten(progress.trouble, TROUBLE_CHARS, placeholder=" ...")] if progress.trouble else []),
    )
    return "  ".join(facts)
