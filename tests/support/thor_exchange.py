"""Exchange of AI2-THOR's client with the engine: each request, and the parts of its answer that are compared.

`python -m tests.support.thor_exchange` writes the golden file again with the real client, if that is installed.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

GOLDEN = Path(__file__).parents[1] / "golden" / "thor_exchange.jsonl"
SETTINGS = {"gridSize": 0.25, "snapToGrid": False, "visibilityDistance": 2.0, "renderInstanceSegmentation": True}
SIZE = {"width": 304, "height": 300}
KEPT = ("lastAction", "lastActionSuccess", "errorMessage", "errorCode", "actionReturn", "agent", "inventoryObjects")
STEPS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("TeleportFull", {"position": {"x": 5.2, "y": 0.901, "z": 3.0}, "rotation": 0, "horizon": 20, "standing": True}),
    ("OpenObject", {"objectId": "Fridge|1"}),
    ("PickupObject", {"objectId": "Lettuce|1", "forceAction": True}),
    ("CloseObject", {"objectId": "Fridge|1", "forceAction": True}),
    ("RotateLeft", {"degrees": 90.0}),
    ("MoveAhead", {"moveMagnitude": 1.0}),
    ("MoveAhead", {"moveMagnitude": 9.0}),
    ("LookUp", {}),
    ("LookUp", {"degrees": 30}),
    ("GetReachablePositions", {"gridSize": 1.0}),
    ("GetObjectInFrame", {"x": 0.5, "y": 0.5}),
    ("PutObject", {"objectId": "DiningTable|1", "forceAction": True}),
    ("ToggleObjectOn", {"objectId": "FloorLamp|1", "forceAction": True}),
    ("PlaceObjectAtPoint", {"objectId": "Apple|1", "position": {"x": 3.0, "y": 0.9225, "z": 4.6}}),
    ("DisableObject", {"objectId": "Statue|1"}),
    ("GetShortestPath", {"objectId": "Mug|1", "position": {"x": 4.0, "y": 0.0, "z": 1.5}}),
    ("Crouch", {}),
    ("DropHandObject", {}),
)


def kept(sent: dict[str, Any], metadata: dict[str, Any]) -> dict[str, Any]:
    """Return a line of the golden file: an action and its answer, with hashes in place of objects and houses."""
    house = sent.get("house")
    names = (
        "lastAction",
        "lastActionSuccess",
        "errorMessage",
        "errorCode",
        "actionReturn",
        "agent",
        "inventoryObjects",
    )
    response = {name: _rounded(metadata[name]) for name in names}
    objects = [{**each, "visibleBounds2D": None} for each in metadata["objects"]]  # the client adds this field
    return {
        "sent": sent if house is None else {**sent, "house": _hash(house)},
        "answer": {**response, "objects": len(objects), "sha256": _hash(_rounded(objects))},
    }


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 5) + 0.0
    if isinstance(value, dict):
        return {key: _rounded(each) for key, each in value.items()}
    return [_rounded(each) for each in value] if isinstance(value, list) else value


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def golden() -> list[dict[str, Any]]:
    """Return the lines of the golden file."""
    return [json.loads(line) for line in GOLDEN.read_text(encoding="utf-8").splitlines()]


def played(house: dict[str, Any], command: str) -> list[dict[str, Any]]:
    """Return the lines of an exchange of the real client with an engine."""
    from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.fifo_server import FifoServer  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent

    sent: list[dict[str, Any]] = []
    lines: list[dict[str, Any]] = []

    send, receive = FifoServer.send, FifoServer.receive

    def overheard_send(server: Any, action: dict[str, Any]) -> None:
        send(server, action)
        sent.append(json.loads(json.dumps(action)))

    def overheard_receive(server: Any, timeout: float | None = None) -> Any:
        event = receive(server, timeout)
        if sent:
            lines.append(kept(sent[-1], json.loads(json.dumps(event.metadata))))
        return event

    FifoServer.send, FifoServer.receive = overheard_send, overheard_receive
    try:
        controller = Controller(local_executable_path=command, scene=house, **SIZE, **SETTINGS)
        for action, arguments in STEPS:
            controller.step(action, **arguments)
        controller.stop()
    finally:
        FifoServer.send, FifoServer.receive = send, receive
    return lines


if __name__ == "__main__":
    from vigil.sim.conformance.reference_house import reference_house
    from vigil.thor.launch import thor_engine

    found = played(reference_house().data, thor_engine(backend="fake"))
    GOLDEN.write_text("".join(json.dumps(line, sort_keys=True) + "\n" for line in found), encoding="utf-8")
