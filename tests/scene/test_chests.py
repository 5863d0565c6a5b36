"""Houses that name drawers as parts of their furniture."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.assets.making import make
from vigil.errors import HouseError
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.geometry import prisms_of
from vigil.scene.plan import floor_plan
from vigil.scene.supports import containers_of, drawers_of, furniture_of, is_inside_closed
from vigil.sim.conformance.reference_house import DRAWER, DRESSER, SIBLING, WATCH, reference_house

SIZES = AssetDatabase.default()


@pytest.fixture
def data():
    return copy.deepcopy(reference_house().data)


def dresser_of(data) -> dict:
    return next(node for node in data["objects"] if node["id"] == DRESSER)


def test_every_drawer_is_there_named_or_not(data):
    scene = build_scene(House("h", data), SIZES)
    dresser = scene.things[DRESSER]
    assert [part.id for part in drawers_of(scene, dresser)] == [f"Drawer|1|Dresser{n}" for n in range(8)]
    assert not dresser.is_openable
    for part in drawers_of(scene, dresser):
        assert part.is_openable
        assert part.is_receptacle
        assert part.openness == 0.0
        assert furniture_of(scene, part) is dresser
    assert furniture_of(scene, dresser) is None


def test_what_lies_in_a_drawer_lies_in_the_furniture(data):
    scene = build_scene(House("h", data), SIZES)
    watch = scene.things[WATCH]
    assert (watch.parent, watch.parent_joint) == (DRAWER, "drawer4")
    assert [thing.id for thing in containers_of(scene, watch)] == [DRAWER, DRESSER]
    assert is_inside_closed(scene, watch)
    scene.things[SIBLING].openness = 1.0
    assert is_inside_closed(scene, watch)
    scene.things[DRAWER].openness = 1.0
    assert not is_inside_closed(scene, watch)
    assert containers_of(scene, scene.things[DRAWER]) == []


def test_taken_apart_it_takes_the_same_room(data):
    scene = build_scene(House("h", data), SIZES)
    dresser = scene.things[DRESSER]
    pieces = [prism for thing in (dresser, *drawers_of(scene, dresser)) for prism in prisms_of(thing)]
    entry = SIZES.look_up("vigil_Dresser_1", DRESSER)
    one = prisms_of(replace(dresser, asset=make(entry.category, entry.size, entry.variant)))
    assert len(pieces) == len(one)
    for found, wanted in zip(pieces, one, strict=True):
        assert np.allclose(found.polygon, wanted.polygon, atol=1e-6)
        assert (found.bottom, found.top) == pytest.approx((wanted.bottom, wanted.top), abs=1e-6)


def test_a_house_that_names_no_drawer_has_them_all_as_open_as_it_says_of_the_furniture(data):
    dresser_of(data)["children"] = []
    dresser_of(data)["openness"] = 0.5
    scene = build_scene(House("h", data), SIZES)
    parts = drawers_of(scene, scene.things[DRESSER])
    assert [part.openness for part in parts] == [0.5] * 8
    assert not scene.things[DRESSER].is_openable


def test_a_single_drawer_in_its_case_is_one_thing_that_opens(data):
    data["objects"].append(dresser_of(data) | {"id": "Drawer|9", "assetId": "vigil_Drawer_1", "children": []})
    scene = build_scene(House("h", data), SIZES)
    assert scene.things["Drawer|9"].is_openable
    assert drawers_of(scene, scene.things["Drawer|9"]) == []


def test_what_the_document_leaves_in_the_furniture_goes_into_a_drawer(data):
    drawer = dresser_of(data)["children"][0]
    (watch,) = drawer["children"]
    drawer["children"] = []
    dresser_of(data)["children"].append(watch)
    assert build_scene(House("h", data), SIZES).things[WATCH].parent == DRAWER


def test_a_drawer_is_where_its_furniture_has_it(data):
    before = build_scene(House("h", data), SIZES).things[DRAWER].position
    dresser_of(data)["children"][0]["position"]["y"] += 0.5
    assert build_scene(House("h", data), SIZES).things[DRAWER].position == before


def test_openness_is_the_drawers_own(data):
    dresser_of(data)["children"][0]["openness"] = 0.9
    scene = build_scene(House("h", data), SIZES)
    assert [part.openness for part in drawers_of(scene, scene.things[DRESSER])] == [0.0] * 4 + [0.9] + [0.0] * 3


def test_drawers_that_it_does_not_have_are_refused(data):
    dresser_of(data)["children"][0]["assetId"] += "1"
    with pytest.raises(HouseError, match=r"'drawer41' of 'Dresser\|1', which has drawer0, "):
        build_scene(House("h", data), SIZES)


def test_one_drawer_is_named_once(data):
    again = copy.deepcopy(dresser_of(data)["children"][0]) | {"id": "Drawer|again", "children": []}
    dresser_of(data)["children"].append(again)
    with pytest.raises(HouseError, match=r"both name 'drawer4' of 'Dresser\|1'"):
        build_scene(House("h", data), SIZES)


def test_a_plan_shows_what_is_in_drawers_and_not_the_drawers(data):
    house = House("h", data)
    shown = {shape.id for shape in floor_plan(house, build_scene(house, SIZES).things.values()).shapes}
    assert WATCH in shown
    assert DRAWER not in shown
