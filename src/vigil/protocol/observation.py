"""All that an agent may see of a step: one RGB frame and, in one profile, two booleans.

Nothing hidden may enter these types. `protocol.md` section 2.1.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

FRAME_WIDTH = 640
FRAME_HEIGHT = 480
Quality = Literal["default", "fast"]
"""How carefully a frame is drawn: with smooth edges and shade where things touch, or twice as many a second."""


class Feedback(BaseModel):
    """The action-feedback profile's two booleans about the action just done."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    too_far: bool
    path_blocked: bool


class Observation:
    """One step's observation. The frame is drawn when first looked at, and only then."""

    __slots__ = ("_draw", "_rgb", "feedback")

    def __init__(self, draw: Callable[[], np.ndarray], feedback: Feedback | None = None) -> None:
        self._draw = draw
        self._rgb: np.ndarray | None = None
        self.feedback = feedback

    @property
    def rgb(self) -> np.ndarray:
        """The current frame: (480, 640, 3) uint8, origin top left; read-only, for its hash is recorded."""
        if self._rgb is None:
            self._rgb = self._draw().view()
            self._rgb.flags.writeable = False
        return self._rgb

    @property
    def is_drawn(self) -> bool:
        """Whether somebody has looked at the frame."""
        return self._rgb is not None
