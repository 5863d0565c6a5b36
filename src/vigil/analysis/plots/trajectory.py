"""Trajectories: several agents on one episode side by side, frame by frame, as a picture or as an animation.

The caller gives the frames (saved by the run, or drawn again from its actions). The rest comes from the records.
"""

import io
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image

from vigil.analysis.measures.rows import Run
from vigil.analysis.plots.style import (
    FAINT,
    INK,
    LABEL_COLOURS,
    canvas,
    ink_of,
    ink_on,
    paper_width_in,
    styled,
    text_pt,
)
from vigil.errors import RecordError
from vigil.protocol.actions import AnyAction, InteractPixel, Navigate, Report, Stop
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.records.record import EpisodeRecord, Key, StepRecord
from vigil.scoring.goal_check import check
from vigil.scoring.outcomes import Label, Outcome, score
from vigil.scoring.saved_run import RecordTable

GOAL_COLOUR = LABEL_COLOURS["B"]
CLICK_COLOUR = "#ff2d95"
DEFAULT_COLUMNS = 6
ANIMATION_MS = 900
FINAL_MS = 3000
TITLE_LETTERS_PER_IN = 11.5
_PANEL_IN, _NAME_IN = 1.75, 1.15
_PAPER_PANEL_IN = 1.4
"""Least width (inches) of a frame in a paper."""
_ENDS: dict[Label, str] = {
    "B": "verified success",
    "FR": "false report",
    "NR": "no report",
    "IL": "invalid limit",
    "Other": "matched, W=0",
}


@dataclass(frozen=True)
class AgentTrajectory:
    """One agent's trajectory in one episode."""

    name: str
    record: EpisodeRecord
    outcome: Outcome
    holds: tuple[bool, ...]
    """Whether the goal holds after the reset and after each step."""
    frames: Sequence[np.ndarray]
    """The frame that the agent saw before each reply, (480, 640, 3) uint8."""


def find_record(run: Run, episodes: Iterable[Episode], key: Key) -> EpisodeRecord:
    """Return the record that counts for `key` (episode and epoch) in a run. `episodes` are all episodes of the run's
    pack. Raises RecordError."""
    table = RecordTable(run.folder, run.header, episodes)
    table.refresh()
    row = table.rows.get(key)
    if row is None or row.outcome is None:
        raise RecordError(f"Run {run.name!r} has no scored record of episode {key[0]!r} (epoch {key[1]}).")
    return table.record(key)


def make_trajectory(
    name: str, episode: Episode, record: EpisodeRecord, frames: Sequence[np.ndarray]
) -> AgentTrajectory:
    """Score a record, and return it with its frames. Raises RecordError unless there is one frame per step."""
    if len(frames) != len(record.steps):
        raise RecordError(
            f"{name!r} has {len(frames)} frames for the {len(record.steps)} steps of episode {episode.id!r}; each "
            "step needs one frame."
        )
    truth = tuple(row.semantic for row in check(episode.goal, record).rows)
    return AgentTrajectory(name, record, score(episode, record), truth, frames)


def trajectory_figure(episode: Episode, tracks: Sequence[AgentTrajectory], columns: int = DEFAULT_COLUMNS) -> Figure:
    """Draw one row per agent: frames of the first, the last and other key steps, with actions and verdicts."""
    printed = paper_width_in()
    if printed is not None:
        columns = min(columns, int((printed - _NAME_IN * text_pt(8.5) / 8.5) / _PAPER_PANEL_IN))
    width = max(2, min(columns, max(len(one.record.steps) for one in tracks)))
    with styled():
        width_in = printed or figure_width_in(width)
        title = _title(episode, tracks, width_in)
        panel_in = (width_in - _NAME_IN) / width
        line_in = text_pt(9.5) / 72
        figure = canvas(
            width_in, 0.35 + 1.5 * line_in * len(title.splitlines()) + len(tracks) * (panel_in * 0.75 + 0.5)
        )
        figure.suptitle(title, x=0.008, ha="left", fontsize=text_pt(9.5), fontweight="bold", linespacing=1.5)
        ratios = [_NAME_IN / panel_in, *[1.0] * width]
        grid = figure.subplots(len(tracks), width + 1, squeeze=False, width_ratios=ratios)
        for row, one in enumerate(tracks):
            _name(grid[row][0], one)
            chosen = key_steps(one, width)
            for column in range(width):
                axes = grid[row][column + 1]
                axes.axis("off")
                if column < len(chosen):
                    _panel(axes, one, chosen[column], chosen[column - 1] if column else -1)
        return figure


def figure_width_in(columns: int) -> float:
    """Return the width (inches) of a figure with `columns` frames per row."""
    return _NAME_IN + _PANEL_IN * columns


def key_steps(one: AgentTrajectory, count: int) -> list[int]:
    """Return at most `count` step indices, sorted: the first step, the last, the step that reached the goal, and others
    spread evenly."""
    last = len(one.record.steps) - 1
    if last < count:
        return list(range(last + 1))
    first = one.outcome.first_goal_step
    wanted = [0, last, *([] if first is None else [first - 1, first])]
    wanted += [round(last * k / (count - 1)) for k in range(count)] + list(range(last))
    chosen: list[int] = []
    for step in wanted:
        if 0 <= step <= last and step not in chosen and len(chosen) < count:
            chosen.append(step)
    return sorted(chosen)


def trajectory_animation(episode: Episode, tracks: Sequence[AgentTrajectory], kind: str) -> bytes:
    """Return all steps of all agents, side by side, as an animated GIF or WebP file."""
    length = max(len(one.record.steps) for one in tracks)
    frames = [_animation_frame(episode, tracks, step) for step in range(length)]
    durations = [ANIMATION_MS] * (length - 1) + [FINAL_MS]
    buffer = io.BytesIO()
    if kind == "gif":
        palette = [frame.quantize(256, dither=Image.Dither.NONE) for frame in frames]
        palette[0].save(buffer, "GIF", save_all=True, append_images=palette[1:], duration=durations, loop=0)
    else:
        frames[0].save(buffer, "WEBP", save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=80)
    return buffer.getvalue()


def step_caption(step: StepRecord) -> str:
    """Return a step's action in a few words."""
    return "invalid: " + step.invalid.reason.replace("_", " ") if step.invalid else action_caption(step.action)


def action_caption(action: AnyAction | None) -> str:
    """Return an action in a few words."""
    match action:
        case None:
            return ""
        case Navigate():
            mode_words = action.mode.replace("turn_", "turn ")
            return f"{mode_words} {round(action.magnitude, 1):g}{'°' if 'turn' in mode_words else ' steps'}"
        case InteractPixel():
            where = "" if action.x is None else f" ({action.x}, {action.y})"
            return f"{action.intent.replace('_', ' ')}{where}"
        case Report():
            return f"report: {action.raw_status or action.status}"
        case Stop():
            return "stop"
        case _:
            return f"look {action.direction} {round(action.magnitude, 1):g}°"


def verdict_caption(one: AgentTrajectory) -> str:
    """Return a text that says how an episode ended, and the verdict."""
    outcome = one.outcome
    w, b = f"W={int(outcome.W)}", f"B={int(outcome.B) if outcome.has_report else '–'}"
    named = "not a state label" if outcome.subtype == "off_mode_label" else (outcome.subtype or "").replace("_", " ")
    kind = f"\n{named}" if named else ""
    return f"{w}  {b}\n{_end(outcome)}{kind}"


def _end(outcome: Outcome) -> str:
    if outcome.label is None:
        return "stopped" if outcome.is_ended_by_agent else "did not stop"
    return _ENDS[outcome.label]


def _colour(outcome: Outcome) -> str:
    return FAINT if outcome.label is None else LABEL_COLOURS[outcome.label]


def _title(episode: Episode, tracks: Sequence[AgentTrajectory], width_in: float) -> str:
    """Return the title of an episode, wrapped to the width of a figure."""
    expected = next((f"; expected label: {one.outcome.expected}" for one in tracks if one.outcome.expected), "")
    what = f"{episode.family}, {FAMILIES[episode.family].name}; at most {episode.max_steps} steps"
    lines = (f"{episode.id}   ({what}{expected})", f"“{episode.instruction}”")
    return "\n".join(textwrap.fill(line, int(TITLE_LETTERS_PER_IN * width_in * 9.5 / text_pt(9.5))) for line in lines)


def _name(axes: Axes, one: AgentTrajectory) -> None:
    axes.axis("off")
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.text(
        0,
        0.98,
        _wrapped_name(one.name, 14 if paper_width_in() else 16),
        va="top",
        fontsize=text_pt(8.5),
        fontweight="bold",
    )
    colour = _colour(one.outcome)
    axes.text(0, 0.52, verdict_caption(one), va="top", fontsize=text_pt(8), color=INK, linespacing=1.4)
    axes.add_patch(Rectangle((0, 0.56), 0.6, 0.03, color=colour, transform=axes.transAxes))


def goal_words(one: AgentTrajectory, *, held: bool) -> str:
    """Return the words under a step that say whether W holds after it, which the agent is not shown.

    In episodes that ask for a state (`outcome.expected`), W says only that the state is in view and unchanged.
    """
    if one.outcome.expected:
        return f"after it: {'state in view' if held else 'W=0'}"
    return f"after it: goal {'met' if held else 'unmet'} (hidden)"


def _panel(axes: Axes, one: AgentTrajectory, index: int, previous: int) -> None:
    """Draw the frame before a step, with a mark at the pixel that the step clicks; under it, the step and whether the
    goal holds.

    `previous` is the step of the panel to the left; the number of steps between the two is written above the frame.
    """
    step = one.record.steps[index]
    axes.imshow(one.frames[index], interpolation="antialiased")
    mark_click(axes, step.action)
    skipped = index - previous - 1
    gap = f"  ({skipped} not shown)" if skipped else ""
    axes.set_title(f"step {index + 1}{gap}", fontsize=text_pt(7), color=INK, pad=2, fontweight="normal")
    is_last = index == len(one.record.steps) - 1
    look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "va": "top"}
    axes.annotate(
        step_caption(step),
        (0.5, 0.0),
        (0, -2),
        fontsize=text_pt(7.5),
        color=ink_of(_colour(one.outcome)) if is_last else INK,
        fontweight="bold" if is_last else "normal",
        **look,
    )
    if (held := one.holds[index + 1]) or is_last:
        colour = GOAL_COLOUR if held else INK
        said = goal_words(one, held=held)
        axes.annotate(said, (0.5, 0.0), (0, -4 - text_pt(7.5)), fontsize=text_pt(7), color=colour, **look)


def mark_click(axes: Axes, action: AnyAction | None) -> None:
    """Draw a ring around the pixel that an action clicks, on a picture whose axes are in pixels, so that what is
    clicked stays visible. Other actions are not marked."""
    if isinstance(action, InteractPixel) and action.x is not None and action.y is not None:
        axes.plot(action.x, action.y, "o", ms=16, mfc="none", mec="white", mew=2.6)
        axes.plot(action.x, action.y, "o", ms=16, mfc="none", mec=CLICK_COLOUR, mew=1.3)


def _animation_frame(episode: Episode, tracks: Sequence[AgentTrajectory], step: int) -> Image.Image:
    """Return one image of the animation: every agent at `step`. An agent that has ended shows its last step, paler."""
    columns = min(2, len(tracks)) if len(tracks) <= 4 else 3
    rows = -(-len(tracks) // columns)
    with styled():
        title = _title(episode, tracks, 4.2 * columns)
        figure = canvas(4.2 * columns, 0.41 + 0.17 * len(title.splitlines()) + 3.75 * rows)
        figure.suptitle(title, x=0.01, ha="left", fontsize=text_pt(9.5), fontweight="bold")
        for place, one in zip(figure.subplots(rows, columns, squeeze=False).flat, tracks, strict=False):
            last = len(one.record.steps) - 1
            index = min(step, last)
            _panel(place, one, index, index - 1)
            place.set_title(f"{one.name}   step {index + 1}", fontsize=text_pt(9))
            if step >= last:
                place.images[0].set_alpha(0.55)
                place.text(
                    320,
                    240,
                    verdict_caption(one),
                    ha="center",
                    va="center",
                    fontsize=text_pt(13),
                    fontweight="bold",
                    color=ink_on(_colour(one.outcome)),
                    bbox={"fc": _colour(one.outcome), "ec": "none", "pad": 7},
                )
        for place in figure.axes:
            place.axis("off")
        figure.set_dpi(100)
        figure.canvas.draw()
        return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])  # type: ignore[attr-defined] - of Agg


def _wrapped_name(name: str, width: int) -> str:
    """Return a name wrapped at spaces, hyphens and underscores, at most `width` characters a line."""
    lines, line = [], ""
    for word in name.replace("-", "- ").replace("_", "_ ").split(" "):
        joined = f"{line}{word}" if line.endswith(("-", "_")) or not line else f"{line} {word}"
        if len(joined) > width and line:
            lines.append(line)
            line = word
        else:
            line = joined
    return "\n".join([*lines, line])
