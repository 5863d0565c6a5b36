"""Progress of long work, on standard error: a bar in a terminal; elsewhere, a plain line from time to time."""

import math
import sys
import textwrap
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from vigil.cli.text import console, duration, percent_text

if TYPE_CHECKING:
    from vigil.analysis.measures.rows import Run
    from vigil.runner.progress import OnProgress, RunProgress

PLAIN_SECONDS = 10.0
"""Minimum time between two plain lines, in seconds; the last line is printed at once."""
QUIET_SECONDS = 25.0
"""Time in seconds without reported progress after which a line says that the work continues."""
RETRY_REASON_CHARS = 70


class ShowProgress(Protocol):
    """Function that shows how much of the work is done."""

    def __call__(self, done: int, total: int, facts: str = "") -> None: ...  # noqa: D102


class _PlainProgress:
    """Latest progress of long work, which is printed as plain lines."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._began_s = time.monotonic()
        self._line_s = -math.inf
        self._first: tuple[float, int] | None = None
        """Time of the first report, and the amount of work that was already done then."""
        self._text = ""

    def update(self, done: int, total: int, facts: str) -> str:
        """Record how much is done, and return the time left, estimated from the work since the first report."""
        now_s = time.monotonic()
        if self._first is None:
            self._first = now_s, done
        first_s, before = self._first
        each_s = (now_s - first_s) / (done - before) if done > before else None
        left = "0:00" if done >= total else duration(None if each_s is None else each_s * (total - done))
        self._text = "  ".join(filter(None, (f"{self._label}: {done}/{total}", facts, f"ETA {left}")))
        return left

    def print_line(self, least_s: float, more: str = "") -> None:
        """Print the progress, unless a line was printed less than `least_s` seconds ago."""
        now_s = time.monotonic()
        if now_s - self._line_s >= least_s:
            self._line_s = now_s
            print(self._text + more, file=sys.stderr, flush=True)

    def print_heartbeat(self) -> None:
        """Print that the work continues, unless a line was printed recently."""
        since = duration(time.monotonic() - self._began_s)
        self.print_line(QUIET_SECONDS, f"  (begun {since} ago)" if self._text else f"{self._label}: begun {since} ago")


@contextmanager
def progress(label: str, *, may_fork: bool = False) -> Iterator[ShowProgress]:
    """Yield a callback that shows the number done and the total. Short work does not show anything.

    With `may_fork`, no thread is started, because the process may fork. The bar then changes only when the callback is
    called.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    output = console(stderr=True)
    is_live = sys.stderr.isatty() and output.is_interactive
    bar = Progress(
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(),
        TextColumn("{task.fields[facts]}", markup=False), TextColumn("ETA {task.fields[left]}"), TimeElapsedColumn(),
        console=output, redirect_stdout=sys.stdout.isatty(), disable=not is_live, auto_refresh=not may_fork,
    )  # fmt: skip
    task = bar.add_task(label, total=None, facts="", left="-")
    plain = _PlainProgress(label)
    is_over, order = threading.Event(), threading.Lock()

    def show(done: int, total: int, facts: str = "") -> None:
        left = plain.update(done, total, facts)
        bar.start()
        bar.update(task, completed=done, total=total, facts=facts, left=left, refresh=may_fork)
        if not is_live:
            plain.print_line(0.0 if done >= total else PLAIN_SECONDS)

    def keep_alive() -> None:
        while not is_over.wait(QUIET_SECONDS):
            with order:
                if is_live and not is_over.is_set():
                    bar.start()
                elif not is_over.is_set():
                    plain.print_heartbeat()

    if not may_fork:
        threading.Thread(target=keep_alive, name=f"progress of {label}", daemon=True).start()
    try:
        yield show
    finally:
        with order:
            is_over.set()
        if bar.live.is_started:
            bar.stop()


@contextmanager
def run_progress(label: str) -> "Iterator[OnProgress]":
    """Yield a callback that shows the progress of a run."""
    with progress(label) as show:
        yield lambda run: show(run.done + run.errors, run.total, progress_facts(run))


def progress_facts(run: "RunProgress") -> str:
    """Return a text with a run's rates, cost, errors and latest retry."""
    return "  ".join(
        (
            f"W {percent_text(run.W)}",
            f"B {percent_text(run.B)}",
            *([f"T {percent_text(run.T)}"] if run.T is not None else []),
            *([f"cost {run.cost:,.2f}"] if run.cost is not None else []),
            *([f"errors {run.errors}"] if run.errors else []),
            *([textwrap.shorten(run.retry_reason, RETRY_REASON_CHARS, placeholder=" ...")] if run.retry_reason else []),
        )
    )


def read_runs_shown(folders: Sequence[Path], pack: str | Path | None = None, **options: Any) -> "list[Run]":
    """Return the scored runs in `folders`, and show how many were read if there are several.

    `options` are those of `vigil.analysis.measures.rows.read_runs`. Raises RecordError or PackMismatch.
    """
    from vigil.analysis.measures.rows import read_runs

    if len(folders) < 2:
        return read_runs(folders, pack, **options)
    with progress("runs") as show:
        show(0, len(folders))
        return read_runs(folders, pack, **options, on_run=show)
