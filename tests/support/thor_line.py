"""This project's engine in this process in the place of AI2-THOR's client: what the back end needs of that, no more."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np

from vigil.assets.sizes import AssetDatabase
from vigil.errors import SimulatorError
from vigil.sim import make_simulator
from vigil.sim.staging import Stage
from vigil.sim.thor.simulator import ThorSimulator
from vigil.sim.thor.start import INITIALIZE
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import Engine

WIDTH, HEIGHT = INITIALIZE["width"], INITIALIZE["height"]
RAISED = ("InvalidAction", "MissingArguments", "AmbiguousAction", "InvalidArgument")


class InProcess:
    """A `vigil.sim.thor.line.Line`."""

    def __init__(self, house: dict[str, Any], backend: str = "mujoco") -> None:
        stage = make_simulator(backend, assets=AssetDatabase.default(), quality="fast")
        assert isinstance(stage, Stage)
        self.engine = Engine(World(stage, Settings(screen_width=WIDTH, screen_height=HEIGHT)))
        self.stage, self.is_over = stage, False
        self.sent: list[dict[str, Any]] = []
        self._metadata: dict[str, Any] = {}
        self.open(house)

    def open(self, house: dict[str, Any]) -> None:
        self.step("Reset", sceneName="Procedural")
        settings = {name: value for name, value in INITIALIZE.items() if name not in ("width", "height")}
        for action, arguments in (("Initialize", settings), ("CreateHouse", {"house": house})):
            event = self.step(action, **arguments)
            if not event.metadata["lastActionSuccess"]:
                raise SimulatorError(event.metadata["errorMessage"])

    def step(self, action: str, **arguments: Any) -> Any:
        if self.is_over:
            raise SimulatorError("gone")
        sent = json.loads(json.dumps({"action": action, **arguments}))
        self.sent.append(sent)
        answer = self.engine.answer({**sent, "sequenceId": len(self.sent)})
        said = answer.metadata if answer.is_patch else answer.metadata["agents"][0]
        self._metadata = {**self._metadata, **said}
        assert self._metadata["errorCode"] not in RAISED, self._metadata["errorMessage"]
        images = {image.kind: image.data for image in answer.images}
        return SimpleNamespace(
            metadata=self._metadata,
            frame=_picture(images.get("image"), np.uint8),
            depth_frame=_picture(images.get("depth"), np.float32),
            instance_segmentation_frame=_picture(images.get("ids"), np.uint8),
            color_to_object_id={tuple(each["color"]): each["name"] for each in self._metadata["colors"] or ()},
        )

    def close(self) -> None:
        if not self.is_over:
            self.stage.close()
        self.is_over = True


def _picture(data: bytes | None, kind: type) -> np.ndarray | None:
    if data is None:
        return None
    return np.frombuffer(data, dtype=kind).reshape(HEIGHT, WIDTH, -1).squeeze()[::-1]


def in_process(assets: AssetDatabase | None = None, backend: str = "mujoco") -> ThorSimulator:
    """Returns the back end over this project's engine, without AI2-THOR's client."""
    return ThorSimulator("thor/in-process", lambda house: InProcess(house, backend), assets or AssetDatabase.default())
