"""Random changes of a scene, what the rearrangement challenge asks for, and the hand."""

import math

import numpy as np
import pytest


def poses(client) -> list[dict]:
    loose = [each for each in client.do("Pass")["objects"] if each["pickupable"] or each["moveable"]]
    return [{"objectName": each["name"], "position": each["position"], "rotation": each["rotation"]} for each in loose]


def test_objects_are_spawned_elsewhere_by_the_seed(client):
    first = poses(client)
    client.do("InitialRandomSpawn", randomSeed=3, placeStationary=True, excludedObjectIds=["Mug|1"])
    third = poses(client)
    moved = [old["objectName"] for old, new in zip(first, third, strict=True) if old != new]
    assert len(moved) > 3
    assert "Mug|1" not in moved
    client.start()
    client.do("InitialRandomSpawn", randomSeed=3, excludedObjectIds=["Mug|1"])
    assert poses(client) == third
    client.start()
    client.do("InitialRandomSpawn", randomSeed=4, excludedObjectIds=["Mug|1"])
    assert poses(client) != third
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    assert "held object" in client.fail("InitialRandomSpawn", randomSeed=4)


def test_poses_take_the_rearrangement_challenges_arguments(client):
    wanted = poses(client)
    client.do("InitialRandomSpawn", randomSeed=5)
    settle = {"placeStationary": False, "enablePhysicsJitter": True, "forceRigidbodySleep": True, "skipMoveable": True}
    pickupable = {each["name"] for each in client.do("Pass")["objects"] if each["pickupable"]}
    client.do("SetObjectPoses", objectPoses=[each for each in wanted if each["objectName"] in pickupable], **settle)
    assert poses(client) == wanted
    spots = [{"x": 3.5, "y": 0.1, "z": 2.5}, {"x": 0.0, "y": 0.0, "z": 0.0}]
    client.do("TeleportObject", objectId="Apple|1", positions=spots, rotation=0, makeUnbreakable=True)
    assert client.get("Apple|1")["position"] == pytest.approx(spots[0])
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    assert "held" in client.fail("TeleportObject", objectId="Apple|1", positions=spots, allowTeleportOutOfHand=False)


def test_materials_and_lights_change_and_come_back(client):
    client.do("OpenObject", objectId="Fridge|1", forceAction=True)
    first = client.world.house.data
    for action in ("RandomizeMaterials", "RandomizeColors"):
        client.do("SetRandomSeed", seed=7)
        before = client.world.house.data
        client.do(action)
        assert client.world.house.data["walls"] != before["walls"]
    client.do("RandomizeLighting", brightness=[0.5, 0.6], synchronized=True)
    assert client.get("Fridge|1")["isOpen"]
    client.do("ResetMaterials")
    assert client.world.house.data == first
    client.do("SetRandomSeed", seed=8)
    used = client.do("RandomizeMaterials", inRoomTypes=["Kitchen", "Bathroom"])["actionReturn"]
    assert used["chosenRoomTypes"] == ["Kitchen"]
    assert used["useTrainMaterials"]
    assert not used["useValMaterials"]
    changed = {
        wall["roomId"]
        for wall, old in zip(client.world.house.data["walls"], first["walls"], strict=True)
        if wall != old
    }
    assert changed == {"room|1"}
    assert "Bathroom" in client.fail("RandomizeMaterials", inRoomTypes=["Bathroom"])
    assert "must be true" in client.fail("RandomizeMaterials", useTrainMaterials=False)
    client.do("ResetMaterials")
    assert client.get("Fridge|1")["isOpen"]
    assert "must be in" in client.fail("RandomizeLighting", hue=[0.5, 7.0])


def test_the_held_object_moves_with_the_agent(client):
    assert "hand is empty" in client.fail("MoveHeldObjectAhead", moveMagnitude=0.1)
    client.stand(3.5, 2.5)
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    usual = client.get("Apple|1")["position"]
    hand = client.do("LookDown")["heldObjectPose"]
    assert hand["localPosition"] == {"x": 0.0, "y": -0.16, "z": 0.38}  # the rearrangement challenge asks for this
    client.do("LookUp")
    client.do("MoveHeldObject", ahead=0.1, right=0.2, up=0.05)
    moved = client.get("Apple|1")["position"]
    assert [moved[axis] - usual[axis] for axis in "xyz"] == pytest.approx([0.2, 0.05, 0.1])
    client.do("RotateRight")
    turned = client.do("Pass")["heldObjectPose"]["position"]
    assert [turned["x"] - 3.5, turned["z"] - 2.5] == pytest.approx([0.5, -0.2])
    client.do("RotateHeldObject", yaw=90.0)
    assert client.get("Apple|1")["rotation"]["y"] == pytest.approx((90.0 + 0.0) % 360.0)
    client.do("RotateHeldObject", pitch=90.0, roll=90.0)
    hand = client.do("Pass")["heldObjectPose"]
    assert hand["localRotation"] == pytest.approx({"x": 90.0, "y": 180.0, "z": 0.0})  # as (90, 90, 270)
    assert hand["rotation"]["y"] == pytest.approx(270.0)  # the agent looks to 90
    assert hand["localPosition"] == pytest.approx({"x": 0.2, "y": -0.11, "z": 0.48})
    assert "out of range" in client.fail("MoveHandDelta", x=5.0)
    client.do("DropHandObject", forceAction=True)
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    held = client.do("Pass")["heldObjectPose"]["position"]
    assert [held["x"] - 3.5, held["z"] - 2.5] == pytest.approx([0.4, 0.0], abs=1e-6)


def test_a_push_slides_an_object_until_something_is_in_the_way(client):
    client.stand(3.5, 2.5, yaw=180.0)
    client.do("TeleportObject", objectId="Box|1", position={"x": 3.5, "y": 0.16, "z": 1.5}, rotation=0)
    before = client.get("Box|1")["position"]
    client.do("DirectionalPush", objectId="Box|1", moveMagnitude=200.0, pushAngle=0.0, forceAction=True)
    after = client.get("Box|1")["position"]
    assert after["x"] == pytest.approx(before["x"])
    assert 0.1 < before["z"] - after["z"] <= 1.0
    client.do("DirectionalPush", objectId="Box|1", moveMagnitude=1e5, forceAction=True)
    low = min(corner[2] for corner in client.get("Box|1")["axisAlignedBoundingBox"]["cornerPoints"])
    assert low > 0.0  # the wall is at z = 0
    assert "cannot be moved" in client.fail("PushObject", objectId="Fridge|1", moveMagnitude=5.0, forceAction=True)


def test_a_camera_rolls_and_a_grid_turns_with_the_agent(client):
    pose = {"position": {"x": 3.5, "y": 1.5, "z": 2.5}, "rotation": {"x": 0, "y": 0, "z": 90}}
    client.do("AddThirdPartyCamera", **pose, fieldOfView=90)
    client.do("UpdateThirdPartyCamera", rotation={"z": 0})
    level = client.last.images[-1].data
    client.do("UpdateThirdPartyCamera", rotation={"z": 180})
    flipped = np.frombuffer(client.last.images[-1].data, np.uint8).reshape(24, 32, 3)[::-1, ::-1]
    assert np.array_equal(flipped, np.frombuffer(level, np.uint8).reshape(24, 32, 3))
    client.stand(3.5, 2.5, yaw=45.0)
    places = client.do("GetReachablePositions", directionsRelativeAgent=True, gridSize=0.5)["actionReturn"]
    steps = {
        (round((each["x"] - 3.5) * math.sqrt(8), 6), round((each["z"] - 2.5) * math.sqrt(8), 6)) for each in places
    }
    assert len(steps) > 5
    assert all(float(x).is_integer() and float(z).is_integer() for x, z in steps)
    assert (1.0, 1.0) in steps


def test_hulls_are_outlines_on_the_floor(client):
    hulls = client.do("Get2DSemanticHulls", objectTypes=["Fridge", "Apple"])["actionReturn"]
    assert set(hulls) == {"Fridge|1", "Apple|1"}
    corners = np.array(hulls["Fridge|1"])
    box = client.get("Fridge|1")["axisAlignedBoundingBox"]
    assert np.ptp(corners[:, 0]) == pytest.approx(box["size"]["x"], rel=0.15)
    assert client.do("Get2DSemanticHull", objectId="Apple|1")["actionReturn"] == hulls["Apple|1"]
    assert "not both" in client.fail("Get2DSemanticHulls", objectTypes=["Fridge"], objectIds=["Apple|1"])


def test_a_thrown_object_is_dropped_and_slides_ahead(client):
    client.stand(3.5, 2.5, yaw=180.0)
    assert "Nothing is in the agent's hand" in client.fail("ThrowObject", moveMagnitude=10.0)
    places = []
    for force in (0.0, 10.0):
        client.do("PickupObject", objectId="Apple|1", forceAction=True)
        client.do("ThrowObject", moveMagnitude=force)
        places.append(client.get("Apple|1")["position"])
    assert places[0]["y"] == pytest.approx(places[1]["y"])
    assert places[1]["z"] < places[0]["z"] - 0.05


@pytest.mark.parametrize("force", [True, False])
def test_forced_to_be_visible_nothing_is_put_into_what_opens(client, force):
    places: set[str] = set()
    for seed in range(8):
        before = {each["objectId"]: each["position"] for each in client.do("Pass")["objects"]}
        after = client.do("InitialRandomSpawn", randomSeed=seed, forceVisible=force)["objects"]
        moved = [each for each in after if each["pickupable"] and each["position"] != before[each["objectId"]]]
        assert moved
        places |= {parent for each in moved for parent in each["parentReceptacles"] or ()}
    opening = {each["objectId"] for each in client.do("Pass")["objects"] if each["openable"]}
    assert bool(places & opening) != force
