"""Which words give away a constraint that is to be found."""

import numpy as np
import pytest

from vigil.authoring.drafting.proposals import act_of
from vigil.authoring.families.cr.drafts import CONSTRAINTS
from vigil.authoring.language.implicit_constraints import constraint_giveaways, implicit_kind, is_implicit
from vigil.authoring.language.sentences import ORDERS
from vigil.authoring.language.wording import VERBS, Act, opening_phrase, order_slots, pronoun_slots, say
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
    **opening_phrase("Safe", "the safe").slots(),
    **opening_phrase("Fridge", "the fridge").slots("blocker"),
    **pronoun_slots("Safe", "target_"),
    **pronoun_slots("BasketBall", "obstacle_"),
    **dict.fromkeys(("order", "order_it"), "do it"),
}
OF_THEMSELVES = ("close_first", "stop_first")
"""Kinds whose constraint is about the target."""
ORDERED: dict[str, tuple[Act, str]] = {"object_released": ("pick", "mug"), "object_off": ("open", "safe")}
"""Kind of constraint -> an act that it may prevent, and on what; a lamp is turned on otherwise."""


def test_implicit_kinds_are_known_by_their_names() -> None:
    assert is_implicit(implicit_kind("leaf"))
    assert not is_implicit("leaf")


@pytest.mark.parametrize("words", KINDS)
def test_every_told_sentence_would_give_its_constraint_away(words: str) -> None:
    name = None if words in OF_THEMSELVES else {"leaf": "fridge"}.get(words, "ball")
    told = [say((form,), RNG, **SLOTS) for form in CONSTRAINTS[words].of("all")]
    given = [sentence for sentence in told if list(constraint_giveaways(sentence, KINDS[words], name))]
    silent = set(told) - set(given)
    assert len(given) >= len(told) - 1, silent  # "Shut the safe, and then ..." names no constraint, only an act
    if name is not None:
        assert not silent


@pytest.mark.parametrize("kind", sorted(set(KINDS.values())))
def test_orders_alone_give_nothing_away(kind: str) -> None:
    act, name = ORDERED.get(kind, ("turn_on", "lamp"))
    words = order_slots(act, "Mug", f"the {name}", RNG) | pronoun_slots("Mug")
    for form in ORDERS.of("all"):
        said = say((form,), RNG, target=f"the {name}", **words)
        assert not list(constraint_giveaways(said, kind, "ball")), said


@pytest.mark.parametrize("verb", VERBS["pick"])
def test_no_way_of_asking_to_pick_up_speaks_of_a_full_hand(verb: str) -> None:
    assert not list(constraint_giveaways(f"Please {verb.format('the mug')}.", "object_released", "ball"))


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
