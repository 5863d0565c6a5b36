"""Walls that are empty: nothing stands there, so one walks, sees and is checked as where a house leaves them out."""

import numpy as np
import pytest

from tests.support.two_rooms import BETWEEN, door_between, point, two_rooms, without_walls_between
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.housegen.checking.check import check_house
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.scene.build import build_scene
from vigil.scene.plan import floor_plan
from vigil.scene.portals import Portals
from vigil.sim import make_simulator
from vigil.sim.core.motion import CollisionMap

SIZES = AssetDatabase.default()
OPEN = House("open", two_rooms(empty=True))
SEALED = House("sealed", two_rooms())


def rules(house: House) -> set[str]:
    return {fault.rule for fault in check_house(house, SIZES)} - {"room-lacks"}


def reached(house: House) -> int:
    return len(CollisionMap(build_scene(house, SIZES)).reachable(Vec3(1.0, 0.0, 2.0)))


def walls_in_plan(house: House) -> list[np.ndarray]:
    """Return the ends of the walls that a plan draws."""
    return [shape.points for shape in floor_plan(house, []).shapes if shape.kind == "wall"]


def test_nothing_stands_where_walls_are_empty():
    ids = {panel.id for panel in build_scene(OPEN, SIZES).panels}
    assert ids == {panel.id for panel in build_scene(SEALED, SIZES).panels} - set(BETWEEN)
    scene = build_scene(OPEN, SIZES)
    assert CollisionMap(scene).blocker(Vec3(3, 0, 2), Vec3(5, 0, 2)) is None
    assert Portals(scene).connected_rooms() == [[0, 1]]
    assert len(walls_in_plan(OPEN)) == 6


def test_one_walks_as_where_the_walls_are_left_out():
    assert reached(OPEN) == reached(without_walls_between()) > 2 * reached(SEALED) > 0


@pytest.mark.parametrize("house", [OPEN, without_walls_between()], ids=lambda house: house.name)
def test_the_check_walks_through_rooms_that_no_wall_parts(house):
    assert rules(house) == set()
    assert rules(SEALED) == {"unreachable-room", "free-floor"}


def test_where_one_of_the_pair_stands_one_does_not_pass():
    data = two_rooms()
    next(wall for wall in data["walls"] if wall["id"] == BETWEEN[0])["empty"] = True
    assert "unreachable-room" in rules(House("half", data))
    assert reached(House("half", data)) == reached(SEALED)


def test_the_check_does_not_walk_through_half_a_wall():
    data = two_rooms()
    for wall in data["walls"]:
        if wall["id"] in BETWEEN:
            wall["polygon"] = [{**corner, "y": min(corner["y"], 0.9)} for corner in wall["polygon"]]
    assert "unreachable-room" in rules(House("low", data))
    for wall in data["walls"]:
        if wall["id"] in BETWEEN:
            wall["polygon"] = [{**corner, "z": min(corner["z"], 2.5)} for corner in wall["polygon"]]
    assert "unreachable-room" not in rules(House("short", data))


def test_a_door_stands_in_an_empty_wall():
    house = House("door", {**two_rooms(empty=True), "doors": [door_between(openness=0.0)]})
    door = build_scene(house, SIZES).things["door|2|3"]
    assert (door.position, door.openness) == (pytest.approx((4.0, 1.05, 2.0)), 0.0)
    same = House("walls", {**two_rooms(), "doors": [door_between(openness=0.0)]})
    assert build_scene(same, SIZES).things["door|2|3"].rotation == door.rotation


@pytest.mark.parametrize(("house", "is_seen"), [(OPEN, True), (SEALED, False)], ids=["open", "sealed"])
def test_one_sees_through(house, is_seen):
    apple = {"id": "Apple|1", "assetId": "vigil_Apple_1", "position": point(6, 0.04, 2), "rotation": point(0, 0, 0)}
    simulator = make_simulator("fake", assets=SIZES)
    simulator.load(House("apple", {**house.data, "objects": [apple]}))
    simulator.reset(Pose(position=Vec3(2.5, 0, 2), rotation=90.0, horizon=30.0), Setup())
    assert simulator.world(["Apple|1"]).objects["Apple|1"].visible == is_seen
    simulator.close()


def test_a_wall_without_a_room_is_seen_from_the_room_that_it_faces():
    data = two_rooms()
    named = {panel.id: panel for panel in build_scene(House("named", data), SIZES).panels}
    for wall in data["walls"]:
        wall["roomId"] = None
    for panel in build_scene(House("unnamed", data), SIZES).panels:
        assert (panel.room_id, panel.normal) == (named[panel.id].room_id, named[panel.id].normal)


def test_the_corners_of_a_wall_may_go_round():
    """Holodeck's do: one bottom corner, two top ones, the other bottom corner."""
    data = two_rooms()
    for wall in data["walls"]:
        low_a, low_b, top_a, top_b = wall["polygon"]
        wall["polygon"] = [low_a, top_a, top_b, low_b]
    house = House("round", data)
    assert build_scene(house, SIZES).panels == build_scene(SEALED, SIZES).panels
    assert np.allclose(walls_in_plan(house), walls_in_plan(SEALED))


def test_a_ceiling_of_its_own():
    data = two_rooms()
    data["rooms"][0]["ceilings"] = [{"id": "c", "polygon": [], "material": {"name": "RedBrick"}}]
    first, second = build_scene(House("ceilings", data), SIZES).rooms
    assert [room.ceiling_material and room.ceiling_material.name for room in (first, second)] == [
        "RedBrick",
        "PureWhite",
    ]


@pytest.mark.parametrize("outside", ["exterior", None])
def test_a_door_to_the_outside(outside):
    """As Holodeck has it: its first wall is that of the outside, its first room none."""
    data = two_rooms(empty=True)
    inner = next(wall for wall in data["walls"] if wall["id"] == "wall|2|w")
    data["walls"].append({**inner, "id": "wall|2|w|exterior", "polygon": inner["polygon"][::-1]})
    door = door_between(room0=outside, room1="room|2", wall0="wall|2|w|exterior", wall1="wall|2|w", openable=False)
    house = House("front", {**data, "doors": [door]})
    scene = build_scene(house, SIZES)
    assert scene.things["door|2|3"].position == pytest.approx((0.0, 1.05, 2.0))
    assert [len(panel.holes) for panel in scene.panels if panel.id.startswith("wall|2|w")] == [1, 1]
    assert not scene.things["door|2|3"].is_openable
    assert rules(house) == set()
