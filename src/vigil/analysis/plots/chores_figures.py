"""Figures of the suite `chores`: what truthfulness (T) depends on, and how precise T gets with more model calls."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
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
    names = _in_order([parts for _, parts in found])
    with styled():
        figure = canvas(*_SIZE)
        axes = figure.add_subplot()
        for index, (run, parts) in enumerate(found):
            shift = 0.5 * (index - (len(found) - 1) / 2) / max(len(found), 1)
            places = [names.index(name) + shift for name in parts]
            values = 100 * np.array([mean for mean, _ in parts.values()])
            ends = 100 * np.array([interval or (mean, mean) for mean, interval in parts.values()])
            _draw(axes, index, places, (values, ends), run.name)
        axes.set(xlabel=axis, ylabel=_T_AXIS, ylim=(-3, 103), xlim=(-0.6, len(names) - 0.4))
        axes.set_xticks(range(len(names)), names)
        set_figure_title(axes, title)
        axes.grid(visible=True, axis="y")
        figure.legend(loc="outside lower center", ncols=min(3, len(found)), handlelength=3.0)
        return figure


def _in_order(splits: Sequence[Mapping[str, Mean]]) -> list[str]:
    """Return the names of all parts, sorted by the number at the start of each name."""
    names = {name for parts in splits for name in parts}
    return sorted(names, key=lambda name: int(name.split()[0]))


def _draw(axes: Axes, index: int, places: Sequence[float], points: tuple[np.ndarray, np.ndarray], name: str) -> None:
    values, ends = points
    colour, dash = CYCLE[index % len(CYCLE)], DASHES[index % len(DASHES)]
    axes.errorbar(
        places,
        values,
        yerr=np.abs(ends.T - values),
        color=colour,
        ls=dash,
        marker="o",
        ms=5,
        lw=1.6,
        capsize=3,
        label=name,
    )


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
CHORES_CAPTIONS = {
    "chores_number": "Number of chores: T of the lists of each length. Intervals: resampled houses with all their "
    "lists.",
    "chores_since": "Steps since a chore was done: T of the chores that hold because of an act, by the steps from when "
    "they were done to the report. The history that an agent gets has the last 20 turns. Intervals as above.",
    "chores_interference": "Interference of chores: T of the lists in which other acts of the agent undid chores that "
    "often. Intervals as above.",
    "chores_power": "Calls and width of the interval: half the width of the 95 % interval on T after a number of model "
    "calls (solid), and that of a rate as high in episodes with one claim each (dotted).",
}
"""Figure -> its caption."""
