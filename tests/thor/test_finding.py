"""Actions that only ask."""

import math
from itertools import pairwise

import pytest

from vigil.sim.thor.units import BODY_HEIGHT_M

POSE = {"rotation": {"y": 90.0}, "horizon": 0.0, "standing": True}


def test_an_answer_to_a_question_is_a_patch(client):
    places = client.do("GetReachablePositions")["actionReturn"]
    assert client.last.is_patch
    assert len(places) > 50
    assert set(places[0]) == {"x", "y", "z"}
    client.start(fastActionEmit=False)
    client.do("GetReachablePositions")
    assert not client.last.is_patch


def test_every_reachable_position_can_be_teleported_to(client):
    places = client.do("GetReachablePositions", gridSize=1.0)["actionReturn"]
    assert len(places) > 5
    for place in places:
        assert client.do("Teleport", position=place)["lastActionSuccess"]


@pytest.mark.parametrize("place", [(3.5, 2.5), (3.37, 2.61)])
@pytest.mark.parametrize("settings", [{"gridSize": size} for size in (0.1, 0.25, 0.4, 0.5)] + [{}])
def test_snapping_holds_to_the_grid_of_the_reachable_positions(client, settings, place):
    client.stand(*place)
    client.do("Initialize", snapToGrid=True, **settings)
    places = client.do("GetReachablePositions")["actionReturn"]
    assert len(places) > 5
    assert any(math.dist((each["x"], each["z"]), place) < 1e-9 for each in places)
    for each in places[::7]:
        assert client.do("Teleport", position=each)["lastActionSuccess"]
        assert client.do("TeleportFull", position=each, **POSE)["lastActionSuccess"]
    assert client.do("GetReachablePositions")["actionReturn"] == [
        {axis: pytest.approx(value, abs=1e-9) for axis, value in each.items()} for each in places
    ]


@pytest.mark.parametrize(("own_size", "step"), [(0.5, 0.5), (0.1, 0.5), (0.125, 0.25)])
def test_a_grid_of_its_own_lists_what_snapping_allows(client, own_size, step):
    client.stand(3.37, 2.61)
    client.do("Initialize", snapToGrid=True, gridSize=0.25)
    places = client.do("GetReachablePositions", gridSize=own_size)["actionReturn"]
    steps = {round((each["x"] - 3.37) / step, 6) for each in places}
    assert len(steps) > 2
    assert all(each == int(each) for each in steps)
    for each in places:
        assert client.do("Teleport", position=each)["lastActionSuccess"]


def test_interactable_poses_off_the_house_s_grid_can_be_taken(client):
    client.stand(3.37, 2.61)
    client.do("Initialize", snapToGrid=True)
    for pose in client.do("GetInteractablePoses", objectId="Apple|1", maxPoses=3)["actionReturn"]:
        assert client.do("TeleportFull", **pose)["lastActionSuccess"]


def test_where_the_agent_touches_something_it_may_stay(client):
    place = {"x": 0.05, "y": BODY_HEIGHT_M, "z": 2.5}
    client.do("Teleport", position=place, forceAction=True)
    assert not client.world.editor.can_stand(client.world.agent.position)
    assert client.do("Teleport", position=place, rotation=90.0)["agent"]["rotation"]["y"] == 90.0
    assert place in client.do("GetReachablePositions")["actionReturn"]
    assert client.do("GetShortestPathToPoint", target=place)["actionReturn"]["corners"]


def test_an_interactable_pose_is_one(client):
    poses = client.do("GetInteractablePoses", objectId="Apple|1", maxPoses=3)["actionReturn"]
    assert len(poses) == 3
    for pose in poses:
        client.do("TeleportFull", **pose)
        assert client.get("Apple|1")["isInteractable"]


def test_a_path_ends_near_and_goes_round(client):
    client.do("OpenObject", objectId="door|1|2", forceAction=True)
    start, end = {"x": 3.5, "y": 0.901, "z": 2.5}, {"x": 8.0, "y": 0.0, "z": 2.5}
    corners = client.do("GetShortestPathToPoint", position=start, target=end)["actionReturn"]["corners"]
    assert (corners[0]["x"], corners[0]["z"]) == (3.5, 2.5)
    assert math.hypot(corners[-1]["x"] - 8.0, corners[-1]["z"] - 2.5) < 0.2
    length = sum(math.dist((a["x"], a["z"]), (b["x"], b["z"])) for a, b in pairwise(corners))
    assert 4.4 < length < 5.5
    assert "Path to target" in client.fail("GetShortestPathToPoint", position=start, target={"x": 90, "y": 0, "z": 0})
    found = client.do("GetShortestPath", objectType="Fridge", position=start)["actionReturn"]["corners"]
    assert math.hypot(found[-1]["x"] - 5.2, found[-1]["z"] - 4.6) < 2.5


def test_a_place_in_the_picture_is_the_object_there(client):
    client.go_to("Fridge|1")
    fridge = client.get("Fridge|1")["position"]
    eye = client.do("Pass")["cameraPosition"]
    found = client.do("PerformRaycast", origin=eye, destination=fridge)["actionReturn"]
    assert found["objectId"] == "Fridge|1"
    assert client.do("GetObjectHitFromRaycast", origin=eye, destination=fridge)["actionReturn"] == "Fridge|1"
    point = client.do("GetCoordinateFromRaycast", x=0.5, y=0.5)["actionReturn"]
    assert set(point) == {"x", "y", "z"}
    assert "x/y must be in [0:1]" in client.fail("GetObjectInFrame", x=1.5, y=0.5)


def test_a_filter_confines_the_metadata(client):
    client.do("SetObjectFilter", objectIds=["Apple|1"])
    assert [each["objectId"] for each in client.do("Pass")["objects"]] == ["Apple|1"]
    client.do("ResetObjectFilter")
    assert len(client.do("Pass")["objects"]) > 10


def test_the_view_of_a_map_holds_the_house(client):
    found = client.do("GetMapViewCameraProperties")["actionReturn"]
    assert found["position"]["x"] == pytest.approx(5.0)
    assert found["orthographicSize"] == pytest.approx(5.0)
    names = client.do("GetScenesInBuild")["actionReturn"]
    assert {"Procedural", "FloorPlan1_physics", "FloorPlan430_physics", "FloorPlan_Train12_5"} <= set(names)
    assert len(names) == 1 + 4 * 30 + 15 * 5


def test_the_older_form_of_interactable_poses_has_the_same_places(client):
    poses = client.do("GetInteractablePoses", objectId="Fridge|1")["actionReturn"]
    found = client.do("PositionsFromWhichItemIsInteractable", objectId="Fridge|1")["actionReturn"]
    assert len(poses) > 3
    assert found == {name: [float(pose[name]) for pose in poses] for name in poses[0]}
