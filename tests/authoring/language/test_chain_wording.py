"""Sentences of longer sequences: enough of them, and inside is said where inside is meant."""

import pytest

from vigil.authoring.language.chain_wording import CHAINS
from vigil.authoring.language.referring import Phrase, mentions
from vigil.authoring.language.wording import asks_inside

LEAST_FORMS = 8
ALWAYS_INSIDE = ("put_and_close", "out_of_into")
NEVER_INSIDE = ("swap",)
NAMES = {
    "target": "the apple",
    "second": "the egg",
    "receptacle": "the sofa",
    "source": "the desk",
    "container": "the safe",
    "whole": "the safe",
    "other": "the fridge",
    "it": "it",
    "order_a": "turn on the television",
    "order_b": "close the laptop",
}


def said(template: str, into: str) -> list[str]:
    slots = NAMES | {"into": into}
    capitals = {name.capitalize(): text[:1].upper() + text[1:] for name, text in slots.items()}
    return [sentence.format(**slots, **capitals) for sentence in CHAINS[template]]


@pytest.mark.parametrize("template", CHAINS)
def test_there_are_enough_different_forms(template: str) -> None:
    assert len(set(CHAINS[template])) >= LEAST_FORMS


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
            assert sentence[0].isupper()
            assert sentence[-1] in ".?"
