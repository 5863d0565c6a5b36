"""Placement of labels in a plane, so that they cover neither each other nor a point."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from vigil.analysis.plots.style import GROUND

PointLabel = tuple[tuple[float, float], str, str, float]
"""Label of a point: position (data coordinates), text, colour, and size in points."""
_DISTANCES_PT = (7, 12, 20, 30, 42, 58, 76, 96, 120, 150)
_DIRECTIONS = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
_LEADER_FROM = 14
_OUTSIDE = 100.0
"""Number of covered labels that leaving the axes is as bad as."""


def place_labels(
    figure: Figure, axes: Axes, labels: Sequence[PointLabel], avoid: Sequence[tuple[float, float]] = ()
) -> None:
    """Write each label next to its point, larger labels first, with a line to the point if the label is not close.

    `avoid` are further points (data coordinates) that labels must not cover.
    """
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined] - an Agg canvas has get_renderer
    pixels = [axes.transData.transform(place) for place, *_ in labels]
    others = [axes.transData.transform(place) for place in avoid]
    taken = [Bbox.from_extents(x - 5, y - 5, x + 5, y + 5) for x, y in (*pixels, *others)]
    inside = axes.get_window_extent(renderer)
    for index in sorted(range(len(labels)), key=lambda i: (-labels[i][3], labels[i][1])):
        place, text, colour, size = labels[index]
        drawn = axes.annotate(text, place, (0, 0), textcoords="offset points", fontsize=size, color=colour, zorder=6)
        drawn.set_path_effects([withStroke(linewidth=2.0, foreground=GROUND)])
        offset, box = _free_position(pixels[index], drawn.get_window_extent(renderer), taken, inside, figure.dpi)
        taken.append(box)
        drawn.set_position(offset)
        (x, y), scale = _nearest_point(pixels[index], box), figure.dpi / 72
        end = ((x - pixels[index][0]) / scale, (y - pixels[index][1]) / scale)
        if math.hypot(*end) > _LEADER_FROM:
            line = {"arrowstyle": "-", "color": colour, "lw": 0.6}
            axes.annotate("", place, end, textcoords="offset points", arrowprops=line)


def _free_position(
    point: np.ndarray, extent: Bbox, taken: Sequence[Bbox], inside: Bbox, dpi: float
) -> tuple[tuple[float, float], Bbox]:
    """Return the offset (points) and the box (pixels) of the first position where a label covers nothing.

    Without such a position: the one inside the axes where it covers least.
    """
    scale = dpi / 72
    least, fallback = math.inf, None
    for near in _DISTANCES_PT:
        for dx, dy in _DIRECTIONS:
            x = point[0] + near * scale * dx - (extent.width if dx < 0 else extent.width / 2 if dx == 0 else 0)
            y = point[1] + near * scale * dy - (extent.height if dy < 0 else extent.height / 2 if dy == 0 else 0)
            box = Bbox.from_extents(x - 1, y - 1, x + extent.width + 1, y + extent.height + 1)
            offset = ((x - point[0]) / scale, (y - point[1]) / scale)
            within = inside.x0 <= box.x0 and box.x1 <= inside.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1
            covered = sum(_shared_area(box, other) for other in taken)
            if within and not covered:
                return offset, box
            if (cost := covered + (0.0 if within else _OUTSIDE * box.width * box.height)) < least:
                least, fallback = cost, (offset, box)
    assert fallback is not None
    return fallback


def _shared_area(one: Bbox, other: Bbox) -> float:
    """Return the area (pixels) that two boxes share."""
    across, down = min(one.x1, other.x1) - max(one.x0, other.x0), min(one.y1, other.y1) - max(one.y0, other.y0)
    return max(0.0, across) * max(0.0, down)


def _nearest_point(point: np.ndarray, box: Bbox) -> tuple[float, float]:
    return min(max(point[0], box.x0), box.x1), min(max(point[1], box.y0), box.y1)
