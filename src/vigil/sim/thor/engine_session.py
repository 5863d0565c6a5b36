"""Sending actions to an engine of AI2-THOR's: a mirror follows, and pictures are asked for when they are needed."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vigil.errors import SimulatorError
from vigil.sim.core.sight import HEIGHT, WIDTH
from vigil.sim.thor.engine_client import EngineClient, Event
from vigil.sim.thor.scene_sync import SceneSync
from vigil.sim.thor.segmented_frame import SegmentedFrame

REST_STEP_S = 0.02
REST_EACH_S = 0.1
MAX_REST_STEPS = 50
"""Pieces of time in which things may come to rest; what moves on after these is taken as it is then."""


@dataclass(frozen=True, slots=True)
class ActionOutcome:
    """What THOR said of an action."""

    is_done: bool
    message: str = ""
    returned: Any = None


class EngineSession:
    """One engine with a house."""

    def __init__(self, client: EngineClient, scene_sync: SceneSync) -> None:
        self._client = client
        self.scene_sync = scene_sync
        self._segmented_frame: SegmentedFrame | None = None
        self._frame: np.ndarray | None = None
        self._masks_need_frame = False
        """Whether this engine draws masks only with a frame, as Unity does."""
        self._frame_was_asked = False
        """Whether somebody looked at the last frame, and is likely to look at the next."""

    def do(self, action: str, **arguments: Any) -> ActionOutcome:
        """Carries out an action that may change something, without a picture of it. Raises SimulatorError."""
        self._segmented_frame = self._frame = None
        event = self._client.step(action, **arguments, renderImage=False)
        self.scene_sync.update(event.metadata)
        return _outcome(event)

    def query(self, action: str, **arguments: Any) -> ActionOutcome:
        """Carries out an action that changes nothing. Raises SimulatorError."""
        return _outcome(self._client.step(action, **arguments, renderImage=False))

    def wait_until_at_rest(self) -> None:
        """Lets time pass, always in the same pieces, until all is at rest."""
        for _ in range(MAX_REST_STEPS):
            self._segmented_frame = self._frame = None
            arguments = {"timeStep": REST_STEP_S, "simSeconds": REST_EACH_S}
            metadata = self._client.step("AdvancePhysicsStep", **arguments, renderImage=False).metadata
            self.scene_sync.update(metadata)
            if metadata["isSceneAtRest"]:
                return

    def segmented_frame(self) -> SegmentedFrame:
        """Return which object each pixel shows now."""
        if self._segmented_frame is None:
            self._look(with_frame=self._masks_need_frame or self._frame_was_asked)
            self._frame_was_asked = False
        if self._segmented_frame is None:
            self._masks_need_frame = True
            self._look(with_frame=True)
        if self._segmented_frame is None:
            raise SimulatorError("AI2-THOR's engine sent no instance segmentation. Is it another build?")
        return self._segmented_frame

    def frame(self) -> np.ndarray:
        """Return what the agent sees, (480, 640, 3) uint8."""
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
