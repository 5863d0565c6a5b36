"""THOR's documented actions that the engine does not have, and why; they are answered as any unknown action."""

_NO_PHYSICS = "nothing is pushed, thrown or falls here: things are put to rest"
_NO_SUCH_STATE = "things have no such state here"
_NO_LOOKS = "materials and lights of a house are its own"
_NO_SHAPES = "of a thing's shape, boxes are told and no meshes"
_OWN_ASSETS = "THOR's assets are not here"
_HAND = "what is held stays where the hand is"
_ARM = "the agent has a hand and no arm"
_ASK = "ask GetInteractablePoses"
_ONE_BY_ONE = "by object: OpenObject, ToggleObjectOn and ToggleObjectOff, with forceAction"

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
    "GetHouseFromTemplate": "houses are given whole, to CreateHouse",
    "SetObjectStates": _ONE_BY_ONE,
    "InitialRandomSpawn": "places are the house's, or the program's: PlaceObjectAtPoint, SetObjectPoses",
    "GetSpawnCoordinatesAboveReceptacle": "PutObject finds a place by itself",
    "PlaceHeldObject": "PutObject finds a place by itself",
    "PositionsFromWhichItemIsInteractable": _ASK,
    "NumberOfPositionsFromWhichItemIsVisible": _ASK,
    "ObjectNavExpertAction": "ask GetShortestPath",
    "VisualizePath": "nothing is drawn into the scene",
    "ToggleMapView": "add a camera with what GetMapViewCameraProperties returns",
    "HideObject": "DisableObject takes a thing away, and EnableObject brings it back",
    "UnhideObject": "DisableObject takes a thing away, and EnableObject brings it back",
    "SetObjectFilterForType": "SetObjectFilter takes ids",
    "MoveRelative": "MoveAgent takes ahead and right",
    "Sleep": "time does not pass between actions",
    "GetSceneBounds": "metadata have `sceneBounds` always",
}
