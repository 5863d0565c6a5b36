"""This project's engine in place of AI2-THOR's client, in the same process; only the parts that the backend needs."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.errors import SimulatorError
from vigil.sim import make_simulator
from vigil.sim.scene_editor import SceneEditor
from vigil.sim.thor.simulator import ThorSimulator
from vigil.sim.thor.start import INITIALIZE
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import ThorEngine

WIDTH, HEIGHT = INITIALIZE["width"], INITIALIZE["height"]
RAISED = ("InvalidAction", "MissingArguments", "AmbiguousAction", "InvalidArgument")


class InProcess:
    """A `vigil.sim.thor.engine_session.EngineClient`."""

    def __init__(self, house: dict[str, Any], backend: str = "mujoco") -> None:
        editor = make_simulator(backend, assets=AssetDatabase.default(), quality="fast")
        assert isinstance(editor, SceneEditor)
        self.engine = ThorEngine(World(editor, Settings(screen_width=WIDTH, screen_height=HEIGHT)))
        self.editor, self.is_over = editor, False
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
        response = self.engine.respond({**sent, "sequenceId": len(self.sent)})
        said = response.metadata if response.is_patch else response.metadata["agents"][0]
        self._metadata = {**self._metadata, **said}
        assert self._metadata["errorCode"] not in RAISED, self._metadata["errorMessage"]
        images = {image.kind: image.data for image in response.images}
        return SimpleNamespace(
            metadata=self._metadata,
            frame=_picture(images.get("image"), np.uint8),
            depth_frame=_picture(images.get("depth"), np.float32),
            instance_segmentation_frame=_picture(images.get("ids"), np.uint8),
            color_to_object_id={tuple(each["color"]): each["name"] for each in self._metadata["colors"] or ()},
        )

    def close(self) -> None:
        if not self.is_over:
            self.editor.close()
        self.is_over = True


class UnityLike(InProcess):
    """The same client with behaviour of Unity that our engine does not have.

    Pivots are at the bottom of objects. An object's receptacles include the floor and the receptacle below its own.
    Masks come only with a frame. After a change objects are not at rest immediately.
    """

    restless = 0

    def step(self, action: str, **arguments: Any) -> Any:
        if action == "TeleportObject":
            half = self._half(arguments["objectId"])
            arguments["position"] = {**arguments["position"], "y": arguments["position"]["y"] + half}
        if action != "Initialize":
            arguments = {**arguments, "renderInstanceSegmentation": False}
        event = super().step(action, **arguments)
        self.restless = max(0, self.restless - 1) if action == "AdvancePhysicsStep" else 3
        event.metadata = self._told(event.metadata)
        return event

    def _half(self, name: str) -> float:
        thing = self.editor.scene().things.get(name)
        return 0.0 if thing is None else thing.asset.size.y / 2  # floors are not among the things

    def _told(self, metadata: dict[str, Any]) -> dict[str, Any]:
        objects = [self._object(each, metadata["objects"]) for each in metadata["objects"]]
        return {**metadata, "objects": objects, "isSceneAtRest": self.restless == 0}

    def _object(self, said: dict[str, Any], others: list[dict[str, Any]]) -> dict[str, Any]:
        x, y, z = (said["position"][axis] for axis in "xyz")
        below = list(said["parentReceptacles"] or ())
        for name in below:
            below += next((each["parentReceptacles"] or () for each in others if each["objectId"] == name), ())
        return {
            **said,
            "position": {"x": x, "y": y - self._half(said["objectId"]), "z": z},
            "parentReceptacles": [*reversed(below), "Floor|1"],
        }


def _picture(data: bytes | None, kind: type) -> np.ndarray | None:
    if data is None:
        return None
    return np.frombuffer(data, dtype=kind).reshape(HEIGHT, WIDTH, -1).squeeze()[::-1]


def in_process(assets: AssetDatabase | None = None, backend: str = "mujoco") -> ThorSimulator:
    """Return the THOR backend over this project's engine, without AI2-THOR's client."""
    return ThorSimulator("thor/in-process", lambda house: InProcess(house, backend), assets or AssetDatabase.default())


class DiesOnce(InProcess):
    """The same client, except that the first instance ends in the middle of an episode."""

    started = 0
    """Number of instances so far."""

    def __init__(self, house: dict[str, Any]) -> None:
        super().__init__(house, "fake")
        DiesOnce.started += 1
        self.left = 3 if DiesOnce.started == 1 else None

    def step(self, action: str, **arguments: Any) -> Any:
        left = getattr(self, "left", None)
        if left is not None and action == "RotateRight":
            self.left = left - 1
            if not self.left:
                self.close()
        return super().step(action, **arguments)


def dies_once(assets: AssetDatabase, quality: str) -> ThorSimulator:
    """Return such a backend, as a `SimulatorFactory`."""
    del quality
    return ThorSimulator("thor/dies-once", DiesOnce, assets)
