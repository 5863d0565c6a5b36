"""Tables of `vigil run`, `score` and `merge` for the closure-stress suite: C by kind, and pairs of twins.

It stands apart from `scores`, which must not load what these measures need.
"""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from vigil.analysis.measures.closure import ClosureRun, read_closure_runs
from vigil.cli.text import percent, print_fitting, with_interval

RATES = ("C", "pairs_right")
"""Those that are shown with their intervals."""
MORE = "C: the report says what is true of the world at the end. All tables of the suite: `vigil report`."


def read_closure_run(folder: Path, pack: str | Path | None) -> ClosureRun:
    """Returns a run of the suite, settled."""
    return read_closure_runs([folder], pack)[0]


def print_closure(runs: Sequence[ClosureRun]) -> None:
    """Prints one run's table, a row a kind; of several, a row a run."""
    if len(runs) == 1:
        print_fitting(lambda is_full: _by_kind(runs[0], is_full))
    else:
        print_fitting(lambda is_full: _side_by_side(runs, is_full))
    print(MORE)


def _by_kind(run: ClosureRun, is_full: bool) -> Table:
    interval = " [95 % interval]" if is_full else ""
    table = _table(Text(f"{run.name}: closure stress, %{interval}"), "kind", is_full)
    for heading in ("episodes", "C", "both twins", "W", "false success", "no report"):
        table.add_column(heading, justify="right", no_wrap=True)
    for kind, rates in run.rates().items():
        if kind == "all":
            table.add_section()
        cells = [with_interval(rates, name) if is_full else percent(rates[name]) for name in RATES]
        rest = [percent(rates[name]) for name in ("W", "false_success", "no_report")]
        table.add_row(kind, str(rates["episodes"]), *cells, *rest)
    return table


def _side_by_side(runs: Sequence[ClosureRun], is_full: bool) -> Table:
    rows = [(run, run.rates()) for run in runs]
    kinds = list(dict.fromkeys(kind for _, rates in rows for kind in rates if kind != "all"))
    table = _table(Text("Closure stress: C by kind, %"), "agent", is_full)
    for heading in ("episodes", "all", "both twins", *kinds):
        table.add_column(heading, justify="right", no_wrap=is_full)
    for run, rates in rows:
        cells = [with_interval(rates["all"], name) if is_full else percent(rates["all"][name]) for name in RATES]
        each = [percent(rates[kind]["C"]) if kind in rates else "-" for kind in kinds]
        table.add_row(Text(run.name), str(rates["all"]["episodes"]), *cells, *each)
    return table


def _table(title: Text, first: str, is_full: bool) -> Table:
    table = Table(title=title, title_justify="left", padding=(0, 1) if is_full else 0)
    table.add_column(first, overflow="fold")
    return table
