"""How far long work has come, on standard error: a bar in a terminal, elsewhere a plain line now and then."""

import math
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from vigil.cli.text import console, duration, percent
from vigil.runner.progress import OnProgress
from vigil.runner.progress import Progress as RunProgress

PLAIN_SECONDS = 10.0
"""Between two plain lines at least, but for the last."""
SPEED_SECONDS = 600.0
"""The time left is estimated from what was done in so many seconds."""
TROUBLE_CHARS = 70


class Show(Protocol):
    """Takes in how much is done."""

    def __call__(self, done: int, total: int, facts: str = "") -> None: ...  # noqa: D102


@contextmanager
def progress(label: str, *, ticks: bool = True) -> Iterator[Show]:
    """Yields what is told how many of how many are done; nothing is shown before that.

    Without `ticks` a bar changes only when something is told: no thread draws it, so that the process may fork.
    """
    output = console(stderr=True)
    is_live = sys.stderr.isatty() and output.is_interactive
    bar = Progress(
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(),
        TextColumn("{task.fields[facts]}", markup=False), TextColumn("ETA"), TimeRemainingColumn(), TimeElapsedColumn(),
        console=output, speed_estimate_period=SPEED_SECONDS, redirect_stdout=sys.stdout.isatty(), disable=not is_live,
        auto_refresh=ticks,
    )  # fmt: skip
    task = bar.add_task(label, total=None, facts="")
    last_s = -math.inf

    def show(done: int, total: int, facts: str = "") -> None:
        nonlocal last_s
        bar.start()
        bar.update(task, completed=done, total=total, facts=facts, refresh=not ticks)
        if not is_live and (done >= total or time.monotonic() - last_s >= PLAIN_SECONDS):
            last_s = time.monotonic()
            parts = (f"{label}: {done}/{total}", facts, f"ETA {duration(bar.tasks[0].time_remaining)}")
            print("  ".join(filter(None, parts)), file=sys.stderr, flush=True)

    try:
        yield show
    finally:
        if bar.live.is_started:
            bar.stop()


@contextmanager
def run_progress(label: str) -> Iterator[OnProgress]:
    """Yields what takes in where a run stands."""
    with progress(label) as show:
        yield lambda run: show(run.done + run.errors, run.total, facts_of(run))


def facts_of(run: RunProgress) -> str:
    """Returns what a run's progress says besides the number of its episodes."""
    return "  ".join(
        (
            f"W {percent(run.W)}",
            f"B {percent(run.B)}",
            *([f"cost {run.cost:,.2f}"] if run.cost is not None else []),
            *([f"errors {run.errors}"] if run.errors else []),
            *([textwrap.shorten(run.trouble, TROUBLE_CHARS, placeholder=" ...")] if run.trouble else []),
        )
    )
