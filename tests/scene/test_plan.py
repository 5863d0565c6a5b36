"""What is drawn of a house seen from above."""

import copy

import numpy as np
import pytest
import shapely

from tests.support.tiny_pack import FRIDGE, MUG, SIDE, TABLE, tiny_house
from vigil.assets.database import AssetDatabase
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.geometry import bounding_box
from vigil.scene.outlines import footprint
from vigil.scene.plan import HUNG_M, LABELLED_DEPTH_M, LEAST_FILLED, MARGIN_M, SHOWN_BELOW_M, FloorPlan, floor_plan
from vigil.scene.plan_image import STYLES, draw_plan
from vigil.scene.things import Scene
from vigil.web.plan import plan_of


@pytest.fixture(scope="module")
def house() -> House:
    return generate(3, spec_for("2"))


@pytest.fixture(scope="module")
def scene(house: House) -> Scene:
    return build_scene(house, AssetDatabase.default())


@pytest.fixture(scope="module")
def plan(house: House, scene: Scene) -> FloorPlan:
    return floor_plan(house, scene.things.values())


def test_a_tiny_house_is_drawn_whole() -> None:
    house = tiny_house()
    plan = floor_plan(house, build_scene(house, AssetDatabase.default()).things.values())
    (room,) = plan.rooms
    assert (room.name, room.area_m2) == ("kitchen", SIDE * SIDE)
    assert {(thing.id, thing.kind, thing.label) for thing in plan.things} == {
        (TABLE, "thing", "dining table"),
        (FRIDGE, "thing", "fridge"),
    }
    assert [label.text for label in plan.labels(0.1)] == ["dining table", "fridge", "kitchen"]
    assert [label.text for label in plan.labels(0.1, detailed=True)][-1] == "kitchen, 25 m2"
    assert [shape.id for shape in plan.shapes if shape.kind == "small"] == [MUG]
    assert [shape.kind for shape in plan.shapes].count("wall") == 4
    assert [corner.tolist() for corner in plan.bounds] == [[-MARGIN_M, -MARGIN_M], [SIDE + MARGIN_M, SIDE + MARGIN_M]]


def test_what_hangs_is_known_by_its_height_and_what_is_too_high_is_left_out(scene: Scene, plan: FloorPlan) -> None:
    bottoms = {thing.id: bounding_box(thing).bottom for thing in scene.things.values()}
    drawn = {thing.id: thing for thing in plan.things}
    in_rooms = [thing for thing in scene.things.values() if thing.parent is None and not thing.is_structure]
    assert drawn.keys() == {thing.id for thing in in_rooms if bottoms[thing.id] < SHOWN_BELOW_M}
    assert len(drawn) < len(in_rooms)
    hung = {thing.id for thing in plan.things if thing.kind == "hung"}
    assert hung == {name for name in drawn if bottoms[name] > HUNG_M}
    assert {thing.id for thing in plan.things if not thing.label} == {
        name
        for name, thing in drawn.items()
        if thing.kind == "rug" or scene.things[name].asset.size.z <= LABELLED_DEPTH_M
    }


def test_rugs_come_first_then_things_from_below(scene: Scene, plan: FloorPlan) -> None:
    order = [(thing.kind != "rug", bounding_box(scene.things[thing.id]).bottom, thing.id) for thing in plan.things]
    assert order == sorted(order)


def test_a_rooms_name_stands_on_its_free_floor(plan: FloorPlan) -> None:
    for room in plan.rooms:
        middle = shapely.Point(room.name_at)
        assert shapely.Polygon(room.corners).contains(middle)
        assert not any(shapely.Polygon(thing.corners).contains(middle) for thing in plan.things if thing.kind != "rug")


def test_picture_and_page_draw_the_same_plan(house: House, scene: Scene, plan: FloorPlan) -> None:
    width, height = draw_plan(house, scene, 50).size
    low, high = plan.bounds
    assert width / height == pytest.approx((high - low)[0] / (high - low)[1], abs=0.01)
    drawing = plan_of(house, AssetDatabase.default())
    assert [(shape.kind, shape.id) for shape in drawing.shapes] == [(shape.kind, shape.id) for shape in plan.shapes]
    kinds = {shape.kind.split()[-1] for shape in plan.shapes}
    assert kinds <= STYLES.keys()
    assert {"thing", "front", "wall", "door", "leaf", "window", "small"} <= kinds
    assert {label.text for label in drawing.labels} <= {room.name for room in plan.rooms} | {
        thing.label for thing in plan.things
    }
    assert any(label.kind == "room-name" for label in drawing.labels)


def test_a_floor_without_a_point_of_the_grid_has_its_name_inside() -> None:
    data = copy.deepcopy(tiny_house().data)
    corners = [(0.0, 0.0), (0.0, 0.05), (0.05, 0.05), (0.05, 0.0)]
    data["rooms"][0]["floorPolygon"] = [{"x": x, "y": 0.0, "z": z} for x, z in corners]
    (room,) = floor_plan(House("closet", data), ()).rooms
    assert np.allclose(room.name_at, 0.025)


def test_a_countertop_around_a_corner_is_drawn_as_it_is() -> None:
    house = generate(21, spec_for("4"))
    things = build_scene(house, AssetDatabase.default()).things
    drawn = {thing.id: shapely.Polygon(thing.corners) for thing in floor_plan(house, things.values()).things}
    counters = {name: drawn[name] for name in drawn if things[name].category == "CounterTop"}
    (cornered,) = (name for name, outline in counters.items() if len(outline.exterior.coords) > 5)
    box = footprint(bounding_box(things[cornered]))
    assert np.allclose(counters[cornered].bounds, box.bounds, atol=0.02)
    assert counters[cornered].area < LEAST_FILLED * box.area
    assert house.start is not None
    start = shapely.Point(house.start.position.x, house.start.position.z)
    assert box.contains(start)
    assert not counters[cornered].contains(start)
