"""The protocol of a simulator whose world can be edited at any time and whose images can be drawn from any camera.

The AI2-THOR-compatible engine (`vigil.thor`) uses this protocol. Scored episodes use only
`vigil.sim.protocol.Simulator`.
"""

# pyright: reportReturnType=false

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.protocol.actions import Intent
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup
from vigil.sim.privileged import PrivilegedSimulator

Layer = Literal["rgb", "depth", "things"]
"""Name of a layer of a camera's image: colours, depth, or the thing at each pixel."""

NOTHING = -1
"""Number in the layer `things` for sky, and for structure that the engine assigns to none of `STRUCTURES`."""
STRUCTURES = ("wall", "floor", "ceiling")
"""Kinds of structure. In the layer `things`, the kind with index k has the number -2 - k."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """A camera's position, direction, field of view and image size."""

    eye: Vec3
    yaw: float
    """Yaw (deg), measured like an agent's rotation."""
    pitch: float
    """Pitch (deg); a positive pitch looks down."""
    fovy_deg: float
    """Vertical field of view (deg)."""
    width: int
    """Width of the image in pixels."""
    height: int
    """Height of the image in pixels."""
    roll: float = 0.0
    """Roll (deg); a positive roll turns the camera anticlockwise, so that what it sees turns clockwise."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraImage:
    """The layers of a camera's image, with the top row first; a layer that was not requested is None."""

    rgb: np.ndarray | None = None
    """Colours (height, width, 3) uint8."""
    depth: np.ndarray | None = None
    """Depth (height, width) float32 in metres along the camera's axis; inf where nothing is."""
    things: np.ndarray | None = None
    """Index of the thing at each pixel, in the scene's order, (height, width) int32; negative for walls and sky."""


@runtime_checkable
class SceneEditor(PrivilegedSimulator, Protocol):
    """A simulator whose world can be changed at any time, not only by a reset."""

    def stand(self, pose: Pose) -> None:
        """Put the agent, with what it holds, at a pose. Whether the body fits there is not checked."""

    def apply_changes(self, setup: Setup) -> None:
        """Apply a setup to the world as it is now. Doors, lids and drawers may then reach through walls and containers.

        Raises EpisodeError; in that case nothing has changed.
        """

    def restore_object(self, object_id: str) -> None:
        """Put an object that was removed from the scene back where it was. Raises EpisodeError on an unknown id."""

    def apply_intent(self, intent: Intent, object_id: str, point: Vec3) -> Effect:
        """Do what a click on a point of an object would do, at any distance. Raises EpisodeError on an unknown id."""

    def open_to(self, object_id: str, openness: float) -> Effect:
        """Open or close an object to `openness` (0 to 1), or refuse. Raises EpisodeError on an unknown id."""

    def redecorate(self, house: House) -> None:
        """Load a house that differs from the present one only in materials and lights; things keep their states."""

    def move_hand(self, by: Vec3, rotation: Vec3) -> None:
        """Move the held object by `by` (m to the agent's right, up and ahead), and turn it to `rotation`."""

    def reachable(self, start: Vec3, step_m: float, yaw: float = 0.0) -> np.ndarray:
        """Return the places (n, 2; x and z) that the body can reach on a grid through `start`, along grid edges.

        The grid is turned by `yaw` (deg).
        """

    def blocker(self, start: Vec3, end: Vec3) -> str | None:
        """Return the id of what stops the body on the straight way from `start` to `end`; None if nothing does.

        If only the edge of the rooms stops the body, return "exterior". An obstacle that the middle of the body is
        already inside at `start` never stops the body.
        """

    def meets(self, eye: Vec3, directions: np.ndarray, *, through_glass: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return two arrays (n,) for rays along unit directions (n, 3): what each ray meets first, and how far (m).

        A thing is given by its index in the scene's order. The number -1 stands for structure (e.g. a wall) and for
        nothing.
        """

    def render_view(self, view: CameraView, layers: frozenset[Layer], *, with_hand: bool) -> CameraImage:
        """Return the requested layers of a camera's image; `with_hand` draws the held object as the agent sees it."""
