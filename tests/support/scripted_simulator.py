"""Scripted stand-in for a simulator: it plays back worlds and effects, and fails at a chosen call."""

from collections.abc import Iterable

import numpy as np

from vigil.base.geometry import Pose
from vigil.errors import SimulatorError
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, ObjectState, Setup, WorldState


class ScriptedSimulator:
    """Simulator for which each physical action returns the next scripted effect and world."""

    name = "stand-in 1"

    def __init__(self, objects: dict[str, ObjectState], effects: Iterable[Effect] = (), fails_at: str = "") -> None:
        self.objects = objects
        self.effects = list(effects)
        self.fails_at = fails_at
        """The call that raises SimulatorError: load, reset, step, world or frame."""
        self.calls: list[str] = []
        self.actions: list[PhysicalAction] = []

    def load(self, house: House) -> None:
        self._call("load")

    def prepare(self, house: House) -> None:
        self._call("prepare")

    def reset(self, start: Pose, setup: Setup) -> None:
        self._call("reset")
        self.agent, self.setup = start, setup
        self.moment = 0

    def step(self, action: PhysicalAction) -> Effect:
        self._call("step")
        self.actions.append(action)
        self.moment += 1
        return self.effects.pop(0) if self.effects else Effect()

    def frame(self) -> np.ndarray:
        self._call("frame")
        return np.full((480, 640, 3), self.moment, dtype=np.uint8)

    def object_at(self, x: int, y: int) -> str | None:
        return None

    def world(self, object_ids: Iterable[str]) -> WorldState:
        self._call("world")
        moved = {"box_distance_m": float(self.moment)}
        return WorldState(
            agent=self.agent, objects={name: self.objects[name].model_copy(update=moved) for name in object_ids}
        )

    def renderer(self) -> str:
        return "none"

    def close(self) -> None:
        self._call("close")

    def _call(self, name: str) -> None:
        self.calls.append(name)
        if name == self.fails_at:
            raise SimulatorError(f"{name} broke")
