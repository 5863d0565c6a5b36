"""Figures: the figures of the paper that show numbers, the plane of W and B, and the closure curves.

Each function takes a Study and returns a matplotlib Figure, or None if the runs have no data for it.
"""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from vigil.analysis.measures.metrics import CLOSURE_STEPS, LABELS, RunMetrics, after_goal_shares, closure_curve, measure
from vigil.analysis.measures.rows import ACTION_KINDS, Run
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
    KIND_LOOKS,
    LABEL_LOOKS,
    OTHER_MARKER,
    PLOT_WIDTH_IN,
    canvas,
    ink_on,
    is_column,
    paper_width_in,
    points,
    set_figure_title,
    styled,
)
from vigil.analysis.tables.paper_captions import PRIVILEGED_MARK
from vigil.analysis.tables.text import MARKS

MIN_SHARE_WITH_NUMBER = 6.0
_NAME_CHARS, _COLUMN_NAME_CHARS = 40, 20
_W_AXIS, _B_AXIS = "W: the world reached the goal (%)", "B: reached, and closed by a matching report (%)"


def _shown(study: Study) -> list[RunEntry]:
    """Return the runs that the figures of W and B show: only runs with reports, because others have no B."""
    return [entry for entry in study.shown_runs() if entry.overall.has_reports]


def outcome_partition(study: Study) -> Figure | None:
    """Draw B, FR, Other, NR and IL as stacked bars, best B first. A mark shows W; its distance from B is W - B."""
    entries = [entry for entry in _shown(study) if entry.overall.n]
    if not entries:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 1.25 + 0.36 * len(entries))
        axes = figure.add_subplot()
        shares = np.array([[100 * (entry.overall.share(name) or 0.0) for name in LABELS] for entry in entries])
        handles = _stack(axes, shares, LABEL_LOOKS)
        _name_rows(axes, [f"{_marked(entry.run)}  (n={entry.overall.n:,})" for entry in entries])
        mark = _mark_w(axes, entries)
        axes.set_xlabel("share of scored episodes (%)")
        set_figure_title(axes, "Outcome partition, sorted by B")
        figure.legend(
            handles=[*handles, mark], loc="outside lower center", ncols=2 if is_column() else 3, handlelength=1.6
        )
        return figure


def belief_closure(study: Study) -> Figure | None:
    """Draw (a) the mean number of steps from goal to report and (b) the kinds of actions after the goal was reached.
    Best B comes first."""
    entries = [entry for entry in _shown(study) if entry.overall.counts["W"]]
    if not entries:
        return None
    with styled():
        panels = 2 if is_column() else 1
        figure = canvas(PLOT_WIDTH_IN, 1.5 + 0.38 * len(entries) * panels)
        left, right = (
            figure.subplots(2, 1) if is_column() else figure.subplots(1, 2, width_ratios=(1.0, 1.5), sharey=True)
        )
        _lags(left, entries)
        shares = [after_goal_shares(entry.run.rows) for entry in entries]
        values = np.array(
            [[100 * (pair[0] if (pair := share[kind]) else 0.0) for kind in ACTION_KINDS] for share in shares]
        )
        handles = _stack(right, values, KIND_LOOKS)
        for row, each in enumerate(values):
            if not each.any():
                right.text(1, row, "no later action", va="center", fontsize=points(7.5), color=FAINT)
        for row, entry in enumerate(entries):
            right.text(101, row, f"n={entry.overall.counts['W']:,}\u2002", va="center", fontsize=points(7.5))
        _name_rows(right, [_marked(entry.run) for entry in entries])
        right.tick_params(left=False, labelleft=is_column())
        right.set_xlabel("share of actions after the goal first held (%)")
        right.set_title("(b) After attainment (W=1)" if is_column() else "(b) What follows attainment (W=1, pooled)")
        figure.legend(
            handles=handles,
            loc="outside lower center",
            ncols=3 if is_column() else 5,
            handlelength=1.6,
            columnspacing=1.2,
        )
        return figure


def plane(study: Study) -> Figure | None:
    """Draw every run in the plane of W and B, with the paper's rows as grey reference points."""
    entries = [entry for entry in _shown(study) if entry.overall.n]
    if not entries:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 4.7 if is_column() else 6.6)
        axes = figure.add_subplot()
        top = _plane_frame(axes, study, entries)
        texts = _published_points(axes, study)
        for index, entry in enumerate(entries):
            texts.append(_own_point(axes, entry, CYCLE[index % len(CYCLE)]))
        axes.set(xlim=(-0.02 * top, top), ylim=(-0.02 * top, top))
        others = [(w, b) for _, w, b in study.published.points()] if study.published else []
        _plane_legend(figure, study, entries)
        crosses = [place for entry in entries for place in _cross(entry)]
        name_points(axes, texts, [*others, *crosses])
        return figure


def closure_curves(study: Study) -> Figure | None:
    """Draw the share of W=1 episodes that were closed by a matching report at most k steps after attainment."""
    curves = [(entry, curve) for entry in _shown(study) if (curve := closure_curve(entry.run.rows)) is not None]
    if not curves:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 3.6 + 0.11 * len(curves))
        axes = figure.add_subplot()
        for index, (entry, curve) in enumerate(curves):
            label = textwrap.fill(f"{_marked(entry.run)} (W=1: {entry.overall.counts['W']})", _NAME_CHARS)
            dash = DASHES[(index // len(CYCLE) + index) % len(DASHES)]
            axes.step(
                range(len(curve)),
                100 * np.array(curve),
                where="post",
                color=CYCLE[index % len(CYCLE)],
                ls=dash,
                lw=1.8,
                label=label,
            )
        axes.set(
            xlim=(0, CLOSURE_STEPS),
            ylim=(-2, 103),
            xlabel="k: steps after the goal first held",
            ylabel="W=1 episodes closed within k steps (%)",
        )
        set_figure_title(axes, "Closure curves: how fast achieved states become matching reports")
        axes.set_xticks(range(0, CLOSURE_STEPS + 1, 2))
        axes.grid(visible=True)
        figure.legend(
            loc="outside lower center", ncols=2 if len(curves) > 3 and not is_column() else 1, handlelength=3.2
        )
        return figure


def feedback_shift(study: Study) -> Figure | None:
    """Draw how action feedback shifts each paired model in the plane of W and B."""
    if not study.pairing.feedback:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 4.3 if is_column() else 5.4)
        axes = figure.add_subplot()
        texts, values = [], [5.0]
        for index, pair in enumerate(study.pairing.feedback):
            base, other = (measure(rows) for rows in pair.tables())
            if not base.n:
                continue
            start, end = _place(base), _place(other)
            colour = CYCLE[index % len(CYCLE)]
            axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
            axes.plot(*start, "o", ms=9, color=GROUND, mec=colour, mew=1.5)
            axes.plot(*end, "o", ms=6, color=colour)
            texts.append((end, f"{_marked(pair.base)} (n={base.n:,})", colour, points(8.5)))
            values += [*start, *end]
        top = min(104.0, 1.15 * max(values))
        axes.set(xlim=(-0.03 * top, top), ylim=(-0.03 * top, top), xlabel=_W_AXIS, ylabel=_B_AXIS)
        axes.axline((0, 0), slope=1, color=FAINT, lw=0.8)
        set_figure_title(axes, "Action feedback: from the base contract (hollow) to +FB (filled)")
        axes.grid(visible=True)
        name_points(axes, texts)
        return figure


FIGURES: dict[str, Callable[[Study], Figure | None]] = {
    "outcome_partition": outcome_partition,
    "belief_closure": belief_closure,
    "plane": plane,
    "closure_curves": closure_curves,
    "feedback_shift": feedback_shift,
}
_CAPTIONS = {
    "outcome_partition": "All scored episodes of each run (n), split into five exclusive outcomes; runs with the "
    "highest B come first. The mark is W: where it is beyond B, the world reached the goal in episodes that no "
    "matching report closed. W−B: this difference, in points.",
    "belief_closure": "(a) Mean number of steps from attainment to the matching report. n: episodes with B=1. "
    "(b) Kinds of action after the goal first held: shares of all these actions, pooled over the episodes with W=1. n: "
    "these episodes. Runs with the highest B come first.",
    "plane": "World completion against benchmark success. On the diagonal every achieved state is closed by a matching "
    "report; the distance below it is the gap Δ = W−B. Crosses: 95 % Wilson intervals. Grey: published rows, another "
    "pack and simulator.",
    "closure_curves": "Share of the episodes with W=1 that a matching report closed within k steps of attainment.",
    "feedback_shift": "Runs without (hollow) and with action feedback (filled), over the episodes (n) that both have "
    "scored.",
}


def figure_captions(study: Study) -> dict[str, str]:
    """Return the caption of each figure. In a paper it explains the mark of privileged runs."""
    has_marks = any(_marked(entry.run) != entry.name for entry in study.shown_runs())
    return {name: f"{text} {PRIVILEGED_MARK}" if has_marks else text for name, text in _CAPTIONS.items()}


def _marked(run: Run) -> str:
    """Return a run's name; in a paper, the name of a privileged run has the mark that it has in tables."""
    return run.name + MARKS["privileged"] if paper_width_in() is not None and run.model.is_privileged else run.name


def _mark_w(axes: Axes, entries: Sequence[RunEntry]) -> Line2D:
    """Mark W on each bar, write W - B next to the mark, and return the mark for a legend."""
    look: dict[str, Any] = {"ls": "none", "marker": "|", "ms": 21, "mew": 3.0, "color": INK, "clip_on": False}
    for row, entry in enumerate(entries):
        w, b = (100 * (entry.overall.share(name) or 0.0) for name in ("W", "B"))
        axes.plot([w], [row], **look)
        look_of_gap: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": points(8)}
        axes.annotate(f"W−B {w - b:.1f}\u2002", (100, row), (5, 0), **look_of_gap)
    handle: dict[str, Any] = {**look, "ms": 11}
    return Line2D([], [], **handle, label="W: the world reached the goal")


def _stack(axes: Axes, shares: np.ndarray, looks: Mapping[str, tuple[str, str]]) -> list[Patch]:
    """Draw shares in percent, (rows, parts), as stacked bars, and return one handle per part for a legend.

    `looks` maps the name of each part to its colour and hatch.
    """
    left = np.zeros(len(shares))
    least = MIN_SHARE_WITH_NUMBER * points(7.5) / 7.5 * PLOT_WIDTH_IN / (paper_width_in() or PLOT_WIDTH_IN)
    rows = np.arange(len(shares))
    for column, (colour, hatch) in enumerate(looks.values()):
        widths = shares[:, column]
        axes.barh(rows, widths, left=left, height=0.72, color=colour, hatch=hatch, edgecolor="white", lw=0.5)
        for row, width in enumerate(widths):
            if width >= least:
                box = {"boxstyle": "round,pad=0.12", "fc": colour, "ec": "none"}
                axes.text(
                    left[row] + width / 2,
                    row,
                    f"{width:.1f}",
                    ha="center",
                    va="center",
                    fontsize=points(7.5),
                    color=ink_on(colour),
                    bbox=box,
                )
        left = left + widths
    axes.set_xlim(0, 100)
    axes.spines["left"].set_visible(False)
    return [Patch(facecolor=fill, hatch=hatch, edgecolor="white", label=name) for name, (fill, hatch) in looks.items()]


def _name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Write the names next to the rows; long names are wrapped to leave room for the bars."""
    width = _COLUMN_NAME_CHARS if is_column() else _NAME_CHARS
    folded = [name if len(name) <= width else "\n".join(textwrap.wrap(name, width)) for name in names]
    axes.set_yticks(range(len(names)), folded)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(names) - 0.5, -0.5)


def _lags(axes: Axes, entries: Sequence[RunEntry]) -> None:
    for row, entry in enumerate(entries):
        lag = entry.overall.means["lag"]
        if lag is None:
            axes.text(0.02, row, "no B=1 episode", va="center", fontsize=points(7.5), color=FAINT)
            continue
        axes.barh(row, lag, height=0.6, color=GREY)
        n = entry.overall.counts["B"]
        axes.annotate(
            f"{lag:.1f}  (n={n})", (lag, row), (4, 0), textcoords="offset points", va="center", fontsize=points(7.5)
        )
    longest = max((entry.overall.means["lag"] or 0.0 for entry in entries), default=0.0)
    axes.set_xlim(0, 1.55 * longest + 0.3)
    _name_rows(axes, [_marked(entry.run) for entry in entries])
    axes.set_xlabel("mean belief lag (steps)")
    axes.set_title("(a) Belief lag (B=1)")


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
    for gap in range(0, int(top), 10):
        axes.plot(
            [gap, top], [0, top - gap], color=FAINT if gap == 0 else "#d6d6d1", lw=1.0 if gap == 0 else 0.7, zorder=1
        )
        if gap:
            axes.text(
                top + 0.006 * top, top - gap, f"Δ={gap}", fontsize=points(6.5), color=FAINT, ha="left", va="center"
            )
    axes.text(0.03 * top, 0.95 * top, "B cannot exceed W", fontsize=points(8), color=FAINT)
    axes.set(xlabel=_W_AXIS, ylabel=_B_AXIS)
    set_figure_title(axes, f"World completion and terminal commitment ({_sizes(entries)})")
    return top


def _published_points(axes: Axes, study: Study) -> list[PointLabel]:
    if not study.published:
        return []
    for model, w, b in study.published.points():
        axes.plot(w, b, GROUP_MARKERS[model.group], ms=4.5, color=GREY, mec="white", mew=0.4, zorder=2)
    return [((w, b), model.name, "#7d828a", points(6.2)) for model, w, b in study.published.points() if model.anchor]


def _sizes(entries: Sequence[RunEntry]) -> str:
    """Return a text that says how many episodes the runs have."""
    sizes = sorted(entry.overall.n for entry in entries)
    return f"n={sizes[0]:,}" if sizes[0] == sizes[-1] else f"n={sizes[0]:,} to {sizes[-1]:,}"


def _cross(entry: RunEntry) -> list[tuple[float, float]]:
    """Return points along the intervals of W and B in percent, which labels must not cover."""
    w, b = _place(entry.overall)
    (w_low, w_high), (b_low, b_high) = (entry.overall.rate(name).interval or (0.0, 1.0) for name in ("W", "B"))
    along = np.linspace(0.0, 100.0, 7)
    return [
        *((w_low * (100 - t) + w_high * t, b) for t in along),
        *((w, b_low * (100 - t) + b_high * t) for t in along),
    ]


def _own_point(axes: Axes, entry: RunEntry, colour: str) -> PointLabel:
    w, b = _place(entry.overall)
    (w_low, w_high), (b_low, b_high) = (entry.overall.rate(name).interval or (0.0, 1.0) for name in ("W", "B"))
    axes.plot([100 * w_low, 100 * w_high], [b, b], color=colour, lw=1.0, alpha=0.7, zorder=3)
    axes.plot([w, w], [100 * b_low, 100 * b_high], color=colour, lw=1.0, alpha=0.7, zorder=3)
    axes.plot(w, b, GROUP_MARKERS.get(entry.group, OTHER_MARKER), ms=8, color=colour, mec="white", mew=0.8, zorder=4)
    return (w, b), _marked(entry.run), colour, points(8.5)


def name_points(axes: Axes, labels: Sequence[PointLabel], avoid: Sequence[tuple[float, float]] = ()) -> None:
    """Write labels next to their points. If a label has no room, write a number, and explain it under the axes."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    before, axis = len(axes.texts), axes.get_xlabel()
    numbered = place_labels(figure, axes, labels, avoid)
    width = int(72 * figure.get_figwidth() / (0.62 * points(8)))
    shown: list[str] = []
    while numbered != shown and len(shown) < len(labels):  # the names below make the axes smaller: place all again
        shown = [*shown, *(text for text in numbered if text not in shown)]
        words = ", ".join(f"{number}: {text}" for number, text in enumerate(shown, start=1))
        axes.set_xlabel(f"{axis}\n{textwrap.fill(words, width)}")
        for text in axes.texts[before:]:
            text.remove()
        numbered = place_labels(figure, axes, labels, avoid, shown)
    figure.set_layout_engine("none")  # the labels are placed for these very axes


def _plane_legend(figure: Figure, study: Study, entries: Sequence[RunEntry]) -> None:
    shown = {entry.group for entry in entries}
    shown |= {model.group for model in study.published.models} if study.published else set()
    groups = [group for group in GROUP_MARKERS if group in shown] + sorted(shown - set(GROUP_MARKERS))
    handles = [
        Line2D([], [], marker=GROUP_MARKERS.get(group, OTHER_MARKER), ls="", color=INK, ms=6, label=group)
        for group in groups
    ]
    if study.published:
        handles.append(Line2D([], [], marker="o", ls="", color=GREY, ms=5, label="published (paper)"))
    figure.legend(handles=handles, loc="outside lower center", ncols=1 if is_column() else 2, columnspacing=1.5)
