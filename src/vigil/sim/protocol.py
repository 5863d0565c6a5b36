"""The protocol that every simulator backend implements. `vigil.env` uses nothing else of a simulator.

`vigil.sim.privileged` adds queries for solvers and authoring.
"""

# pyright: reportReturnType=false

from collections.abc import Iterable
from typing import Protocol, runtime_checkable

import numpy as np

from vigil.base.geometry import Pose
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, Setup, WorldState

WORKER_NUMBER = "VIGIL_WORKER_NUMBER"
"""Environment variable with the number (from 0) of a run's worker; a backend uses it to choose the worker's GPU."""


class Simulator(Protocol):
    """A simulator: it holds one house with an agent, carries out the agent's actions, and draws what the agent sees."""

    name: str
    """Backend name with version, for run headers."""

    def load(self, house: House) -> None:
        """Build the scene of `house`, replacing any earlier one. Raises HouseError."""

    def prepare(self, house: House) -> None:
        """Make a later `load` of `house` faster, if the backend can do this. Any thread may call this at any time."""

    def reset(self, start: Pose, setup: Setup) -> None:
        """Restore the house as loaded, apply `setup` and put the agent at `start`. Raises EpisodeError."""

    def step(self, action: PhysicalAction) -> Effect:
        """Carry out or refuse one action; never raises because of an agent's action."""

    def frame(self) -> np.ndarray:
        """Return the current egocentric frame, (480, 640, 3) uint8."""

    def object_at(self, x: int, y: int) -> str | None:
        """Return the id of the object that a click on the pixel (x right, y down) hits; None for a wall or the sky."""

    def world(self, object_ids: Iterable[str]) -> WorldState:
        """Return the hidden state of the agent and the objects with these ids. Raises EpisodeError on an unknown id."""

    def renderer(self) -> str:
        """Return the GL renderer string; "none" when no frame can be drawn."""

    def close(self) -> None:
        """Release the scene; the simulator can load again."""


@runtime_checkable
class NamesObjects(Protocol):
    """A simulator in which an agent can name the object that it acts on."""

    def pixel_of_named(self, name: str) -> tuple[int, int] | None:
        """Return a pixel (x, y) of the object called `name`; None unless exactly one object in view has this name."""
