"""ProcTHOR's ways with walls: point orders, coincident panels, holes along the first wall."""

import copy
import re

import pytest

from vigil.errors import HouseError
from vigil.protocol.house import House
from vigil.scene.walls import panels_of, place_of_opening, rooms_of
from vigil.sim.conformance.reference_house import DOOR, reference_house


def panels(data) -> dict:
    return {panel.id: panel for panel in panels_of(House("changed", data))}


@pytest.fixture
def data():
    return copy.deepcopy(reference_house().data)


def test_panels_look_into_their_room(data):
    found = panels(data)
    assert found["wall|1|w"].normal == pytest.approx((1.0, 0.0))
    assert found["wall|1|e"].normal == pytest.approx((-1.0, 0.0))
    assert found["wall|2|w"].normal == pytest.approx((1.0, 0.0))


def test_exterior_panels_look_away_and_may_give_their_top_first(data):
    inner = next(wall for wall in data["walls"] if wall["id"] == "wall|1|w")
    data["walls"].append(inner | {"id": "wall|exterior|0|0|0|5", "polygon": inner["polygon"][::-1]})
    outer = panels(data)["wall|exterior|0|0|0|5"]
    assert outer.room_id == "exterior"
    assert outer.normal == pytest.approx((-1.0, 0.0))
    assert (outer.bottom, outer.height) == (0.0, 2.5)
    assert outer.start == (0.0, 5.0)


def test_holes_of_the_second_wall_go_through_the_house_frame(data):
    found = panels(data)
    first, second = found["wall|2|w"], found["wall|1|e"]
    assert [(hole.left, hole.right) for hole in first.holes] == [(0.5, 1.5), (2.0, 3.0)]
    # the kitchen's side runs the other way: z 5 -> 0
    assert second.start == (6.0, 5.0)
    assert [(hole.left, hole.right) for hole in second.holes] == [
        (pytest.approx(2.0), pytest.approx(3.0)),
        (pytest.approx(3.5), pytest.approx(4.5)),
    ]
    assert [(hole.bottom, hole.top) for hole in second.holes] == [(0.0, 2.1), (0.9, 2.0)]


def test_hole_polygons_may_have_four_points(data):
    door = data["doors"][0]
    low, high = door["holePolygon"]
    door["holePolygon"] = [high, {**low, "y": high["y"]}, low, {**high, "y": low["y"]}]
    assert panels(data)["wall|2|w"].holes == panels(reference_house().data)["wall|2|w"].holes


def test_an_opening_faces_its_first_room_and_fits_its_hole():
    house = reference_house()
    found = {panel.id: panel for panel in panels_of(house)}
    position, yaw, size = place_of_opening(house, house.document.doors[0], found)
    assert position == pytest.approx((6.0, 1.05, 2.5))
    assert yaw == pytest.approx(90.0)  # +z of the asset towards the bedroom, +x
    assert (size.x, size.y) == (1.0, 2.1)
    assert house.document.doors[0].id == DOOR


def test_lights_come_from_the_document_else_from_the_rooms_middle(data):
    light = {"id": "light_2", "type": "point", "position": {"x": 7, "y": 2.4, "z": 1}, "intensity": 0.5}
    data["proceduralParameters"]["lights"] = [{**light, "id": "sun", "type": "directional"}, light]
    kitchen, bedroom = rooms_of(House("lit", data))
    assert bedroom.light == (7.0, 2.4, 1.0)
    assert (kitchen.light.x, kitchen.light.z) == pytest.approx((3.0, 2.5))
    assert kitchen.height == bedroom.height == 2.5


def test_a_floor_that_crosses_itself_is_named(data):
    room = data["rooms"][0]
    room["floorPolygon"][:2] = room["floorPolygon"][1::-1]
    with pytest.raises(HouseError, match=f"room {re.escape(repr(room['id']))}: its floor is not a simple polygon"):
        rooms_of(House("bow", data))


def test_a_floor_without_area_is_named(data):
    for point in data["rooms"][0]["floorPolygon"]:
        point["x"] *= 1e-4
    with pytest.raises(HouseError, match=r"House 'strip': room 'room\|1': its floor has .* expected at least 0.01"):
        rooms_of(House("strip", data))


@pytest.mark.parametrize("part", ["rooms", "walls", "doors"])
def test_what_could_not_be_held_in_memory_is_named(data, part: str):
    polygon = {"rooms": "floorPolygon", "walls": "polygon", "doors": "holePolygon"}[part]
    data[part][0][polygon][1]["x"] = 9000.0
    with pytest.raises(HouseError, match=r"House 'wide': (room|wall|opening) '.*' reaches 9000 m from the origin"):
        rooms_of(House("wide", data))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_wall_without_length_or_height_is_named(data, axis: str):
    wall = next(wall for wall in data["walls"] if wall["polygon"][0]["x"] != wall["polygon"][1]["x"])
    for point in wall["polygon"]:
        point[axis] = 1.0
    with pytest.raises(HouseError, match=f"{re.escape(repr(wall['id']))} has no length or no height"):
        panels_of(House("flat", data))
