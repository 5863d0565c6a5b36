"""What things are called by who sees them: cabinets under worktops, colours of seats, shelves, rooms of a kind."""

from collections.abc import Callable

import numpy as np
import pytest

from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.palette import nearest_word
from vigil.assets.making import MAKERS
from vigil.authoring.language.appearance import (
    MIN_SEAT_COLOUR_SHARE,
    colour_shares,
    has_misleading_name,
    min_colour_share,
)
from vigil.authoring.language.referring import DescribedThing, Phrase, items_as_seen, mentions, phrase_for, referents
from vigil.base.geometry import Vec3
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.sim.privileged import PrivilegedSimulator

STOOL = Vec3(0.5, 0.45, 0.35)
PADDED = 4
"""A seed of a stool with white legs under a brown seat."""
TWO_BEDROOMS = ("5", 7105)
CABINET = DescribedThing("Cabinet|1", "Cabinet", "cabinet", ("red",), "room|1", "kitchen")
COUNTER = DescribedThing(
    "CounterTop|1", "CounterTop", "countertop", ("grey",), "room|1", "kitchen", alternative_names=("cabinet",)
)
DRESSER = DescribedThing("Dresser|1", "Dresser", "dresser", (), "room|2", "bedroom")


def made(maker: Callable[..., Asset], size: Vec3, seed: int) -> Asset:
    return maker(size, np.random.default_rng(seed), ())


def test_a_counter_with_doors_answers_to_cabinet() -> None:
    assert {item.id for item in referents(Phrase("cabinet"), [CABINET, COUNTER])} == {"Cabinet|1", "CounterTop|1"}
    assert str(phrase_for(CABINET, [CABINET, COUNTER])) == "the red cabinet"
    assert str(phrase_for(COUNTER, [CABINET, COUNTER])) == "the countertop"


def test_a_counter_is_no_dresser() -> None:
    """What looks like a cabinet is not taken for what a cabinet is taken for."""
    assert str(phrase_for(DRESSER, [DRESSER, COUNTER])) == "the dresser"


def test_nothing_is_called_by_a_name_that_does_not_suit_it() -> None:
    assert has_misleading_name("CounterTop", "bathroom")
    assert not has_misleading_name("CounterTop", "kitchen")
    strip = DescribedThing(
        "CounterTop|2", "CounterTop", "countertop", (), "room|3", "bathroom", has_misleading_name=True
    )
    assert phrase_for(strip, [strip, DRESSER]) is None


def test_a_room_is_not_named_where_there_are_two() -> None:
    here, there = (
        DescribedThing(f"Pen|{n}", "Pen", "pen", (), f"room|{n}", room, is_room_one=n == 1)
        for n, room in enumerate(("bedroom", "kitchen"))
    )
    assert phrase_for(here, [here, there]) is None
    assert str(phrase_for(there, [here, there])) == "the pen in the kitchen"


def test_what_lies_on_an_open_shelf_is_said_to_lie_on_it() -> None:
    stand = DescribedThing("TVStand|1", "TVStand", "TV stand", (), "room|1", "bedroom")
    phone = DescribedThing(
        "CellPhone|1", "CellPhone", "cell phone", (), "room|1", "bedroom", "TVStand|1", "TV stand", is_on_shelf=True
    )
    other = DescribedThing("CellPhone|2", "CellPhone", "cell phone", (), "room|1", "bedroom", "Bed|1", "bed")
    phrase = phrase_for(phone, [phone, other, stand])
    assert str(phrase) == "the cell phone on a shelf of the TV stand"
    assert mentions(f"Find {phrase}.", ["cell phone", "TV stand"]) == [Phrase("cell phone", support="TV stand")]


def test_the_legs_of_a_stool_do_not_give_it_its_colour() -> None:
    shares = colour_shares(made(MAKERS["Stool"], STOOL, PADDED))
    assert made(MAKERS["Stool"], STOOL, PADDED).tags == {"white"}
    assert 0 < shares["white"] < MIN_SEAT_COLOUR_SHARE == min_colour_share("Stool")
    assert sum(shares.values()) == pytest.approx(1.0)


def test_the_nearest_word_is_found_however_far() -> None:
    assert nearest_word(250, 250, 250) == "white"
    assert nearest_word(60, 100, 180) == "blue"


def test_washbasins_stand_on_painted_cabinets_or_not() -> None:
    tall = [made(MAKERS["Sink"], Vec3(0.6, 0.85, 0.5), seed) for seed in range(12)]
    painted = [any(part.material.startswith("paint/") for part in asset.parts) for asset in tall]
    assert any(painted)
    assert not all(painted)


def test_a_house_is_described_as_it_looks(simulator: PrivilegedSimulator) -> None:
    spec, seed = TWO_BEDROOMS
    simulator.load(generate(seed, spec_for(spec)))
    scene = simulator.scene()
    items = items_as_seen(scene).values()
    named = [room.room_type for room in scene.rooms]
    for item in items:
        assert item.category != "CounterTop" or "cabinet" in item.alternative_names
        room_type = next((room.room_type for room in scene.rooms if room.id == item.room_id), None)
        assert item.is_room_one == (room_type is None or named.count(room_type) == 1)
        assert not (item.is_inside and item.is_on_shelf)
    assert any(not item.is_room_one for item in items)
    assert any(item.is_on_shelf for item in items)
