"""Figures of beliefs: how they change, how often they are true, and why reports were false or missing."""

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from vigil.analysis.measures.beliefs.study import CURVE_STEPS, BeliefStudy, Estimate
from vigil.analysis.measures.study import RunEntry, Study
from vigil.analysis.plots.style import (
    CYCLE,
    DASHES,
    FAINT,
    GREY,
    LABEL_COLOURS,
    PLOT_WIDTH_IN,
    canvas,
    is_column,
    set_figure_title,
    styled,
)
from vigil.analysis.tables.belief_tables import belief_rows, partition_rows
from vigil.scoring.beliefs import PARTS

_NAME_CHARS = {False: 40, True: 27}
"""Whether a figure is for one column of a paper -> number of characters in a line of a name."""
PART_LOOKS = {
    "knew_and_did_not_say": ("knew and did not say", LABEL_COLOURS["NR"], ""),
    "said_without_believing": ("said without believing", LABEL_COLOURS["FR"], ""),
    "believed_wrongly": ("believed wrongly", "#f0c04a", "////"),
    "doubted_correctly": ("doubted correctly", "#56b4e9", "...."),
    "no_answer": ("no answer", GREY, "xxxx"),
}
"""Reason why a report was false or missing (`BeliefPart`) -> its words, colour and hatch."""


def belief_curve(study: Study) -> Figure | None:
    """Draw the mean stated likelihood by steps from attainment, with its interval."""
    rows = list(belief_rows(study))
    if not any(beliefs.curve() for _, beliefs in rows):
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 3.2 + (0.2 if is_column() else 0.1) * _lines(rows))
        axes = figure.add_subplot()
        axes.axvline(0, color=FAINT, lw=1.0, ls=":")
        for number, (entry, beliefs) in enumerate(rows):
            curve = beliefs.curve()
            dash = DASHES[(number // len(CYCLE) + number) % len(DASHES)]
            look: dict[str, Any] = {"color": CYCLE[number % len(CYCLE)], "ls": dash}
            axes.plot([point.since for point in curve], [point.mean.value for point in curve], marker="o", ms=3.5,
                      label=_name(entry, beliefs), **look)  # fmt: skip
            known = [(point.since, point.mean.interval) for point in curve if point.mean.interval is not None]
            if known:
                axes.fill_between([since for since, _ in known], [low for _, (low, _) in known],
                                  [high for _, (_, high) in known], color=look["color"], alpha=0.15, lw=0)  # fmt: skip
        axes.set(xlim=(-CURVE_STEPS - 0.5, CURVE_STEPS + 0.5), ylim=(-0.02, 1.02))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("steps since the frame that first shows the goal")
        axes.set_ylabel("stated likelihood that the task is done")
        set_figure_title(axes, "Belief over time, aligned on attainment")
        figure.legend(loc="outside lower center", ncols=1 if is_column() else 2, handlelength=3.2)
        return figure


def belief_reliability(study: Study) -> Figure | None:
    """Draw for each stated likelihood the share of beliefs that were true; larger marks stand for more answers."""
    rows = [row for row in belief_rows(study) if row[1].answered]
    if not rows:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 4.2 + 0.2 * _lines(rows) if is_column() else 4.6)
        axes = figure.add_subplot()
        axes.plot([0, 1], [0, 1], color=FAINT, lw=1.0, ls=":")
        for number, (entry, beliefs) in enumerate(rows):
            points = beliefs.reliability_points()
            colour = CYCLE[number % len(CYCLE)]
            most = max(found.n for _, found in points)
            shift = min(0.012, 0.04 / len(rows)) * (number - (len(rows) - 1) / 2)
            for stated, found in points:
                axes.plot([stated + shift] * 2, _ends(found), color=colour, lw=1.0, alpha=0.6)
            axes.scatter([stated + shift for stated, _ in points], [found.value for _, found in points],
                         s=[12 + 90 * found.n / most for _, found in points], color=colour, alpha=0.85,
                         marker="osD^vP"[number % 6], label=_name(entry, beliefs), lw=0)  # fmt: skip
        axes.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), aspect="equal")
        axes.set_xlabel("stated likelihood")
        axes.set_ylabel("share that was true")
        set_figure_title(axes, "Reliability of stated beliefs")
        legend = figure.legend(loc="outside lower center" if is_column() else "outside right upper")
        for handle in legend.legend_handles:
            handle.set(sizes=[30])  # pyright: ignore[reportOptionalMemberAccess] - scatter has handles
        return figure


def belief_partition(study: Study) -> Figure | None:
    """Draw FR and NR of each run as bars, split by what was believed at the last step."""
    rows = [row for row in partition_rows(study) if row[1].plays]
    if not rows:
        return None
    bars = [(entry, beliefs, label) for entry, beliefs in rows for label in ("FR", "NR")]
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 1.4 + 0.36 * len(bars))
        axes = figure.add_subplot()
        at, left = np.arange(len(bars)), np.zeros(len(bars))
        for part in PARTS:
            words, colour, hatch = PART_LOOKS[part]
            shares = np.array([100 * (beliefs.parts[part][label].rate.value or 0.0) for _, beliefs, label in bars])
            axes.barh(at, shares, left=left, height=0.66, color=colour, hatch=hatch, edgecolor="white", label=words)
            left += shares
        names = [f"{_name(entry, beliefs)} · {label}" for entry, beliefs, label in bars]
        axes.set_yticks(at, names)
        axes.invert_yaxis()
        axes.set_xlim(0, max(10.0, 1.08 * float(left.max())))
        axes.set_xlabel("share of all scored plays (%)")
        set_figure_title(axes, "Why reports were false (FR) or missing (NR)")
        figure.legend(loc="outside lower center", ncols=2 if is_column() else 3)
        return figure


BELIEF_FIGURES: dict[str, Callable[[Study], Figure | None]] = {
    "belief_curve": belief_curve,
    "belief_reliability": belief_reliability,
    "belief_partition": belief_partition,
}


def _name(entry: RunEntry, beliefs: BeliefStudy) -> str:
    """Return a run's name, wrapped; with the framing of the question if the run was asked under several."""
    name = entry.name if len(entry.run.beliefs) == 1 else f"{entry.name} ({beliefs.framing})"
    return textwrap.fill(name, _NAME_CHARS[is_column()])


def _lines(rows: Sequence[tuple[RunEntry, BeliefStudy]]) -> int:
    """Return the number of lines of a legend with one column."""
    return sum(1 + _name(*row).count("\n") for row in rows)


def _ends(found: Estimate) -> tuple[float, float]:
    return found.interval or (found.value, found.value)
