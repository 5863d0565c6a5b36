"""The table of actions: what the engine has and what it says it has not."""

import inspect

import pytest

from vigil.thor.actions.action import Action
from vigil.thor.actions.missing import MISSING
from vigil.thor.actions.table import ACTIONS, MODULES


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
