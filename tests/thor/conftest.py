"""An engine in this process, on rays alone, with the trial house."""

from typing import Any

import pytest

from vigil.assets.database import AssetDatabase
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.scene_editor import SceneEditor
from vigil.sim.thor.units import BODY_HEIGHT_M
from vigil.thor.base.settings import Settings
from vigil.thor.base.world import World
from vigil.thor.engine import EngineResponse, ThorEngine


class Client:
    """Sends actions as AI2-THOR's client does, and keeps the last answer."""

    def __init__(self) -> None:
        editor = make_simulator("fake", assets=AssetDatabase.default())
        assert isinstance(editor, SceneEditor)
        self.world = World(editor, Settings(screen_width=32, screen_height=24))
        self.engine = ThorEngine(self.world)
        self.last: EngineResponse = self.engine.first_response()
        self.sequence = 0

    def send(self, action: str, **arguments: Any) -> dict[str, Any]:
        """Return the acting agent's metadata after an action."""
        self.sequence += 1
        if isinstance(arguments.get("rotation"), float | int):  # so does the client
            arguments["rotation"] = {"y": arguments["rotation"]}
        self.last = self.engine.respond({"action": action, **arguments, "sequenceId": self.sequence})
        found = self.last.metadata
        return found if self.last.is_patch else found["agents"][found["activeAgentId"]]

    def do(self, action: str, **arguments: Any) -> dict[str, Any]:
        """Return the agent's metadata after an action that must succeed."""
        found = self.send(action, **arguments)
        assert found["lastActionSuccess"], found["errorMessage"]
        return found

    def fail(self, action: str, **arguments: Any) -> str:
        """Return the message of an action that must fail."""
        found = self.send(action, **arguments)
        assert not found["lastActionSuccess"]
        return found["errorMessage"]

    def start(self, **settings: Any) -> None:
        """Opens the trial house, with the agent at its start."""
        self.send("Reset", sceneName="Procedural")
        self.do("Initialize", snapToGrid=False, **settings)
        self.do("CreateHouse", house=reference_house().data)

    def stand(self, x: float, z: float, yaw: float = 0.0, horizon: float = 0.0) -> dict[str, Any]:
        """Stands the agent somewhere."""
        place = {"x": x, "y": BODY_HEIGHT_M, "z": z}
        return self.do("TeleportFull", position=place, rotation={"y": yaw}, horizon=horizon, standing=True)

    def get(self, object_id: str) -> dict[str, Any]:
        """Return the metadata of an object."""
        objects = self.do("Pass")["objects"]
        return next(each for each in objects if each["objectId"] == object_id)

    def go_to(self, object_id: str) -> None:
        """Stands the agent where it gets at an object."""
        poses = self.do("GetInteractablePoses", objectId=object_id, maxPoses=1)["actionReturn"]
        self.do("TeleportFull", **poses[0])


@pytest.fixture(scope="module")
def house_client() -> Client:
    client = Client()
    client.start()
    return client


@pytest.fixture
def client(house_client: Client) -> Client:
    house_client.start()
    return house_client
