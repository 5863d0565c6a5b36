"""Diagrams: the protocol's eight families in two tiers, and the pipeline of one evaluated episode, with real frames."""

import textwrap
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from vigil.analysis.plots.style import FAINT, INK, LABEL_COLOURS, canvas, styled
from vigil.analysis.plots.trajectory import AgentTrajectory, key_steps, mark_click, step_caption
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, PACKAGED_FAMILIES, Family
from vigil.protocol.family import Tier
from vigil.scoring.outcomes import Outcome

_TIER_COLOURS: dict[Tier, str] = {"diagnostic": "#0072b2", "compositional": "#d55e00"}
_TIER_TEXTS = {
    "diagnostic": "Diagnostic tier: one bottleneck each",
    "compositional": "Compositional tier: capacities chained",
}
_CARD_WIDTH_IN = 2.75
_HEIGHT = 49.0
"""Height of the pipeline's diagram, in tenths of an inch."""
_BOXES_TOP = 19.0
_MAX_WIDTH = 21.2
"""Greatest width of a picture with its gap, in tenths of an inch; a wider picture would overlap the boxes below."""


def protocol_figure(frames: Mapping[Family, np.ndarray], episodes: Mapping[Family, Episode]) -> Figure:
    """Draw the families, each with the first frame of an example episode; a family without example stays blank."""
    with styled():
        tiers: dict[Tier, list[Family]] = {
            tier: [code for code, spec in FAMILIES.items() if spec.tier == tier and code in PACKAGED_FAMILIES]
            for tier in _TIER_COLOURS
        }
        most = max(map(len, tiers.values()))
        figure = canvas(_CARD_WIDTH_IN * most, 6.9)
        grid = figure.subplots(2, most)
        for row, (tier, families) in enumerate(tiers.items()):
            for empty in grid[row][len(families) :]:
                empty.axis("off")
            for column, family in enumerate(families):
                _card(grid[row][column], family, frames.get(family), episodes.get(family))
            heading = grid[row][0].annotate(
                _TIER_TEXTS[tier],
                (0, 1.17),
                xycoords="axes fraction",
                fontsize=10.5,
                fontweight="bold",
                color=_TIER_COLOURS[tier],
            )
            heading.set_in_layout(False)
        figure.supxlabel(
            "The agent sees one egocentric RGB frame per step and its own past replies; no success signal, state, "
            "map or budget. "
            "Only its own report ends an episode.\nW: the hidden world reached the "
            "goal.   B: W, and the report matches the hidden world.",
            fontsize=8.5,
            color=INK,
            x=0.01,
            ha="left",
        )
        return figure


def pipeline_figure(episode: Episode, track: AgentTrajectory, columns: int = 5) -> Figure:
    """Draw one episode as a pipeline: its input, the output of each step, and how the end is scored."""
    chosen = key_steps(track, columns)
    with styled():
        figure = canvas(11.0, _HEIGHT / 10, is_free=True)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0, 110), ylim=(0, _HEIGHT))
        axes.axis("off")
        top = _HEIGHT
        axes.text(2, top - 2.6, "Evaluation pipeline", fontsize=11, fontweight="bold", va="center")
        name = f"{episode.id}, {FAMILIES[episode.family].name}"
        axes.text(108, top - 2.6, name, fontsize=8.5, color=FAINT, va="center", ha="right")
        axes.text(2, top - 5.2, _wrapped(f"“{episode.instruction}”", 145, 1), fontsize=8.5, color=FAINT, va="center")
        pitch = 106 / len(chosen)
        width = min(pitch, _MAX_WIDTH) - 2.5
        for place, index in enumerate(chosen):
            left = 2 + place * pitch
            _step(figure, axes, track, index, left=left, width=width)
            if place:
                middle = top - 9.2 - 0.375 * width
                _arrow(axes, (left - pitch + width + 0.1, middle), (left - 0.2, middle))
                if skipped := index - chosen[place - 1] - 1:
                    between = left - (pitch - width) / 2
                    axes.text(between, middle + 0.6, f"+{skipped}", fontsize=7, ha="center", va="bottom", color=FAINT)
        _interface(axes, episode, track)
        return figure


def _card(axes: Axes, family: Family, frame: np.ndarray | None, episode: Episode | None) -> None:
    spec = FAMILIES[family]
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set(visible=True, color=_TIER_COLOURS[spec.tier], linewidth=1.6)
    axes.imshow(np.full((480, 640, 3), 235, np.uint8) if frame is None else frame)
    axes.set_title(f"\n{family}  {spec.name}", fontsize=9.5)
    seen = "target in view" if spec.visible_at_start else "target out of view"
    instruction = "" if episode is None else f"\n“{_wrapped(episode.instruction, 46)}”"
    text = f"{spec.summary}; {seen}\n{spec.max_steps} steps, {spec.max_invalid} invalid replies{instruction}"
    axes.set_xlabel(text, fontsize=7.3, loc="left", linespacing=1.35)


def _step(figure: Figure, axes: Axes, track: AgentTrajectory, index: int, *, left: float, width: float) -> None:
    height = 0.75 * width
    top = _HEIGHT - 9.2
    picture = figure.add_axes((left / 110, (top - height) / _HEIGHT, width / 110, height / _HEIGHT))
    picture.imshow(track.frames[index], aspect="auto")
    picture.axis("off")
    mark_click(picture, track.record.steps[index].action)
    held = track.holds[index + 1]
    axes.text(left, top + 0.5, f"step {index + 1}", fontsize=8, color=FAINT)
    hidden = "after it: goal holds" if held else "after it: not yet"
    axes.text(left + width, top + 0.5, hidden, fontsize=7, ha="right", color=LABEL_COLOURS["B"] if held else FAINT)
    step = track.record.steps[index]
    axes.text(
        left + width / 2, top - height - 0.9, step_caption(step), fontsize=8, ha="center", va="top", fontweight="bold"
    )
    reply = _wrapped(
        " ".join(step.reply.text.replace(",", ", ").replace(":", ": ").split()),
        int(1.9 * width),
        lines=max(1, int((top - height - 3.4 - _BOXES_TOP) / 1.1)),
    )
    axes.text(left, top - height - 3.4, reply, fontsize=6, va="top", family="DejaVu Sans Mono", color=FAINT)


def _interface(axes: Axes, episode: Episode, track: AgentTrajectory) -> None:
    boxes = (
        (2.0, "Agent sees", "system prompt, the current frame,\n20 turns of its own text replies", "#0072b2"),
        (29.5, "Agent answers", "one JSON object: navigate, look,\ninteract_pixel or report", "#e69f00"),
        (57.0, "Simulator acts", "no success signal, no state\ngoes back; only the next frame", "#555b66"),
        (84.5, "Settlement, offline", "hidden state gives W; the report\nagainst it gives B and the label", "#009e73"),
    )
    for left, head, text, colour in boxes:
        axes.add_patch(
            FancyBboxPatch(
                (left, 8.5), 23, 10, boxstyle="round,pad=0.3,rounding_size=0.8", fc="white", ec=colour, lw=1.6
            )
        )
        axes.text(left + 1, 16.3, head, fontsize=9.5, fontweight="bold", color=colour, va="center")
        axes.text(left + 1, 11.8, text, fontsize=7.8, va="center", linespacing=1.4)
    for left in (25.6, 53.1, 80.6):
        _arrow(axes, (left, 13.5), (left + 3.2, 13.5))
    axes.add_patch(
        FancyArrowPatch(
            (68, 8.0),
            (14, 8.0),
            connectionstyle="arc3,rad=-0.12",
            arrowstyle="-|>",
            mutation_scale=10,
            color=FAINT,
            lw=1.1,
        )
    )
    _footnotes(axes, episode, track.outcome)


def _footnotes(axes: Axes, episode: Episode, outcome: Outcome) -> None:
    """Write the budgets and the episode's outcome."""
    axes.text(
        41,
        2.6,
        f"at most {episode.max_steps} steps and {episode.max_invalid} invalid replies, hidden from it",
        fontsize=7.8,
        color=FAINT,
        ha="center",
    )
    said_text = f"reported {outcome.reported}" if outcome.reported else "no report"
    axes.text(
        96,
        4.6,
        f"here: {said_text}, W={int(outcome.W)}, B={int(outcome.B) if outcome.has_report else '–'}",
        fontsize=8.5,
        ha="center",
        fontweight="bold",
        color=INK,
    )


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=10, color=INK, lw=1.2, shrinkA=0, shrinkB=0)
    )


def _wrapped(text: str, width: int, lines: int = 4) -> str:
    """Return a text wrapped into lines of at most `width` characters; a text that is too long is cut."""
    return "\n".join(textwrap.wrap(text, width, max_lines=lines, placeholder=" ..."))
