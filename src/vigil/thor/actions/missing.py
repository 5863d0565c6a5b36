"""AI2-THOR's documented actions that the engine does not have, and why. They are answered like unknown actions."""

_NO_PHYSICS = "the engine has no physics: objects are put where they rest"
_NO_SUCH_STATE = "objects do not have this state"
_NO_LOOKS = "materials and lights are those of the house"
_NO_SHAPES = "objects have boxes, but their meshes are not given"
_OWN_ASSETS = "the engine does not have THOR's assets"
_ARM = "the agent has a hand without an arm; use PickupObject, MoveHeldObject and PutObject"
_DRONE = "the engine has no drone; add a third-party camera, and move it with UpdateThirdPartyCamera"

MISSING: dict[str, str] = {
    **dict.fromkeys(("MakeAllObjectsMoveable", "MakeAllObjectsStationary"), _NO_PHYSICS),
    **dict.fromkeys(("SetRoomTempDecayTimeForType", "SetRoomTempDecayTimeGlobal"), _NO_SUCH_STATE),
    **dict.fromkeys(("SetSkybox", "GetMaterials"), _NO_LOOKS),
    **dict.fromkeys(("SpawnAsset", "GetAssetDatabase"), _OWN_ASSETS),
    **dict.fromkeys(("MoveArm", "MoveArmBase", "ReleaseObject", "SetHandSphereRadius"), _ARM),
    **dict.fromkeys(("FlyAhead", "FlyBack", "FlyLeft", "FlyRight", "FlyUp", "FlyDown", "LaunchDroneObject"), _DRONE),
    **dict.fromkeys(("GetInSceneAssetGeometry",), _NO_SHAPES),
    "GetHouseFromTemplate": "CreateHouse takes whole houses",
    "GetSpawnCoordinatesAboveReceptacle": "PutObject finds a place by itself",
    "PlaceHeldObject": "PutObject finds a place by itself",
    "NumberOfPositionsFromWhichItemIsVisible": "use GetInteractablePoses",
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
