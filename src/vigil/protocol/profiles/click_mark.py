"""The mark of a click in a frame: a ring of two colours, so that it is seen on any background."""

import numpy as np

RADIUS_PX, WIDTH_PX = 9.0, 2.0
INNER, OUTER = (255, 0, 255), (255, 255, 255)
"""Colours of the ring and of its outline."""


def with_click_mark(rgb: np.ndarray, x: int, y: int) -> np.ndarray:
    """Return a frame (h, w, 3) uint8 with a ring around the pixel (x, y), which itself stays visible."""
    marked = rgb.copy()
    rows, columns = np.ogrid[: rgb.shape[0], : rgb.shape[1]]
    away = np.abs(np.hypot(columns - x, rows - y) - RADIUS_PX)
    marked[away <= WIDTH_PX] = OUTER
    marked[away <= WIDTH_PX / 2] = INNER
    return marked
