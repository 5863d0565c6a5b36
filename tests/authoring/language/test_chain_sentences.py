"""Sentences of longer sequences: enough of them in either half, and inside is said where inside is meant."""

import numpy as np
import pytest

from vigil.authoring.families.sm.drafts import CHAINS
from vigil.authoring.language.referring import Phrase, mentions
from vigil.authoring.language.wording import asks_inside, opening_phrase, pronoun_slots, say
from vigil.authoring.review.wording_rules import ONE_PAIR, STACKED

LEAST_FORMS = 10
ALWAYS_INSIDE = ("put_and_close", "out_of_into")
NEVER_INSIDE = ("swap",)
NAMES = {
    "target": "the apple",
    "second": "the egg",
    "receptacle": "the sofa",
    "source": "the desk",
    "container": "the safe",
    "other": "the fridge",
    "order_a": "turn on the television",
    "order_b": "close the laptop",
    **pronoun_slots("Apple", "target_"),
    **opening_phrase("Safe", "the safe").slots(),
}


def said(template: str, into: str, **names: str) -> list[str]:
    slots = NAMES | names | {"into": into}
    return [say((form,), np.random.default_rng(0), **slots) for form in CHAINS[template].of("all")]


@pytest.mark.parametrize("template", CHAINS)
def test_there_are_enough_different_forms(template: str) -> None:
    assert len(set(CHAINS[template].of("all"))) >= LEAST_FORMS


@pytest.mark.parametrize("template", CHAINS)
def test_inside_is_said_where_it_is_meant_and_only_there(template: str) -> None:
    if template not in NEVER_INSIDE:
        assert all(asks_inside(sentence) for sentence in said(template, "into"))
    if template not in ALWAYS_INSIDE:
        assert not [sentence for sentence in said(template, "onto") if asks_inside(sentence)]


@pytest.mark.parametrize("template", CHAINS)
def test_no_thing_is_said_to_be_where_it_is_still_to_be_put(template: str) -> None:
    """ "Put the apple on the sofa" would be read as the apple that lies on the sofa."""
    things = ["apple", "egg", "sofa", "desk", "safe", "fridge", "television", "laptop"]
    for into in ("into", "onto"):
        for sentence in said(template, into):
            assert all(phrase == Phrase(phrase.name) for phrase in mentions(sentence, things)), sentence


@pytest.mark.parametrize("role", ["receptacle", "source", "container", "other"])
@pytest.mark.parametrize("template", CHAINS)
def test_places_do_not_follow_each_other(template: str, role: str) -> None:
    placed = f"{NAMES[role]} in the kitchen"
    names = {role: placed, "whole": placed} if role == "container" else {role: placed}
    for into in ("into", "onto"):
        for sentence in said(template, into, **names):
            assert not STACKED.search(sentence), sentence


@pytest.mark.parametrize("template", ["two_to_one", "swap", "three_acts"])
def test_what_comes_in_pairs_is_spoken_of_as_several(template: str) -> None:
    for sentence in said(template, "onto", target="the pair of boots", **pronoun_slots("Boots", "target_")):
        assert not ONE_PAIR.search(sentence), sentence


@pytest.mark.parametrize("template", CHAINS)
def test_what_is_opened_agrees_in_number_with_what_is_said_of_it(template: str) -> None:
    plural = opening_phrase("Dresser", "the dresser").slots()
    for sentence in said(template, "into", container="the dresser", **plural):
        assert "drawers of the dresser is " not in sentence
