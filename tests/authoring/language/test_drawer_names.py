"""What single drawers are called, and what such names fit."""

import pytest

from vigil.assets.database import AssetDatabase
from vigil.authoring.language.drawer_names import drawer_name, furniture_name, without_position
from vigil.authoring.language.referring import (
    DescribedThing,
    Phrase,
    items_of,
    mentions,
    phrase_for,
    referents,
    resolve_mentions,
)
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.scene.build import build_scene
from vigil.scene.supports import drawers_of
from vigil.sim.conformance.reference_house import DRESSER, WATCH, reference_house

SIZES = AssetDatabase.default()
OF = "of the dresser"
DRAWERS = 8 + 3
"""Of the dresser and of the desk."""
ROWS = (
    ("top left drawer", "top right drawer"),
    ("left drawer in the second row from above", "right drawer in the second row from above"),
    ("left drawer in the third row from above", "right drawer in the third row from above"),
    ("bottom left drawer", "bottom right drawer"),
)
"""Of a dresser of four rows, from above, as one sees it."""


@pytest.fixture(scope="module")
def scene():
    return build_scene(reference_house(), SIZES)


@pytest.fixture(scope="module")
def things(scene):
    return items_of(scene)


def drawer(name: str, room: str = "bedroom", number: int = 1) -> DescribedThing:
    return DescribedThing(f"Drawer|{number}", "Drawer", name, (), f"room|{room}", room, f"Chest|{number}", "x")


def test_rows_count_from_above_and_left_is_left_for_who_looks_at_the_front(scene):
    # The dresser faces north: who looks at its front looks south and has what lies further east on the left.
    places = sorted(drawers_of(scene, scene.things[DRESSER]), key=lambda part: (-part.position.y, -part.position.x))
    said = [name for row in ROWS for name in row]
    assert [drawer_name(scene, part) for part in places] == [f"{name} {OF}" for name in said]


@pytest.mark.parametrize(
    ("category", "names"),
    [
        ("SideTable", ("top drawer of the side table", "bottom drawer of the side table")),
        ("Desk", ("top drawer of the desk", "second drawer from above of the desk", "bottom drawer of the desk")),
        (
            "TVStand",
            tuple(f"{row} {side} drawer of the TV stand" for row in ("upper", "lower") for side in ("left", "right")),
        ),
    ],
)
def test_every_grid_has_its_words(category, names):
    houses = (generate(seed, spec_for("bedroom")) for seed in range(10))
    for scene in (build_scene(house, SIZES) for house in houses):
        for chest in (thing for thing in scene.things.values() if thing.category == category):
            parts = drawers_of(scene, chest)
            if len(parts) == len(names):
                assert {drawer_name(scene, part) for part in parts} == set(names)
                return
    pytest.fail(f"no house has a {category} with {len(names)} drawers")


def test_every_drawer_has_a_phrase_that_is_read_back(things):
    drawers = [item for item in things.values() if item.category == "Drawer"]
    assert len(drawers) == DRAWERS
    names = [item.name for item in things.values()]
    for item in drawers:
        phrase = phrase_for(item, things.values())
        assert phrase is not None
        text = f"First close {phrase}, then go on."
        assert mentions(text, names) == [phrase]
        assert [[found.id for found in fitting] for fitting in resolve_mentions([phrase], things.values())] == [
            [item.id]
        ]


def test_the_bare_word_fits_every_drawer_and_the_furniture_alone_fits_none(things):
    assert len(referents(Phrase("drawer"), things.values())) == DRAWERS
    assert [item.id for item in referents(Phrase("dresser"), things.values())] == [DRESSER]
    assert mentions("Close the drawer.", [item.name for item in things.values()]) == [Phrase("drawer")]


def test_which_drawer_is_said_together_with_its_furniture():
    top, other = drawer("top drawer of the dresser"), drawer("top drawer of the TV stand", number=2)
    assert (
        str(phrase_for(top, [top, drawer("bottom drawer of the dresser", number=3)])) == "the top drawer of the dresser"
    )
    assert phrase_for(top, [top, other]) is None  # a TV stand may pass for a dresser
    upstairs = drawer("top drawer of the TV stand", "living room", 2)
    assert str(phrase_for(top, [top, upstairs])) == "the top drawer of the dresser in the bedroom"
    desk = drawer("top drawer of the desk", number=2)
    assert str(phrase_for(top, [top, desk])) == "the top drawer of the dresser"


def test_what_lies_in_a_drawer_lies_in_its_furniture_too(things):
    watch = things[WATCH]
    assert watch.support == "right drawer in the second row from above of the dresser"
    assert watch.is_inside
    for support, fits in ((watch.support, True), ("dresser", True), ("bottom left drawer of the dresser", False)):
        assert (watch in referents(Phrase("watch", support=support), things.values())) == fits


def test_parts_of_a_name():
    assert without_position("top drawer of the dresser") == "drawer"
    assert without_position("mug") == "mug"
    assert furniture_name("top drawer of the dresser") == "dresser"
    assert furniture_name("mug") is None
