"""What the back end needs of AI2-THOR's client: one engine that takes actions and answers with events.

`vigil.sim.thor.guarded_client.GuardedClient` is one, over the real client; tests have one that calls an engine
in-process.
"""

# pyright: reportReturnType=false

from typing import Any, Protocol

import numpy as np


class Event(Protocol):
    """What the client returns for an action."""

    metadata: Any
    frame: np.ndarray | None
    """(height, width, 3) uint8."""
    depth_frame: np.ndarray | None
    """(height, width) float32: metres along the camera's axis."""
    instance_segmentation_frame: np.ndarray | None
    """(height, width, 3 or 4) uint8: the colour of the object that each pixel shows."""
    color_to_object_id: dict[tuple[int, ...], str]


class EngineClient(Protocol):
    """A started engine."""

    @property
    def is_over(self) -> bool:
        """Whether it was closed, or has failed."""

    def open(self, house: dict[str, Any]) -> None:
        """Has a house built, in place of the one before. Raises SimulatorError."""

    def step(self, action: str, **arguments: Any) -> Event:
        """Return the event after an action, also one that failed. Raises SimulatorError, and is then over."""

    def close(self) -> None:
        """Ends the engine."""
