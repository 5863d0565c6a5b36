"""A simulator that costs nothing: one picture, a world where nothing moves."""

from collections.abc import Iterable

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Box, Pose, Vec3
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.house import House
from vigil.protocol.world import Effect, ObjectState, Setup, WorldState

PLACE = Vec3(0.0, 1.0, 3.0)
THING = ObjectState(
    category="Thing",
    position=PLACE,
    box=Box(center=PLACE, size=Vec3(1.0, 1.0, 1.0)),
    visible=True,
    visible_px=500,
    open_px=300,
    box_distance_m=2.5,
    center_distance_m=3.0,
)


class StillSimulator:
    name = "still/1"

    def __init__(self) -> None:
        rows, columns = np.mgrid[0:480, 0:640]
        self._frame = np.stack([rows // 2, columns // 3, (rows + columns) // 5], axis=2).astype(np.uint8)
        self._start = Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0)

    def load(self, house: House) -> None:
        """Nothing to load."""

    def prepare(self, house: House) -> None:
        """Nothing to prepare."""

    def reset(self, start: Pose, setup: Setup) -> None:
        self._start = start

    def step(self, action: PhysicalAction) -> Effect:
        return Effect()

    def frame(self) -> np.ndarray:
        return self._frame

    def object_at(self, x: int, y: int) -> str | None:
        return None

    def world(self, object_ids: Iterable[str]) -> WorldState:
        return WorldState(agent=self._start, objects=dict.fromkeys(object_ids, THING))

    def renderer(self) -> str:
        return "none"

    def close(self) -> None:
        """Nothing to free."""


def make(assets: AssetDatabase, quality: str) -> StillSimulator:
    return StillSimulator()
