"""Cameras at any place in a scene, and their images: for programs that edit a scene, never in scored episodes."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vigil.base.geometry import Vec3

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
