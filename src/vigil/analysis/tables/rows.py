"""Rows of tables: one for each run, and the paper's published rows, which are marked."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from vigil.analysis.measures.closure import SuiteRun
from vigil.analysis.measures.labels import Role
from vigil.analysis.measures.paper import PublishedModel
from vigil.analysis.measures.rows import Run
from vigil.analysis.measures.study import RunEntry, Study
from vigil.analysis.tables.table import Column, TableRow, cells_of, counts, intervals, means, pp_cell, rate_cell

MODEL, RUN = Column("model", "Model", "text"), Column("model", "Run", "text")
PUBLISHED = "Published: the paper's own pack and simulator"
ROLE_HEADINGS: dict[Role, str] = {
    "main": "",
    "repeat": "Repeats of a run above",
    "condition": "Under another condition",
}
Measured = str | tuple[str, str]
"""Heading of a column, or (heading, name of the measure). With only a heading, the column's key is the name."""


def shown_name(name: str) -> str:
    """Return the heading of a rate's column, with the unit."""
    return "Δ (pp)" if name == "Delta" else f"{name} %"


def rates(**headings: Measured) -> tuple[Column, ...]:
    """Return columns with rates of a run and their Wilson intervals; `headings` are {key: heading}."""
    return intervals(**with_values(headings, lambda entry, name: rate_cell(entry.overall.rate(name))))


def tallies(**headings: Measured) -> tuple[Column, ...]:
    """Return columns with a run's numbers of episodes; `headings` are {key: heading}."""
    return counts(**with_values(headings, lambda entry, name: entry.overall.counts[name]))


def run_means(**headings: Measured) -> tuple[Column, ...]:
    """Return columns of means over a run's episodes, with one decimal and intervals; `headings` are {key: heading}."""
    return intervals(**with_values(headings, RunEntry.mean))


def precise_means(**headings: Measured) -> tuple[Column, ...]:
    """Return columns like `run_means`, with two decimals."""
    return means(**with_values(headings, RunEntry.mean))


def clustered_rates(*names: str) -> tuple[Column, ...]:
    """Return columns with W, B or Delta of a run, with intervals from resampled houses."""
    headings = {name: shown_name(name) for name in names}
    return intervals(
        **with_values(headings, lambda entry, name: pp_cell(entry.overall.share(name), entry.clustered[name]))
    )


def run_row(entry: RunEntry, cells: dict[str, Any], group: str = "") -> TableRow:
    """Return a run's row: its name, the cells, and whether its agent is privileged."""
    return TableRow({"model": entry.name, **cells}, group, is_privileged=entry.run.model.is_privileged)


def row_of(run: SuiteRun | Run, **cells: Any) -> TableRow:
    """Return the row of a run in a table whose first column is `run`."""
    return TableRow({"run": run.name, **cells}, is_privileged=run.header.is_privileged)


def run_rows(
    entries: Iterable[RunEntry], columns: Sequence[Column], group: Callable[[RunEntry], str] = lambda entry: ""
) -> list[TableRow]:
    """Return one row for each run, with the cells of the columns; `group` returns the heading of a run's group."""
    return [run_row(entry, cells_of(columns, entry), group(entry)) for entry in entries]


def published_row(model: PublishedModel, cells: dict[str, Any], group: str = PUBLISHED) -> TableRow:
    """Return a row with the name of a published model, marked as published."""
    return TableRow({"activated": model.activated, **cells, "model": model.name}, group, is_published=True)


def published_rows(
    study: Study,
    table: str,
    cells: Callable[[dict[str, Any]], dict[str, Any]] = lambda row: row,
    group: Callable[[PublishedModel], str] = lambda model: PUBLISHED,
) -> list[TableRow]:
    """Return the rows of one of the paper's tables; empty if the study has no published rows.

    `cells` returns the cells of a printed row; `group` returns the heading of a model's group.
    """
    if study.published is None:
        return []
    return [published_row(model, cells(row), group(model)) for model, row in study.published.rows(table)]


def side_by_side(study: Study, own: Sequence[TableRow], published: Sequence[TableRow]) -> list[TableRow]:
    """Return the rows of `own`, each followed by the published row of the same model, then the remaining published
    rows."""
    names = {entry.name: entry.published for entry in study.entries}
    printed = {row.cells["model"]: row for row in published}
    found = []
    for row in own:
        found.append(row)
        twin = printed.pop(names.get(row.cells["model"]), None)
        if twin is not None:
            found.append(replace(twin, group=row.group))
    return [*found, *printed.values()]


def role_row(entry: RunEntry, cells: dict[str, Any]) -> TableRow:
    """Return a run's row in a table of all runs, under the heading of the run's role."""
    return run_row(entry, cells, ROLE_HEADINGS[entry.role])


def published_group(model: PublishedModel) -> str:
    """Return the heading over a published row, for tables that also group the user's own rows."""
    return f"{model.group}, published"


def with_values(
    headings: Mapping[str, Measured], value: Callable[[RunEntry, str], Any]
) -> dict[str, tuple[str, Callable[[RunEntry], Any]]]:
    """Return {key: (heading, function)}; the function returns the measure of a run."""
    named = {key: (given, key) if isinstance(given, str) else given for key, given in headings.items()}
    return {key: (heading, lambda entry, name=name: value(entry, name)) for key, (heading, name) in named.items()}
