"""What an agent may see at a step: one RGB frame and, in one profile, two booleans.

These types must not contain hidden state. Source: `protocol.md` section 2.1.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from vigil.base.models import FrozenModel

if TYPE_CHECKING:
    import numpy as np

FRAME_WIDTH = 640
FRAME_HEIGHT = 480
Quality = Literal["default", "fast"]
"""Rendering quality: `default` has smooth edges and contact shadows; `fast` omits both and draws in half the time."""


class Feedback(FrozenModel):
    """The two booleans about the last action in the action-feedback profile."""

    too_far: bool
    path_blocked: bool


class Cues(FrozenModel):
    """Facts that some profiles show with a frame, in addition to feedback."""

    remaining_steps: int | None = None
    """Number of replies that are left, including the reply to this frame."""
    request: str | None = None
    """What the agent is asked to do next."""


class Observation:
    """The observation at one step. The frame is drawn only when `rgb` is first read."""

    __slots__ = ("_draw", "_rgb", "cues", "feedback")

    def __init__(
        self, draw: "Callable[[], np.ndarray]", feedback: Feedback | None = None, cues: Cues | None = None
    ) -> None:
        self._draw = draw
        self.cues = cues
        self._rgb: np.ndarray | None = None
        self.feedback = feedback

    @property
    def rgb(self) -> "np.ndarray":
        """The current frame: (480, 640, 3) uint8, origin top left. It is read-only, because its hash is recorded."""
        if self._rgb is None:
            self._rgb = self._draw().view()
            self._rgb.flags.writeable = False
        return self._rgb

    @property
    def is_drawn(self) -> bool:
        """Whether the frame has been drawn. The frame is drawn when `rgb` is first read."""
        return self._rgb is not None
