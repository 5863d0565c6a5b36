"""Referring expressions and what they fit."""

from vigil.authoring.language.referring import (
    DescribedThing,
    Phrase,
    mentions,
    phrase_for,
    referents,
    resolve_mentions,
    without_repeats,
)

RED = DescribedThing("Mug|1", "Mug", "mug", ("red",), "room|1", "kitchen", "Desk|1", "desk")
NAVY = DescribedThing("Mug|2", "Mug", "mug", ("navy",), "room|1", "kitchen", "Counter|1", "countertop")
BLACK = DescribedThing("Mug|3", "Mug", "mug", ("black",), "room|2", "bedroom", "Counter|1", "countertop")
DESK = DescribedThing("Desk|1", "Desk", "desk", ("brown",), "room|1", "kitchen")
COUNTER = DescribedThing("Counter|1", "CounterTop", "countertop", (), "room|1", "kitchen")
WINE = DescribedThing("WineBottle|1", "WineBottle", "wine bottle", ("green",), "room|1", "kitchen")
BOTTLE = DescribedThing("Bottle|1", "Bottle", "bottle", ("blue",), "room|1", "kitchen")


def test_one_of_a_kind_needs_no_more() -> None:
    assert str(phrase_for(DESK, [RED, NAVY, DESK])) == "the desk"


def test_colour_tells_apart_only_clearly_different_colours() -> None:
    everything = [RED, NAVY, BLACK, DESK, COUNTER]
    assert str(phrase_for(RED, everything)) == "the red mug"
    assert str(phrase_for(NAVY, everything)) != "the navy mug"


def test_support_or_room_when_colour_does_not_help() -> None:
    assert str(phrase_for(BLACK, [NAVY, BLACK, COUNTER])) == "the mug in the bedroom"
    green = DescribedThing("Mug|4", "Mug", "mug", ("navy",), "room|1", "kitchen", "Desk|1", "desk")
    assert str(phrase_for(green, [NAVY, green, DESK, COUNTER])) == "the mug on the desk"


def test_a_support_that_is_not_clear_helps_nobody() -> None:
    other = DescribedThing("Desk|2", "Desk", "desk", (), "room|1", "kitchen")
    mug = DescribedThing("Mug|5", "Mug", "mug", ("navy",), "room|1", "kitchen", "Desk|1", "desk")
    assert phrase_for(mug, [NAVY, mug, DESK, other, COUNTER]) is None


def test_a_general_name_fits_the_special_thing() -> None:
    assert {item.id for item in referents(Phrase("bottle"), [WINE, BOTTLE])} == {"WineBottle|1", "Bottle|1"}
    assert [item.id for item in referents(Phrase("wine bottle"), [WINE, BOTTLE])] == ["WineBottle|1"]


def test_mentions_are_read_back() -> None:
    names = ["mug", "wine bottle", "bottle", "desk", "fridge"]
    text = "Take the red mug on the desk, then open the fridge in the kitchen and find the wine bottle."
    assert mentions(text, names) == [
        Phrase("mug", colour="red", support="desk"),
        Phrase("fridge", room="kitchen"),
        Phrase("wine bottle"),
    ]


def test_every_phrase_is_read_back_as_itself() -> None:
    for phrase in (
        Phrase("mug"),
        Phrase("mug", colour="light blue"),
        Phrase("mug", support="desk"),
        Phrase("mug", room="living room"),
    ):
        assert mentions(f"Find {phrase}.", ["mug", "desk"]) == [phrase]


def test_doors_are_called_by_the_rooms_that_they_join() -> None:
    first = DescribedThing("door|1|2", "Doorway", "door between the bathroom and the bedroom")
    second = DescribedThing("door|2|3", "Doorway", "door between the bedroom and the kitchen")
    front = DescribedThing("door|1|9", "Doorway", "door")
    everything = [first, second, front]
    phrase = phrase_for(first, everything)
    assert str(phrase) == "the door between the bathroom and the bedroom"
    assert mentions(f"Close {phrase}.", [item.name for item in everything]) == [phrase]
    assert len(referents(Phrase("door"), everything)) == 3
    assert mentions("Close the door, please.", [first.name]) == [Phrase("door")]


def test_a_part_of_a_thing_is_no_mention_of_another() -> None:
    assert mentions("Open the door of the fridge.", ["door", "fridge"]) == [Phrase("fridge")]


def test_an_apple_is_told_by_no_colour_that_others_share() -> None:
    green, olive = (
        DescribedThing(f"Apple|{n}", "Apple", "apple", (c,)) for n, c in enumerate(("green", "light green"))
    )
    assert phrase_for(green, [green, olive]) is None


IN_KITCHEN = DescribedThing("Safe|1", "Safe", "safe", (), "room|1", "kitchen")
IN_BEDROOM = DescribedThing("Safe|2", "Safe", "safe", (), "room|2", "bedroom")
NAMES = ["safe", "mug", "desk"]


def test_a_place_is_said_once() -> None:
    text = "The safe in the kitchen is shut. Open the safe in the kitchen."
    assert without_repeats(text, NAMES) == "The safe in the kitchen is shut. Open the safe."
    both = "Take it from the safe in the kitchen to the safe in the bedroom. Open the safe in the kitchen."
    assert without_repeats(both, NAMES) == both
    assert without_repeats("Open the red mug. The red mug?", NAMES) == "Open the red mug. The red mug?"


def test_what_has_been_singled_out_may_be_named_again() -> None:
    everything = [IN_KITCHEN, IN_BEDROOM, DESK]
    again = resolve_mentions(mentions("The safe in the kitchen is shut. Open the safe.", NAMES), everything)
    assert [[item.id for item in meant] for meant in again] == [["Safe|1"], ["Safe|1"]]
    first = resolve_mentions(mentions("Open the safe. It is the safe in the kitchen.", NAMES), everything)
    assert len(first[0]) == 2
    two = "The safe in the kitchen and the safe in the bedroom: open the safe."
    assert len(resolve_mentions(mentions(two, NAMES), everything)[2]) == 2


def test_what_is_in_the_hand_needs_no_place() -> None:
    put_down = mentions("Put down the mug.", NAMES)
    assert resolve_mentions(put_down, [NAVY, BLACK], NAVY) == [[NAVY]]
    assert len(resolve_mentions(put_down, [NAVY, BLACK])[0]) == 2
    assert (
        len(
            resolve_mentions(
                mentions("Put down the mug on the countertop.", [*NAMES, "countertop"]), [NAVY, BLACK], NAVY
            )[0]
        )
        == 2
    )
