"""A session with AI2-THOR's engine: it sends actions, updates the scene, and requests frames only when needed."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from vigil.errors import SimulatorError
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.thor.scene_sync import SceneSync
from vigil.sim.thor.segmented_frame import Event, SegmentedFrame

REST_STEP_S = 0.02
"""Time step (s) of the physics while objects come to rest."""
REST_EACH_S = 0.1
"""Simulated time (s) that passes with each request while objects come to rest."""
MAX_REST_STEPS = 50
"""Greatest number of requests while objects come to rest. The position that an object has after the last of these
requests is recorded, even if it still moves."""


class EngineClient(Protocol):
    """A client of a started engine: `vigil.sim.thor.guarded_client.GuardedClient`; tests have one in their process."""

    @property
    def is_over(self) -> bool:
        """Whether the engine was closed or has failed."""
        ...

    def open(self, house: dict[str, Any]) -> None:
        """Make the engine build a house, replacing any earlier one. Raises SimulatorError."""

    def step(self, action: str, **arguments: Any) -> Event:
        """Return the event after an action, even if the action was refused.

        Raises SimulatorError; after that, the client cannot be used any more.
        """
        ...

    def close(self) -> None:
        """End the engine."""


@dataclass(frozen=True, slots=True)
class ActionOutcome:
    """THOR's answer to an action."""

    is_done: bool
    """Whether THOR carried the action out."""
    message: str = ""
    """Reason that THOR gave if it did not carry the action out."""
    returned: Any = None
    """Value that the action returned."""


class EngineSession:
    """A session with one engine and one house. Its scene has the state that the engine's last answer reported."""

    def __init__(self, client: EngineClient, scene_sync: SceneSync) -> None:
        self._client = client
        self.scene_sync = scene_sync
        self._segmented_frame: SegmentedFrame | None = None
        self._frame: np.ndarray | None = None
        self._masks_need_frame = False
        """Whether this engine, like Unity, draws masks only together with a frame."""
        self._frame_was_asked = False
        """Whether `frame` was called since the last segmentation; if so, the next frame is likely to be needed, too."""

    def do(self, action: str, **arguments: Any) -> ActionOutcome:
        """Send an action that may change the world, and request no frame; return its outcome. Raises SimulatorError."""
        self._segmented_frame = self._frame = None
        event = self._client.step(action, **arguments, renderImage=False)
        self.scene_sync.update(event.metadata)
        return _outcome(event)

    def query(self, action: str, **arguments: Any) -> ActionOutcome:
        """Send an action that changes nothing; return its outcome. Raises SimulatorError."""
        return _outcome(self._client.step(action, **arguments, renderImage=False))

    def wait_until_at_rest(self) -> None:
        """Let time pass in equal steps until everything is at rest, or until `MAX_REST_STEPS` steps have passed."""
        for _ in range(MAX_REST_STEPS):
            self._segmented_frame = self._frame = None
            arguments = {"timeStep": REST_STEP_S, "simSeconds": REST_EACH_S}
            metadata = self._client.step("AdvancePhysicsStep", **arguments, renderImage=False).metadata
            self.scene_sync.update(metadata)
            if metadata["isSceneAtRest"]:
                return

    def segmented_frame(self) -> SegmentedFrame:
        """Return the segmentation of what the agent sees now. Raises SimulatorError."""
        if self._segmented_frame is None:
            self._look(with_frame=self._masks_need_frame or self._frame_was_asked)
            self._frame_was_asked = False
        if self._segmented_frame is None:
            self._masks_need_frame = True
            self._look(with_frame=True)
        if self._segmented_frame is None:
            raise SimulatorError(
                "AI2-THOR's engine did not send an instance segmentation. Is it another build than this client expects?"
            )
        return self._segmented_frame

    def frame(self) -> np.ndarray:
        """Return the frame that the agent sees now, (480, 640, 3) uint8. Raises SimulatorError."""
        self._frame_was_asked = True
        if self._frame is None:
            self._look(with_frame=True)
        if self._frame is None or self._frame.shape[:2] != (HEIGHT, WIDTH):
            raise SimulatorError(f"AI2-THOR's engine sent no frame of {WIDTH} x {HEIGHT} pixels.")
        return self._frame

    def _look(self, *, with_frame: bool) -> None:
        event = self._client.step("Pass", renderImage=with_frame, renderInstanceSegmentation=True)
        if event.instance_segmentation_frame is not None and self._segmented_frame is None:
            self._segmented_frame = SegmentedFrame(event, self.scene_sync.in_hand())
        if event.frame is not None:
            self._frame = np.ascontiguousarray(event.frame[..., :3])


def _outcome(event: Event) -> ActionOutcome:
    metadata = event.metadata
    is_done = bool(metadata["lastActionSuccess"])
    return ActionOutcome(is_done, metadata["errorMessage"] or "", metadata["actionReturn"])
