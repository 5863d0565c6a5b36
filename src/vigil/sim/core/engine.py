"""The seam between the engine-neutral simulator and what draws and casts rays for it."""

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
BEARS_TOGGLE = 2


@dataclass(frozen=True, slots=True, eq=False)
class RayHits:
    """What n rays met."""

    things: np.ndarray
    """(n,) int32: index of the thing in the scene's order; -1 for structure without an id or nothing."""
    roles: np.ndarray
    """(n,) uint8: bits BEARS_OPEN and BEARS_TOGGLE of the part that was hit."""
    distances: np.ndarray
    """(n,) float64 metres from the origin; inf where nothing was met."""


class Engine(Protocol):
    """Draws a scene and casts rays into it; keeps no world state of its own."""

    name: str
    """With version, for run headers."""

    def load(self, scene: Scene) -> None:
        """Builds `scene`, replacing any earlier one."""

    def prepare(self, scene: Scene) -> None:
        """Makes a later `load` of an equal scene quicker, where it can. May be called in another thread meanwhile."""

    def update(self, scene: Scene, ids: set[str]) -> None:
        """Takes over the present places and states of the named things."""

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
        """Casts rays along unit `directions` (n, 3). Held and absent things are never met; with `only` nothing but
        that thing is, and the things `without` are not. What is farther than `within_m` may be passed over.

        Of what is equally far, structure is met first, then things in the scene's order.
        """

    def draw(self, agent: Pose, held: str | None) -> np.ndarray:
        """Return the egocentric frame, (480, 640, 3) uint8, with the held thing at the bottom centre."""

    def render_view(self, view: CameraView, layers: frozenset[Layer], held: str | None) -> CameraImage:
        """Return what a camera sees; with `held`, that thing is drawn in the hand of who looks."""

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when there is no GL."""

    def close(self) -> None:
        """Frees the scene."""
