"""Diagrams: the protocol's eight families in two tiers, and the pipeline of one evaluated episode, with real frames."""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from vigil.analysis.plots.style import FAINT, INK, MIN_POINTS, canvas, paper_width_in, styled, text_pt
from vigil.analysis.plots.trajectory import (
    CLICK_COLOUR,
    GOAL_COLOUR,
    AgentTrajectory,
    goal_words,
    key_steps,
    mark_click,
    step_caption,
)
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, PACKAGED_FAMILIES, Family
from vigil.protocol.family import Tier

_TIER_COLOURS: dict[Tier, str] = {"diagnostic": "#0072b2", "compositional": "#d55e00"}
_TIER_TEXTS = {
    "diagnostic": "Diagnostic tier: one bottleneck each",
    "compositional": "Compositional tier: capacities chained",
}
CONTRACT = (
    "The agent sees one egocentric RGB frame per step and its own past replies; no success signal, state, map or "
    "limits. It can end an episode only by a report. W: the hidden world reached the goal (in SV: the state is in view "
    "at the end). B: W, and the report matches the hidden world. Ring: the target; in SM, the object that comes first. "
    "Frames without a ring: the target is out of view."
)
"""Legend of the protocol's diagram. On a screen it is part of the diagram, in a paper part of the caption."""
SKIPPED_WORDS = "+n: n steps that are not shown"
_CARD_WIDTH_IN = 2.75


@dataclass(frozen=True)
class FamilyExample:
    """Example of a family: an episode with its first frame."""

    episode: Episode
    frame: np.ndarray
    """The first frame, (480, 640, 3) uint8."""
    target: tuple[float, float] | None
    """Pixel (x, y) in the middle of the target, or of a chain's first object; None if it is out of view."""


def protocol_figure(examples: Mapping[Family, FamilyExample]) -> Figure:
    """Draw each family with the first frame of an example, and a mark at the target. Families without an example are
    blank."""
    with styled():
        tiers: dict[Tier, list[Family]] = {
            tier: [code for code, spec in FAMILIES.items() if spec.tier == tier and code in PACKAGED_FAMILIES]
            for tier in _TIER_COLOURS
        }
        most = max(map(len, tiers.values()))
        figure = canvas(paper_width_in() or _CARD_WIDTH_IN * most, 7.9 if paper_width_in() is None else 5.0)
        grid = figure.subplots(2, most)
        for row, (tier, families) in enumerate(tiers.items()):
            for empty in grid[row][len(families) :]:
                empty.axis("off")
            for column, family in enumerate(families):
                _card(grid[row][column], family, examples.get(family))
            heading = grid[row][0].annotate(
                _TIER_TEXTS[tier],
                (0, 1.17),
                xycoords="axes fraction",
                fontsize=text_pt(10.5),
                fontweight="bold",
                color=_TIER_COLOURS[tier],
            )
            heading.set_in_layout(False)
        if paper_width_in() is None:
            said = _wrapped(CONTRACT, _letters(10 * figure.get_figwidth() - 2, 8.5))
            figure.supxlabel(said, fontsize=text_pt(8.5), color=INK, x=0.01, ha="left")
        return figure


@dataclass(frozen=True)
class _Layout:
    """Places in the pipeline's diagram, in tenths of an inch."""

    across: float = 110.0
    height: float = 49.0
    pictures_top: float = 39.8
    boxes_top: float = 16.0
    boxes_bottom: float = 8.5
    columns: int = 6
    """Greatest number of frames in a row."""

    @property
    def widest(self) -> float:
        """Greatest width of a picture: it leaves room for four lines of a reply between the picture and the boxes."""
        return (self.pictures_top - self.boxes_top - 9.4) / 0.75


_PAPER_LAYOUT = _Layout(67.5, 39.6, 34.6, 13.8, 4.1, 4)


def pipeline_figure(episode: Episode, track: AgentTrajectory, columns: int = 5) -> Figure:
    """Draw one episode as a pipeline: its input, the output of each step, and how the end is scored."""
    layout = _Layout() if paper_width_in() is None else _PAPER_LAYOUT
    chosen = key_steps(track, min(columns, layout.columns))
    with styled():
        figure = canvas(layout.across / 10, layout.height / 10, is_free=True)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0, layout.across), ylim=(0, layout.height))
        axes.axis("off")
        top, right = layout.height, layout.across - 2
        if paper_width_in() is None:
            axes.text(2, top - 2.6, "Evaluation pipeline", fontsize=11, fontweight="bold", va="center")
            name = f"{episode.id}, {FAMILIES[episode.family].name}"
            axes.text(right, top - 2.6, name, fontsize=text_pt(8.5), color=FAINT, va="center", ha="right")
        said = _wrapped(f"“{episode.instruction}”", _letters(right - 2, 8.5), 1)
        axes.text(2, layout.pictures_top + 3.4, said, fontsize=text_pt(8.5), color=INK, va="center")
        width = min((layout.across - 1.5) / len(chosen) - 2.5, layout.widest)
        pitch = (layout.across - 4 - width) / max(len(chosen) - 1, 1)
        for place, index in enumerate(chosen):
            left = 2 + place * pitch
            _step(axes, track, index, layout, (left, width))
            if place:
                middle = layout.pictures_top - 0.375 * width
                _arrow(axes, (left - pitch + width + 0.1, middle), (left - 0.2, middle))
                if skipped := index - chosen[place - 1] - 1:
                    between = left - (pitch - width) / 2
                    axes.text(between, middle + 0.6, f"+{skipped}", fontsize=text_pt(7), ha="center", color=INK)
        _interface(axes, layout)
        _footnotes(axes, layout, episode, track)
        return figure


def limits(episode: Episode) -> str:
    """Return a text that says when an episode ends without a report."""
    return f"limits (hidden): at most {episode.max_steps} steps and {episode.max_invalid} invalid replies"


def _card(axes: Axes, family: Family, example: FamilyExample | None) -> None:
    spec = FAMILIES[family]
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set(visible=True, color=_TIER_COLOURS[spec.tier], linewidth=1.6)
    axes.imshow(np.full((480, 640, 3), 235, np.uint8) if example is None else example.frame)
    axes.set_title(f"\n{family}  {spec.name}", fontsize=text_pt(9.5 if paper_width_in() is None else 8.2))
    figure = axes.get_figure(root=True)
    assert figure is not None
    letters = int(46 * figure.get_figwidth() / (_CARD_WIDTH_IN * 4) * 7.3 / text_pt(7.3))
    if example is not None and example.target is not None:
        axes.plot(*example.target, "o", ms=15, mfc="none", mec="white", mew=3.2)
        axes.plot(*example.target, "o", ms=15, mfc="none", mec=CLICK_COLOUR, mew=1.6)
    allowed = f"at most {spec.max_steps} steps\nat most {spec.max_invalid} invalid replies"
    said = "" if example is None else _wrapped(f"“{example.episode.instruction}”", letters, 6)
    text = "\n".join((_wrapped(spec.summary, letters), allowed, said))
    axes.set_xlabel(text, fontsize=text_pt(7.3), loc="left", linespacing=1.35)


def _step(axes: Axes, track: AgentTrajectory, index: int, layout: _Layout, at: tuple[float, float]) -> None:
    """Draw the frame before a step; under it, the action, whether W holds after it, and the reply.

    `at` is the left edge and the width of the frame.
    """
    (left, width), top = at, layout.pictures_top
    height, step = 0.75 * width, track.record.steps[index]
    picture = axes.inset_axes((left, top - height, width, height), transform=axes.transData)
    picture.imshow(track.frames[index], aspect="auto")
    picture.axis("off")
    mark_click(picture, step.action)
    axes.text(left, top + 0.5, f"frame of step {index + 1}", fontsize=text_pt(8), color=INK)
    look: dict[str, Any] = {"ha": "center", "va": "top"}
    middle, under = left + width / 2, top - height
    axes.text(middle, under - 0.9, step_caption(step), fontsize=text_pt(8), fontweight="bold", **look)
    held = track.holds[index + 1]
    hidden = goal_words(track, held=held)
    axes.text(middle, under - 2.5, hidden, fontsize=text_pt(7), color=GOAL_COLOUR if held else INK, **look)
    lines = max(1, int((under - 4.4 - layout.boxes_top) / 1.1))
    spaced = " ".join(step.reply.text.replace(",", ", ").replace(":", ": ").split())
    reply = _wrapped(spaced, int(1.9 * width), lines)
    axes.text(left, under - 4.4, reply, fontsize=MIN_POINTS, va="top", family="DejaVu Sans Mono", color=INK)


def _interface(axes: Axes, layout: _Layout) -> None:
    boxes = (
        ("Agent sees", "system prompt, the current frame, up to 20 turns of its own text replies", "#0072b2"),
        ("Agent answers", "one JSON object: navigate, look, interact_pixel or report", "#e69f00"),
        ("Simulator acts", "no success signal, no state goes back; only the next frame", "#555b66"),
        ("Scoring, offline", "hidden state gives W; the report against it gives B and the label", "#009e73"),
    )
    gap = 4.0
    width = (layout.across - 4 - 3 * gap) / 4
    bottom, high = layout.boxes_bottom, layout.boxes_top - layout.boxes_bottom - 0.5
    shape = "round,pad=0.3,rounding_size=0.8"
    for place, (head, text, colour) in enumerate(boxes):
        left = 2 + place * (width + gap)
        axes.add_patch(FancyBboxPatch((left, bottom), width, high, boxstyle=shape, fc="white", ec=colour, lw=1.6))
        axes.text(
            left + 0.6, bottom + high - 1.4, head, fontsize=text_pt(9.5), fontweight="bold", color=colour, va="center"
        )
        said = _wrapped(text, _letters(width - 0.8, 7.8), 5)
        axes.text(left + 0.6, bottom + high - 2.9, said, fontsize=text_pt(7.8), va="top", linespacing=1.4)
        if place:
            _arrow(axes, (left - gap + 0.5, bottom + high / 2), (left - 0.5, bottom + high / 2))
    back = {"connectionstyle": "arc3,rad=-0.12", "arrowstyle": "-|>", "mutation_scale": 10, "color": FAINT, "lw": 1.1}
    axes.add_patch(FancyArrowPatch((2 + 2.5 * width + 2 * gap, bottom - 0.5), (2 + width / 2, bottom - 0.5), **back))


def _footnotes(axes: Axes, layout: _Layout, episode: Episode, track: AgentTrajectory) -> None:
    """Write the episode's outcome; on a screen also the limits and the marks, which a paper's caption explains."""
    outcome = track.outcome
    if paper_width_in() is None:
        said = f"{limits(episode)}    ring: where the action clicks    {SKIPPED_WORDS}"
        axes.text(2, 0.9, said, fontsize=text_pt(7.8), color=INK)
    said = f"reported {outcome.reported}" if outcome.reported else "no report"
    text = f"here: {said}, W={int(outcome.W)}, B={int(outcome.B) if outcome.has_report else '–'}"
    axes.text(
        layout.across - 2,
        layout.boxes_bottom - 3.1,
        text,
        fontsize=text_pt(8.5),
        ha="right",
        fontweight="bold",
        color=INK,
    )


def _letters(width: float, size: float) -> int:
    """Return how many letters fit into a width (tenths of an inch); on a screen, the text has this `size` (points)."""
    return int(7.2 * width / (0.58 * text_pt(size)))


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=10, color=INK, lw=1.2, shrinkA=0, shrinkB=0)
    )


def _wrapped(text: str, width: int, lines: int = 4) -> str:
    """Return a text wrapped into lines of at most `width` characters; a text that is too long is cut."""
    return "\n".join(textwrap.wrap(text, width, max_lines=lines, placeholder=" ..."))
