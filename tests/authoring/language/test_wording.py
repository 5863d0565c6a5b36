"""Sentences: many for each family, in agreement with what they speak of, and never answering themselves."""

import re
import string

import numpy as np
import pytest

from vigil.authoring.families.cr.drafts import CONSTRAINTS
from vigil.authoring.families.da.drafts import APPROACH
from vigil.authoring.families.pg.drafts import POINT
from vigil.authoring.families.sm.drafts import CHAINS, SEQUENCES
from vigil.authoring.families.sv.drafts import BURNING_OR_NOT, QUESTIONS, QueriedState, state_question
from vigil.authoring.families.vs.drafts import SEARCH
from vigil.authoring.language import sentences as tables
from vigil.authoring.language.referring import mentions
from vigil.authoring.language.sentences import FORMS, Sentences
from vigil.authoring.language.wording import (
    PARTICIPLES,
    Act,
    opening_phrase,
    order_slots,
    pronoun_slots,
    say,
)
from vigil.authoring.review.rules import STANDARDS_IN_WORDS
from vigil.authoring.review.wording_rules import ASIDE, ONE_PAIR, STACKED, VAGUE
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import STATE_LABELS

RNG = np.random.default_rng(0)
FAMILY_TABLES: dict[str, dict[str, Sentences]] = {
    "PG": {"point": POINT},
    "DA": {"approach": APPROACH},
    "VS": {"search": SEARCH},
    "SV": {**QUESTIONS, "flame": BURNING_OR_NOT},
    "AI": {"orders": tables.ORDERS},
    "SI": {"search_orders": tables.SEARCH_ORDERS},
    "SM": {**SEQUENCES, **CHAINS},
    "CR": CONSTRAINTS,
}
KINDS = [(family, kind) for family, kinds in FAMILY_TABLES.items() for kind in kinds]
LEAST_OF_FAMILY, LEAST_OF_KIND = 30, 8
ACTS: tuple[Act, ...] = ("open", "close", "turn_on", "turn_off", "pick")
ACTED = {
    "Fridge": "fridge",
    "Dresser": "dresser",
    "Candle": "candle",
    "Faucet": "faucet",
    "Boots": "pair of boots",
    "Mug": "mug",
}
"""Category -> its name, of things of every grammatical sort."""
NAMES = [*ACTED.values(), "safe", "desk", "light switch"]


def slots_in(sentence: str) -> set[str]:
    return {name.lower() for _, name, _, _ in string.Formatter().parse(sentence) if name}


@pytest.mark.parametrize("family", FAMILY_TABLES)
def test_a_family_has_thirty_forms(family: str) -> None:
    forms = [form for table in FAMILY_TABLES[family].values() for form in table.of("all")]
    assert len(set(forms)) == len(forms) >= LEAST_OF_FAMILY


@pytest.mark.parametrize(("family", "kind"), KINDS)
def test_a_kind_has_two_halves_of_like_size(family: str, kind: str) -> None:
    table = FAMILY_TABLES[family][kind]
    assert len(table.of("all")) >= LEAST_OF_KIND
    assert abs(len(table.public) - len(table.held_out)) <= 1
    assert not set(table.public) & set(table.held_out)
    assert set(table.of("public")) | set(table.of("held_out")) == set(table.of("all"))


@pytest.mark.parametrize("forms", FORMS)
@pytest.mark.parametrize(("family", "kind"), KINDS)
def test_sentences_end_speak_of_something_and_vary(family: str, kind: str, forms: tables.Forms) -> None:
    table = FAMILY_TABLES[family][kind].of(forms)
    assert all(sentence[-1] in ".?" for sentence in table)
    assert all(slots_in(sentence) for sentence in table)
    assert len({sentence.split()[0] for sentence in table}) >= 3


def says_its_end(family: Family, sentence: str) -> bool:
    words = FAMILIES[family].end_words
    return words is not None and re.search(words, sentence) is not None


@pytest.mark.parametrize("sentence", APPROACH.of("all"))
def test_approaching_says_how_near_and_how_to_tell(sentence: str) -> None:
    assert any(standard in sentence for standard in STANDARDS_IN_WORDS)
    assert says_its_end("DA", sentence)
    assert not VAGUE.search(sentence)


@pytest.mark.parametrize("sentence", SEARCH.of("all"))
def test_searching_says_how_to_tell(sentence: str) -> None:
    assert says_its_end("VS", sentence)
    assert not VAGUE.search(sentence)


@pytest.mark.parametrize("sentence", CONSTRAINTS["obstacle"].of("all"))
def test_an_obstacle_is_put_aside(sentence: str) -> None:
    assert ASIDE.search(sentence)


@pytest.mark.parametrize("category", ACTED)
@pytest.mark.parametrize("act", ACTS)
def test_orders_are_read_back_as_one_thing(act: Act, category: str) -> None:
    """Whatever the form: in the order, in the passive, once named or twice, without a place that is misread."""
    phrase = f"the {ACTED[category]} in the living room"
    for table in (tables.ORDERS, tables.SEARCH_ORDERS):
        for form in table.of("all"):
            words = order_slots(act, category, phrase, RNG) | pronoun_slots(category)
            text = say((form,), RNG, target=phrase, **words)
            assert {str(found) for found in mentions(text, NAMES)} == {phrase}, text
            assert not STACKED.search(text), text
            assert not ONE_PAIR.search(text), text


@pytest.mark.parametrize("category", ["Boots", "Mug"])
@pytest.mark.parametrize("table", [POINT, APPROACH, SEARCH], ids=["PG", "DA", "VS"])
def test_one_thing_is_read_back(table: Sentences, category: str) -> None:
    phrase = f"the {ACTED[category]} in the bedroom"
    for form in table.of("all"):
        text = say((form,), RNG, target=phrase, **pronoun_slots(category))
        assert {str(found) for found in mentions(text, NAMES)} == {phrase}, text
        assert not STACKED.search(text), text
        assert not ONE_PAIR.search(text), text


ROLES = {"target": "mug", "container": "safe", "source": "desk", "receptacle": "fridge", "obstacle": "pair of boots"}
AS_SAID = {"whole": "container", "blocker": "container"}
"""Slots that speak of a thing by another name than its role's."""


@pytest.mark.parametrize("table", [*SEQUENCES.values(), *CONSTRAINTS.values()], ids=[*SEQUENCES, *CONSTRAINTS])
def test_several_things_are_read_back_one_by_one(table: Sentences) -> None:
    """No two phrases run together to one: "put the mug on the desk" would be the mug on the desk."""
    said = {role: f"the {name}" for role, name in ROLES.items()}
    words = {
        **order_slots("open", "Microwave", "the microwave", RNG),
        **opening_phrase("Safe", said["container"]).slots(),
        **opening_phrase("Safe", said["container"]).slots("blocker"),
        **pronoun_slots("Mug", "target_"),
        **pronoun_slots("Boots", "obstacle_"),
        **said,
    }
    for form in table.of("all"):
        for into in ("into",) if table is SEQUENCES["put_into"] else ("into", "on"):
            text = say((form,), RNG, **{**words, "into": into, "in_": into})
            slots = {AS_SAID.get(slot, slot) for slot in slots_in(form)}
            wanted = {said[slot] for slot in slots if slot in said}
            wanted |= {"the microwave"} if "order" in slots else set()
            assert {str(found) for found in mentions(text, [*ROLES.values(), "microwave"])} == wanted, text
            assert not ONE_PAIR.search(text), text


def test_slots_are_filled_and_sentences_start_with_a_capital() -> None:
    sentence = say(("{Obstacle} is in the way of {target}.",), RNG, obstacle="the box", target="the desk")
    assert sentence == "The box is in the way of the desk."


@pytest.mark.parametrize(
    ("act", "category", "full", "short", "passive"),
    [
        ("open", "Fridge", "open it", "open it", "it has to be opened"),
        (
            "open",
            "LaundryHamper",
            "open the lid of it",
            "open its lid",
            "the lid of it has to be opened",
        ),
        ("turn_on", "Candle", "light it", "light it", "it has to be lit"),
        ("turn_on", "Faucet", "turn on it", "turn it on", "it has to be turned on"),
    ],
)
def test_orders_say_what_people_say(act: Act, category: str, full: str, short: str, passive: str) -> None:
    words = order_slots(act, category, "it", RNG)
    assert (words["order"], words["order_it"]) == (full, short)
    assert "{acted} has to be {done}".format(**words) == passive


def test_a_pair_is_picked_up_as_several_things() -> None:
    said = {order_slots("pick", "Boots", "the pair of boots", RNG)["order_it"] for _ in range(30)}
    assert said == {"pick them up", "take hold of them"}
    assert pronoun_slots("Boots", "obstacle_")["obstacle_blocks"] == "block"
    text = say(
        ("First move {obstacle} aside, which {obstacle_blocks} the way.",),
        RNG,
        obstacle="the pair of boots",
        **pronoun_slots("Boots", "obstacle_"),
    )
    assert text == "First move the pair of boots aside, which block the way."


def test_every_act_has_a_participle() -> None:
    assert set(PARTICIPLES) == set(ACTS)


def test_both_verbs_of_an_act_are_used() -> None:
    said = {order_slots("turn_off", "Television", "the television", RNG)["order_it"] for _ in range(30)}
    assert said == {"turn it off", "switch it off"}


@pytest.mark.parametrize("category", ["Candle", "Television", "Dresser", "Fridge"])
@pytest.mark.parametrize("asked", ["is_toggled", "is_open"])
def test_questions_name_both_answers_or_none(asked: QueriedState, category: str) -> None:
    if (asked, category) == ("is_open", "Candle"):
        return
    for _ in range(120):
        words = state_question(asked, category, "the thing", "all", RNG).lower()
        said = {label for label in STATE_LABELS[asked] if label in words.translate(str.maketrans(".?,", "   ")).split()}
        assert len(said) == 2, words


@pytest.mark.parametrize("forms", ["public", "held_out"])
def test_a_question_is_of_the_half_that_is_asked_for(forms: tables.Forms) -> None:
    said = {state_question("is_toggled", "Television", "the television", forms, RNG) for _ in range(200)}
    wanted = {
        form.format(whole="the television", Whole="The television", it="it")
        for form in QUESTIONS["is_toggled"].of(forms)
    }
    assert said == wanted
