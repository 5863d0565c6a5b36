"""What metadata say of objects and floors, and the actions that change an object's flags."""

import numpy as np
import pytest

from vigil.thor.base.images import NUMBER_OF_FLOOR, with_floors


def test_what_can_be_moved_has_an_oriented_box(client):
    found = {each["objectId"]: each for each in client.do("Pass")["objects"]}
    loose = {name for name, each in found.items() if each["pickupable"] or each["moveable"]}
    assert {name for name, each in found.items() if each["objectOrientedBoundingBox"]} == loose
    client.do("PlaceObjectAtPoint", objectId="Box|1", position={"x": 3.5, "y": 0.0, "z": 2.5}, rotation=30)
    box = client.get("Box|1")
    corners = np.array(box["objectOrientedBoundingBox"]["cornerPoints"])
    sides = np.linalg.norm(corners - corners[0], axis=1)
    upright = box["axisAlignedBoundingBox"]["size"]
    assert corners.shape == (8, 3)
    assert sorted(sides)[1] < upright["x"]  # the upright box around a turned box is larger
    assert corners.mean(axis=0).tolist() == pytest.approx([box["position"][axis] for axis in "xyz"])


def test_properties_are_those_of_the_category(client):
    fridge, apple, mug = (client.get(name) for name in ("Fridge|1", "Apple|1", "Mug|1"))
    assert fridge["isColdSource"]
    assert not apple["isColdSource"]
    assert [each["sliceable"] for each in (apple, mug)] == [True, False]
    assert [each["canFillWithLiquid"] for each in (apple, mug)] == [False, True]
    assert client.get("Microwave|1")["isHeatSource"]
    assert 0.0 < apple["mass"] < client.get("Box|1")["mass"]
    assert apple["salientMaterials"] == ["Food", "Plastic"]
    assert client.get("Lettuce|1")["temperature"] == "Cold"
    assert apple["temperature"] == "RoomTemp"


def test_flags_change_by_actions_and_are_gone_with_a_new_house(client):
    client.do("SliceObject", objectId="Apple|1", forceAction=True)
    assert client.get("Apple|1")["isSliced"]
    assert "already" in client.fail("SliceObject", objectId="Apple|1", forceAction=True)
    assert "is not sliceable" in client.fail("SliceObject", objectId="Mug|1", forceAction=True)
    client.do("FillObjectWithLiquid", objectId="Mug|1", fillLiquid="coffee", forceAction=True)
    assert client.get("Mug|1")["fillLiquid"] == "coffee"
    assert "water" in client.fail("FillObjectWithLiquid", objectId="Mug|1", fillLiquid="oil", forceAction=True)
    client.do("EmptyLiquidFromObject", objectId="Mug|1", forceAction=True)
    assert client.get("Mug|1")["fillLiquid"] is None
    client.start()
    assert not client.get("Apple|1")["isSliced"]


def test_states_are_set_for_all_objects_of_a_type(client):
    client.do(
        "SetObjectStates", SetObjectStates={"objectType": "FloorLamp", "stateChange": "toggleable", "isToggled": True}
    )
    assert all(client.get(f"FloorLamp|{number}")["isToggled"] for number in (1, 2))
    client.do("SetObjectStates", SetObjectStates={"objectType": "Fridge", "stateChange": "openable", "isOpen": True})
    assert client.get("Fridge|1")["isOpen"]
    assert not client.get("Microwave|1")["isOpen"]
    client.do("SetObjectStates", SetObjectStates={"stateChange": "canFillWithLiquid", "isFilledWithLiquid": True})
    assert client.get("Mug|1")["fillLiquid"] == "water"
    assert not client.get("Apple|1")["isFilledWithLiquid"]
    assert "heavy" in client.fail("SetObjectStates", SetObjectStates={"stateChange": "heavy"})


def test_an_emphasized_object_is_all_that_images_show(client):
    client.go_to("Fridge|1")
    usual = pixels(client)
    client.do("EmphasizeObject", objectId="Fridge|1")
    alone = pixels(client)
    assert set(map(tuple, alone.tolist())) == {(255, 0, 255), (0, 0, 0)}
    assert "Nix" in client.fail("EmphasizeObject", objectId="Nix|1")
    client.do("UnemphasizeAll")
    assert np.array_equal(pixels(client), usual)


def pixels(client) -> np.ndarray:
    return np.frombuffer(client.last.images[0].data, np.uint8).reshape(-1, 3)


def test_what_is_unbreakable_does_not_break(client):
    client.do("MakeAllObjectsUnbreakable")
    assert "unbreakable" in client.fail("BreakObject", objectId="Mug|1", forceAction=True)
    client.do("MakeObjectBreakable", objectId="Mug|1")
    client.do("BreakObject", objectId="Mug|1", forceAction=True)
    assert client.get("Mug|1")["isBroken"]


def test_each_room_has_a_floor(client):
    floors = {each["objectId"]: each for each in client.do("Pass")["objects"] if each["objectType"] == "Floor"}
    assert list(floors) == ["room|1", "room|2"]
    assert "Box|1" in floors["room|1"]["receptacleObjectIds"]
    assert client.get("Box|1")["parentReceptacles"] == ["room|1"]
    assert client.get("Apple|1")["parentReceptacles"] != ["room|1"]
    assert floors["room|1"]["receptacle"]
    client.stand(3.5, 2.5, horizon=60.0)
    assert [client.get(name)["visible"] for name in floors] == [True, False]
    assert client.do("GetObjectInFrame", x=0.5, y=0.9)["actionReturn"] == "room|1"
    assert client.fail("OpenObject", objectId="room|1") == "room|1 is not an Openable object"
    client.do("PickupObject", objectId="Apple|1", forceAction=True)
    client.do("PutObject", objectId="room|1")
    assert client.get("Apple|1")["parentReceptacles"] == ["room|1"]


def test_masks_tell_the_floors_apart(client):
    client.stand(5.4, 2.5, yaw=90.0, horizon=30.0)  # the wall between the rooms is at x = 6
    world = client.world
    shown = with_floors(world, world.view(), np.full((24, 32), NUMBER_OF_FLOOR, np.int32))
    count = len(world.editor.scene().things)
    assert shown[-1, 15:17].tolist() == [count] * 2  # the bottom row shows the near room
    assert shown[12, 15:17].tolist() == [count + 1] * 2
    assert shown[0, 0] == NUMBER_OF_FLOOR  # above the horizon
