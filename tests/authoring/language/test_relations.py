"""Relations: said only where they hold clearly for one thing, and read back as they are said."""

from dataclasses import replace

import pytest

from vigil.authoring.language.disambiguation import disambiguating_phrases, look_alikes
from vigil.authoring.language.referring import (
    DescribedThing,
    Phrase,
    mentions,
    referents,
    resolve_mentions,
    without_repeats,
)
from vigil.authoring.language.relations import RELATIONS
from vigil.base.geometry import Box, Vec3

FLOOR_M = 0.4


def thing(
    name: str, x: float, *, z: float = 0.0, side: float = 0.4, y: float = FLOOR_M / 2, room: str = "1", **facts: str
) -> DescribedThing:
    """A thing with its middle at x, z; square on the floor."""
    category = "".join(word.capitalize() for word in name.split())
    colours = (facts["colour"],) if "colour" in facts else ()
    box = Box(center=Vec3(x, y, z), size=Vec3(side, FLOOR_M, side))
    return DescribedThing(f"{category}|{x:g}|{z:g}", category, name, colours, room, "kitchen", box=box)


FRIDGE = thing("fridge", 0.0, side=0.8)


def meant(relation: str, *stools: DescribedThing) -> list[str]:
    phrase = Phrase("ottoman", relation=relation, anchor="fridge")
    return [item.id for item in referents(phrase, [FRIDGE, *stools])]


def test_next_to_holds_for_what_touches_almost_and_for_nothing_near_that() -> None:
    beside, away, near = thing("ottoman", 0.8), thing("ottoman", 3.0), thing("ottoman", -1.4)
    assert meant("next to", beside, away) == [beside.id]
    assert set(meant("beside", beside, near)) == {beside.id, near.id}


@pytest.mark.parametrize("only", [thing("ottoman", 1.4), thing("ottoman", 0.7, y=1.2), thing("ottoman", 0.5)])
def test_next_to_is_not_said_of_what_is_too_far_too_high_or_overlaps(only: DescribedThing) -> None:
    assert meant("next to", only, thing("ottoman", 5.0)) == []


def test_closest_needs_all_others_to_be_farther_by_a_factor() -> None:
    first, almost, far = thing("ottoman", 1.1), thing("ottoman", -1.5), thing("ottoman", 4.0)
    assert meant("closest to", first, far) == [first.id]
    assert set(meant("nearest to", first, almost, far)) == {first.id, almost.id}


def test_closest_is_not_said_across_the_room_or_through_a_wall() -> None:
    assert meant("closest to", thing("ottoman", 3.5), thing("ottoman", 9.0)) == []
    assert meant("closest to", thing("ottoman", 1.0, room="2"), thing("ottoman", 9.0)) == []


def test_under_is_what_lies_for_the_most_part_beneath() -> None:
    desk = thing("desk", 0.0, side=1.2, y=0.7)
    below, aside = thing("box", 0.2), thing("box", 2.0)
    phrase = Phrase("box", relation="under", anchor="desk")
    assert referents(phrase, [desk, below, aside]) == [below]
    assert referents(phrase, [desk, thing("box", 0.65), aside]) == []


def test_a_relation_to_one_of_two_things_tells_nothing_apart() -> None:
    other = thing("fridge", 9.0, side=0.8)
    stools = [thing("ottoman", 0.8), thing("ottoman", 3.0)]
    assert referents(Phrase("ottoman", relation="next to", anchor="fridge"), [FRIDGE, other, *stools]) == stools


@pytest.mark.parametrize("relation", RELATIONS)
def test_phrases_with_relations_are_read_back(relation: str) -> None:
    phrase = Phrase("ottoman", colour="red", relation=relation, anchor="coffee table")
    assert mentions(f"Walk up to {phrase}, please.", ["ottoman", "coffee table", "table"]) == [phrase]


def test_a_second_mention_needs_no_relation() -> None:
    near, far = thing("ottoman", 0.8), thing("ottoman", 4.0)
    names = ["ottoman", "fridge"]
    text = without_repeats("Go to the ottoman next to the fridge and open the ottoman next to the fridge.", names)
    assert text == "Go to the ottoman next to the fridge and open the ottoman."
    assert resolve_mentions(mentions(text, names), [FRIDGE, near, far]) == [[near], [near]]


def test_no_relation_to_what_two_things_answer_to_by_their_looks() -> None:
    cabinet, counter = (
        thing("cabinet", 0.0, side=0.8),
        replace(thing("counter top", 9.0), alternative_names=("cabinet",)),
    )
    stools = [thing("ottoman", 0.8), thing("ottoman", 4.0)]
    assert disambiguating_phrases(stools[0], [cabinet, *stools])
    assert disambiguating_phrases(stools[0], [cabinet, counter, *stools]) == []


def test_what_nobody_would_call_by_its_name_is_not_told_apart_nor_an_anchor() -> None:
    red, green = thing("ottoman", 0.8, colour="red"), thing("ottoman", 4.0, colour="green")
    misnamed = replace(FRIDGE, has_misleading_name=True)
    assert {str(phrase) for phrase in disambiguating_phrases(red, [misnamed, red, green])} == {"the red ottoman"}
    assert disambiguating_phrases(replace(red, has_misleading_name=True), [FRIDGE, red, green]) == []


def test_look_alikes_are_told_apart_by_colour_or_by_relation() -> None:
    red = thing("ottoman", 0.8, colour="red")
    green = thing("ottoman", 4.0, colour="green")
    everything = [FRIDGE, red, green]
    said = {str(phrase) for phrase in disambiguating_phrases(red, everything)}
    assert said == {"the red ottoman", "the ottoman next to the fridge", "the ottoman closest to the fridge"}
    assert look_alikes(red, everything) == [green]
    assert all(referents(phrase, everything) == [red] for phrase in disambiguating_phrases(red, everything))


def test_what_has_no_look_alike_is_not_told_apart() -> None:
    assert disambiguating_phrases(thing("ottoman", 0.8), [FRIDGE, thing("ottoman", 0.8)]) == []


def test_large_things_are_not_found_by_small_or_movable_ones() -> None:
    bed, other, lamp = thing("bed", 0.0, side=1.8), thing("bed", 6.0, side=1.8), thing("desk lamp", 1.2, side=0.25)
    assert disambiguating_phrases(bed, [bed, other, lamp]) == []
    stools = [thing("ottoman", 0.0), thing("ottoman", 5.0)]
    assert disambiguating_phrases(stools[0], [*stools, thing("chair", 0.5, side=0.5)]) == []
