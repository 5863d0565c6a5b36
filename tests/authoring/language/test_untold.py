"""Which words give away a constraint that is to be found."""

import numpy as np
import pytest

from vigil.authoring.drafting.untold_constraints import act_of
from vigil.authoring.language.constraint_sentences import CONSTRAINTS
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.untold import is_untold, says_constraint, untold
from vigil.authoring.language.wording import VERBS, Act, opened, order, say, spoken_of
from vigil.protocol.goals import Goal, ObjectHeld, ObjectInState

KINDS = {
    "obstacle": "object_moved",
    "swing": "object_moved",
    "leaf": "object_closed",
    "close_first": "object_closed",
    "stop_first": "object_off",
    "hand": "object_released",
}
RNG = np.random.default_rng(0)
SLOTS = {
    "target": "the safe",
    "obstacle": "the ball",
    **opened("Safe", "the safe").slots(),
    **opened("Fridge", "the fridge").slots("blocker"),
    **spoken_of("Safe", "target_"),
    **spoken_of("BasketBall", "obstacle_"),
    **dict.fromkeys(("order", "order_it"), "do it"),
}
OF_THEMSELVES = ("close_first", "stop_first")
"""Kinds whose constraint is about the target."""
ORDERED: dict[str, tuple[Act, str]] = {"object_released": ("pick", "mug"), "object_off": ("open", "safe")}
"""Kind of constraint -> an act that it may prevent, and on what; a lamp is turned on otherwise."""


def test_untold_kinds_are_known_by_their_names() -> None:
    assert is_untold(untold("leaf"))
    assert not is_untold("leaf")


@pytest.mark.parametrize("words", KINDS)
def test_every_told_sentence_would_give_its_constraint_away(words: str) -> None:
    name = None if words in OF_THEMSELVES else {"leaf": "fridge"}.get(words, "ball")
    told = [say((form,), RNG, **SLOTS) for form in CONSTRAINTS[words].of("all")]
    given = [sentence for sentence in told if list(says_constraint(sentence, KINDS[words], name))]
    silent = set(told) - set(given)
    assert len(given) >= len(told) - 1, silent  # "Shut the safe, and then ..." names no constraint, only an act
    if name is not None:
        assert not silent


@pytest.mark.parametrize("kind", sorted(set(KINDS.values())))
def test_orders_alone_give_nothing_away(kind: str) -> None:
    act, name = ORDERED.get(kind, ("turn_on", "lamp"))
    words = order(act, "Mug", f"the {name}", RNG) | spoken_of("Mug")
    for form in ORDERS.of("all"):
        said = say((form,), RNG, target=f"the {name}", **words)
        assert not list(says_constraint(said, kind, "ball")), said


@pytest.mark.parametrize("verb", VERBS["pick"])
def test_no_way_of_asking_to_pick_up_speaks_of_a_full_hand(verb: str) -> None:
    assert not list(says_constraint(f"Please {verb.format('the mug')}.", "object_released", "ball"))


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
