"""Houses in the forms that others write are taken, stand as they should, and what is not done for them is told."""

from collections import Counter

import pytest

from tests.support.external_houses import APPLE_ID, DRESSER_ID, FORMS, TABLE_ID, furnished, thing
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.housegen.checking.check import check_house
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.geometry import bounding_box
from vigil.sim.core.motion import CollisionMap

SIZES = AssetDatabase.default()
FAULTS = {
    "leaves apart": {"key": 1, "state": 1},
    "flat": {"asset": 4},
    "Objaverse": {"asset": 2},
    "gable": {"wall-outline": 1},
    "more keys": {"key": 4},
    "added by hand": {"asset": 1},
}
"""What the check says of a form; of the others nothing."""


@pytest.mark.parametrize("form", FORMS)
def test_a_form_of_others_is_taken(form):
    house = House(form, FORMS[form]())
    scene = build_scene(house, SIZES)
    assert Counter(fault.rule for fault in check_house(house, SIZES)) == FAULTS.get(form, {})
    kinds = [each.category for each in scene.things.values() if each.parent is None and not each.is_structure]
    assert kinds[:3] == ["Dresser", "DiningTable", "Fridge"]
    apple = next(each for each in scene.things.values() if each.category == "Apple")
    assert scene.things[apple.parent or ""].category == "DiningTable"
    assert {room.room_type for room in scene.rooms} <= {"LivingRoom", "Kitchen", ""}


@pytest.mark.parametrize("form", FORMS)
def test_one_walks_from_room_to_room(form):
    house = House(form, FORMS[form]())
    plan = CollisionMap(build_scene(house, SIZES))
    assert house.start is not None
    places = plan.reachable(house.start.position)
    rooms = {plan.room_at(Vec3(x, 0.0, z)) for x, z in places[:, [0, -1]].tolist()}
    assert len(rooms - {None}) == 2


def test_what_hovers_over_nothing_is_left_there():
    data = furnished()
    data["objects"] += [thing("Apple|9", "Apple_1", (3.0, 1.0, 1.0)), thing("Mug|9", "Mug_1", (6.4, 2.0, 2.0))]
    scene = build_scene(House("loose", data), SIZES)
    assert (scene.things["Apple|9"].parent, scene.things["Mug|9"].parent) == (None, None)


def test_a_loose_thing_in_furniture_has_a_shelf_where_it_lies():
    data = furnished()
    data["objects"].append(thing("Egg|9", "Egg_1", (7.5, 0.6, 3.5)))
    scene = build_scene(House("loose", data), SIZES)
    egg = scene.things["Egg|9"]
    assert egg.parent == "Fridge|3|2"
    assert egg.position.y == pytest.approx(0.6, abs=0.02)
    assert "Egg|9: judging by its place, it rests on 'Fridge|3|2'" in scene.notes


@pytest.mark.parametrize("off_m", [-0.3, 0.2])
def test_a_thing_of_guessed_size_stands_on_the_floor(off_m):
    data = furnished()
    data["objects"][0]["position"]["y"] += off_m
    guessed = build_scene(House("h", data), SIZES).things[DRESSER_ID]
    assert bounding_box(guessed).bottom == pytest.approx(0.0, abs=1e-6)
    size = guessed.asset.size
    measured = AssetDatabase({"Dresser_213_1": ("Dresser", size)})
    assert build_scene(House("h", data), measured).things[DRESSER_ID].position.y == pytest.approx(0.45 + off_m)
    assert not any(fault.subject == DRESSER_ID for fault in check_house(House("h", data), SIZES))
    assert any(fault.subject == DRESSER_ID for fault in check_house(House("h", data), measured))


def test_the_table_carries_what_is_its_child():
    scene = build_scene(House("h", furnished()), SIZES)
    assert scene.things[APPLE_ID].parent == TABLE_ID
