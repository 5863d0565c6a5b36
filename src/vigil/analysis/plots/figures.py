"""Figures: the figures of the paper that show numbers, and the closure curves; `planes` has those of W and B.

Each function takes a Study and returns a matplotlib Figure, or None if the runs have no data for it.
"""

import textwrap
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from vigil.analysis.measures.metrics import CLOSURE_STEPS, LABELS, after_goal_shares, closure_curve
from vigil.analysis.measures.rows import ACTION_KINDS, values
from vigil.analysis.measures.study import RunEntry, Study
from vigil.analysis.plots.planes import PUBLISHED_MARKS, feedback_shift, marked, plane, run_looks, shown_with_reports
from vigil.analysis.plots.style import (
    FAINT,
    GREY,
    INK,
    KIND_LOOKS,
    LABEL_LOOKS,
    PLOT_WIDTH_IN,
    canvas,
    ink_on,
    is_column,
    paper_width_in,
    set_figure_title,
    styled,
    text_pt,
)
from vigil.analysis.tables.paper_captions import PRIVILEGED_MARK

MIN_SHARE_WITH_NUMBER = 6.0
_NAME_CHARS, _COLUMN_NAME_CHARS = 40, 20
_APART_PT = 1.6
"""Distance (points) between equal curves, which are drawn apart so that each can be seen."""
_FEW = 5
"""A curve of fewer episodes is drawn thin."""


def outcome_partition(study: Study) -> Figure | None:
    """Draw B, FR, Other, NR and IL as stacked bars, best B first. A mark shows W; its distance from B is W - B."""
    entries = [entry for entry in shown_with_reports(study) if entry.overall.n]
    if not entries:
        return None
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 1.25 + 0.36 * len(entries))
        axes = figure.add_subplot()
        shares = np.array([[100 * (entry.overall.share(name) or 0.0) for name in LABELS] for entry in entries])
        handles = _stack(axes, shares, LABEL_LOOKS)
        _name_rows(axes, [f"{marked(entry.run)}  (n={entry.overall.n:,})" for entry in entries])
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
    entries = [entry for entry in shown_with_reports(study) if entry.overall.counts["W"]]
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
                right.text(1, row, "no later action", va="center", fontsize=text_pt(7.5), color=FAINT)
        for row, entry in enumerate(entries):
            right.text(101, row, f"n={entry.overall.counts['W']:,}\u2002", va="center", fontsize=text_pt(7.5))
        _name_rows(right, [marked(entry.run) for entry in entries])
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


def closure_curves(study: Study) -> Figure | None:
    """Draw the share of W=1 episodes that were closed by a matching report at most k steps after attainment."""
    curves = [
        (entry, curve) for entry in shown_with_reports(study) if (curve := closure_curve(entry.run.rows)) is not None
    ]
    if not curves:
        return None
    last = np.nanmax([0.0, *(values(entry.run.rows, "lag").max(initial=0.0) for entry, _ in curves)])
    end = min(CLOSURE_STEPS, int(last) + 2)
    looks = run_looks(study)
    with styled():
        figure = canvas(PLOT_WIDTH_IN, 3.6 + 0.11 * len(curves))
        axes = figure.add_subplot()
        for index, (entry, curve) in enumerate(curves):
            apart = min(_APART_PT, 6 * _APART_PT / len(curves)) * ((len(curves) - 1) / 2 - index) / 72
            colour, dash = looks[entry.name]
            n = entry.overall.counts["W"]
            axes.step(
                range(end + 1),
                100 * np.array(curve[: end + 1]),
                where="post",
                color=colour,
                ls=dash,
                lw=1.5 if n >= _FEW else 0.8,
                marker="o",
                ms=3.5,
                markevery=[k for k in range(end + 1) if curve[k] > (curve[k - 1] if k else 0.0)],
                label=textwrap.fill(f"{marked(entry.run)} (n={n:,})", _NAME_CHARS),
                transform=axes.transData + ScaledTranslation(-apart, apart, figure.dpi_scale_trans),
            )
        axes.set(
            xlim=(-0.015 * end, end),
            ylim=(-5, 106),
            xlabel="k: steps after the goal first held",
            ylabel="W=1 episodes closed within k steps (%)",
        )
        set_figure_title(axes, "Closure curves: how fast achieved states become matching reports")
        axes.set_xticks(range(0, end + 1, 1 if end <= CLOSURE_STEPS / 2 else 2))
        axes.grid(visible=True)
        figure.legend(
            loc="outside lower center", ncols=2 if len(curves) > 3 and not is_column() else 1, handlelength=3.2
        )
        return figure


FIGURES: dict[str, Callable[[Study], Figure | None]] = {
    "outcome_partition": outcome_partition,
    "belief_closure": belief_closure,
    "plane": plane,
    "closure_curves": closure_curves,
    "feedback_shift": feedback_shift,
}
CAPTIONS: dict[str, str] = tomllib.loads((Path(__file__).parent / "captions.toml").read_text(encoding="utf-8"))
"""Figure of a report -> its caption, with braces where it depends on the study."""


def figure_captions(study: Study) -> dict[str, str]:
    """Return the caption of each figure. In a paper it explains the mark of privileged runs."""
    found = {name: CAPTIONS[name].format(closure_steps=CLOSURE_STEPS) for name in FIGURES}
    if study.published:
        found["plane"] += f" {PUBLISHED_MARKS}"
    has_marks = any(marked(entry.run) != entry.name for entry in study.shown_runs())
    return {name: f"{text} {PRIVILEGED_MARK}" if has_marks else text for name, text in found.items()}


def _mark_w(axes: Axes, entries: Sequence[RunEntry]) -> Line2D:
    """Mark W on each bar, write W - B next to the mark, and return the mark for a legend."""
    look: dict[str, Any] = {"ls": "none", "marker": "|", "ms": 21, "mew": 3.0, "color": INK, "clip_on": False}
    for row, entry in enumerate(entries):
        w, b = (100 * (entry.overall.share(name) or 0.0) for name in ("W", "B"))
        axes.plot([w], [row], **look)
        look_of_gap: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": text_pt(8)}
        axes.annotate(f"W−B {w - b:.1f}\u2002", (100, row), (5, 0), **look_of_gap)
    handle: dict[str, Any] = {**look, "ms": 11}
    return Line2D([], [], **handle, label="W: the world reached the goal")


def _stack(axes: Axes, shares: np.ndarray, looks: Mapping[str, tuple[str, str]]) -> list[Patch]:
    """Draw shares in percent, (rows, parts), as stacked bars, and return one handle per part for a legend.

    `looks` maps the name of each part to its colour and hatch.
    """
    left = np.zeros(len(shares))
    least = MIN_SHARE_WITH_NUMBER * text_pt(7.5) / 7.5 * PLOT_WIDTH_IN / (paper_width_in() or PLOT_WIDTH_IN)
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
                    fontsize=text_pt(7.5),
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
            axes.text(0.02, row, "no B=1 episode", va="center", fontsize=text_pt(7.5), color=FAINT)
            continue
        axes.barh(row, lag, height=0.6, color=GREY)
        n = entry.overall.counts["B"]
        axes.annotate(
            f"{lag:.1f}  (n={n})", (lag, row), (4, 0), textcoords="offset points", va="center", fontsize=text_pt(7.5)
        )
    longest = max((entry.overall.means["lag"] or 0.0 for entry in entries), default=0.0)
    axes.set_xlim(0, 1.55 * longest + 0.3)
    _name_rows(axes, [marked(entry.run) for entry in entries])
    axes.set_xlabel("mean belief lag (steps)")
    axes.set_title("(a) Belief lag (B=1)")
