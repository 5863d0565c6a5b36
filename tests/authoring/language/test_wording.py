"""Sentences: many for each family, in agreement with what they speak of, and never answering themselves."""

import string

import numpy as np
import pytest

from vigil.authoring.language import wording
from vigil.authoring.language.wording import Act, Asked, opened, order, question, say
from vigil.authoring.review.rules import STANDARD_IN_WORDS
from vigil.goals import STATE_LABELS

RNG = np.random.default_rng(0)
TABLES: dict[str, tuple[str, ...]] = {
    **{name: getattr(wording, name) for name in ("POINT", "APPROACH", "SEARCH", "ORDERS", "SEARCH_ORDERS")},
    **{f"QUESTIONS {name}": table for name, table in wording.QUESTIONS.items()},
    **{f"SEQUENCES {name}": table for name, table in wording.SEQUENCES.items()},
    **{f"CONSTRAINTS {name}": table for name, table in wording.CONSTRAINTS.items()},
}


def slots_in(sentence: str) -> set[str]:
    return {name.lower() for _, name, _, _ in string.Formatter().parse(sentence) if name}


@pytest.mark.parametrize("name", TABLES)
def test_there_are_several_sentences_that_all_end(name: str) -> None:
    table = TABLES[name]
    assert len(set(table)) == len(table) >= 3
    assert all(sentence[-1] in ".?" for sentence in table)
    assert all(slots_in(sentence) for sentence in table)


def test_approaching_says_how_near() -> None:
    assert all(STANDARD_IN_WORDS in sentence for sentence in wording.APPROACH)


def test_slots_are_filled_and_sentences_start_with_a_capital() -> None:
    sentence = say(("{Obstacle} is in the way of {target}.",), RNG, obstacle="the box", target="the desk")
    assert sentence == "The box is in the way of the desk."


@pytest.mark.parametrize(
    ("act", "category", "full", "short"),
    [
        ("open", "Fridge", "open the thing", "open it"),
        ("open", "Dresser", "open the drawers of the thing", "open its drawers"),
        ("turn_on", "Candle", "light the thing", "light it"),
        ("turn_on", "Faucet", "turn on the thing", "turn it on"),
    ],
)
def test_orders_say_what_people_say(act: Act, category: str, full: str, short: str) -> None:
    assert order(act, category, "the thing", RNG) == {"order": full, "order_it": short}


def test_both_verbs_of_an_act_are_used() -> None:
    said = {order("turn_off", "Television", "the television", RNG)["order_it"] for _ in range(30)}
    assert said == {"turn it off", "switch it off"}


def test_several_drawers_are_spoken_of_in_the_plural() -> None:
    asked = {question("is_open", "Dresser", "the dresser", RNG) for _ in range(60)}
    assert "Are the drawers of the dresser open or closed? Report their state." in asked
    assert not any(" is the drawers" in text.lower() or "Is the drawers" in text for text in asked)
    assert opened("Dresser", "the dresser").slots("blocker")["stands"] == "stand"


@pytest.mark.parametrize("category", ["Candle", "Television", "Dresser", "Fridge"])
@pytest.mark.parametrize("asked", ["is_toggled", "is_open"])
def test_questions_name_both_answers_or_none(asked: Asked, category: str) -> None:
    if (asked, category) == ("is_open", "Candle"):
        return
    for _ in range(40):
        words = question(asked, category, "the thing", RNG).lower()
        said = {label for label in STATE_LABELS[asked] if label in words.translate(str.maketrans(".?,", "   ")).split()}
        assert len(said) in (0, 2)
