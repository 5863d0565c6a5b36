"""Cases of AI2-THOR's suite about the agent, the wires and the metadata, written for a house of this project."""

from typing import Any

import numpy as np

from sweeps.support.thor_trial import LOOK, SCENE, DoesNotApplyError, Trial, near, raises

NO_TURN = {"x": 0.0, "y": 0.0, "z": 0.0}


def stochastic_controller(trial: Trial) -> None:
    assert trial.reset(agentControllerType="stochastic")


def multi_agent_with_third_party_camera(trial: Trial) -> None:
    event = trial.reset(agentCount=2)
    assert not np.array_equal(event.events[0].frame, event.events[1].frame)
    event = trial.do("AddThirdPartyCamera", position={"x": 1.0, "y": 1.0, "z": 1.0}, rotation={"x": 0, "y": 0, "z": 90})
    assert not np.array_equal(event.events[0].frame, event.events[1].frame)
    assert [len(each.third_party_camera_frames) for each in event.events] == [1, 1]


def third_party_camera_with_image_synthesis(trial: Trial) -> None:
    trial.reset(renderInstanceSegmentation=True, renderDepthImage=True, renderSemanticSegmentation=True)
    event = trial.do("AddThirdPartyCamera", position={"x": 1.0, "y": 1.0, "z": 1.0}, rotation={"x": 0, "y": 0, "z": 90})
    kinds = ("depth", "semantic_segmentation", "instance_segmentation", "camera")
    assert all(len(getattr(event, f"third_party_{kind}_frames")) == 1 for kind in kinds)


def rectangle_aspect(trial: Trial) -> None:
    trial.reset(width=600, height=300)
    assert trial.do("Initialize", gridSize=0.25).frame.shape == (300, 600, 3)


def small_aspect(trial: Trial) -> None:
    trial.reset(width=128, height=64)
    assert trial.do("Initialize", gridSize=0.25).frame.shape == (64, 128, 3)


def bot_deprecation(trial: Trial) -> None:
    assert trial.reset(agentMode="bot")
    assert trial.controller.initialization_parameters["agentMode"].lower() == "locobot"


def deprecated_segmentation_params(trial: Trial) -> None:
    _masks(trial.reset(renderObjectImage=True, renderClassImage=True))


def deprecated_segmentation_params2(trial: Trial) -> None:
    _masks(trial.reset(renderSemanticSegmentation=True, renderInstanceSegmentation=True))


def _masks(event: Any) -> None:
    assert event.semantic_segmentation_frame is not None
    assert event.class_segmentation_frame is event.semantic_segmentation_frame
    assert event.instance_segmentation_frame is not None


def reset(trial: Trial) -> None:
    event = trial.reset(width=520, height=310, renderDepthImage=True)
    assert event.frame.shape == (310, 520, 3)
    assert event.depth_frame.shape == (310, 520)
    event = trial.reset(renderDepthImage=False)
    assert event.depth_frame is None
    assert event.frame.shape == (300, 300, 3)


def fast_emit(trial: Trial) -> None:
    """Check that an action that only reads leaves the old metadata in place (Unity's test action: `TestFastEmit`)."""
    if trial.controller.server.server_type == "WSGI":
        raise DoesNotApplyError("only named pipes have answers without images")
    turned = trial.step("RotateRight")
    read = trial.do("GetReachablePositions")
    looked = trial.do("LookUp")
    assert read.metadata["actionReturn"]
    assert turned.metadata["objects"] is read.metadata["objects"]
    assert read.metadata["objects"] is not looked.metadata["objects"]


def fast_emit_disabled(trial: Trial) -> None:
    trial.reset(fastActionEmit=False)
    turned = trial.step("RotateRight")
    assert turned.metadata["objects"] is not trial.do("GetReachablePositions").metadata["objects"]


def fifo_large_input(trial: Trial) -> None:
    """Check that a long argument arrives whole (Unity's test action `TestActionReflectParam` would send it back)."""
    name = "x" * 16384
    assert name in trial.fail("RemoveFromScene", objectId=name)


def _facing(trial: Trial) -> dict[str, Any]:
    trial.step("RotateLook", rotation=0, horizon=0)
    agent = trial.data["agent"]
    assert agent["cameraHorizon"] == 0.0
    assert agent["rotation"] == NO_TURN
    return agent


def _looks(trial: Trial, action: str, horizons: list[float]) -> None:
    before = _facing(trial)
    for horizon in horizons:
        trial.step(action)
        assert round(trial.data["agent"]["cameraHorizon"]) == horizon
    assert trial.data["agent"]["position"] == before["position"]
    assert trial.data["agent"]["rotation"] == NO_TURN


def lookdown(trial: Trial) -> None:
    _looks(trial, "LookDown", [30.0, 60.0, 60.0])


def lookup(trial: Trial) -> None:
    _looks(trial, "LookUp", [-30.0, -30.0])


def no_leak_params(trial: Trial) -> None:
    action = {"action": "RotateLook", "rotation": 0, "horizon": 0}
    trial.controller.step(action)
    assert "sequenceId" not in action


def target_invocation_exception(trial: Trial) -> None:
    trial.fail("OpenObject", x=1.5, y=0.5)


def _turns(trial: Trial, action: str, yaw: float) -> None:
    before = _facing(trial)
    agent = trial.do(action).metadata["agent"]
    assert agent["position"] == before["position"]
    assert agent["cameraHorizon"] == before["cameraHorizon"]
    assert agent["rotation"] == {**NO_TURN, "y": yaw}


def rotate_left(trial: Trial) -> None:
    _turns(trial, "RotateLeft", 270.0)


def rotate_right(trial: Trial) -> None:
    _turns(trial, "RotateRight", 90.0)


def rotate_look(trial: Trial) -> None:
    before = _facing(trial)
    agent = trial.do("RotateLook", rotation=90, horizon=31).metadata["agent"]
    assert agent["position"] == before["position"]
    assert int(agent["cameraHorizon"]) == 31
    assert agent["rotation"] == {**NO_TURN, "y": 90.0}


def action_dispatch_missing_args(trial: Trial) -> None:
    with raises():
        trial.step("OpenObject")
    assert trial.data["errorCode"] == "MissingArguments"


def action_dispatch_invalid_action(trial: Trial) -> None:
    with raises():
        trial.step("NoActionOfThisName")
    assert trial.data["errorCode"] == "InvalidAction"


def invalid_arguments(trial: Trial) -> None:
    with raises():
        trial.step("PutObject", x=0.0, y=0.0, z=1.0, forceAction=False, placeStationary=True)
    assert not trial.data["lastActionSuccess"]
    assert trial.data["errorMessage"]


def _moves(trial: Trial, action: str, x: float, z: float, **arguments: Any) -> None:
    place = trial.base()
    trial.do(action, **arguments)
    near(trial.data["agent"]["position"], {"x": place["x"] + x, "y": place["y"], "z": place["z"] + z})


def moveahead(trial: Trial) -> None:
    _moves(trial, "MoveAhead", 0.0, 0.25)


def moveback(trial: Trial) -> None:
    _moves(trial, "MoveBack", 0.0, -0.25)


def moveleft(trial: Trial) -> None:
    _moves(trial, "MoveLeft", -0.25, 0.0)


def moveright(trial: Trial) -> None:
    _moves(trial, "MoveRight", 0.25, 0.0)


def moveahead_mag(trial: Trial) -> None:
    _moves(trial, "MoveAhead", 0.0, 0.5, moveMagnitude=0.5)


def moveahead_fail(trial: Trial) -> None:
    trial.base()
    trial.fail("MoveAhead", moveMagnitude=9.0)


AGENT_FIELDS = (
    "objects isSceneAtRest agent heldObjectPose fov cameraPosition cameraOrthSize thirdPartyCameras collided "
    "collidedObjects inventoryObjects sceneName lastAction errorMessage errorCode lastActionSuccess screenWidth "
    "screenHeight agentId colors colorBounds flatSurfacesOnGrid distances normals isOpenableGrid segmentedObjectIds "
    "objectIdsInBox actionIntReturn actionFloatReturn actionStringsReturn actionFloatsReturn actionVector3sReturn "
    "visibleRange currentTime sceneBounds actionReturn"
)
OBJECT_FIELDS = (
    "name position rotation visible obstructed receptacle toggleable isToggled breakable isBroken canFillWithLiquid "
    "isFilledWithLiquid dirtyable isDirty canBeUsedUp isUsedUp cookable isCooked isHeatSource isColdSource sliceable "
    "isSliced openable isOpen openness pickupable isPickedUp moveable mass salientMaterials receptacleObjectIds "
    "distance objectType objectId parentReceptacles controlledObjects isMoving axisAlignedBoundingBox "
    "objectOrientedBoundingBox fillLiquid"
)


def jsonschema_metadata(trial: Trial) -> None:
    found = trial.do("Pass").metadata
    assert not [name for name in AGENT_FIELDS.split() if name not in found]
    assert found["objects"]
    missing = {name for each in found["objects"] for name in OBJECT_FIELDS.split() if name not in each}
    assert not missing, missing


def get_scenes_in_build(trial: Trial) -> None:
    found = set(trial.do("GetScenesInBuild").metadata["actionReturn"])
    wanted = [*trial.controller.ithor_scenes(), *trial.controller.robothor_scenes()]
    assert (
        not {f"{name}_physics" if name.startswith("FloorPlan") and "_" not in name else name for name in wanted} - found
    )


def get_reachable_positions(trial: Trial) -> None:
    event = trial.do("GetReachablePositions")
    assert event.metadata["actionReturn"]
    assert event.metadata["actionReturn"] == event.metadata["reachablePositions"]
    assert "reachablePositions" not in event.metadata
    try:
        trial.do("Pass").metadata["reachablePositions"]
    except (IndexError, KeyError):
        return
    raise AssertionError("reachablePositions are there after another action")


def get_reachable_positions_with_directions_relative_agent(trial: Trial) -> None:
    place = trial.base()
    aligned = trial.do("GetReachablePositions").metadata["actionReturn"]
    trial.do("TeleportFull", **place, rotation={"x": 0, "y": 49.11111, "z": 0}, **LOOK)
    assert len(trial.do("GetReachablePositions").metadata["actionReturn"]) == len(aligned)
    turned = trial.do("GetReachablePositions", directionsRelativeAgent=True).metadata["actionReturn"]
    assert 0.5 * len(aligned) < len(turned) < 2.0 * len(aligned)
    assert {(each["x"], each["z"]) for each in turned} != {(each["x"], each["z"]) for each in aligned}


def teleport(trial: Trial) -> None:
    place = trial.base()
    pose = {"rotation": NO_TURN, **LOOK}
    trial.do("TeleportFull", **{**place, "y": 0.95}, **pose)
    near(trial.data["agent"]["position"], place)
    before = trial.data["agent"]["position"]
    trial.fail("Teleport", **{**place, "y": 1.0}, **pose)
    assert trial.data["agent"]["position"] == before
    fridge = trial.first("Fridge")["position"]
    trial.fail("Teleport", position={**fridge, "y": place["y"]}, **pose)
    low = trial.data["sceneBounds"]["center"]["z"] - trial.data["sceneBounds"]["size"]["z"] / 2
    trial.fail("Teleport", **{**place, "z": low}, **pose)
    _tilts(trial)
    for action in ("Teleport", "TeleportFull"):
        trial.fail(action, position={"x": 2000, "y": 0, "z": 9000}, rotation={"x": 0, "y": 90, "z": 0}, **LOOK)
    assert trial.reset(SCENE, agentMode="locobot").metadata["agent"]["isStanding"] is None
    turned = {"position": place, "rotation": {"x": 0, "y": 90, "z": 0}, "horizon": 30}
    for action in ("Teleport", "TeleportFull"):
        trial.do(action, **turned)
        with raises():
            trial.step(action, **turned, standing=True)
        trial.fail(action, **{**turned, "position": {"x": 2000, "y": 0, "z": 9000}})
    _tilts(trial)


def _tilts(trial: Trial) -> None:
    before = trial.data["agent"]
    after = trial.do("Teleport", horizon=10).metadata["agent"]
    assert abs(after["cameraHorizon"] - 10) < 1e-2
    assert {**after, "cameraHorizon": 0} == {**before, "cameraHorizon": 0}


CASES = (
    stochastic_controller,
    multi_agent_with_third_party_camera,
    third_party_camera_with_image_synthesis,
    rectangle_aspect,
    small_aspect,
    bot_deprecation,
    deprecated_segmentation_params,
    deprecated_segmentation_params2,
    reset,
    fast_emit,
    fifo_large_input,
    fast_emit_disabled,
    lookdown,
    no_leak_params,
    target_invocation_exception,
    lookup,
    rotate_left,
    rotate_look,
    rotate_right,
    action_dispatch_missing_args,
    action_dispatch_invalid_action,
    moveahead,
    moveback,
    moveleft,
    moveright,
    moveahead_mag,
    moveahead_fail,
    jsonschema_metadata,
    get_scenes_in_build,
    get_reachable_positions,
    teleport,
    get_reachable_positions_with_directions_relative_agent,
    invalid_arguments,
)
