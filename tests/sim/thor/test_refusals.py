"""What THOR says when it refuses becomes the refusal that it is by the protocol."""

import logging

import pytest

from vigil.sim.core.handling import InteractionResult
from vigil.sim.thor.refusals import MESSAGES, UNKNOWN, is_out_of_sight, refusal_of
from vigil.thor.actions.handling import REFUSALS


@pytest.mark.parametrize("code", REFUSALS)
def test_what_our_engine_says_is_understood(code):
    message = REFUSALS[code].format(thing="Fridge|1", blocker="Box|1", held="Apple")
    assert refusal_of(message).refusal == code


@pytest.mark.parametrize(
    ("message", "blocker"),
    [
        ("Openable object collided with Box|1", "Box|1"),
        ("InvalidOperationException: Openable object collided with Box|1. trace: at Foo", "Box|1"),
        ("Openable object collided with FPSController", "agent"),
        ("door|2|4 is blocking Agent 0 from moving by (0.2500, 0.0000, 0.0000).", "door|2|4"),
        ("Wall_1: Mug|1 is blocking the Agent from moving by (0, 0, 1) with Apple|1", "Mug|1"),
        ("InvalidOperationException: Scene bounds do not contain target position (1, 2, 3). trace: ", "exterior"),
        ("object is not toggleable.", None),
    ],
)
def test_what_was_in_the_way_is_named(message, blocker):
    assert refusal_of(message).blocked_by == blocker


def test_exceptions_with_traces_are_understood():
    thrown = "NullReferenceException: Target object not found within the specified visibility.. trace: at X.cs:12"
    assert refusal_of(thrown).refusal == "nothing_hit"
    assert is_out_of_sight(thrown)
    assert not is_out_of_sight("No valid positions to place object found")


def test_what_is_unknown_is_told_and_taken_for_one_thing(caplog):
    with caplog.at_level(logging.WARNING):
        assert refusal_of("The moon is in the way") == InteractionResult(UNKNOWN)
    assert "The moon is in the way" in caplog.text


def test_no_row_is_hidden_by_one_before_it():
    parts = [part for part, _ in MESSAGES]
    for number, part in enumerate(parts):
        assert not any(earlier in part for earlier in parts[:number]), part
