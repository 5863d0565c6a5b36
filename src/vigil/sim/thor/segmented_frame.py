"""AI2-THOR's segmentation and depth: which object each pixel shows, and each object's number of pixels and distance."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.sim.core.sight import HEIGHT, WIDTH, camera_axes, directions, pixels_near

LISTED_PIXELS = 1600
"""Approximate limit on the pixels that are listed for one object; of a larger object, only some pixels are listed."""
MEASURED_PIXELS = 2000
"""A large object's distance is measured at a sample of its pixels: at least this many, and fewer than twice as many."""
_PIXELS = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1)
_LEVEL = Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0)
_ALONG = (directions(_LEVEL, _PIXELS.reshape(-1, 2)) @ camera_axes(_LEVEL)[2]).reshape(HEIGHT, WIDTH)
"""Cosine of the angle between each pixel's ray and the camera's axis."""


class Event(Protocol):
    """The client's answer to an action."""

    metadata: Any
    frame: np.ndarray | None
    """Colours (height, width, 3) uint8; None when not requested."""
    depth_frame: np.ndarray | None
    """Depth (height, width) float32 in metres along the camera's axis; None when not requested."""
    instance_segmentation_frame: np.ndarray | None
    """Colour (height, width, 3 or 4) uint8 that stands for the object at each pixel; None when not requested."""
    color_to_object_id: dict[tuple[int, ...], str]
    """Colour in the segmentation -> id of its object."""


@dataclass(frozen=True, slots=True)
class PixelCount:
    """What a frame shows of an object."""

    pixels: int = 0
    """Number of pixels that show the object."""
    nearest_m: float | None = None
    """Least distance (m) from the eye to a visible point of the object; None if it is not visible or not measured."""


class SegmentedFrame:
    """One frame from the agent's eye, pixel by pixel."""

    def __init__(self, event: Event, in_hand: frozenset[str]) -> None:
        assert event.instance_segmentation_frame is not None
        self._colours = event.instance_segmentation_frame
        self._depth = event.depth_frame
        self._names = event.color_to_object_id
        self._colour_of = {name: colour for colour, name in self._names.items()}
        self._in_hand = in_hand

    def at(self, x: int, y: int) -> str | None:
        """Return the name of the object at a pixel, also of a held object; None if no named object is there."""
        return self._names.get(tuple(self._colours[y, x, :3].tolist()))

    def ids_near_pixel(self, x: int, y: int) -> set[str]:
        """Return the names of the objects within 3 px of a pixel, except held objects."""
        found = {self.at(column, row) for column, row in pixels_near(x, y).tolist()}
        return {name for name in found if name is not None and name not in self._in_hand}

    def pixel_count(self, *names: str) -> PixelCount:
        """Return what the frame shows of an object and its parts, by their names; a held object counts as not shown."""
        rows, columns = (np.concatenate(each) for each in zip(*map(self._shown, names), strict=True))
        if not len(rows):
            return PixelCount()
        if self._depth is None:
            return PixelCount(len(rows))
        some = slice(None, None, max(1, len(rows) // MEASURED_PIXELS))
        nearest = float((self._depth[rows[some], columns[some]] / _ALONG[rows[some], columns[some]]).min())
        return PixelCount(len(rows), round(nearest, 6))

    def pixels_of(self, name: str) -> np.ndarray:
        """Return the pixels (n, 2; x and y) that show an object. Only pixels of a fixed lattice are listed."""
        rows, columns = self._shown(name)
        stride = max(1, int(np.sqrt(len(rows) / LISTED_PIXELS)))
        is_listed = (rows % stride == stride // 2) & (columns % stride == stride // 2)
        return np.column_stack([columns[is_listed], rows[is_listed]])

    def _shown(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows (n,) and columns (n,) of the pixels that show an object; empty for a held object."""
        colour = self._colour_of.get(name)
        if colour is None or name in self._in_hand:
            return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
        rows, columns = np.divmod(np.flatnonzero(self._reds == colour[0]), WIDTH)
        is_shown = (self._colours[rows, columns, 1:3] == colour[1:3]).all(axis=1)
        return rows[is_shown], columns[is_shown]

    @cached_property
    def _reds(self) -> np.ndarray:
        """First byte (HEIGHT * WIDTH,) uint8 of each pixel's colour, stored contiguously for fast search."""
        return np.ascontiguousarray(self._colours[..., 0]).reshape(-1)
