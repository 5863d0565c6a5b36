"""Tables of results that the paper states only in its text: why B rises, events with feedback, and false reports of
success."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import houses_of, paired_difference
from vigil.analysis.measures.metrics import EVENTS
from vigil.analysis.measures.rows import values
from vigil.analysis.measures.study import RunEntry, Study, sorted_by_role
from vigil.analysis.tables.paired import named_tables
from vigil.analysis.tables.rows import RUN, role_row
from vigil.analysis.tables.table import Table, TableRow, counts, intervals, numbers, pp_cell, rate_cell, texts, titled
from vigil.scoring.rates import rate_of

BINS = {"0": (0.0, 0.0), "to 25": (0.0, 0.25), "to 50": (0.25, 0.5), "to 75": (0.5, 0.75), "above 75": (0.75, 1.0)}
"""Heading (%) -> (lower, upper end) of a class of progress, as fractions. The lower end is excluded, except in the
first class."""


def gain_sources(study: Study) -> Table:
    """Return where a change of B comes from: closures of reached goals, or goals that were newly reached or lost."""
    columns = (
        *texts(model="Change"),
        *counts(n="n"),
        *counts(closed="Reached before, now closed", reached="Newly reached and closed"),
        *counts(unclosed="Still reached, no longer closed", lost="No longer reached"),
        *intervals(closure="ΔB by closure (pp)", goals="ΔB by goals (pp)", both="ΔB (pp)"),
    )
    rows = [
        TableRow({"model": name, "n": len(base), **_gain_cells(base, other)})
        for name, base, other in named_tables(study)
    ]
    return titled("gain_sources", columns, rows)


def _gain_cells(base: pd.DataFrame, other: pd.DataFrame) -> dict[str, Any]:
    (w, b), (w2, b2) = ((values(rows, "W", bool), values(rows, "B", bool)) for rows in (base, other))
    in_both = w & w2
    houses = houses_of(base)
    parts = {"closure": (b & in_both, b2 & in_both), "goals": (b & ~in_both, b2 & ~in_both), "both": (b, b2)}
    found: dict[str, Any] = {
        "closed": int(np.sum(in_both & ~b & b2)),
        "reached": int(np.sum(~w & b2)),
        "unclosed": int(np.sum(in_both & b & ~b2)),
        "lost": int(np.sum(b & ~w2)),
    }
    return found | {name: pp_cell(*paired_difference(before, after, houses)) for name, (before, after) in parts.items()}


def event_reductions(study: Study) -> Table:
    """Return how many models have fewer events (such as blocked moves) with action feedback, and by how much."""
    columns = (
        *texts(model="Event"),
        *counts(models="Models", fewer="With fewer"),
        *numbers(median="Median change %", lowest="Lowest change %", highest="Highest change %"),
        *texts(least="Model with the lowest"),
    )
    own = [
        (pair.base.name, {event: tuple(each.means[event] for each in pair.measures) for event in EVENTS})
        for pair in study.pairing.feedback
    ]
    rows = list(_reductions(own, is_published=False))
    if study.published:
        printed = [(model.name, row) for model, row in study.published.rows("proprio_minimal")]
        rows += _reductions(printed, is_published=True)
    return titled("event_reductions", columns, rows)


def _reductions(found: list[tuple[str, dict[str, Any]]], *, is_published: bool) -> Iterator[TableRow]:
    for event in EVENTS:
        changes = {
            name: 100 * (after / before - 1)
            for name, means in found
            for before, after in [means[event]]
            if before and after is not None
        }
        if changes:
            low = min(changes, key=lambda name: changes[name])
            sizes = list(changes.values())
            cells = {"model": event, "models": len(sizes), "fewer": sum(size < 0 for size in sizes), "least": low}
            cells |= {"median": float(np.median(sizes)), "lowest": min(sizes), "highest": max(sizes)}
            yield TableRow(cells, "Published" if is_published else "", is_published)


def false_success_progress(study: Study) -> Table:
    """Return how far the goal had advanced at reports of success with W=0."""
    columns = (
        RUN,
        *counts(FS="FS", without="Without progress"),
        *intervals(**{f"share {name}": f"{name} %" for name in BINS}),
        *numbers(mean="Mean %", median="Median %"),
    )
    rows = [role_row(entry, _progress_cells(entry)) for entry in sorted_by_role(study.entries)]
    return titled("false_success_progress", columns, rows)


def _progress_cells(entry: RunEntry) -> dict[str, Any]:
    rows = entry.run.rows
    progress, is_false = values(rows, "progress_at_report"), values(rows, "subtype", object) == "false_success"
    known = is_false & np.isfinite(progress)
    episodes = values(rows, "episode_id", str)
    cells: dict[str, Any] = {"FS": int(is_false.sum()), "without": int((is_false & ~np.isfinite(progress)).sum())}
    for name, (low, high) in BINS.items():
        inside = progress == 0 if high == 0 else (progress > low) & (progress <= high)
        cells[f"share {name}"] = rate_cell(rate_of(inside, known, episodes))
    if known.any():
        cells |= {"mean": 100 * float(progress[known].mean()), "median": 100 * float(np.median(progress[known]))}
    return cells
