"""The protocol of a client of AI2-THOR's engine: it sends actions and returns events.

`vigil.sim.thor.guarded_client.GuardedClient` implements it with AI2-THOR's client; tests use a client that calls an
engine in the same process.
"""

# pyright: reportReturnType=false

from typing import Any, Protocol

import numpy as np


class Event(Protocol):
    """The client's answer to an action."""

    metadata: Any
    frame: np.ndarray | None
    """Colours (height, width, 3) uint8; None when not requested."""
    depth_frame: np.ndarray | None
    """Depth (height, width) float32 in metres along the camera's axis; None when not requested."""
    instance_segmentation_frame: np.ndarray | None
    """Colour of the object that each pixel shows (height, width, 3 or 4) uint8; None when not requested."""
    color_to_object_id: dict[tuple[int, ...], str]
    """Object id for each colour of the segmentation."""


class EngineClient(Protocol):
    """A client of a started engine."""

    @property
    def is_over(self) -> bool:
        """Whether the engine was closed or has failed."""

    def open(self, house: dict[str, Any]) -> None:
        """Let the engine build a house, replacing any earlier one. Raises SimulatorError."""

    def step(self, action: str, **arguments: Any) -> Event:
        """Return the event after an action, also after a refused action.

        Raises SimulatorError; the client is then over.
        """

    def close(self) -> None:
        """End the engine."""
