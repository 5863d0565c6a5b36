"""Actions that only read the world: places, poses, paths, rays, and what is in the scene."""

from dataclasses import replace
from typing import Any

import numpy as np

from vigil.base.geometry import Pose, Vec3, floor_distance
from vigil.scene.geometry import bounding_box, convex_hull
from vigil.sim.thor.units import BODY_HEIGHT_M, from_thor, to_thor
from vigil.thor.actions.action import Action
from vigil.thor.base.agents import agent_between
from vigil.thor.base.errors import ActionFailed, bad_argument, invalid_operation
from vigil.thor.base.paths import shortest_walk
from vigil.thor.base.settings import RIGHT_ANGLE
from vigil.thor.base.sight import points_of, visibility_of
from vigil.thor.base.targets import cast_ray, first_met, need_interactable
from vigil.thor.base.world import World, agent_position

UNLIMITED_M = 1e6
"""Visibility distance (m) that is in practice unlimited."""
_HORIZONS = (-30.0, 0.0, 30.0, 60.0)
_NEAR_OBJECT_M = 0.5
"""A path to an object may end within this distance (m) of the object, even if the visibility distance is smaller."""


def _reachable(
    world: World, gridSize: float | None = None, directionsRelativeAgent: bool = False, **_: object
) -> list[dict[str, float]]:
    start, step = world.agent.position._replace(y=0.0), gridSize or world.settings.grid_size
    yaw = world.agent.rotation % RIGHT_ANGLE if directionsRelativeAgent else 0.0
    places = [Vec3(x, 0.0, z) for x, z in world.editor.reachable(start, step, yaw).tolist()]
    places = [place for place in places if agent_between(world, place, place) is None]
    return [to_thor(place._replace(y=BODY_HEIGHT_M)) for place in places if yaw or world.is_on_grid(place)]


def _hull(world: World, objectId: str) -> list[list[float]]:
    """Return the corners (x, z) of the convex hull of a thing's box on the floor plane, anticlockwise."""
    return convex_hull(points_of(world.thing(objectId))[:, [0, 2]]).tolist()


def _hulls(
    world: World, objectIds: list[str] | None = None, objectTypes: list[str] | None = None
) -> dict[str, list[list[float]]]:
    if objectIds is not None and objectTypes is not None:
        raise bad_argument("give objectIds or objectTypes, not both")
    wanted = world.things() if objectIds is None else [world.thing(name) for name in objectIds]
    return {each.id: _hull(world, each.id) for each in wanted if objectTypes is None or each.category in objectTypes}


def _interactable_poses(
    world: World,
    objectId: str,
    positions: list[Any] | None = None,
    rotations: list[Any] | None = None,
    horizons: list[Any] | None = None,
    standings: list[Any] | None = None,
    maxDistance: float | None = None,
    maxPoses: int | None = None,
) -> list[dict[str, Any]]:
    thing = world.thing(objectId)
    seeing = world if maxDistance is None else _seeing(world, maxDistance)
    places = positions if positions is not None else _reachable(world)
    limit = seeing.settings.visibility_distance + float(np.linalg.norm(thing.asset.size))
    upright = [True] if world.settings.is_locobot else standings
    found: list[dict[str, Any]] = []
    for spot in _read(places):
        if floor_distance(spot, thing.position) > limit or not world.editor.can_stand(spot):
            continue
        for pose in _poses_at(spot, rotations, horizons, upright):
            if visibility_of(seeing, [thing], pose)[thing.id].interactable:
                place = to_thor(agent_position(pose))
                standing = None if world.settings.is_locobot else pose.standing
                found.append({**place, "rotation": pose.rotation, "horizon": pose.horizon, "standing": standing})
                if maxPoses is not None and len(found) >= maxPoses:
                    return found
    return found


def _interactable_positions(world: World, **asked: Any) -> dict[str, list[float]]:
    """Return what GetInteractablePoses finds in the older form: a list for each coordinate; `standing` is 0 or 1."""
    poses = _interactable_poses(world, **asked)
    names = ("x", "y", "z", "rotation", "horizon", "standing")
    return {name: [1.0 if pose[name] is None else float(pose[name]) for pose in poses] for name in names}


def _seeing(world: World, distance_m: float | None) -> World:
    """Return a copy of the world with `distance_m` as the agent's visibility distance; None makes it unlimited."""
    limit = UNLIMITED_M if distance_m is None else distance_m
    return replace(world, settings=world.settings.model_copy(update={"visibility_distance": limit}))


def _read(places: list[Any]) -> list[Vec3]:
    try:
        return [from_thor(place) for place in places]
    except (KeyError, TypeError, ValueError):
        raise bad_argument("positions must be a list of dicts, each with the keys x, y and z") from None


def _poses_at(
    place: Vec3, rotations: list[Any] | None, horizons: list[Any] | None, standings: list[Any] | None
) -> list[Pose]:
    floor = Vec3(place.x, place.y - BODY_HEIGHT_M, place.z)
    yaws = [_yaw(turn) for turn in rotations] if rotations is not None else [k * RIGHT_ANGLE for k in range(4)]
    return [
        Pose(position=floor, rotation=yaw, horizon=float(horizon), standing=bool(standing))
        for yaw in yaws
        for horizon in (horizons if horizons is not None else _HORIZONS)
        for standing in (standings if standings is not None else (True, False))
    ]


def _yaw(turn: Any) -> float:
    try:
        return float(turn["y"] if isinstance(turn, dict) else turn)
    except (KeyError, TypeError, ValueError):
        raise bad_argument("rotations must be a list of degrees, or of dicts with the keys x, y and z") from None


def _object_in_frame(world: World, x: float, y: float, checkVisible: bool = False) -> str:
    thing, _ = cast_ray(world, x, y)
    if thing is None:
        raise invalid_operation(f"no sim objects found at ({x},{y})")
    if checkVisible:
        try:
            need_interactable(world, thing)
        except ActionFailed:
            raise invalid_operation(
                f"target hit ({thing.id}) at ({x}, {y}) is not currently Visible to Agent"
            ) from None
    return thing.id


def _raycast(world: World, origin: Vec3, destination: Vec3) -> dict[str, Any]:
    world.need_house()
    ray = np.subtract(destination, origin)
    length = float(np.linalg.norm(ray))
    thing, point = first_met(world, origin, (ray / max(length, 1e-9))[None])
    if point is None:
        raise ActionFailed(f"Raycast from {tuple(origin)} to {tuple(destination)} failed to hit any target object!")
    return {
        "objectId": thing.id if thing else None,
        "hitPoint": to_thor(point),
        "hitDistance": float(np.linalg.norm(np.subtract(point, origin))),
    }


def _hit_object(world: World, origin: Vec3, destination: Vec3) -> str:
    found = _raycast(world, origin, destination)["objectId"]
    if found is None:
        way = f"from {tuple(origin)} to {tuple(destination)}"
        raise ActionFailed(f"Raycast {way} hit object, but not a SimObject!")
    return found


def _path_to_point(
    world: World, target: Vec3, position: Vec3 | None = None, allowedError: float | None = None
) -> dict[str, Any]:
    start = position or world.agent.position
    corners = shortest_walk(
        world, start._replace(y=0.0), target, **({} if allowedError is None else {"within_m": allowedError})
    )
    return {"corners": [to_thor(corner) for corner in corners]}


def _path(
    world: World,
    objectId: str | None = None,
    objectType: str | None = None,
    position: Vec3 | None = None,
    allowedError: float | None = None,
    **_: object,
) -> dict[str, Any]:
    if objectId is None:
        objectId = next((thing.id for thing in world.things() if thing.category == objectType), None)
    if objectId is None:
        raise bad_argument(f"No object of type {objectType} in the scene!")
    thing = world.thing(objectId)
    start = (position or world.agent.position)._replace(y=0.0)
    reach = max(allowedError or 0.0, world.settings.visibility_distance, _NEAR_OBJECT_M)
    half = float(np.linalg.norm([thing.asset.size.x, thing.asset.size.z])) / 2
    return {"corners": [to_thor(corner) for corner in shortest_walk(world, start, thing.position, reach + half)]}


def _in_view(world: World, maxDistance: float | None = None, visibilityScheme: str | None = None) -> list[str]:
    del visibilityScheme
    world.need_house()
    seen = visibility_of(_seeing(world, maxDistance), world.things())
    return [name for name, found in seen.items() if found.visible]


def _point_in_frame(world: World, x: float, y: float) -> dict[str, float]:
    return to_thor(cast_ray(world, x, y)[1] or Vec3(0.0, 0.0, 0.0))


def _visibility_points(world: World, objectId: str) -> list[dict[str, float]]:
    return [to_thor(Vec3(*point)) for point in points_of(world.thing(objectId)).tolist()]


def _distance(world: World, objectId: str) -> float:
    return bounding_box(world.thing(objectId)).floor_distance(world.agent.position)


def _map_view(world: World) -> dict[str, Any]:
    world.need_house()
    rooms = world.editor.scene().rooms
    floor = np.concatenate([room.polygon for room in rooms])
    (left, low), (right, high) = floor.min(axis=0).tolist(), floor.max(axis=0).tolist()
    top = max(room.height for room in rooms)
    return {
        "position": {"x": (left + right) / 2, "y": top, "z": (low + high) / 2},
        "rotation": {"x": 90.0, "y": 0.0, "z": 0.0},
        "orthographicSize": max(right - left, high - low) / 2,
        "orthographic": True,
    }


_ID = "string objectId"
_PLACES = "float gridSize, int maxStepCount, bool directionsRelativeAgent"
_POSITIONS = f"{_ID}, list positions"
_RAY = "Vector3 origin, Vector3 destination"
_POSES = "list positions, list rotations, list horizons, list standings, float maxDistance, int maxPoses"
_PATH = "string objectId, string objectType, Vector3 position, Vector3 rotation, float allowedError"
_PATH_TO_POINT = "Vector3 position, Vector3 target, float allowedError"
_NEAR = "paths follow a grid of 0.125 m, straightened where possible; THOR's follow a mesh"
_NEAR_OBJECT = f"{_NEAR}; the path ends near the object, whether or not the object is seen from there"
_POINTS = "an object's points are a lattice in the box of each part; THOR's assets have chosen points"
_OUTLINES = "outlines are those of the boxes of an object's parts"
_GRID = (
    "the grid goes through the agent; with snapToGrid, another gridSize lists only the places to which Teleport can "
    "go; the held object never collides"
)

_READS = (
    Action("GetReachablePositions", _reachable, _PLACES, lacks=_GRID),
    Action("GetInteractablePoses", _interactable_poses, f"{_ID}, {_POSES}", "objectId", lacks=_POINTS),
    Action("PositionsFromWhichItemIsInteractable", _interactable_positions, _POSITIONS, "objectId", lacks=_POINTS),
    Action("GetObjectInFrame", _object_in_frame, "float x, float y, bool checkVisible", "x y"),
    Action("GetCoordinateFromRaycast", _point_in_frame, "float x, float y", "x y"),
    Action("PerformRaycast", _raycast, _RAY, "origin destination"),
    Action("GetObjectHitFromRaycast", _hit_object, _RAY, "origin destination"),
    Action("GetShortestPath", _path, _PATH, "objectId | objectType", lacks=_NEAR_OBJECT),
    Action("GetShortestPathToPoint", _path_to_point, _PATH_TO_POINT, "target", lacks=_NEAR),
    Action("GetVisibilityPoints", _visibility_points, _ID, "objectId", lacks=_POINTS),
    Action("Get2DSemanticHulls", _hulls, "list objectIds, list objectTypes", lacks=_OUTLINES),
    Action("Get2DSemanticHull", _hull, _ID, "objectId", lacks=_OUTLINES),
    Action("GetVisibleObjects", _in_view, "float maxDistance, string visibilityScheme", lacks=_POINTS),
    Action("GetMapViewCameraProperties", _map_view),
    Action("DistanceToObject", _distance, _ID, "objectId", lacks="the distance to the object's box"),
)
ACTIONS = tuple(replace(each, only_reads=True) for each in _READS)
