"""The catalogue: complete, consistent, and of the affordances that AI2-THOR gives."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from vigil.assets.catalog import CATALOG, CEILING, FLOOR, ROOM_TYPES, WALL, Category, category_of
from vigil.assets.making import MAKERS, register
from vigil.errors import SettingError

CATEGORIES = sorted(CATALOG.values(), key=lambda row: row.name)
STRUCTURE = {"Doorway", "Doorframe", "Window"}


@pytest.mark.parametrize("row", CATEGORIES, ids=lambda row: row.name)
def test_row_is_consistent(row: Category) -> None:
    assert CATALOG[row.name] is row
    assert all(0.001 <= side <= 3.0 for side in row.typical_size)
    assert 0.0 <= row.size_spread <= 0.25
    assert row.rooms
    assert set(row.rooms) <= set(ROOM_TYPES)
    assert row.rests_on
    assert set(row.rests_on) <= {*CATALOG, FLOOR, WALL, CEILING}
    assert not (row.is_pickupable and row.is_moveable)
    assert row.accepts is None or row.is_receptacle
    assert set(row.accepts or ()) <= {name for name, other in CATALOG.items() if other.is_pickupable}
    assert not row.runs_only_when_closed or (row.is_openable and row.is_toggleable)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"can": "pick hodl"}, "category Globe: 'hodl' is not among pick, move, .* Did you mean 'hold'"),
        ({"room": "L"}, "category Globe: 'room' is not among called, .* Did you mean 'rooms'"),
        ({"rooms": "LX"}, "category Globe: 'X' is not among K, L, B, W"),
    ],
)
def test_a_row_that_says_what_nothing_means_is_refused(changed: dict[str, str], message: str) -> None:
    row = {"called": "globe", "size": [0.2, 0.3, 0.2], "spread": 0.1, "rooms": "LB", "on": ["@tables"]}
    assert category_of("Globe", row, {"tables": ["Desk"]}).rests_on == ("Desk",)
    with pytest.raises(ValueError, match=message):
        category_of("Globe", row | changed, {"tables": ["Desk"]})


def test_a_category_that_cannot_be_is_not_registered() -> None:
    known = len(CATALOG)
    with pytest.raises(SettingError, match="'Mug' exists already"):
        register(replace(CATALOG["Mug"], display_name="beaker"), MAKERS["Mug"])
    with pytest.raises(SettingError, match=r"rests on 'Desc', which does not exist\. Did you mean 'Desk'"):
        register(replace(CATALOG["Mug"], name="Beaker", rests_on=("Desc",)), MAKERS["Mug"])
    register(CATALOG["Mug"], MAKERS["Mug"])
    assert len(CATALOG) == known


def test_spoken_names_are_words_and_tell_categories_apart() -> None:
    display_name = [row.display_name.lower() for row in CATEGORIES]
    assert len(set(display_name)) == len(display_name)
    assert all(re.fullmatch(r"[A-Za-z ]+", row.display_name) for row in CATEGORIES)


def test_what_carries_pickupable_things_is_a_receptacle() -> None:
    bearers = {name for row in CATEGORIES if row.is_pickupable for name in row.rests_on if name in CATALOG}
    hooks = {"HandTowelHolder", "TowelHolder"}
    assert {name for name in bearers if not CATALOG[name].is_receptacle} == hooks


def test_every_pickupable_thing_is_taken_by_most_places_named_for_it() -> None:
    for row in CATEGORIES:
        if row.is_pickupable and "Floor" not in row.rests_on and "Wall" not in row.rests_on:
            assert any(CATALOG[name].can_hold(row) for name in row.rests_on), row.name


@pytest.mark.parametrize(
    ("place", "thing", "expected"),
    [
        ("Fridge", "Apple", True),
        ("Toaster", "Bread", True),
        ("Toaster", "Apple", False),
        ("Mug", "Pen", True),
        ("Mug", "Apple", False),
        ("StoveBurner", "Pan", True),
        ("Fridge", "Sofa", False),  # nobody carries a sofa
        ("Painting", "Apple", False),  # nothing stands on a painting
    ],
)
def test_takes(place: str, thing: str, expected: bool) -> None:
    assert CATALOG[place].can_hold(CATALOG[thing]) is expected


def test_interlocks_are_those_of_machines_with_a_door() -> None:
    locked = {row.name for row in CATEGORIES if row.runs_only_when_closed}
    assert locked == {"Microwave", "WashingMachine", "ClothesDryer"}


def test_target_sizes_of_pixel_grounding_differ_clearly() -> None:
    def volume(name: str) -> float:
        x, y, z = CATALOG[name].typical_size
        return x * y * z

    assert max(map(volume, ("Egg", "Pen", "Watch"))) * 50 < min(map(volume, ("Microwave", "Cabinet")))
    assert volume("Microwave") * 10 < volume("Fridge")


@pytest.mark.real_houses
def test_agrees_with_the_simulator_that_the_categories_come_from(thor_files: Path) -> None:
    database = json.loads((thor_files / "asset-database.json").read_bytes())
    assert set(database) <= set(CATALOG)
    assert len(database) == 109
    for name, rows in database.items():
        said = {word for row in rows for word in row.get("secondaryProperties", [])}
        primary = {row.get("primaryProperty") for row in rows}
        row = CATALOG[name]
        assert row.is_pickupable == ("CanPickup" in primary), name
        assert row.is_toggleable == ("CanToggleOnOff" in said), name
        has_drawers = {"Desk", "Dresser", "SideTable", "TVStand"}
        assert row.is_openable == ("CanOpen" in said) or name in has_drawers, name
        hooks = {"HandTowelHolder", "TowelHolder", "ToiletPaperHanger"}
        assert row.is_receptacle == ("Receptacle" in said) or name in hooks, name
