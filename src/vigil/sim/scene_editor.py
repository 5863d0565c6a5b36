"""What a program that directs a scene may do besides `vigil.sim.privileged`: pictures from anywhere, changes any time.

The AI2-THOR-compatible engine (`vigil.thor`) works on it. Nothing that is scored does: an episode is played by
`vigil.sim.protocol.Simulator` alone.
"""

# pyright: reportReturnType=false

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import Intent
from vigil.protocol.world import Effect, Setup
from vigil.sim.privileged import PrivilegedSimulator

Layer = Literal["rgb", "depth", "things"]

NOTHING = -1
"""In the layer `things`: sky, or structure of no kind that the engine knows."""
STRUCTURES = ("wall", "floor", "ceiling")
"""In the layer `things`, kind k of these is the number -2 - k."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """A camera: where it is, its yaw and pitch (deg; positive looks down), vertical field of view, size in pixels."""

    eye: Vec3
    yaw: float
    pitch: float
    fovy_deg: float
    width: int
    height: int


@dataclass(frozen=True, slots=True, eq=False)
class CameraImage:
    """What a camera sees, the first row on top; a layer that was not asked for is None."""

    rgb: np.ndarray | None = None
    """(height, width, 3) uint8."""
    depth: np.ndarray | None = None
    """(height, width) float32: metres along the camera's axis; inf where nothing is."""
    things: np.ndarray | None = None
    """(height, width) int32: index of the thing in the scene's order, or a negative number (`STRUCTURES`)."""


@runtime_checkable
class SceneEditor(PrivilegedSimulator, Protocol):
    """A simulator whose world can be changed at any time, not only by a reset."""

    def stand(self, pose: Pose) -> None:
        """Stands the agent at a pose, with what it holds; nothing checks that the body fits."""

    def apply_changes(self, setup: Setup) -> None:
        """Changes the world as it is now. Raises EpisodeError, and has then changed nothing."""

    def restore_object(self, object_id: str) -> None:
        """Puts a thing that was taken out of the scene back to where it was. Raises EpisodeError."""

    def apply_intent(self, intent: Intent, object_id: str, point: Vec3) -> Effect:
        """Does what a click on a point of an object would do, however far it is. Raises EpisodeError."""

    def open_to(self, object_id: str, openness: float) -> Effect:
        """Opens or closes an object to an openness in 0..1, or refuses it. Raises EpisodeError."""

    def reachable(self, start: Vec3, step_m: float) -> np.ndarray:
        """Return the places (n, 2) of x, z on a grid through `start` to which the body gets along grid edges."""

    def blocker(self, start: Vec3, end: Vec3) -> str | None:
        """Return the id of what stops the body on a straight way, "exterior" outside of the rooms; None when free."""

    def meets(self, eye: Vec3, directions: np.ndarray, *, through_glass: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return for unit directions (n, 3) the thing that each meets first (index or -1) and the distance (m)."""

    def render_view(self, view: CameraView, layers: frozenset[Layer], *, with_hand: bool) -> CameraImage:
        """Return what a camera sees; `with_hand` draws what is held as the agent sees it."""
