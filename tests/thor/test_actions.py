"""The table of actions: what the engine has and what it says it has not."""

import inspect
from dataclasses import replace

import pytest

from vigil.errors import EpisodeError
from vigil.thor.actions.action import Action
from vigil.thor.actions.missing import MISSING
from vigil.thor.actions.table import ACTIONS, MODULES

NAMING = {"objectId", "objectIds", "objectPoses"}
"""Parameters that name objects."""


def test_no_action_is_named_twice():
    rows = [action.name for module in MODULES for action in module.ACTIONS]
    assert len(rows) == len(set(rows)) == len(ACTIONS)
    assert not set(rows) & set(MISSING)


@pytest.mark.parametrize("action", ACTIONS.values(), ids=lambda action: action.name)
def test_a_handler_takes_the_parameters_of_its_row(action: Action):
    signature = inspect.signature(action.handler)
    signature.bind("world", **dict.fromkeys(action.parameters))
    for names in action.required:
        assert set(names) <= set(action.parameters)
        signature.bind("world", **dict.fromkeys(names))


@pytest.mark.parametrize("name", MISSING)
def test_what_is_missing_is_unknown(client, name: str):
    found = client.send(name)
    assert found["errorCode"] == "InvalidAction"
    assert found["errorMessage"] == f"Invalid action: {name} ({MISSING[name]})"


@pytest.mark.parametrize("name", [name for name, action in ACTIONS.items() if NAMING & set(action.parameters)])
def test_no_action_on_a_floor_ends_the_engine(client, name):
    client.stand(3.5, 2.5, horizon=60.0)
    place, still = {"x": 3.0, "y": 0.5, "z": 2.0}, {"x": 0.0, "y": 0.0, "z": 0.0}
    pose = {"objectName": "room|1", "position": place, "rotation": still}
    values = {"objectId": "room|1", "objectIds": ["room|1"], "objectPoses": [pose], "position": place}
    values |= {"rotation": still, "moveMagnitude": 10.0, "fillLiquid": "water"}
    sent = {key: value for key, value in values.items() if key in ACTIONS[name].parameters}
    assert client.send(name, **sent)["errorCode"] is None
    if "forceAction" in ACTIONS[name].parameters:
        client.send(name, **sent, forceAction=True)
    assert client.get("room|1")["objectType"] == "Floor"


def test_an_object_that_the_world_refuses_is_a_failed_action(client, monkeypatch):
    def refused(world):
        raise EpisodeError("no such object here")

    monkeypatch.setitem(ACTIONS, "Pass", replace(ACTIONS["Pass"], handler=refused))
    assert client.fail("Pass") == "no such object here"
