"""What the engine answers: metadata field by field, pictures, and errors as AI2-THOR's."""

import json

import numpy as np
import pytest

from vigil.thor.base.images import colour_of

VECTOR = {"x": float, "y": float, "z": float}
BOX = {"cornerPoints": list, "center": VECTOR, "size": VECTOR}
NAMES = ("name", "objectId", "objectType", "ObjectTemperature", "temperature", "assetId")
FLAGS = (
    *("visible", "obstructed", "receptacle", "toggleable", "isToggled", "breakable", "isBroken", "canFillWithLiquid"),
    *("isFilledWithLiquid", "dirtyable", "isDirty", "canBeUsedUp", "isUsedUp", "cookable", "isCooked", "isHeatSource"),
    *("isColdSource", "sliceable", "isSliced", "openable", "isOpen", "pickupable", "isPickedUp", "moveable"),
    *("isMoving", "isInteractable"),
)
OBJECT = {
    **dict.fromkeys(NAMES, str),
    **dict.fromkeys(FLAGS, bool),
    **dict.fromkeys(("mass", "distance", "openness"), float),
    **dict.fromkeys(("position", "rotation"), VECTOR),
    **dict.fromkeys(
        ("receptacleObjectIds", "parentReceptacles", "salientMaterials", "controlledObjects"), (list, None)
    ),
    "fillLiquid": None,
    "objectOrientedBoundingBox": (dict, None),
    "axisAlignedBoundingBox": BOX,
}
AGENT = {
    "agent": {
        "name": str,
        "position": VECTOR,
        "rotation": VECTOR,
        "cameraHorizon": float,
        "isStanding": bool,
        "inHighFrictionArea": bool,
    },
    "heldObjectPose": dict.fromkeys(("position", "rotation", "localPosition", "localRotation"), VECTOR),
    "cameraPosition": VECTOR,
    "vigil": {"house": (str, None), "notes": int, "note": str},
    "sceneBounds": BOX,
    **dict.fromkeys(("fov", "cameraOrthSize", "actionFloatReturn", "currentTime"), float),
    **dict.fromkeys(("screenWidth", "screenHeight", "agentId", "actionIntReturn"), int),
    **dict.fromkeys(("sceneName", "lastAction", "errorMessage", "depthFormat"), str),
    **dict.fromkeys(("lastActionSuccess", "isSceneAtRest", "collided"), bool),
    **dict.fromkeys(("thirdPartyCameras", "inventoryObjects", "collidedObjects", "flatSurfacesOnGrid"), list),
    **dict.fromkeys(("distances", "normals", "isOpenableGrid", "segmentedObjectIds", "objectIdsInBox"), list),
    **dict.fromkeys(("actionStringsReturn", "actionFloatsReturn", "actionVector3sReturn", "objects"), list),
    **dict.fromkeys(("errorCode", "colors", "colorBounds"), (None,)),
    **dict.fromkeys(("actionReturn", "visibleRange"), (dict, None)),
}
"""The fields of the schema in AI2-THOR's own tests, those that its client or programs read besides, and our own."""


def check(value, kind, place: str) -> None:
    if isinstance(kind, dict):
        assert set(kind) == set(value), place
        for name, inner in kind.items():
            check(value[name], inner, f"{place}.{name}")
    elif isinstance(kind, tuple):
        assert any(value is None if each is None else isinstance(value, each) for each in kind), (place, value)
    elif kind is None:
        assert value is None, place
    else:
        assert type(value) is kind, (place, value)


def test_every_field_is_there_and_of_its_type(client):
    found = client.do("Pass")
    check(found, AGENT, "agent")
    assert len(found["objects"]) > 15
    for each in found["objects"]:
        check(each, OBJECT, each["objectId"])
        assert len(each["axisAlignedBoundingBox"]["cornerPoints"]) == 8
    assert client.get("Apple|1")["assetId"]
    json.dumps(client.last.metadata, allow_nan=False)
    assert client.last.metadata["sequenceId"] == client.sequence


def test_before_a_house_there_is_an_empty_world(client):
    found = client.send("Reset", sceneName="Procedural")
    check(found, AGENT, "agent")
    assert found["objects"] == []
    assert "There is no house yet" in client.fail("MoveAhead")
    assert not any(client.last.images[0].data)


@pytest.mark.parametrize(
    ("action", "arguments", "code", "message"),
    [
        ("Fly", {}, "InvalidAction", "Invalid action: Fly"),
        ("OpenObject", {}, "MissingArguments", "action: OpenObject is missing the following arguments: objectId"),
        ("MoveAhead", {"speed": 1}, "InvalidArgument", "called with invalid argument: 'speed'"),
        ("MoveAhead", {"moveMagnitude": "far"}, "InvalidArgument", "moveMagnitude (==far). Cannot convert to: float"),
        ("Teleport", {"position": 3}, None, "Cannot convert to: Vector3"),
        ("Crouch", {"agentId": 1}, None, "the scene has 1 agents"),
        ("OpenObject", {"objectId": "Nix|1"}, None, "objectId: Nix|1 is not the objectId on any object in the scene!"),
    ],
)
def test_what_makes_no_sense_fails_as_in_thor(client, action, arguments, code, message):
    found = client.send(action, **arguments)
    assert not found["lastActionSuccess"]
    assert found["errorCode"] == code
    assert message in found["errorMessage"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"agentMode": "arm"}, "hand without an arm"),
        ({"renderNormalsImage": True}, "not supported"),
        ({"gridSize": 9}, "gridSize"),
        ({"fieldOfView": 200}, "fieldOfView"),
        ({"snapToGrid": True, "rotateStepDegrees": 30}, "rotateStepDegrees"),
    ],
)
def test_settings_that_cannot_be_are_refused(client, settings, message):
    assert message in client.fail("Initialize", **settings)


def test_settings_that_do_nothing_here_are_taken(client):
    found = client.do("Initialize", autoSimulation=False, massThreshold=1, renderObjectImage=True, timeScale=2.0)
    assert found["actionReturn"] == {"cameraNearPlane": 0.1, "cameraFarPlane": 20.0}
    client.do("ChangeOpenSpeed", x=1000.0)
    client.do("RotateRight", actionSimulationSeconds=0.26, fixedDeltaTime=0.02)
    assert found["colors"]


def test_a_house_that_cannot_be_built_says_why(client):
    assert client.fail("CreateHouse", house={"rooms": []}).startswith(
        "Exception creating house: House 'house' has no rooms"
    )
    assert client.do("Pass")["objects"] == []
    assert "does not exist in this engine" in client.fail("Reset", sceneName="FloorPlan31_physics")


def test_pictures_are_of_the_size_and_layers_asked_for(client):
    client.start(renderDepthImage=True, renderInstanceSegmentation=True, renderSemanticSegmentation=True)
    client.do("AddThirdPartyCamera", position={"x": 3, "y": 2, "z": 2}, rotation={"x": 60}, fieldOfView=60)
    client.do("ChangeResolution", x=40, y=24)
    kinds = [(image.kind, image.is_third_party) for image in client.last.images]
    assert kinds == [(kind, third) for third in (False, True) for kind in ("image", "depth", "ids", "classes")]
    sizes = {image.kind: len(image.data) for image in client.last.images}
    assert sizes == {"image": 40 * 24 * 3, "depth": 40 * 24 * 4, "ids": 40 * 24 * 4, "classes": 40 * 24 * 4}


def test_an_action_may_ask_for_no_picture(client):
    client.start(renderDepthImage=True, renderInstanceSegmentation=True)
    client.do("Pass", renderImage=False)
    assert client.last.images == []
    client.do("Pass", renderImage=False, renderInstanceSegmentation=True)
    assert [image.kind for image in client.last.images] == ["depth", "ids"]


def test_masks_lead_back_to_objects(client):
    client.start(renderInstanceSegmentation=True)
    client.go_to("Fridge|1")
    found = client.do("Pass")
    colours = {tuple(each["color"]): each["name"] for each in found["colors"]}
    ids = next(image.data for image in client.last.images if image.kind == "ids")
    drawn = {tuple(pixel[:3].tolist()) for pixel in np.frombuffer(ids, np.uint8).reshape(-1, 4)}
    assert "Fridge|1" in {colours.get(colour) for colour in drawn}
    assert len(colours) == len(found["colors"])
    assert colour_of("Fridge|1") == list(next(key for key, name in colours.items() if name == "Fridge|1"))


def test_cameras_that_cannot_be_are_refused(client):
    place = {"x": 3, "y": 2, "z": 2}
    assert "orthographicSize" in client.fail("AddThirdPartyCamera", position=place, rotation={}, orthographic=True)
    assert "there are 0 cameras" in client.fail("UpdateThirdPartyCamera", thirdPartyCameraId=0)
    client.do("AddThirdPartyCamera", position=place, rotation={})
    client.do("UpdateThirdPartyCamera", thirdPartyCameraId=0, fieldOfView=40.0)
    assert client.last.metadata["thirdPartyCameras"][0]["fieldOfView"] == 40.0


def test_a_camera_keeps_what_an_update_leaves_out(client):
    client.do("AddThirdPartyCamera", position={"x": 3, "y": 2, "z": 2}, rotation={"x": 30, "y": 40}, fieldOfView=45)
    client.do("UpdateThirdPartyCamera", position={"x": 1, "z": 4}, rotation={"y": 90}, fieldOfView=55)
    camera = client.last.metadata["thirdPartyCameras"][0]
    assert camera["position"] == {"x": 1.0, "y": 2.0, "z": 4.0}
    assert camera["rotation"] == {"x": 30.0, "y": 90.0, "z": 0.0}
    for wrong in (-1, 0, 181):
        assert "fov must be set" in client.fail("UpdateThirdPartyCamera", fieldOfView=wrong)
    assert client.last.metadata["thirdPartyCameras"][0] == camera


def test_one_action_may_ask_for_masks(client):
    client.do("RotateRight")
    assert [image.kind for image in client.last.images] == ["image"]
    assert client.do("Pass", renderInstanceSegmentation=True)["colors"]
    assert [image.kind for image in client.last.images] == ["image", "ids"]
    client.do("Pass")
    assert [image.kind for image in client.last.images] == ["image"]


def test_what_is_here_already_may_be_asked_for(client):
    before = client.do("Pass")["objects"]
    assert client.do("ResetMaterials")["objects"] == client.do("SetRandomSeed", seed=3)["objects"] == before


def test_the_answer_to_a_filter_is_filtered(client):
    assert [each["objectId"] for each in client.do("SetObjectFilter", objectIds=["Fridge|1"])["objects"]] == [
        "Fridge|1"
    ]
    assert len(client.do("ResetObjectFilter")["objects"]) > 1
