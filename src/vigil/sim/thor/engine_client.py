"""The protocol of a client of AI2-THOR's engine: a client sends actions and returns events.

`vigil.sim.thor.guarded_client.GuardedClient` implements it on top of AI2-THOR's client. Tests use a client that calls
an engine in the same process.
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
    """Colour (height, width, 3 or 4) uint8 that stands for the object at each pixel; None when not requested."""
    color_to_object_id: dict[tuple[int, ...], str]
    """Colour in the segmentation -> id of its object."""


class EngineClient(Protocol):
    """A client of a started engine."""

    @property
    def is_over(self) -> bool:
        """Whether the engine was closed or has failed."""

    def open(self, house: dict[str, Any]) -> None:
        """Make the engine build a house, replacing any earlier one. Raises SimulatorError."""

    def step(self, action: str, **arguments: Any) -> Event:
        """Return the event after an action, even if the action was refused.

        Raises SimulatorError; after that, the client cannot be used any more.
        """

    def close(self) -> None:
        """End the engine."""
