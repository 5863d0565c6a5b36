"""Figures in the plane of W and B: runs next to the published rows, and shifts by action feedback; the names, colours
and dashes of runs in all figures.

Each figure is drawn by a function that takes a Study; it returns None if the runs have no data for the figure.
"""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from vigil.analysis.measures.metrics import RunMetrics, measure
from vigil.analysis.measures.rows import Run
from vigil.analysis.measures.study import RunEntry, Study
from vigil.analysis.plots.label_placement import PointLabel, place_labels
from vigil.analysis.plots.style import (
    CYCLE,
    DASHES,
    FAINT,
    GREY,
    GROUND,
    GROUP_MARKERS,
    INK,
    OTHER_MARKER,
    PLOT_WIDTH_IN,
    canvas,
    is_column,
    paper_width_in,
    set_figure_title,
    styled,
    text_pt,
)
from vigil.analysis.tables.text import MARKS

_W_AXIS, _B_AXIS = "W: the world reached the goal (%)", "B: reached, and closed by a matching report (%)"
PUBLISHED_MARKS = (
    "Grey: published rows, another pack and simulator; only the ten models of the paper's main text are named."
)
_GAP_STEP = 20
"""Distance (points of W - B) between the lines of equal gap."""


def shown_with_reports(study: Study) -> list[RunEntry]:
    """Return the runs that the figures of W and B show: only runs with reports, because others have no B."""
    return [entry for entry in study.shown_runs() if entry.overall.has_reports]


def run_looks(study: Study) -> dict[str, tuple[str, Any]]:
    """Return {name of a run: (colour, dash)}, the same for all figures of a study."""
    names = dict.fromkeys(entry.name for entry in (*shown_with_reports(study), *study.entries))
    return {
        name: (CYCLE[index % len(CYCLE)], DASHES[(index // len(CYCLE) + index) % len(DASHES)])
        for index, name in enumerate(names)
    }


def marked(run: Run) -> str:
    """Return a run's name; in a paper, the name of a privileged run has the mark that it has in tables."""
    return run.name + MARKS["privileged"] if paper_width_in() is not None and run.model.is_privileged else run.name


def plane(study: Study) -> Figure | None:
    """Draw every run in the plane of W and B, with the paper's rows as grey reference points."""
    entries = [entry for entry in shown_with_reports(study) if entry.overall.n]
    if not entries:
        return None
    looks = run_looks(study)
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 4.7 if is_column() else 6.6)
        axes = figure.add_subplot()
        top = _plane_frame(axes, study, entries)
        texts = _published_points(axes, study)
        at: dict[tuple[float, float], list[RunEntry]] = {}
        for entry in entries:
            at.setdefault(_place(entry.overall), []).append(entry)
        for place, runs in at.items():
            for inner, entry in reversed(list(enumerate(reversed(runs)))):
                _own_point(axes, entry, looks[entry.name][0], inner)
            colour = looks[runs[0].name][0] if len(runs) == 1 else INK
            texts.append((place, " around ".join(marked(entry.run) for entry in runs), colour, text_pt(8.5)))
        axes.set(xlim=(-0.02 * top, top), ylim=(-0.02 * top, top))
        others = [(w, b) for _, w, b in study.published.points()] if study.published else []
        _plane_legend(figure, study, entries)
        crosses = [place for entry in entries for place in _cross(entry)]
        steps = np.arange(0.0, top, 0.03 * top)
        above = [(w, b) for w in steps for b in steps if b >= w]
        name_points(axes, texts, [*others, *crosses, *((x, x) for x in np.linspace(0.0, top, 60))], above)
        return figure


def feedback_shift(study: Study) -> Figure | None:
    """Draw how action feedback shifts each paired model in the plane of W and B; None if it shifts no model."""
    measured = [(pair, *(measure(rows) for rows in pair.tables())) for pair in study.pairing.feedback]
    shifts = [(pair, base, _place(base), _place(other)) for pair, base, other in measured if base.n]
    if all(start == end for _, _, start, end in shifts):
        return None
    looks = run_looks(study)
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 4.3 if is_column() else 5.4)
        axes = figure.add_subplot()
        texts, values, ends = [], [5.0], [end for *_, end in shifts]
        for index, (pair, base, start, end) in enumerate(shifts):
            colour, _ = looks[pair.base.name]
            larger = 4 * ends[index + 1 :].count(end)
            axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
            axes.plot(*start, "o", ms=9 + larger, color=GROUND, mec=colour, mew=1.5)
            axes.plot(*end, "o", ms=6 + larger, color=colour, mec="white", mew=0.8)
            texts.append((end, f"{marked(pair.base)} (n={base.n:,})", colour, text_pt(8.5)))
            values += [*start, *end]
        top = min(104.0, 1.15 * max(values))
        axes.set(xlim=(-0.03 * top, top), ylim=(-0.03 * top, top), xlabel=_W_AXIS, ylabel=_B_AXIS)
        axes.axline((0, 0), slope=1, color=FAINT, lw=0.8)
        set_figure_title(axes, "Action feedback: from the base contract (hollow) to +FB (filled)")
        axes.grid(visible=True)
        starts = [start for _, _, start, _ in shifts]
        name_points(axes, texts, [*starts, *((x, x) for x in np.linspace(0.0, top, 60))])
        return figure


def _place(measures: RunMetrics) -> tuple[float, float]:
    """Return (W, B) in percent: the run's point in the plane."""
    return 100 * (measures.share("W") or 0.0), 100 * (measures.share("B") or 0.0)


def _plane_frame(axes: Axes, study: Study, entries: Sequence[RunEntry]) -> float:
    """Draw the diagonal and the lines of equal W - B, and return the upper limit of both axes."""
    values = [value for entry in entries for value in _place(entry.overall)]
    if study.published:
        values += [value for _, w, b in study.published.points() for value in (w, b)]
    top = min(104.0, max(20.0, 1.12 * max(values)))
    axes.fill_between([0, top], [0, top], top, color="#efeee9", lw=0)
    for gap in range(0, int(top), _GAP_STEP):
        axes.plot(
            [gap, top], [0, top - gap], color=FAINT if gap == 0 else "#d6d6d1", lw=1.0 if gap == 0 else 0.7, zorder=1
        )
        if gap:
            axes.text(
                top + 0.006 * top, top - gap, f"Δ={gap}", fontsize=text_pt(6.5), color=FAINT, ha="left", va="center"
            )
    axes.text(0.03 * top, 0.95 * top, "B cannot exceed W", fontsize=text_pt(8), color=FAINT)
    axes.set(xlabel=_W_AXIS, ylabel=_B_AXIS)
    set_figure_title(axes, f"World completion and terminal commitment ({_sizes(entries)})")
    return top


def _published_points(axes: Axes, study: Study) -> list[PointLabel]:
    if not study.published:
        return []
    for model, w, b in study.published.points():
        axes.plot(w, b, GROUP_MARKERS[model.group], ms=4.5, color=GREY, mec="white", mew=0.4, zorder=2)
    return [((w, b), model.name, "#7d828a", text_pt(6.2)) for model, w, b in study.published.points() if model.anchor]


def _sizes(entries: Sequence[RunEntry]) -> str:
    """Return a text that says how many episodes the runs have."""
    sizes = sorted(entry.overall.n for entry in entries)
    return f"n={sizes[0]:,}" if sizes[0] == sizes[-1] else f"n={sizes[0]:,} to {sizes[-1]:,}"


def _cross(entry: RunEntry) -> list[tuple[float, float]]:
    """Return points along the intervals of W and B in percent, which labels must not cover."""
    w, b = _place(entry.overall)
    (w_low, w_high), (b_low, b_high) = (entry.overall.rate(name).interval or (0.0, 1.0) for name in ("W", "B"))
    along = np.linspace(0.0, 100.0, 25)
    return [
        *((w_low * (100 - t) + w_high * t, b) for t in along),
        *((w, b_low * (100 - t) + b_high * t) for t in along),
    ]


def _own_point(axes: Axes, entry: RunEntry, colour: str, inner: int) -> None:
    """Draw a run with its intervals; larger if other runs, `inner` of them, are drawn over it later."""
    w, b = _place(entry.overall)
    (w_low, w_high), (b_low, b_high) = (entry.overall.rate(name).interval or (0.0, 1.0) for name in ("W", "B"))
    line: dict[str, Any] = {"color": colour, "lw": 1.0 + 1.6 * inner, "alpha": 0.7, "zorder": 3}
    axes.plot([100 * w_low, 100 * w_high], [b, b], **line)
    axes.plot([w, w], [100 * b_low, 100 * b_high], **line)
    marker = GROUP_MARKERS.get(entry.group, OTHER_MARKER)
    axes.plot(w, b, marker, ms=8 + 5 * inner, color=colour, mec="white", mew=0.8, zorder=4)


def name_points(
    axes: Axes,
    labels: Sequence[PointLabel],
    avoid: Sequence[tuple[float, float]] = (),
    rather_avoid: Sequence[tuple[float, float]] = (),
) -> None:
    """Write labels next to their points. If a label has no room, write a number, and explain it under the axes."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    before, axis = len(axes.texts), axes.get_xlabel()
    numbered = place_labels(axes, labels, avoid, rather_avoid)
    width = int(72 * figure.get_figwidth() / (0.62 * text_pt(8)))
    shown: list[str] = []
    while numbered != shown and len(shown) < len(labels):  # the names below make the axes smaller: place all again
        shown = [*shown, *(text for text in numbered if text not in shown)]
        words = ", ".join(f"{number}: {text}" for number, text in enumerate(shown, start=1))
        axes.set_xlabel(f"{axis}\n{textwrap.fill(words, width)}")
        for text in axes.texts[before:]:
            text.remove()
        numbered = place_labels(axes, labels, avoid, rather_avoid, shown)
    figure.set_layout_engine("none")  # the labels are placed for these very axes


def _plane_legend(figure: Figure, study: Study, entries: Sequence[RunEntry]) -> None:
    own = {entry.group for entry in entries}
    published = {model.group for model in study.published.models} if study.published else set[str]()
    handles = [
        Line2D([], [], marker=GROUP_MARKERS.get(group, OTHER_MARKER), ls="", color=colour, ms=size, label=group + end)
        for groups, colour, size, end in ((own, INK, 6, ""), (published, GREY, 5, ", published"))
        for group in (*(each for each in GROUP_MARKERS if each in groups), *sorted(groups - set(GROUP_MARKERS)))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=1 if is_column() else 2, columnspacing=1.5)
