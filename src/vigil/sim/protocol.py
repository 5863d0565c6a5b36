"""The protocol that every simulator backend keeps. It is all that `vigil.env` knows of a simulator.

What solvers and authoring may ask besides is in `vigil.sim.privileged`.
"""

# pyright: reportReturnType=false

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup, WorldState

WORKER_NUMBER = "VIGIL_WORKER_NUMBER"
"""Environment variable: which of a run's workers this process is, from 0. Backends share out devices by it."""


class Simulator(Protocol):
    """A house that one can walk through, act in and look at."""

    name: str
    """Backend name with version, for run headers."""

    def load(self, house: House) -> None:
        """Builds the scene of `house`, replacing any earlier one. Raises HouseError."""

    def prepare(self, house: House) -> None:
        """Makes a later `load` of `house` quicker, where a backend can. May be called in another thread meanwhile."""

    def reset(self, start: Pose, setup: Setup) -> None:
        """Restores the house as loaded, applies `setup`, stands the agent at `start`. Raises EpisodeError."""

    def step(self, action: PhysicalAction) -> Effect:
        """Carries out one action, or refuses it; never raises for what an agent did."""

    def frame(self) -> np.ndarray:
        """Return the current egocentric frame, (480, 640, 3) uint8."""

    def object_at(self, x: int, y: int) -> str | None:
        """Return the id of the object under a pixel; None for structure and sky."""

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the agent's and the named objects' hidden state. Raises EpisodeError on an unknown id."""

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when no frame can be drawn."""

    def close(self) -> None:
        """Frees what the scene holds; the simulator can load again."""
