"""Placement of labels in a plane, so that they cover neither each other nor a point, and stay inside the axes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from vigil.analysis.plots.style import GROUND

PointLabel = tuple[tuple[float, float], str, str, float]
"""Label of a point: position (data coordinates), text, colour, and size in points."""
_DISTANCES_PT = (9, 14, 20, 30, 42, 58, 76, 96, 120, 150)
_DIRECTIONS = (
    *((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)),
    *((1, 0.5), (1, -0.5), (-1, 0.5), (-1, -0.5), (0.5, 1), (0.5, -1), (-0.5, 1), (-0.5, -1)),
)
_LEADER_FROM = 11
_POINT_PX = 5
"""Half the width of the square around a point that labels must not cover, in pixels at 100 dots per inch."""
_NEARER_PX = 3
"""A label without a line is nearer to its point than to any other by this distance, in pixels at 100 dots per inch."""


def place_labels(
    axes: Axes,
    labels: Sequence[PointLabel],
    avoid: Sequence[tuple[float, float]] = (),
    rather_avoid: Sequence[tuple[float, float]] = (),
    as_numbers: Sequence[str] = (),
) -> list[str]:
    """Write each label next to its point, larger labels first, with a line to the point if the label is not close.

    Labels do not cover the further points `avoid` (data coordinates), other labels or lines; they cover the points
    `rather_avoid` only if there is no other room. Lines pass through no point, label or line if there is room. A
    label without room is
    replaced by a number, or left out if the number has no room either. The texts in `as_numbers` are always replaced.
    Return the replaced texts; the number is the position in this list.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined] - an Agg canvas has get_renderer
    places = axes.transData.transform([*(label[0] for label in labels), *avoid])
    shy = axes.transData.transform(rather_avoid or np.empty((0, 2)))
    side = _POINT_PX * figure.dpi / 100
    boxes, shy_boxes = (np.hstack([found - side, found + side]) for found in (places, shy))
    room = _Room(boxes, shy_boxes, places, axes.get_window_extent(renderer), figure.dpi / 72)
    numbered = list(as_numbers)
    for index in sorted(range(len(labels)), key=lambda i: (-labels[i][3], labels[i][1])):
        _, text, colour, _ = labels[index]
        number = str(numbered.index(text) + 1 if text in numbered else len(numbered) + 1)
        for said in (number,) if text in numbered else (text, number):
            drawn = _label(axes, labels[index], said)
            found = room.free_position(places[index], drawn.get_window_extent(renderer))
            if found is not None:
                break
            drawn.remove()
        else:
            continue
        if said != text and text not in numbered:
            numbered.append(text)
        offset, end = found
        drawn.set_position(offset)
        if math.hypot(*end) > _LEADER_FROM:
            line = {"arrowstyle": "-", "color": colour, "lw": 0.6}
            axes.annotate("", labels[index][0], end, textcoords="offset points", arrowprops=line)
    return numbered


def _label(axes: Axes, label: PointLabel, said: str) -> Annotation:
    place, _, colour, size = label
    drawn = axes.annotate(said, place, (0, 0), textcoords="offset points", fontsize=size, color=colour, zorder=6)
    drawn.set_path_effects([withStroke(linewidth=2.0, foreground=GROUND)])
    return drawn


@dataclass
class _Room:
    """What is taken in a plane, all in pixels: boxes, (n, 4), as left, bottom, right, top; and points, (m, 2)."""

    taken: np.ndarray
    shy: np.ndarray
    """Boxes, (k, 4), that a label covers only if there is no other room."""
    points: np.ndarray
    inside: Bbox
    scale: float
    """Pixels per point of text."""

    def free_position(self, point: np.ndarray, extent: Bbox) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Take the first position where a label and its line cover nothing; None if there is none.

        Return two offsets from the point, in points of text: of the label, and of the end of its line.
        """
        size = np.array([extent.width, extent.height])
        none = np.empty((0, 4))
        for shy, is_strict in ((self.shy, True), (none, True), (none, False)):
            for near, direction in product(_DISTANCES_PT, _DIRECTIONS):
                way = np.array(direction)
                low = point + near * self.scale * way - size * (1 - np.sign(way)) / 2
                box = np.array([*(low - 1), *(low + size + 1)])
                end = np.clip(point, box[:2], box[2:])
                if self._is_free(box, shy) and (self._is_clear(box, point, end) or not is_strict):
                    self.taken = np.vstack([self.taken, box, self._line(point, end)])
                    (x, y), (x_end, y_end) = (low - point) / self.scale, (end - point) / self.scale
                    return (float(x), float(y)), (float(x_end), float(y_end))
        return None

    def _is_free(self, box: np.ndarray, shy: np.ndarray) -> bool:
        (x0, y0), (x1, y1) = self.inside.min, self.inside.max
        is_outside = box[0] < x0 or box[1] < y0 or box[2] > x1 or box[3] > y1
        return not (is_outside or _covers(box, self.taken) or _covers(box, shy))

    def _is_clear(self, box: np.ndarray, point: np.ndarray, end: np.ndarray) -> bool:
        """Return whether it is clear to which point a label belongs: its line is free, or no other point is as near."""
        away = np.abs(self.points - point).max(axis=1)
        line = self._line(point, end)
        if len(line):
            others = self.points[away > _POINT_PX * self.scale]
            dots = np.hstack([others - 3 * self.scale, others + 3 * self.scale])
            return not _covers(line, np.vstack([dots, self.taken[len(self.points) :]]))
        others = self.points[away > 1]
        far = np.linalg.norm(others - np.clip(others, box[:2], box[2:]), axis=1)
        return float(np.linalg.norm(end - point)) + _NEARER_PX * self.scale * 0.72 <= far.min(initial=np.inf)

    def _line(self, point: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return small boxes, (n, 4), along the line from a point to its label, but not next to either; empty if the
        label is so close that it needs no line."""
        length = float(np.linalg.norm(end - point))
        if length <= _LEADER_FROM * self.scale:
            return np.empty((0, 4))
        begin = 2 * _POINT_PX * self.scale
        along = np.arange(begin, max(length - 3, begin + 1), 4.0)[:, None] * (end - point) / length + point
        return np.hstack([along - 1, along + 1])


def _covers(boxes: np.ndarray, taken: np.ndarray) -> bool:
    """Return whether one of the boxes, (..., 4), overlaps one that is taken, (n, 4)."""
    boxes = boxes[..., None, :]
    over = (taken[:, :2] < boxes[..., 2:]) & (taken[:, 2:] > boxes[..., :2])
    return bool(over.all(axis=-1).any())
