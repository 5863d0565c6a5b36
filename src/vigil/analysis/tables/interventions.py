"""Intervention tables: the paper's tables of feedback, prompt and repeats, and the stability of rates."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from vigil.analysis.measures.metrics import EVENTS, measure, plays_of_k
from vigil.analysis.measures.study import Study, sorted_by_group
from vigil.analysis.tables.paired import SHIFTED, TESTED, TESTS, N, prompt_shifts, shifts
from vigil.analysis.tables.results import ALL, OUTSIDE, family_columns, printed_pairs
from vigil.analysis.tables.rows import MODEL, PUBLISHED, published_group, published_rows, run_row, run_rows, shown_name
from vigil.analysis.tables.table import (
    Column,
    Table,
    TableRow,
    cells_of,
    counts,
    first_number,
    in_percent,
    intervals,
    numbers,
    pp_cell,
    rate_cell,
    texts,
    titled,
)

REPEATED = ("W", "B", "Delta", "FR", "NR", "NoRep")
STABLE_PP = 1.0
"""Half-ranges and shifts below this limit (percentage points) are called stable in the paper."""
_W_AND_B = ("W", "B")
_SIDES = {"base": "base", "fb": "+FB"}
"""End of a column's key -> name, in headings, of the run of a pair that the column is about."""


def proprio_minimal(study: Study) -> Table:
    """Return the table that compares runs without and with action feedback: events per episode and differences."""
    events = tuple(
        Column(
            f"{event} {side}",
            f"{event} {shown}",
            "number2",
            lambda pair, event=event, at=at: pair.measures[at].means[event],
        )
        for event in EVENTS
        for at, (side, shown) in enumerate(_SIDES.items())
    )
    columns = (MODEL, N, *events, *shifts(TESTED), *TESTS)
    found = [(study.entry(pair.base), pair) for pair in study.pairing.feedback]
    found.sort(key=lambda each: -(each[0].overall.share("B") or 0.0))
    rows = [run_row(entry, cells_of(columns, pair), OUTSIDE.get(entry.panel, "")) for entry, pair in found]
    rows.sort(key=lambda row: row.group)
    rows += published_rows(
        study,
        "proprio_minimal",
        lambda row: row | {f"{event} {side}": row[event][i] for event in EVENTS for i, side in enumerate(_SIDES)},
    )
    return titled("proprio_minimal", columns, rows, *study.pairing.choices["feedback"])


def prompt_sensitivity(study: Study) -> Table:
    """Return a table of W and B under the neutral prompt, grouped as in the paper."""
    columns = (MODEL, ALL, *family_columns())
    entries = sorted_by_group(study.entry(pair.other) for pair in study.pairing.prompt)
    rows = run_rows(entries, columns, lambda entry: entry.group)
    rows += published_rows(study, "prompt_sensitivity", printed_pairs, published_group)
    return titled("prompt_sensitivity", columns, rows)


def open_repeat_robustness(study: Study) -> Table:
    """Return a table of the mean and half-range of rates over repeated runs."""
    spreads = (
        Column(name, shown_name(name), "spread", lambda one, name=name: spread(_percents(one.tables, name)))
        for name in REPEATED
    )
    columns = (MODEL, *counts(runs=("Runs", lambda one: len(one.tables))), *spreads)
    rows = [
        run_row(study.entry(one.run), {**cells_of(columns, one), "model": one.name}) for one in study.pairing.repeats
    ]
    rows += published_rows(study, "open_repeat_robustness", lambda row: {**row, "Delta": row["delta"], "runs": 2})
    return titled("open_repeat_robustness", columns, rows)


def repeat_rates(study: Study) -> Table:
    """Return every rate, with its interval, over the plays of all repeats together."""
    columns = (
        MODEL,
        *texts(rate="Rate"),
        *counts(runs="Runs", n="Plays"),
        *intervals(pooled="All repeats"),
        *numbers(low="Lowest run", high="Highest run", half_range="Half-range"),
    )
    rows = []
    for one in study.pairing.repeats:
        whole = measure(pd.concat(one.tables, ignore_index=True))
        for name in REPEATED:
            known = [value for value in _percents(one.tables, name) if value is not None]
            cells: dict[str, Any] = {
                "model": one.name,
                "rate": shown_name(name),
                "runs": len(one.tables),
                "n": whole.n,
                "pooled": rate_cell(whole.rate(name)),
            }
            if known:
                cells |= {"low": min(known), "high": max(known), "half_range": (max(known) - min(known)) / 2}
            rows.append(run_row(study.entry(one.run), cells))
    return titled("repeat_rates", columns, rows)


def several_plays(study: Study) -> Table:
    """Return a table of the chances that all, and that any, of k plays succeed, for every run that played episodes
    several times."""
    columns = (
        MODEL,
        *counts(k="k", episodes="Episodes", plays="Plays"),
        *intervals(
            **{f"every_{name}": f"{name}: all of k %" for name in _W_AND_B},
            **{f"any_{name}": f"{name}: any of k %" for name in _W_AND_B},
        ),
    )
    rows = []
    for entry in study.entries:
        if entry.run.header.spec.epochs == 1:
            continue
        for each in zip(*(plays_of_k(entry.run.rows, name) for name in _W_AND_B), strict=True):
            cells = {"k": each[0].k, "episodes": each[0].episodes, "plays": each[0].plays}
            defined = _W_AND_B if entry.overall.has_reports else ("W",)
            for name, found in zip(defined, each, strict=False):
                cells |= {f"every_{name}": pp_cell(*found.every), f"any_{name}": pp_cell(*found.any)}
            rows.append(run_row(entry, cells))
    return titled("several_plays", columns, rows)


def stability(study: Study) -> Table:
    """Return a table of prompt shifts and of half-ranges of repeats: how many are small, and which are largest."""
    columns = (
        *texts(change="Between", rate="Rate"),
        *counts(n="Configurations", steady=f"Under {STABLE_PP:.0f} pp"),
        *numbers(largest="Largest (pp)"),
        *texts(whose="Whose"),
    )
    sources = {
        "Default and neutral prompt: shift": (prompt_shifts(study).rows, lambda row, name: row.cells.get(f"d{name}")),
        "Repeats: half-range": (
            open_repeat_robustness(study).rows,
            lambda row, name: cell[1] if (cell := row.cells.get(name)) else None,
        ),
    }
    rows: list[TableRow] = []
    for is_published in (False, True):
        for change, (found, cell_of) in sources.items():
            kept = [row for row in found if row.is_published is is_published]
            for name in SHIFTED:
                moved = [(row.cells["model"], first_number(cell_of(row, name))) for row in kept]
                rows += _stability_rows(change, name, moved, is_published)
    return titled("stability", columns, rows)


def spread(values: Sequence[float | None]) -> tuple[float, float] | None:
    """Return (mean, half-range) of the values. The half-range is half of (highest - lowest)."""
    known = [value for value in values if value is not None]
    return (float(np.mean(known)), (max(known) - min(known)) / 2) if known else None


def _percents(tables: Iterable[pd.DataFrame], name: str) -> list[float | None]:
    return [in_percent(measure(table).share(name)) for table in tables]


def _stability_rows(
    change: str, name: str, moved: Iterable[tuple[str, float | None]], is_published: bool
) -> Iterator[TableRow]:
    sizes = [(abs(size), model) for model, size in moved if size is not None]
    if sizes:
        largest, whose = max(sizes, key=lambda pair: pair[0])
        steady = sum(size < STABLE_PP - 1e-9 for size, _ in sizes)
        cells = {"change": change, "rate": shown_name(name), "n": len(sizes), "steady": steady}
        group = PUBLISHED if is_published else ""
        yield TableRow({**cells, "largest": largest, "whose": whose}, group, is_published)
