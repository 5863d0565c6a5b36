"""What AI2-THOR's pictures tell: which object each pixel shows, how much of it is seen, and how far away it is."""

from dataclasses import dataclass

import numpy as np

from vigil.pose import Pose, Vec3
from vigil.sim.core.sight import HEIGHT, NEAR_CLICK_PX, WIDTH, camera_axes, directions
from vigil.sim.thor.line import Event

LISTED_PIXELS = 1600
"""About how many pixels of a thing are listed."""
_PIXELS = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1)
_LEVEL = Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0)
_ALONG = (directions(_LEVEL, _PIXELS.reshape(-1, 2)) @ camera_axes(_LEVEL)[2]).reshape(HEIGHT, WIDTH)
"""Cosine of the angle between each pixel's ray and the camera's axis."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """What is seen of an object."""

    pixels: int = 0
    nearest_m: float | None = None


class Picture:
    """One frame from the agent's eye, pixel by pixel."""

    def __init__(self, event: Event, in_hand: frozenset[str]) -> None:
        assert event.instance_segmentation_frame is not None
        self._codes = _coded(event.instance_segmentation_frame)
        self._depth = event.depth_frame
        self._ids = {_code(colour): name for colour, name in event.color_to_object_id.items()}
        self._code_of = {name: code for code, name in self._ids.items()}
        self._in_hand = in_hand

    def at(self, x: int, y: int) -> str | None:
        """Returns the name of what a pixel shows, what is in the hand included; None for what has none."""
        return self._ids.get(int(self._codes[y, x]))

    def near(self, x: int, y: int) -> set[str]:
        """Returns the names of what is shown within 3 px of a pixel, but for what is in the hand."""
        offsets = _PIXELS[: 2 * NEAR_CLICK_PX + 1, : 2 * NEAR_CLICK_PX + 1].reshape(-1, 2) - NEAR_CLICK_PX
        pixels = offsets[(offsets**2).sum(axis=1) <= NEAR_CLICK_PX**2] + [x, y]
        columns, rows = pixels[((pixels >= 0) & (pixels < [WIDTH, HEIGHT])).all(axis=1)].T
        found = {self._ids.get(int(code)) for code in np.unique(self._codes[rows, columns])}
        return {name for name in found if name is not None and name not in self._in_hand}

    def sighting(self, name: str) -> Sighting:
        """Returns how much of an object is seen; nothing of what is in the hand."""
        mask = self._mask(name)
        count = int(np.count_nonzero(mask))
        if not count:
            return Sighting()
        nearest = None if self._depth is None else float((self._depth[mask] / _ALONG[mask]).min())
        return Sighting(count, None if nearest is None else round(nearest, 6))

    def pixels_of(self, name: str) -> np.ndarray:
        """Returns pixels (n, 2) of x, y that show an object, on a lattice fixed in the frame."""
        mask = self._mask(name)
        stride = max(1, int(np.sqrt(np.count_nonzero(mask) / LISTED_PIXELS)))
        first = stride // 2
        rows, columns = np.nonzero(mask[first::stride, first::stride])
        return np.column_stack([columns, rows]) * stride + first

    def _mask(self, name: str) -> np.ndarray:
        code = self._code_of.get(name) if name not in self._in_hand else None
        return np.zeros((HEIGHT, WIDTH), dtype=bool) if code is None else self._codes == code


def _coded(colours: np.ndarray) -> np.ndarray:
    """Returns one number (height, width) for each pixel's colour."""
    red, green, blue = (colours[..., channel].astype(np.uint32) for channel in range(3))
    return (red << 16) | (green << 8) | blue


def _code(colour: tuple[int, ...]) -> int:
    red, green, blue = colour[:3]
    return (int(red) << 16) | (int(green) << 8) | int(blue)
