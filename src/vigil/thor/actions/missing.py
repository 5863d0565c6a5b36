"""AI2-THOR's documented actions that the engine does not have, and why. They are answered like unknown actions."""

_REASONS = {
    "the engine has no physics: objects are put where they rest": "MakeAllObjectsMoveable MakeAllObjectsStationary",
    "objects do not have this state": "SetRoomTempDecayTimeForType SetRoomTempDecayTimeGlobal",
    "materials and lights are those of the house": "SetSkybox GetMaterials",
    "the engine does not have THOR's assets": "SpawnAsset GetAssetDatabase",
    "the agent has a hand without an arm; use PickupObject, MoveHeldObject and PutObject": "MoveArm MoveArmBase "
    "ReleaseObject SetHandSphereRadius",
    "the engine has no drone; add a third-party camera, and move it with UpdateThirdPartyCamera": "FlyAhead FlyBack "
    "FlyLeft FlyRight FlyUp FlyDown LaunchDroneObject",
    "objects have boxes, but their meshes are not given": "GetInSceneAssetGeometry",
    "CreateHouse takes whole houses": "GetHouseFromTemplate",
    "PutObject finds a place by itself": "GetSpawnCoordinatesAboveReceptacle PlaceHeldObject",
    "use GetInteractablePoses": "NumberOfPositionsFromWhichItemIsVisible",
    "use GetShortestPath": "ObjectNavExpertAction",
    "paths are not drawn into the scene": "VisualizePath",
    "add a camera with what GetMapViewCameraProperties returns": "ToggleMapView",
    "use DisableObject to remove an object, and EnableObject to restore it": "HideObject UnhideObject",
    "SetObjectFilter takes ids": "SetObjectFilterForType",
    "MoveAgent takes ahead and right": "MoveRelative",
    "time does not pass between actions": "Sleep",
    "metadata always have `sceneBounds`": "GetSceneBounds",
}
MISSING = {name: reason for reason, names in _REASONS.items() for name in names.split()}
"""Name of a missing action -> the reason why it is missing, or the action to use instead."""
