"""Opening, switching, picking up and putting down, with AI2-THOR's rules and words."""

import copy

import pytest

from vigil.sim.conformance.reference_house import reference_house


def test_a_fridge_opens_when_it_is_near_and_in_view(client):
    client.stand(3.5, 2.5, yaw=180.0)
    assert "not found within the specified visibility" in client.fail("OpenObject", objectId="Fridge|1")
    client.stand(5.2, 3.0, horizon=20.0)
    client.do("OpenObject", objectId="Fridge|1")
    assert client.get("Fridge|1")["isOpen"]
    assert client.get("Fridge|1")["openness"] == 1.0
    client.do("OpenObject", objectId="Fridge|1")  # again: no error in THOR
    client.do("CloseObject", objectId="Fridge|1", forceAction=True, openness=0.5)
    assert not client.get("Fridge|1")["isOpen"]


def test_force_opens_from_anywhere_and_part_of_the_way(client):
    client.stand(3.5, 2.5, yaw=180.0)
    client.do("OpenObject", objectId="Fridge|1", openness=0.4, forceAction=True)
    assert client.get("Fridge|1")["openness"] == 0.4
    assert client.fail("OpenObject", objectId="Apple|1", forceAction=True) == "Apple|1 is not an Openable object"
    assert "openness must be in [0:1]" in client.fail("OpenObject", objectId="Fridge|1", openness=2)


def test_a_microwave_runs_only_shut_and_opens_only_off(client):
    client.go_to("Microwave|1")
    client.do("ToggleObjectOn", objectId="Microwave|1")
    assert client.get("Microwave|1")["isToggled"]
    assert client.fail("OpenObject", objectId="Microwave|1") == "Target must be OFF to open!"
    assert "already on" in client.fail("ToggleObjectOn", objectId="Microwave|1")
    client.do("ToggleObjectOff", objectId="Microwave|1")
    client.do("OpenObject", objectId="Microwave|1", forceAction=True)
    message = client.fail("ToggleObjectOn", objectId="Microwave|1")
    assert message == "Target must be closed to Toggle On!" or "visibility" in message


def test_what_is_picked_up_is_in_the_hand_until_it_is_put(client):
    client.go_to("Apple|1")
    found = client.do("PickupObject", objectId="Apple|1")
    assert found["inventoryObjects"] == [{"objectId": "Apple|1", "objectType": "Apple"}]
    assert client.get("Apple|1")["isPickedUp"]
    assert "has something in it already" in client.fail("PickupObject", objectId="Mug|1", forceAction=True)
    client.go_to("CounterTop|1")
    client.do("PutObject", objectId="CounterTop|1")
    assert client.get("Apple|1")["parentReceptacles"] == ["CounterTop|1"]
    assert "Apple|1" in client.get("CounterTop|1")["receptacleObjectIds"]
    assert client.do("Pass")["inventoryObjects"] == []


def test_refusals_are_in_thors_words(client):
    client.stand(3.5, 2.5)
    assert "isn't holding anything" in client.fail("PutObject", objectId="DiningTable|1")
    assert client.fail("DropHandObject") == "Nothing is in the agent's hand to drop!"
    assert "CanPickup" in client.fail("PickupObject", objectId="Fridge|1", forceAction=True)
    assert client.fail("ToggleObjectOn", objectId="Apple|1", forceAction=True) == "object is not toggleable."
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    assert "NOT a receptacle" in client.fail("PutObject", objectId="FloorLamp|1", forceAction=True)
    assert "is CLOSED" in client.fail("PutObject", objectId="Fridge|1", forceAction=True)


def test_what_is_dropped_lies_on_the_floor(client):
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    client.stand(3.5, 2.5, yaw=180.0)
    client.do("DropHandObject")
    assert client.get("Apple|1")["position"]["y"] < 0.2
    assert client.get("Apple|1")["parentReceptacles"] == ["room|1"]
    assert client.get("room|1")["receptacleObjectIds"].count("Apple|1") == 1


def test_force_drops_below_the_hand_what_finds_no_place(client):
    client.do("PickupObject", objectId="Pillow|1", forceAction=True)
    client.stand(3.5, 2.5, yaw=180.0)
    while client.send("MoveAhead")["lastActionSuccess"]:
        pass
    assert "can't be dropped" in client.fail("DropHandObject")
    here = client.do("DropHandObject", forceAction=True)["agent"]["position"]
    pillow = client.get("Pillow|1")
    assert not pillow["isPickedUp"]
    assert pillow["position"]["x"] == pytest.approx(here["x"], abs=1e-3)
    assert 0.1 < here["z"] - pillow["position"]["z"] < 0.41
    client.do("MoveBack")


def test_the_agent_walks_out_of_what_it_stands_in(client):
    client.stand(3.5, 2.5, yaw=180.0)
    client.do("PlaceObjectAtPoint", objectId="Pillow|1", position={"x": 3.5, "y": 0.0, "z": 2.5})
    for _ in range(3):
        client.do("MoveBack", moveMagnitude=0.1)
    there = [{"x": 3.5, "y": 0.9, "z": 2.5}]
    assert client.do("GetInteractablePoses", objectId="Pillow|1", positions=there)["actionReturn"] == []


def test_force_opens_what_reaches_through_a_wall(client):
    house = copy.deepcopy(reference_house().data)
    fridge = next(each for each in house["objects"] if each["id"] == "Fridge|1")
    fridge["rotation"]["y"] += 180.0  # its door now faces the wall behind it
    client.do("CreateHouse", house=house)
    client.do("OpenObject", objectId="Fridge|1", forceAction=True)
    assert client.get("Fridge|1")["openness"] == 1.0
    client.do("CloseObject", objectId="Fridge|1", forceAction=True)


def test_a_thing_is_placed_at_a_point_and_rests_there(client):
    client.do("PlaceObjectAtPoint", objectId="Apple|1", position={"x": 3.0, "y": 0.9225, "z": 4.6})
    assert client.get("Apple|1")["parentReceptacles"] == ["CounterTop|1"]
    assert "must be pickupable" in client.fail("TeleportObject", objectId="CounterTop|1", x=0.0, y=0.0, z=0.0)


def test_poses_place_what_is_named_and_take_the_rest_away(client):
    found = [client.get(name) for name in ("Apple|1", "DiningTable|1")]
    poses = [{"objectName": each["name"], **{key: each[key] for key in ("position", "rotation")}} for each in found]
    client.do("SetObjectPoses", objectPoses=poses)
    left = {each["objectId"]: each for each in client.do("Pass")["objects"]}
    assert left["Apple|1"]["parentReceptacles"] == ["DiningTable|1"]
    assert "Mug|1" not in left
    assert "Fridge|1" in left
    client.do("SetObjectPoses", objectPoses=poses[:1])
    assert client.get("Apple|1")["position"] == found[0]["position"]
    assert "objectPoses[0]" in client.fail("SetObjectPoses", objectPoses=[{"objectName": "Apple|1"}])


def test_what_is_disabled_comes_back(client):
    client.do("DisableObject", objectId="Mug|1")
    assert "Mug|1" not in {each["objectId"] for each in client.do("Pass")["objects"]}
    client.do("EnableObject", objectId="Mug|1")
    assert client.get("Mug|1")["objectType"] == "Mug"
    client.do("RemoveFromScene", objectIds=["Mug|1", "Apple|1"])
    assert "is not the objectId on any object" in client.fail("RemoveFromScene", objectId="Mug|1")


def test_the_old_name_of_openness_still_counts(client):
    client.do("OpenObject", objectId="Fridge|1", moveMagnitude=0.65, forceAction=True)
    assert client.get("Fridge|1")["openness"] == 0.65
    client.do("OpenObject", objectId="Fridge|1", moveMagnitude=0, forceAction=True)
    assert client.get("Fridge|1")["openness"] == 1.0
