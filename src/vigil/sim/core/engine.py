"""The protocol between the engine-neutral simulator and an engine, which draws and casts rays for it."""

# pyright: reportReturnType=false

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vigil.base.geometry import Pose, Vec3
from vigil.scene.things import Scene
from vigil.sim.scene_editor import CameraImage, CameraView, Layer

BEARS_OPEN = 1
"""Bit of `RayHits.roles` for a part that shows whether the thing is open."""
BEARS_TOGGLE = 2
"""Bit of `RayHits.roles` for a part that shows whether the thing is switched on."""


@dataclass(frozen=True, slots=True, eq=False)
class RayHits:
    """What each of n rays hits first."""

    things: np.ndarray
    """Index of the thing in the scene's order (n,) int32; -1 for structure without an id, and for nothing."""
    roles: np.ndarray
    """Bits BEARS_OPEN and BEARS_TOGGLE of the part that was hit (n,) uint8."""
    distances: np.ndarray
    """Distance from the origin in metres (n,) float64; inf where nothing was hit."""


class Engine(Protocol):
    """An engine that draws a scene and casts rays into it, without a world state."""

    name: str
    """Name with version, for run headers."""

    def load(self, scene: Scene) -> None:
        """Build `scene`, replacing any earlier one."""

    def prepare(self, scene: Scene) -> None:
        """Make a later `load` of an equal scene faster, if the engine can.

        May be called in another thread at any time.
        """

    def update(self, scene: Scene, ids: set[str]) -> None:
        """Copy the present positions and states of the things with these ids into the engine."""

    def cast(
        self,
        origin: Vec3,
        directions: np.ndarray,
        *,
        through_glass: bool,
        only: str | None = None,
        without: Sequence[str] = (),
        within_m: float = math.inf,
    ) -> RayHits:
        """Return the first hits of rays along unit `directions` (n, 3).

        Rays never hit held things, absent things and the things in `without`. With `only`, they hit no other thing than
        that. Hits beyond `within_m` may be missed. At equal distance structure counts as hit first, then things in the
        scene's order.
        """

    def draw(self, agent: Pose, held: str | None) -> np.ndarray:
        """Return the egocentric frame, (480, 640, 3) uint8, with the held thing at the bottom centre."""

    def render_view(self, view: CameraView, layers: frozenset[Layer], held: str | None) -> CameraImage:
        """Return the requested layers of what a camera sees; the thing `held` is drawn in the viewer's hand."""

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when there is no GL."""

    def close(self) -> None:
        """Release the scene."""
