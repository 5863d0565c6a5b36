"""AI2-THOR's documented actions that the engine does not have, with reasons. They are answered as unknown actions."""

_NO_PHYSICS = "the engine has no physics: objects are put where they rest"
_NO_SUCH_STATE = "objects do not have this state"
_NO_LOOKS = "materials and lights are those of the house"
_NO_SHAPES = "objects have boxes, but their meshes are not given"
_OWN_ASSETS = "the engine does not have THOR's assets"
_HAND = "the held object does not move relative to the hand"
_ARM = "the agent has a hand without an arm"
_ASK = "use GetInteractablePoses"
_ONE_BY_ONE = "use OpenObject, ToggleObjectOn and ToggleObjectOff with forceAction, object by object"

MISSING: dict[str, str] = {
    **dict.fromkeys(("PushObject", "PullObject", "DirectionalPush", "TouchThenApplyForce", "ThrowObject"), _NO_PHYSICS),
    **dict.fromkeys(("MakeAllObjectsMoveable", "MakeAllObjectsStationary"), _NO_PHYSICS),
    **dict.fromkeys(("BreakObject", "SliceObject", "CookObject", "DirtyObject", "CleanObject"), _NO_SUCH_STATE),
    **dict.fromkeys(("FillObjectWithLiquid", "EmptyLiquidFromObject", "UseUpObject"), _NO_SUCH_STATE),
    **dict.fromkeys(("SetRoomTempDecayTimeForType", "SetRoomTempDecayTimeGlobal"), _NO_SUCH_STATE),
    **dict.fromkeys(("RandomizeMaterials", "RandomizeColors", "RandomizeLighting"), _NO_LOOKS),
    **dict.fromkeys(("SetSkybox", "GetMaterials"), _NO_LOOKS),
    **dict.fromkeys(("SpawnAsset", "GetAssetDatabase"), _OWN_ASSETS),
    **dict.fromkeys(("MoveHeldObject", "MoveHeldObjectAhead", "MoveHeldObjectBack", "MoveHeldObjectLeft"), _HAND),
    **dict.fromkeys(("MoveHeldObjectRight", "MoveHeldObjectUp", "MoveHeldObjectDown", "RotateHeldObject"), _HAND),
    **dict.fromkeys(("MoveArm", "MoveArmBase", "ReleaseObject", "SetHandSphereRadius"), _ARM),
    **dict.fromkeys(("Get2DSemanticHull", "Get2DSemanticHulls", "GetInSceneAssetGeometry"), _NO_SHAPES),
    "GetHouseFromTemplate": "CreateHouse takes whole houses",
    "SetObjectStates": _ONE_BY_ONE,
    "InitialRandomSpawn": "the house gives positions; use PlaceObjectAtPoint or SetObjectPoses to change them",
    "GetSpawnCoordinatesAboveReceptacle": "PutObject finds a place by itself",
    "PlaceHeldObject": "PutObject finds a place by itself",
    "PositionsFromWhichItemIsInteractable": _ASK,
    "NumberOfPositionsFromWhichItemIsVisible": _ASK,
    "ObjectNavExpertAction": "use GetShortestPath",
    "VisualizePath": "paths are not drawn into the scene",
    "ToggleMapView": "add a camera with what GetMapViewCameraProperties returns",
    "HideObject": "use DisableObject to remove an object, and EnableObject to restore it",
    "UnhideObject": "use DisableObject to remove an object, and EnableObject to restore it",
    "SetObjectFilterForType": "SetObjectFilter takes ids",
    "MoveRelative": "MoveAgent takes ahead and right",
    "Sleep": "time does not pass between actions",
    "GetSceneBounds": "metadata always have `sceneBounds`",
}
"""Name of a missing action -> the reason why it is missing, or the action to use instead."""
