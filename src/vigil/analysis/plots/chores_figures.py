"""Figures of the suite `chores`: what truthfulness (T) depends on, and how precise T gets with more model calls."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from vigil.analysis.measures.chores import (
    POWER_CALLS,
    ChoresRun,
    Mean,
    by_interference,
    by_number,
    by_steps_since_done,
    predicted_power,
)
from vigil.analysis.plots.style import CYCLE, DASHES, canvas, set_figure_title, styled

_SIZE = (8.6, 4.2)
_T_AXIS = "T: claims that are true (%)"


def _curves(
    runs: Sequence[ChoresRun], split: Callable[[ChoresRun], Mapping[str, Mean]], title: str, axis: str
) -> Figure | None:
    """Draw T of each run for each part of its chores, with intervals; None if no run has claims."""
    found = [(run, parts) for run in runs if (parts := split(run))]
    if not found:
        return None
    names = sorted({name for _, parts in found for name in parts}, key=lambda name: int(name.split()[0]))
    with styled():
        figure = canvas(*_SIZE)
        axes = figure.add_subplot()
        for index, (run, parts) in enumerate(found):
            shift = 0.5 * (index - (len(found) - 1) / 2) / max(len(found), 1)
            places = [names.index(name) + shift for name in parts]
            values = 100 * np.array([mean for mean, _ in parts.values()])
            ends = 100 * np.array([interval or (mean, mean) for mean, interval in parts.values()])
            look = {"color": CYCLE[index % len(CYCLE)], "ls": DASHES[index % len(DASHES)], "marker": "o", "ms": 5}
            axes.errorbar(places, values, np.abs(ends.T - values), lw=1.6, capsize=3, label=run.name, **look)
        axes.set(xlabel=axis, ylabel=_T_AXIS, ylim=(-3, 103), xlim=(-0.6, len(names) - 0.4))
        axes.set_xticks(range(len(names)), names)
        set_figure_title(axes, title)
        axes.grid(visible=True, axis="y")
        figure.legend(loc="outside lower center", ncols=min(3, len(found)), handlelength=3.0)
        return figure


def number_of_chores(runs: Sequence[ChoresRun]) -> Figure | None:
    """Draw T by the number of chores of a list."""
    return _curves(runs, by_number, "Truthfulness by the number of chores", "chores of the list")


def steps_since_done(runs: Sequence[ChoresRun]) -> Figure | None:
    """Draw T by the number of steps since a chore was done, over the chores that were done."""
    axis = "steps from when the chore was done to the report"
    return _curves(runs, by_steps_since_done, "Does it forget? Truthfulness by the steps since a chore was done", axis)


def interference(runs: Sequence[ChoresRun]) -> Figure | None:
    """Draw T by how often chores of a list were undone."""
    return _curves(runs, by_interference, "Truthfulness by interference", "times that chores of the list were undone")


def calls_and_width(runs: Sequence[ChoresRun]) -> Figure | None:
    """Draw half the width of T's interval by the number of model calls, for lists and for episodes with one claim."""
    found = [(run, width) for run in runs if (width := predicted_power(run)) is not None]
    if not found:
        return None
    with styled():
        figure = canvas(*_SIZE)
        axes = figure.add_subplot()
        for index, (run, width) in enumerate(found):
            colour = CYCLE[index % len(CYCLE)]
            for dash, half_width, label in (
                ("-", width.half_width, run.name),
                (":", width.one_claim_half_width, f"{run.name}: one claim an episode"),
            ):
                values = [100 * half_width(calls) for calls in POWER_CALLS]
                axes.plot(POWER_CALLS, values, color=colour, ls=dash, marker="o", ms=4, lw=1.6, label=label)
        axes.set(xscale="log", xlabel="model calls", ylabel="± of the 95 % interval (points)")
        axes.set_xticks(POWER_CALLS, [f"{calls:,}" for calls in POWER_CALLS])
        axes.minorticks_off()
        axes.set_ylim(bottom=0)
        set_figure_title(axes, "Power: how narrow an interval on T model calls buy")
        axes.grid(visible=True)
        figure.legend(loc="outside lower center", ncols=2, handlelength=3.0)
        return figure


CHORES_FIGURES: dict[str, Callable[[Sequence[ChoresRun]], Figure | None]] = {
    "chores_number": number_of_chores,
    "chores_since": steps_since_done,
    "chores_interference": interference,
    "chores_power": calls_and_width,
}
