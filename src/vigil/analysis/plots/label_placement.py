"""Placement of labels in a plane, so that they cover neither each other nor a point, and stay inside the axes."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from vigil.analysis.plots.style import GROUND

PointLabel = tuple[tuple[float, float], str, str, float]
"""Label of a point: position (data coordinates), text, colour, and size in points."""
_DISTANCES_PT = (9, 14, 20, 30, 42, 58, 76, 96, 120, 150)
_DIRECTIONS = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
_LEADER_FROM = 14
_POINT_PX = 5
"""Half the width of the square around a point that labels must not cover, in pixels at 100 dots per inch."""


def place_labels(
    figure: Figure,
    axes: Axes,
    labels: Sequence[PointLabel],
    avoid: Sequence[tuple[float, float]] = (),
    as_numbers: Sequence[str] = (),
) -> list[str]:
    """Write each label next to its point, larger labels first, with a line to the point if the label is not close.

    Labels do not cover the further points `avoid` (data coordinates). A label without room is replaced by a number, or
    left out if the number has no room either. The texts in `as_numbers` are always replaced. Return the replaced texts;
    the number is the position in this list.
    """
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined] - an Agg canvas has get_renderer
    places = [axes.transData.transform(place) for place in (*(label[0] for label in labels), *avoid)]
    side = _POINT_PX * figure.dpi / 100
    taken = [Bbox.from_extents(x - side, y - side, x + side, y + side) for x, y in places]
    inside = axes.get_window_extent(renderer)
    numbered = list(as_numbers)
    for index in sorted(range(len(labels)), key=lambda i: (-labels[i][3], labels[i][1])):
        _, text, colour, _ = labels[index]
        number = str(numbered.index(text) + 1 if text in numbered else len(numbered) + 1)
        for said in (number,) if text in numbered else (text, number):
            drawn = _label(axes, labels[index], said)
            found = _free_position(places[index], drawn.get_window_extent(renderer), taken, inside, figure.dpi)
            if found is not None:
                break
            drawn.remove()
        else:
            continue
        if said != text and text not in numbered:
            numbered.append(text)
        offset, box = found
        taken.append(box)
        drawn.set_position(offset)
        (x, y), scale = _nearest_point(places[index], box), figure.dpi / 72
        end = ((x - places[index][0]) / scale, (y - places[index][1]) / scale)
        if math.hypot(*end) > _LEADER_FROM:
            line = {"arrowstyle": "-", "color": colour, "lw": 0.6}
            axes.annotate("", labels[index][0], end, textcoords="offset points", arrowprops=line)
    return numbered


def _label(axes: Axes, label: PointLabel, said: str) -> Annotation:
    place, _, colour, size = label
    drawn = axes.annotate(said, place, (0, 0), textcoords="offset points", fontsize=size, color=colour, zorder=6)
    drawn.set_path_effects([withStroke(linewidth=2.0, foreground=GROUND)])
    return drawn


def _free_position(
    point: np.ndarray, extent: Bbox, taken: Sequence[Bbox], inside: Bbox, dpi: float
) -> tuple[tuple[float, float], Bbox] | None:
    """Return the offset (points) and the box (pixels) of the first position inside the axes where a label covers
    nothing; None if there is none."""
    scale = dpi / 72
    for near in _DISTANCES_PT:
        for dx, dy in _DIRECTIONS:
            x = point[0] + near * scale * dx - (extent.width if dx < 0 else extent.width / 2 if dx == 0 else 0)
            y = point[1] + near * scale * dy - (extent.height if dy < 0 else extent.height / 2 if dy == 0 else 0)
            box = Bbox.from_extents(x - 1, y - 1, x + extent.width + 1, y + extent.height + 1)
            within = inside.x0 <= box.x0 and box.x1 <= inside.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1
            if within and not any(box.overlaps(other) for other in taken):
                return ((x - point[0]) / scale, (y - point[1]) / scale), box
    return None


def _nearest_point(point: np.ndarray, box: Bbox) -> tuple[float, float]:
    return min(max(point[0], box.x0), box.x1), min(max(point[1], box.y0), box.y1)
