"""Which words give away a constraint that is to be found."""

import pytest

from vigil.authoring.drafting.untold_constraints import act_of
from vigil.authoring.language.untold import is_untold, says_constraint, untold
from vigil.authoring.language.wording import CONSTRAINTS, ORDERS
from vigil.goals import Goal, ObjectHeld, ObjectInState

KINDS = {
    "obstacle": "object_moved",
    "swing": "object_moved",
    "leaf": "object_closed",
    "close_first": "object_closed",
    "stop_first": "object_off",
    "hand": "object_released",
}
SLOTS = {
    "order": "do it",
    "order_it": "do it",
    "Order": "Do it",
    "target": "the safe",
    "Target": "The safe",
    "obstacle": "the ball",
    "Obstacle": "The ball",
    "whole": "the safe",
    "Whole": "The safe",
    "blocker": "the fridge",
    "Blocker": "The fridge",
    "is": "is",
    "they": "it",
    "it": "it",
    "its": "its",
    "stands": "stands",
    "blocks": "blocks",
}
OF_THEMSELVES = ("close_first", "stop_first")
"""Kinds whose constraint is about the target."""


def test_untold_kinds_are_known_by_their_names() -> None:
    assert is_untold(untold("leaf"))
    assert not is_untold("leaf")


@pytest.mark.parametrize("words", KINDS)
def test_every_told_sentence_would_give_its_constraint_away(words: str) -> None:
    name = None if words in OF_THEMSELVES else {"leaf": "fridge"}.get(words, "ball")
    told = [sentence.format(**SLOTS) for sentence in CONSTRAINTS[words]]
    given = [sentence for sentence in told if list(says_constraint(sentence, KINDS[words], name))]
    silent = set(told) - set(given)
    assert len(given) >= len(told) - 1, silent  # "Shut the safe, and then ..." names no constraint, only an act
    if name is not None:
        assert not silent


@pytest.mark.parametrize("kind", sorted(set(KINDS.values())))
def test_orders_alone_give_nothing_away(kind: str) -> None:
    order = "pick up the mug" if kind == "object_released" else "turn on the lamp"
    order = "open the safe" if kind == "object_off" else order
    for sentence in ORDERS:
        said = sentence.format(order=order, Order=order.capitalize(), order_it=order, target="the safe")
        assert not list(says_constraint(said, kind, "ball")), said


@pytest.mark.parametrize(
    ("goal", "act"),
    [
        (ObjectHeld(object_id="a"), "pick"),
        (ObjectInState(object_id="a", state="is_open"), "open"),
        (ObjectInState(object_id="a", state="is_open", value=False), "close"),
        (ObjectInState(object_id="a", state="is_toggled"), "turn_on"),
        (ObjectInState(object_id="a", state="is_toggled", value=False), "turn_off"),
    ],
)
def test_the_act_is_read_off_the_goal(goal: Goal, act: str) -> None:
    assert act_of(goal) == act
