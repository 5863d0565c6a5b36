"""The protocol of an engine, which draws and casts rays for the engine-neutral simulator."""

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
"""Bit of `RayHits.roles`: the part that was hit shows whether the thing is open."""
BEARS_TOGGLE = 2
"""Bit of `RayHits.roles`: the part that was hit shows whether the thing is switched on."""


@dataclass(frozen=True, slots=True, eq=False)
class RayHits:
    """What each of n rays hits first."""

    things: np.ndarray
    """Index (n,) int32 of the thing hit, in the scene's order; -1 for structure (e.g. a wall), and for no hit."""
    roles: np.ndarray
    """Bits BEARS_OPEN and BEARS_TOGGLE (n,) uint8 of the part that was hit."""
    distances: np.ndarray
    """Distance (n,) float64 in metres from the ray's origin; inf where nothing was hit."""


class Engine(Protocol):
    """An engine that draws a scene and casts rays into it. The simulator applies the rules and changes the states."""

    name: str
    """Name with version, as written in run headers."""

    def load(self, scene: Scene) -> None:
        """Build `scene`, replacing any earlier one."""

    def prepare(self, scene: Scene) -> None:
        """Make a later `load` of an equal scene faster, if the engine can do this.

        Any thread may call this at any time.
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
        """Return what rays along unit `directions` (n, 3) hit first.

        Rays never hit held things, absent things, or the things in `without`. If `only` is given, they hit only the
        thing with this id. Hits beyond `within_m` may be missing. At equal distance, structure (e.g. a wall) comes
        before things, and things come in the scene's order.
        """

    def draw(self, agent: Pose, held: str | None) -> np.ndarray:
        """Return the egocentric frame, (480, 640, 3) uint8; the held thing is drawn at the bottom centre."""

    def render_view(self, view: CameraView, layers: frozenset[Layer], held: str | None) -> CameraImage:
        """Return the requested layers of a camera's image; the thing `held` is drawn in the hand."""

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when there is no GL."""

    def close(self) -> None:
        """Release the scene."""
