"""Generated houses keep their promises in a simulator: one can start, walk everywhere and open everything."""

import pytest
from shapely import Polygon, contains_xy

from vigil.assets.database import AssetDatabase
from vigil.protocol.world import ObjectSetup, Setup
from vigil.sim import make_simulator
from vigil.sim.core.motion import CollisionMap
from vigil.sim.core.opening import opening_blocker
from vigil.sim.core.state import AGENT, SceneState


@pytest.fixture
def loaded(house):
    simulator = make_simulator("fake", assets=AssetDatabase.default())
    simulator.load(house)
    yield house, simulator
    simulator.close()


def test_the_start_is_free(loaded):
    house, simulator = loaded
    simulator.reset(house.start, Setup())
    assert simulator.can_stand(house.start.position)


def test_every_room_can_be_walked_to_past_open_doors(loaded):
    house, simulator = loaded
    doors = {door.id: ObjectSetup(openness=1.0) for door in house.document.doors if door.openable}
    simulator.reset(house.start, Setup(objects=doors))
    places = CollisionMap(simulator.scene()).reachable(house.start.position)
    for room in house.document.rooms:
        floor = Polygon([(point.x, point.z) for point in room.floor_polygon])
        assert contains_xy(floor, places[:, 0], places[:, 1]).sum() >= 4, room.id


def test_nothing_is_kept_from_opening_or_closing(loaded):
    house, simulator = loaded
    scene = simulator.scene()
    state = SceneState(scene, house.start, CollisionMap(scene))
    stopped = {
        (thing.id, target): opening_blocker(state, thing, target)
        for thing in scene.things.values()
        for target in (0.0, 1.0)
        if thing.is_openable and thing.openness != target
    }
    assert {key: by for key, by in stopped.items() if by not in (None, AGENT)} == {}


def test_no_leaf_is_turned_back_when_a_house_is_loaded(loaded):
    _, simulator = loaded
    assert simulator.scene().notes == []


def test_nothing_small_falls(loaded):
    _, simulator = loaded
    resting = [thing for thing in simulator.scene().things.values() if thing.parent and not thing.is_drawer]
    loose = [thing for thing in resting if "Towel" not in thing.category]
    assert [thing.id for thing in loose if not thing.surface] == []
