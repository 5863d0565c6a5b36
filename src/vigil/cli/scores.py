"""`vigil score`, and the tables of scores that it and other verbs print."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from vigil.cli.arguments import AsJson, RunArguments
from vigil.cli.text import COLUMNS, percent_text, print_fitting, print_notes, rate_text
from vigil.runner.shared_settings import PackLocation

if TYPE_CHECKING:
    from vigil.analysis.measures.chores import ChoresRun
    from vigil.analysis.measures.closure import ClosureRun
    from vigil.records.record import RunHeader, RunSpec
    from vigil.scoring.summary import RunScores

INVALID_HINT = "`vigil view` shows the replies; section 2.3 of docs/protocol.md says which replies are actions."
LENIENT_HINT = (
    "To accept replies that would parse leniently, play with --reply-policy lenient, which is a separate variant."
)
CLOSURE = "C: the report is true of the world at the end. All tables of the suite: `vigil report`."
CHORES = (
    "W: all chores that can be done are done. B: W, and every claim is right. T: share of claims that are true. Over: "
    "chores claimed as done that are not. Under: done chores that are not claimed. All tables of the suite: "
    "`vigil report`."
)
CHORES_RATES = {
    "W_share": "W share",
    "W": "W",
    "B": "B",
    "T": "T",
    "chance": "T by chance",
    "overclaim": "over",
    "underclaim": "under",
    "status_true": "status true",
}
"""Key of a score for lists of chores -> heading of the score's column in the table."""
CLOSURE_RATES = ("C", "correct_pairs")
"""Rates of the closure-stress suite that are shown with intervals."""
RATES = ("episodes", *COLUMNS, "steps")
"""Headings of the columns of numbers in a table of rates."""
INTERVAL = " [95 % interval]"
"""End of the title of a table whose rates have intervals."""
INTERVALS = "The interval of every rate: `vigil score --json`, `vigil report`."
JSON_SCHEMA = 1
"""Version of the document that `--json` prints."""
MAX_REASONS = 5
MAX_REASON_CHARS = 300


def score(runs: RunArguments, as_json: AsJson = False, pack: PackLocation = None) -> None:
    """Example: vigil score runs/solver runs/premature"""
    different = {path.resolve(): path for path in reversed(runs)}
    scored_runs = _with_unique_names([_scored_run(path, pack) for path in reversed(different.values())])
    print_notes(note for run in scored_runs for note in run.notes)
    if as_json:
        print(json.dumps({"schema_version": JSON_SCHEMA, "runs": [_as_json(run) for run in scored_runs]}))
        return
    _print_scores(scored_runs)


@dataclass(frozen=True, slots=True)
class _ScoredRun:
    """A run with the verdicts on its episodes, its name in tables, and notes about it."""

    path: Path
    name: str
    spec: RunSpec
    scores: RunScores
    notes: tuple[str, ...]
    """Notes that a reader must see before any score."""
    closure: ClosureRun | None = None
    """The run's results on the closure-stress suite; None for other packs."""
    chores: ChoresRun | None = None
    """The run's results on lists of chores; None for other packs."""


def print_run(path: Path, pack: str | Path | None = None) -> None:
    """Print the scores of a run that was just played or merged: the measures of its suite, or else rates by family."""
    _print_scores([_scored_run(path, pack)])


def _print_scores(runs: list[_ScoredRun]) -> None:
    plain = [run for run in runs if run.closure is None and run.chores is None]
    if len(plain) == 1:
        _print_families(plain[0].name, plain[0].scores)
    elif plain:
        _print_comparison([(run.name, run.scores) for run in plain])
    _print_closure([run for run in runs if run.closure is not None])
    _print_chores([run for run in runs if run.chores is not None])


def _as_json(run: _ScoredRun) -> dict[str, Any]:
    from vigil.scoring.summary import summarise

    found = {"run": str(run.path), "agent": run.name, "notes": run.notes, **summarise(run.scores)}
    suites = {
        "closure": None if run.closure is None else run.closure.rates(),
        "chores": None if run.chores is None else run.chores.scores(),
    }
    return {**found, **{suite: scores for suite, scores in suites.items() if scores is not None}}


def _scored_run(path: Path, pack: str | Path | None) -> _ScoredRun:
    from vigil.packs.pack import CHORES_SUITE, manifest_of
    from vigil.scoring.closure import SUITE
    from vigil.scoring.saved_run import read_run

    run = read_run(path, pack)
    found = _ScoredRun(path, run_label(run.header), run.header.spec, run.table.scores(), run.notes)
    suite = manifest_of(run.pack_folder).suite
    # The measures of suites take most of a second to load, and no other run needs them.
    if suite == SUITE:
        from vigil.analysis.measures.closure import read_closure_runs

        return replace(found, closure=read_closure_runs([path], pack)[0])
    if suite == CHORES_SUITE:
        from vigil.analysis.measures.chores import read_chores_runs

        return replace(found, chores=read_chores_runs([path], pack)[0])
    return found


def _with_unique_names(runs: list[_ScoredRun]) -> list[_ScoredRun]:
    """Return the runs with unique names. Runs of one agent get their folder's name, and a note says how they differ."""
    found: list[_ScoredRun] = []
    for run in runs:
        namesakes = [each for each in runs if each.name == run.name]
        if len(namesakes) > 1:
            values = [each.spec.settings for each in namesakes]
            differ = [
                name
                for name in sorted({*chain(*values)})
                if any(each.get(name) != values[0].get(name) for each in values)
            ]
            differences = f"in {', '.join(differ)}" if differ else "only in time"
            note = f"{len(namesakes)} runs are named {run.name}; they differ {differences}."
            notes = (note, *run.notes) if run is namesakes[0] else run.notes
            run = replace(run, name=f"{run.name} · {run.path}", notes=notes)
        found.append(run)
    return found


def run_label(header: RunHeader) -> str:
    """Return the name of a run in tables, with marks if its agent is privileged, has memory or a custom prompt."""
    own_prompt = f" [{header.spec.profile.prompt_variant}]" if header.spec.profile.has_custom_prompt else ""
    source = header.spec.fork
    forked = "" if source is None else f" [from {source.run_id} at {source.at}]"
    return header.spec.agent + own_prompt + forked + header.spec.name_suffix


def _print_families(name: str, scores: RunScores) -> None:
    """Print one run's table, with a row per family."""
    from vigil.scoring.summary import summarise

    _warn(name, scores)
    summary = summarise(scores)

    def build(is_full: bool) -> Table:
        table = _table(f"{name}: %{INTERVAL if is_full else ''}", ("family", *RATES), is_full)
        for family, rates in summary["families"].items():
            table.add_row(family, *_cells(rates, is_full))
        table.add_section()
        table.add_row("all", *_cells(summary["overall"], is_full))
        if "macro" in summary:
            macro = summary["macro"]
            rates = [percent_text(macro[column]) for column in COLUMNS]
            table.add_row("mean of families", "", *rates, f"{macro['mean_steps']:.1f}")
        return table

    print_fitting(build)
    print(INTERVALS)
    if scores.subtypes:
        print(f"FR and Other are: {', '.join(f'{number} {name}' for name, number in scores.subtypes.items())}.")


def _print_comparison(scored_runs: list[tuple[str, RunScores]]) -> None:
    from vigil.protocol.families import FAMILIES
    from vigil.scoring.summary import summarise

    for name, scores in scored_runs:
        _warn(name, scores)
    rows = [(name, summarise(scores)) for name, scores in scored_runs]

    def overall(is_full: bool) -> Table:
        table = _table(f"All episodes, %{INTERVAL if is_full else ''}", ("agent", *RATES), is_full)
        for name, summary in rows:
            table.add_row(name, *_cells(summary["overall"], is_full))
        return table

    def families(is_full: bool) -> Table:
        table = _table("W / B by family, %", ("agent", *FAMILIES), is_full)
        for name, summary in rows:
            table.add_row(name, *[_pair(summary["families"].get(family), is_full) for family in FAMILIES])
        return table

    print_fitting(overall)
    print_fitting(families)
    print(INTERVALS)


def _table(title: Text | str, columns: Sequence[str], is_full: bool, no_wrap: bool = True) -> Table:
    """Return an empty table. The first of `columns` is the column of names, the others are columns of numbers."""
    table = Table(title=title, title_justify="left", padding=(0, 1) if is_full else 0)
    table.add_column(columns[0], overflow="fold")
    for column in columns[1:]:
        table.add_column(column, justify="right", no_wrap=no_wrap)
    return table


def _cells(rates: dict, is_full: bool) -> list[str]:
    steps = "-" if rates["mean_steps"] is None else f"{rates['mean_steps']:.1f}"
    cells = [rate_text(rates, name, is_full and name in ("W", "B")) for name in COLUMNS]
    return [rates["complete"], *cells, steps]


def _pair(rates: dict | None, is_full: bool) -> str:
    if rates is None or rates["W"] is None:
        return "-"
    if is_full or rates["B"] is None:
        return f"{percent_text(rates['W'])} / {percent_text(rates['B'])}"
    return f"{100 * rates['W']:.0f}/{100 * rates['B']:.0f}"


def _print_closure(runs: list[_ScoredRun]) -> None:
    """Print a table of the closure-stress suite: for one run a row per kind; for several runs a row per run."""
    for run in runs:
        _warn(run.name, run.scores)
    found = [replace(run.closure, name=run.name) for run in runs if run.closure is not None]
    if found:
        print_fitting(lambda is_full: _kinds(found[0], is_full) if len(found) == 1 else _side_by_side(found, is_full))
        print(CLOSURE)


def _kinds(run: ClosureRun, is_full: bool) -> Table:
    title = Text(f"{run.name}: closure stress, %{INTERVAL if is_full else ''}")
    table = _table(title, ("kind", "episodes", "C", "both twins", "W", "false success", "no report"), is_full)
    for kind, rates in run.rates().items():
        if kind == "all":
            table.add_section()
        cells = [rate_text(rates, name, is_full) for name in CLOSURE_RATES]
        rest = [percent_text(rates[name]) for name in ("W", "false_success", "no_report")]
        table.add_row(kind, str(rates["episodes"]), *cells, *rest)
    return table


def _side_by_side(runs: Sequence[ClosureRun], is_full: bool) -> Table:
    rows = [(run, run.rates()) for run in runs]
    kinds = list(dict.fromkeys(kind for _, rates in rows for kind in rates if kind != "all"))
    title = Text("Closure stress: C by kind, %")
    table = _table(title, ("agent", "episodes", "all", "both twins", *kinds), is_full, no_wrap=is_full)
    for run, rates in rows:
        cells = [rate_text(rates["all"], name, is_full) for name in CLOSURE_RATES]
        each = [percent_text(rates[kind]["C"]) if kind in rates else "-" for kind in kinds]
        table.add_row(Text(run.name), str(rates["all"]["episodes"]), *cells, *each)
    return table


def _print_chores(runs: list[_ScoredRun]) -> None:
    """Print one table with a row for each run on lists of chores."""
    from vigil.scoring.chores import WITHOUT_CLAIMS

    rows = [(run.name, run.chores.scores()) for run in runs if run.chores is not None]
    for run in runs:
        _warn(run.name, run.scores)

    def build(is_full: bool) -> Table:
        title = Text(f"Lists of chores, %{INTERVAL if is_full else ''}")
        table = _table(title, ("agent", "lists", "claims", *CHORES_RATES.values()), is_full, no_wrap=is_full)
        for name, scores in rows:
            cells = [rate_text(scores, rate, is_full) for rate in CHORES_RATES]
            table.add_row(Text(name), str(scores["episodes"]), str(scores["claims"]), *cells)
        return table

    if rows:
        print_fitting(build)
        print(CHORES)
    for run in runs:
        if run.chores is not None and not run.chores.has_claims:
            print(f"{run.name}: {WITHOUT_CLAIMS}. For claims: --profile itemised_report.")


def _warn(name: str, scores: RunScores) -> None:
    from vigil.scoring.summary import LIBRARY_REPLIES, NO_REPORTS

    if any(not outcome.has_report for outcome in scores.outcomes):
        print(f"{name}: {NO_REPORTS}")
    if scores.has_many_errors:
        print(f"{name}: {len(scores.errors)} episodes ended as errors (more than 1 %); rates leave them out.")
    if not scores.is_complete:
        print(f"{name}: INCOMPLETE, {len(scores.outcomes)} of {sum(scores.planned.values())} episodes scored.")
    if scores.repeats:
        print(f"{name}: {scores.repeats}.")
    if scores.library_replies:
        print(f"{name}: {scores.library_replies} {LIBRARY_REPLIES}.")
    if scores.invalid_replies:
        is_loose = any(outcome.would_parse_leniently for outcome in scores.outcomes)
        print(f"{name}: {scores.invalid_replies}. {LENIENT_HINT if is_loose else INVALID_HINT}")
    reasons = Counter((error.boundary, _last_line(error.message)) for error in scores.errors)
    for (boundary, message), count in reasons.most_common(MAX_REASONS):
        print(f"{name}: {count} x error at the {boundary}: {message}")


def _last_line(message: str) -> str:
    """Return the essential line of a message, which may be a traceback."""
    lines = message.strip().splitlines()
    return lines[-1][:MAX_REASON_CHARS] if lines else "(no message)"
