"""Cases of AI2-THOR's suite about objects, cameras, images and materials, written for a house of this project."""

from typing import Any

import numpy as np

from sweeps.support.thor_trial import LOOK, DoesNotApplyError, Trial, apart, near, raises

SPOT = {"x": 1.2, "y": 2.3, "z": 3.4}
TURN = {"x": 30.0, "y": 40.0, "z": 50.0}
FAR = 10.0
"""Mean difference (of 255) from which two images count as different."""


def simobj_filter(trial: Trial) -> None:
    everything = sorted(each["objectId"] for each in trial.data["objects"])
    some = everything[:3]
    assert sorted(each["objectId"] for each in trial.do("SetObjectFilter", objectIds=some).metadata["objects"]) == some
    assert trial.do("SetObjectFilter", objectIds=[]).metadata["objects"] == []
    assert sorted(each["objectId"] for each in trial.do("ResetObjectFilter").metadata["objects"]) == everything


def _camera(trial: Trial, spot: dict[str, float], turn: dict[str, float], view: float) -> None:
    [camera] = trial.data["thirdPartyCameras"]
    near(camera["position"], spot)
    near(camera["rotation"], turn)
    assert camera["fieldOfView"] == view


def add_third_party_camera(trial: Trial) -> None:
    assert trial.data["thirdPartyCameras"] == []
    trial.do("AddThirdPartyCamera", position=SPOT, rotation=TURN, fieldOfView=45.0)
    _camera(trial, SPOT, TURN, 45.0)
    trial.fail("AddThirdPartyCamera", position=5, rotation=TURN)
    with raises("action: AddThirdPartyCamera has an invalid argument: orthographicSize"):
        trial.step("AddThirdPartyCamera", position=SPOT, rotation=TURN, orthographic=True, orthographicSize=SPOT)


def update_third_party_camera(trial: Trial) -> None:
    trial.do("AddThirdPartyCamera", position=SPOT, rotation=TURN, fieldOfView=45.0)
    spot, turn = {"x": 2.2, "y": 3.3, "z": 4.4}, {"x": 10.0, "y": 20.0, "z": 30.0}
    trial.do("UpdateThirdPartyCamera", thirdPartyCameraId=0, position=spot, rotation=turn)
    _camera(trial, spot, turn, 45.0)
    some = {"position": {"x": 3.2, "z": 5.0}, "rotation": {"y": 90.0}}
    trial.do("UpdateThirdPartyCamera", thirdPartyCameraId=0, fieldOfView=55.0, **some)
    wanted = {**spot, **some["position"]}, {**turn, **some["rotation"]}, 55.0
    _camera(trial, *wanted)
    for view in (-1, 181, 0):
        trial.fail("UpdateThirdPartyCamera", thirdPartyCameraId=0, fieldOfView=view)
        _camera(trial, *wanted)


def third_party_camera_depth(trial: Trial) -> None:
    trial.reset(renderDepthImage=True)
    place = trial.base()
    eye = trial.data["cameraPosition"]
    pose = {"rotation": {"x": 0.0, "y": 90.0, "z": 0.0}, **LOOK}
    trial.do("Teleport", **{**place, "z": place["z"] + 0.25}, **pose)
    seen = trial.do("AddThirdPartyCamera", position=eye, rotation=pose["rotation"]).third_party_depth_frames[0]
    own = trial.do("Teleport", **place, **pose).depth_frame
    assert np.square(seen - own).mean() < 1e-4


def open_aabb_cache(trial: Trial) -> None:
    fridge = trial.first("Fridge")
    shut = fridge["axisAlignedBoundingBox"]["size"]
    trial.do("OpenObject", objectId=fridge["objectId"], forceAction=True)
    assert trial.first("Fridge")["axisAlignedBoundingBox"]["size"] != shut
    trial.do("CloseObject", objectId=fridge["objectId"], forceAction=True)
    assert trial.first("Fridge")["axisAlignedBoundingBox"]["size"] == shut


def toggle_stove(trial: Trial) -> None:
    """Check that a stove's switch can be toggled (a knob in THOR; here the stove has no knobs of its own)."""
    knob = next(
        each for each in trial.data["objects"] if each["objectType"] in ("StoveKnob", "Stove") and each["toggleable"]
    )
    assert not knob["isToggled"]
    trial.go_to(knob["objectId"])
    assert trial.get(knob["objectId"])["visible"]
    trial.do("ToggleObjectOn", objectId=knob["objectId"])
    assert trial.get(knob["objectId"])["isToggled"]


def _fridge_in_view(trial: Trial) -> str:
    name = trial.first("Fridge")["objectId"]
    poses = trial.do("GetInteractablePoses", objectId=name, horizons=[0], standings=[True]).metadata["actionReturn"]
    farthest = max(poses, key=lambda pose: np.hypot(*(pose[axis] - trial.get(name)["position"][axis] for axis in "xz")))
    trial.do("TeleportFull", **farthest)
    assert trial.get(name)["visible"]
    return name


def open_interactable(trial: Trial) -> None:
    name = _fridge_in_view(trial)
    trial.do("OpenObject", objectId=name)
    assert trial.get(name)["isOpen"]


def open_interactable_with_filter(trial: Trial) -> None:
    name = _fridge_in_view(trial)
    assert trial.do("SetObjectFilter", objectIds=[]).metadata["objects"] == []
    trial.do("OpenObject", objectId=name)
    trial.do("ResetObjectFilter")
    assert trial.get(name)["isOpen"]


def open_(trial: Trial) -> None:
    name = trial.first("Fridge")["objectId"]

    def opened(wanted: float, action: str = "OpenObject", **how: float) -> None:
        trial.do(action, objectId=name, forceAction=True, **how)
        assert abs(trial.get(name)["openness"] - wanted) < 1e-3
        assert trial.get(name)["isOpen"] == (wanted != 0.0)

    for openness in (0.5, 0.7, 0.0):
        opened(openness, openness=openness)
    for openness in (-0.5, 1.5):
        trial.fail("OpenObject", objectId=name, forceAction=True, openness=openness)
    opened(1.0, moveMagnitude=0)
    opened(0.65, moveMagnitude=0.65)
    opened(0.0, "CloseObject")


def per_step_instance_segmentation(trial: Trial) -> None:
    trial.reset(renderInstanceSegmentation=False)
    assert trial.step("RotateRight").instance_segmentation_frame is None
    assert trial.step("Pass", renderInstanceSegmentation=True).instance_segmentation_frame is not None


def change_resolution_image_synthesis(trial: Trial) -> None:
    trial.reset(renderInstanceSegmentation=True, renderDepthImage=True, renderSemanticSegmentation=True)
    first = trial.step("RotateRight")
    kinds = ("depth_frame", "instance_segmentation_frame", "semantic_segmentation_frame")
    old = [getattr(first, kind) for kind in kinds]
    large = trial.do("ChangeResolution", x=500, y=500)
    assert [getattr(large, kind).shape[:2] for kind in kinds] == [(500, 500)] * 3
    again = trial.do("ChangeResolution", x=300, y=300)
    assert all(np.allclose(getattr(again, kind), seen, atol=1e-3) for kind, seen in zip(kinds, old, strict=True))
    assert first.color_to_object_id == again.color_to_object_id
    assert first.object_id_to_color == again.object_id_to_color


def change_resolution(trial: Trial) -> None:
    assert trial.do("Pass").frame.shape == (300, 300, 3)
    event = trial.do("ChangeResolution", x=400, y=400)
    assert event.frame.shape == (400, 400, 3)
    assert (event.screen_width, event.screen_height) == (400, 400)
    trial.do("ChangeResolution", x=300, y=300)


def get_interactable_poses(trial: Trial) -> None:
    name = trial.first("Fridge")["objectId"]

    def poses(object_id: str, **how: Any) -> list[dict[str, Any]]:
        return trial.do("GetInteractablePoses", objectId=object_id, **how).metadata["actionReturn"]

    found = poses(name)
    assert len(found) > 50
    pose = found[len(found) // 2]
    agent = trial.do("TeleportFull", **pose).metadata["agent"]
    assert trial.get(name)["visible"]
    near({axis: agent["position"][axis] for axis in "xz"}, {axis: pose[axis] for axis in "xz"})
    assert abs(agent["rotation"]["y"] - pose["rotation"]) < 1e-3
    assert agent["cameraHorizon"] == pose["horizon"]
    assert agent["isStanding"] == pose["standing"]
    inside = next(each for each in trial.data["objects"] if name in (each["parentReceptacles"] or ()))
    assert poses(inside["objectId"]) == []
    assert len(poses(name, maxPoses=50)) == 50
    for pose in poses(name, horizons=[0, 30], rotations=[0, 45]):
        assert pose["horizon"] in (0, 30)
        assert pose["rotation"] in (0, 45)
    unseen = {0.0, 90.0, 180.0, 270.0} - {pose["rotation"] for pose in found}
    assert all(poses(name, rotations=[yaw]) == [] for yaw in unseen)
    assert len(poses(name, maxDistance=5)) > len(found)


def two_d_semantic_hulls(trial: Trial) -> None:
    """Check hulls against boxes (THOR's test compares them with recorded hulls of `FloorPlan28`)."""
    hulls = trial.do("Get2DSemanticHulls").metadata["actionReturn"]
    kinds = ["Tomato", "Fridge"]
    assert {
        hull.partition("|")[0] for hull in trial.do("Get2DSemanticHulls", objectTypes=kinds).metadata["actionReturn"]
    } == set(kinds)
    names = [trial.first("Fridge")["objectId"], trial.first("Faucet")["objectId"]]
    some = trial.do("Get2DSemanticHulls", objectIds=names).metadata["actionReturn"]
    assert some == {name: hulls[name] for name in names}
    assert trial.do("Get2DSemanticHull", objectId=names[0]).metadata["actionReturn"] == hulls[names[0]]
    for name, hull in hulls.items():
        corners = np.array(trial.get(name)["axisAlignedBoundingBox"]["cornerPoints"])[:, [0, 2]]
        assert (np.array(hull) > corners.min(axis=0) - 0.02).all(), name
        assert (np.array(hull) < corners.max(axis=0) + 0.02).all(), name
    trial.fail("Get2DSemanticHulls", objectTypes=kinds, objectIds=names)


def get_coordinate_from_raycast(trial: Trial) -> None:
    trial.reset(renderDepthImage=True)
    trial.base()
    for x, y in ((1.5, 0.5), (1.1, 0.3), (-0.1, 0.8), (-0.5, -0.3)):
        trial.fail("GetCoordinateFromRaycast", x=x, y=y)
    depth, eye = trial.controller.last_event.depth_frame, trial.data["cameraPosition"]
    for x, y in ((0.5, 0.5), (0.5, 0.2), (0.25, 0.5)):
        point = trial.do("GetCoordinateFromRaycast", x=x, y=y).metadata["actionReturn"]
        away = float(depth[int(y * 300), int(x * 300)])
        near(
            point,
            {"x": eye["x"] + away * (2 * x - 1), "y": eye["y"] + away * (1 - 2 * y), "z": eye["z"] + away},
            within=0.05,
        )


def set_random_seed(trial: Trial) -> None:
    def drawn(seed: int) -> list[np.ndarray]:
        return [trial.reset().frame, trial.do("SetRandomSeed", seed=seed).frame, trial.do("RandomizeMaterials").frame]

    one, other, again = drawn(41), drawn(42), drawn(42)
    assert apart(one[2], other[2]) >= FAR
    assert apart(one[0], one[2]) >= FAR
    assert apart(other[0], other[2]) >= FAR
    assert all(apart(frame, same) <= 1.0 for frame, same in zip(other, again, strict=True))
    assert apart(other[0], other[1]) <= 1.0


def _used(trial: Trial, **how: Any) -> dict[str, Any]:
    return trial.do("RandomizeMaterials", **how).metadata["actionReturn"]


def randomize_materials_scenes(trial: Trial) -> None:
    train, val, test = ("Train", "External"), ("Val",), ("Test",)
    rows = [
        (f"FloorPlan{kind + number}", splits)
        for kind in (0, 200, 300, 400)
        for number, splits in ((20, train), (21, val), (25, val), (26, test))
    ]
    for scene, splits in [*rows, ("FloorPlan_Train5_3", train), ("FloorPlan_Val2_1", val)]:
        trial.reset(scene)
        used = _used(trial)
        assert {name for name in ("Train", "External", "Val", "Test") if used[f"use{name}Materials"]} == set(splits), (
            scene
        )
        assert used["totalMaterialsConsidered"] > 0


def randomize_materials_params(trial: Trial) -> None:
    trial.reset("FloorPlan15")
    splits = {
        "useTrainMaterials": True,
        "useValMaterials": True,
        "useTestMaterials": True,
        "useExternalMaterials": False,
    }
    assert {name: _used(trial, **splits)[name] for name in splits} == splits
    trial.fail("RandomizeMaterials", useTrainMaterials=False)
    for rooms in (["Kitchen"], ["Kitchen", "LivingRoom"]):
        assert _used(trial, inRoomTypes=rooms)["chosenRoomTypes"] == ["Kitchen"]
    for rooms in (["LivingRoom"], ["RoboTHOR"]):
        trial.fail("RandomizeMaterials", inRoomTypes=rooms)
    for scene in ("FloorPlan_Train5_2", "FloorPlan_Val3_2"):
        trial.reset(scene)
        for rooms in (["Kitchen", "LivingRoom"], ["LivingRoom"]):
            trial.fail("RandomizeMaterials", inRoomTypes=rooms)
        assert _used(trial, inRoomTypes=["RoboTHOR"])["chosenRoomTypes"] == ["RoboTHOR"]
    trial.do("ResetMaterials")


def randomize_materials_clear_on_reset(trial: Trial) -> None:
    for restore in (trial.reset, lambda: trial.do("ResetMaterials")):
        first = trial.reset().frame
        changed = trial.do("RandomizeMaterials").frame
        last = restore().frame
        assert apart(first, changed) / 255 > 0.05 / 3
        assert apart(changed, last) / 255 > 0.05 / 3
        assert apart(first, last) / 255 < 0.01 / 3


def directional_push(trial: Trial) -> None:
    for angle, axis, sign in ((0, "z", 1), (90, "x", 1), (180, "z", -1), (270, "x", -1), (-1, "z", 1), (-90, "x", -1)):
        trial.reset()
        place = trial.base()
        name = trial.first("Tomato")["objectId"]
        floor = {**place, "y": 0.05, "z": place["z"] + 0.1}
        trial.do("TeleportObject", objectId=name, position=floor, rotation={"x": 0, "y": 0, "z": 0})
        before = trial.get(name)["position"][axis]
        trial.do("DirectionalPush", pushAngle=angle, objectId=name, moveMagnitude=25, forceAction=True)
        assert sign * (trial.get(name)["position"][axis] - before) > 0.2, angle


def drop_object(trial: Trial) -> None:
    trial.base()
    name = trial.first("SoapBottle")["objectId"]
    for action in ("DropHeldObject", "DropHandObject"):
        assert not trial.data["inventoryObjects"]
        trial.do("PickupObject", objectId=name, forceAction=True)
        assert trial.data["inventoryObjects"][0]["objectId"] == name
        trial.do(action)
        assert not trial.data["inventoryObjects"]


def segmentation_colors(trial: Trial) -> None:
    for name in ("renderSemanticSegmentation", "renderInstanceSegmentation"):
        options: dict[str, Any] = {name: True}
        event = trial.reset(**options)
        assert event.color_to_object_id[event.object_id_to_color["Fridge"]] == "Fridge"


def _held(trial: Trial) -> dict[str, Any]:
    trial.reset()
    return trial.do("PickupObject", objectId=trial.first("SoapBottle")["objectId"], forceAction=True).metadata[
        "heldObjectPose"
    ]


def move_hand(trial: Trial) -> None:
    for way in ({"ahead": 0.1}, {"ahead": 0.1, "right": 0.1, "up": 0.1}, {"ahead": 0.1, "right": 0.05, "up": -0.1}):
        before = _held(trial)
        after = trial.do("MoveHeldObject", **way).metadata["heldObjectPose"]
        near(after["rotation"], before["rotation"])
        for axis, name in (("x", "right"), ("y", "up"), ("z", "ahead")):
            moved = after["localPosition"][axis] - before["localPosition"][axis]
            assert abs(moved - way.get(name, 0.0)) < 1e-3, (axis, moved)


def rotate_hand(trial: Trial) -> None:
    for way, axis, turn in (({"pitch": 90}, "x", 90), ({"yaw": 90}, "y", 90), ({"roll": 90}, "z", 270)):
        before = _held(trial)
        after = trial.do("RotateHeldObject", **way).metadata["hand"]
        near(after["position"], before["position"])
        changed = {each: (after["rotation"][each] - before["rotation"][each]) % 360 for each in "xyz"}
        near(changed, {**dict.fromkeys("xyz", 0.0), axis: float(turn)})
    before = _held(trial)
    after = trial.do("RotateHeldObject", roll=90, pitch=90, yaw=90).metadata["hand"]
    near(after["position"], before["position"])
    near(after["rotation"], {"x": 90.0, "y": (before["rotation"]["y"] + 180.0) % 360.0, "z": 0.0})
    before = _held(trial)
    near(before["localRotation"], {"x": 0.0, "y": 0.0, "z": 0.0})
    after = trial.do("RotateHeldObject", rotation={"x": 90, "y": 180, "z": 0}).metadata["hand"]
    near(after["localRotation"], {"x": 90.0, "y": 180.0, "z": 0.0})


def fill_liquid(trial: Trial) -> None:
    name = trial.first("Pot")["objectId"]

    def is_filled_with(liquid: str | None) -> None:
        pot = trial.get(name)
        assert pot["canFillWithLiquid"]
        assert pot["fillLiquid"] == liquid
        assert pot["isFilledWithLiquid"] == (liquid is not None)

    is_filled_with(None)
    for liquid in ("water", "wine", "coffee"):
        trial.do("FillObjectWithLiquid", fillLiquid=liquid, objectId=name, forceAction=True)
        is_filled_with(liquid)
        trial.do("EmptyLiquidFromObject", objectId=name, forceAction=True)
        is_filled_with(None)


def get_object_in_frame(trial: Trial) -> None:
    """Check a lattice of an image's pixels against the masks (AI2-THOR skips its own test)."""
    event = trial.reset(renderInstanceSegmentation=True)
    checked = 0
    for name, mask in event.instance_masks.items():
        if name not in {each["objectId"] for each in event.metadata["objects"]}:
            continue
        inner = mask[2:-2, 2:-2] & mask[:-4, 2:-2] & mask[4:, 2:-2] & mask[2:-2, :-4] & mask[2:-2, 4:]
        rows, columns = np.nonzero(inner)
        for row, column in list(zip(rows, columns, strict=True))[:: max(1, len(rows) // 3)]:
            place = {"x": (float(column) + 2.5) / 300, "y": (float(row) + 2.5) / 300}
            found = trial.step("GetObjectInFrame", **place).metadata["actionReturn"]
            assert found == name, (place, found, name)
            checked += 1
    if not checked:
        raise DoesNotApplyError("no object is in view at the start of the house")


CASES = (
    simobj_filter,
    add_third_party_camera,
    third_party_camera_depth,
    update_third_party_camera,
    open_aabb_cache,
    toggle_stove,
    open_interactable_with_filter,
    open_interactable,
    open_,
    per_step_instance_segmentation,
    change_resolution_image_synthesis,
    change_resolution,
    get_interactable_poses,
    two_d_semantic_hulls,
    get_object_in_frame,
    get_coordinate_from_raycast,
    set_random_seed,
    randomize_materials_scenes,
    randomize_materials_clear_on_reset,
    directional_push,
    randomize_materials_params,
    drop_object,
    segmentation_colors,
    move_hand,
    rotate_hand,
    fill_liquid,
)
