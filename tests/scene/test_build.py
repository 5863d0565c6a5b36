"""House -> Scene: children on surfaces, doors, states; and the real houses."""

import copy
import gzip
import itertools
import json

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.errors import HouseError
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.build import build_scene
from vigil.scene.geometry import bounding_box, prisms_of
from vigil.scene.supports import surface_frame, surface_named
from vigil.sim import make_simulator
from vigil.sim.conformance.reference_house import DOOR, DRAWER, PANE, reference_house
from vigil.sim.core.motion import CollisionMap

SIZES = AssetDatabase.default()


@pytest.fixture
def data():
    return copy.deepcopy(reference_house().data)


def nodes(data) -> dict:
    found = {}
    queue = list(data["objects"])
    for node in queue:
        found[node["id"]] = node
        queue.extend(node["children"])
    return found


def test_everything_is_there_parents_first_openings_last(data):
    scene = build_scene(House("h", data), SIZES)
    assert {thing.id for thing in scene.things.values() if thing.id == DRAWER or not thing.is_drawer} == {
        *nodes(data),
        DOOR,
        PANE,
    }
    order = list(scene.things)
    assert order.index("DiningTable|1") < order.index("Bowl|1") < order.index("Egg|1")
    assert order[-2:] == [DOOR, PANE]
    assert scene.things[DOOR].is_structure
    assert scene.things[DOOR].is_openable


def test_hovering_children_fall_to_their_support(data):
    nodes(data)["Apple|1"]["position"]["y"] += 0.06
    scene = build_scene(House("h", data), SIZES)
    apple, table = scene.things["Apple|1"], scene.things["DiningTable|1"]
    assert (apple.parent, apple.surface) == ("DiningTable|1", "top")
    assert bounding_box(apple).bottom == pytest.approx(bounding_box(table).top, abs=0.002)


def test_children_inside_get_a_level_and_drawers_carry_them(data):
    scene = build_scene(House("h", data), SIZES)
    lettuce, watch = scene.things["Lettuce|1"], scene.things["Watch|1"]
    surface = surface_named(scene.things["Fridge|1"], lettuce.surface)
    assert surface is not None
    assert surface.is_inside
    assert bounding_box(lettuce).bottom == pytest.approx(
        float(surface_frame(scene.things["Fridge|1"], surface).shift[1]), abs=1e-6
    )
    assert watch.parent_joint is not None
    assert watch.parent_joint.startswith("drawer")


@pytest.mark.parametrize("yaw", [0, 30, 90])
def test_nothing_sticks_out_of_a_closed_drawer(data, yaw):
    nodes(data)["Watch|1"]["position"] |= {"x": 7.5, "z": 0.5}
    nodes(data)["Watch|1"]["rotation"]["y"] = yaw
    scene = build_scene(House("h", data), SIZES)
    watch, drawer = scene.things["Watch|1"], scene.things[DRAWER]
    surface = surface_named(drawer, watch.surface)
    assert surface is not None
    frame = surface_frame(drawer, surface).inverse()
    for prism in prisms_of(watch):
        corners = frame(np.insert(prism.polygon, 1, 0.0, axis=1))
        assert (np.abs(corners[:, [0, 2]]) <= np.array([surface.size_x, surface.size_z]) / 2 + 0.0101).all()


def test_what_lies_under_its_bed_is_on_the_floor(data):
    nodes(data)["Pillow|1"]["position"]["y"] = 0.1
    pillow = build_scene(House("h", data), SIZES).things["Pillow|1"]
    assert pillow.parent is None
    assert bounding_box(pillow).bottom == pytest.approx(0.0, abs=1e-9)


def test_states_of_the_document_are_kept(data):
    nodes(data)["FloorLamp|1"]["isOn"] = True
    nodes(data)["Laptop|1"]["openness"] = 0.7
    data["doors"][0]["openness"] = 1
    scene = build_scene(House("h", data), SIZES)
    assert scene.things["FloorLamp|1"].is_toggled
    assert scene.things["Laptop|1"].openness == 0.7
    assert scene.things[DOOR].openness == 1.0


@pytest.mark.parametrize(
    ("change", "category", "can_open"),
    [
        ({"assetId": "Doorframe_3", "openable": None, "openness": None}, "Doorframe", False),
        ({"assetId": "Doorway_Double_2", "openable": True}, "Doorway", True),
        ({"openable": False}, "Doorway", False),
    ],
)
def test_doors_by_their_kind(data, change, category, can_open):
    data["doors"][0].update(change)
    door = build_scene(House("h", data), SIZES).things[DOOR]
    assert (door.category, door.is_openable) == (category, can_open)


def test_an_opening_with_an_objects_id_is_refused(data):
    data["doors"][0]["id"] = "Apple|1"
    with pytest.raises(HouseError, match=r"'Apple\|1'"):
        build_scene(House("h", data), SIZES)


def test_houses_of_thors_assets_build_with_every_object(thor_files):
    assets = AssetDatabase.load(thor_files / "asset-database.json")
    with gzip.open(thor_files / "one_room_train.jsonl.gz", "rt") as lines:
        sample = list(itertools.islice(lines, 0, None, 25))
    houses = [House(f"train_{25 * number}", json.loads(line)) for number, line in enumerate(sample)]
    houses += [House.load(thor_files / f"house_{number}.json") for number in range(3)]
    for house in houses:
        scene = build_scene(house, assets)
        document = house.document
        things = [thing for thing in scene.things.values() if not thing.is_drawer]
        assert len(things) == len(house.objects()) + len(document.doors) + len(document.windows), house.name
        carried = [thing for thing in things if thing.parent and not thing.category.endswith("Towel")]
        assert sum(thing.surface is not None for thing in carried) >= 0.97 * len(carried), house.name


def test_the_rooms_of_such_a_house_are_joined_by_its_doors(thor_files):
    simulator = make_simulator("fake", assets=AssetDatabase.load(thor_files / "asset-database.json"))
    house = House.load(thor_files / "house_2.json")
    simulator.load(house)
    assert house.start is not None
    doors = {door.id: ObjectSetup(openness=1.0) for door in house.document.doors if door.openable}
    simulator.reset(house.start, Setup(objects=doors))
    places = CollisionMap(simulator.scene()).reachable(house.start.position)
    assert len(places) > 500
    rooms = {simulator.room_at(Vec3(float(x), 0.0, float(z))) for x, z in places}
    assert rooms == {room.id for room in house.document.rooms}
    assert len(rooms) == 4


def test_an_unknown_asset_is_shown_and_noted(data):
    data["objects"][0].update(id="Frigde|1", assetId="Frigdge_12")
    scene = build_scene(House("h", data), SIZES)
    assert scene.things["Frigde|1"].category == "Fridge"
    (note,) = scene.notes
    assert "Frigde|1" in note
    assert "'Frigdge_12'" in note
