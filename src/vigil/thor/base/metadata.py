"""AI2-THOR's metadata: a description of the world after an action."""

from functools import lru_cache
from typing import Any

import numpy as np

from vigil.assets.kernel.asset import Asset
from vigil.base.geometry import Pose, Vec3, distance, heading, rotate_floor
from vigil.scene.geometry import box_corners, euler_angles, part_boxes, part_motion, place_of, rotation_matrix
from vigil.scene.supports import children
from vigil.scene.things import Scene, Thing
from vigil.sim.core.state import HAND_AHEAD_M, HAND_DROP_M
from vigil.sim.thor.units import to_thor
from vigil.thor.base.agents import is_in_hand
from vigil.thor.base.floors import floor_below
from vigil.thor.base.images import colours
from vigil.thor.base.properties import is_loose, is_moveable, mass_of, materials_of, properties
from vigil.thor.base.sight import Visibility, visibility_of
from vigil.thor.base.world import World, agent_position

OPEN_FROM = 1e-3
"""Openness above which an object counts as open."""
THORS_HAND_M = (0.0, -0.16, 0.38)
"""Usual `localPosition` (m) of AI2-THOR's hand: to the right, up and ahead of the camera."""
_NOWHERE = Vec3(0.0, 0.0, 0.0)
_UNUSED: dict[str, Any] = {
    **dict.fromkeys(("flatSurfacesOnGrid", "distances", "normals", "isOpenableGrid", "segmentedObjectIds"), ()),
    **dict.fromkeys(("objectIdsInBox", "actionStringsReturn", "actionFloatsReturn", "actionVector3sReturn"), ()),
    "collidedObjects": (),
    "colorBounds": None,
    "visibleRange": None,
    "actionIntReturn": 0,
    "actionFloatReturn": 0.0,
    "currentTime": 0.0,
    "cameraOrthSize": -1.0,
    "collided": False,
    "isSceneAtRest": True,
}
"""Metadata fields that stay empty, because only actions that this engine lacks would fill them."""


def agent_metadata(world: World) -> dict[str, Any]:
    """Return the agent's metadata, without the fields that depend on the last action."""
    width, height = world.settings.screen_width, world.settings.screen_height
    note = world.notes[0] if world.notes else ""  # the other notes are only in the client's log
    ids_are_drawn = world.settings.render_instance_segmentation or world.settings.render_semantic_segmentation
    return {
        **{name: list(value) if value == () else value for name, value in _UNUSED.items()},
        "agentId": world.active,
        "sceneName": world.scene_name,
        "vigil": {"house": world.house.name if world.house else None, "notes": len(world.notes), "note": note},
        "screenWidth": width,
        "screenHeight": height,
        "fov": world.settings.field_of_view,
        "depthFormat": "Meters",
        "colors": colours(world) if ids_are_drawn else None,
        "sceneBounds": _bounds(world),
        "thirdPartyCameras": cameras(world),
        "objects": objects(world),
        **_agent(world),
    }


def _agent(world: World) -> dict[str, Any]:
    pose = world.agent if world.has_house else Pose(position=_NOWHERE, rotation=0.0)
    held = world.editor.scene().things[world.held] if world.held else None
    return {
        "agent": {
            "name": "agent",
            "position": to_thor(agent_position(pose) if world.has_house else _NOWHERE),
            "rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
            "cameraHorizon": pose.horizon,
            "isStanding": None if world.settings.is_locobot else pose.standing,
            "inHighFrictionArea": False,
        },
        "cameraPosition": to_thor(world.eye_of(pose) if world.has_house else _NOWHERE),
        "heldObjectPose": _hand(world, pose, held),
        "inventoryObjects": [{"objectId": held.id, "objectType": held.category}] if held else [],
    }


def _hand(world: World, pose: Pose, held: Thing | None) -> dict[str, Any]:
    """Return the pose of the hand. `localPosition` starts from AI2-THOR's usual place, which programs compare with."""
    (ahead_x, ahead_z), (x, y, z) = heading(pose.rotation), pose.eye
    usual = Vec3(x + HAND_AHEAD_M * ahead_x, y - HAND_DROP_M, z + HAND_AHEAD_M * ahead_z)
    place = held.position if held else usual
    right, ahead = rotate_floor(place.x - usual.x, place.z - usual.z, -pose.rotation)
    turn = rotation_matrix(world.hand_turn if held else _NOWHERE)
    local = np.add(THORS_HAND_M, (right, place.y - usual.y, ahead))
    return {
        "position": to_thor(place),
        "rotation": to_thor(_euler(rotation_matrix(Vec3(0.0, pose.rotation, 0.0)) @ turn)),
        "localPosition": to_thor(Vec3(*local.round(6).tolist())),
        "localRotation": to_thor(_euler(turn)),
    }


def _euler(turn: np.ndarray) -> Vec3:
    return Vec3(*(round(angle, 6) % 360.0 for angle in euler_angles(turn)))


def cameras(world: World) -> list[dict[str, Any]]:
    """Return the metadata of the cameras that the client added."""
    return [
        {
            "thirdPartyCameraId": number,
            "position": to_thor(camera.position),
            "rotation": to_thor(camera.rotation),
            "fieldOfView": camera.field_of_view,
            "orthographic": camera.orthographic_size is not None,
            "orthographicSize": camera.orthographic_size,
        }
        for number, camera in enumerate(world.cameras)
    ]


def objects(world: World) -> list[dict[str, Any]]:
    """Return the metadata of the objects in the house, or only those in `world.shown`; empty before `CreateHouse`."""
    if not world.has_house:
        return []
    everything, scene = [*world.things(), *world.floors.values()], world.editor.scene()
    things = [thing for thing in everything if world.shown is None or thing.id in world.shown]
    seen, body = visibility_of(world, things), agent_position(world.agent)
    held = {world.held, *(other.held for other in world.waiting.values() if is_in_hand(world, other))}
    floor_of = {thing.id: floor_below(scene.rooms, thing) for thing in everything if thing.id not in world.floors}
    found = []
    for thing in things:
        below = thing.parent or floor_of.get(thing.id)
        above = [name for name, floor in floor_of.items() if floor == thing.id] if thing.id in world.floors else None
        found.append(
            {
                **_object(scene, thing, seen[thing.id], body, held),
                **properties(thing, scene, world.flags.get(thing.id, {})),
                "assetId": world.assets.get(thing.id, ""),
                "parentReceptacles": None if below is None else [below],
            }
        )
        if above is not None:
            found[-1]["receptacleObjectIds"] = above
    return found


def _object(scene: Scene, thing: Thing, seen: Visibility, body: Vec3, held: set[str | None]) -> dict[str, Any]:
    return {
        "isMoving": False,
        "obstructed": False,
        "controlledObjects": None,
        "name": thing.id,
        "objectId": thing.id,
        "objectType": thing.category,
        "position": to_thor(thing.position),
        "rotation": to_thor(thing.rotation),
        "visible": seen.visible,
        "isInteractable": seen.interactable,
        "distance": distance(body, thing.position),
        "receptacle": thing.is_receptacle,
        "receptacleObjectIds": [child.id for child in children(scene, thing.id)] if thing.is_receptacle else None,
        "openable": thing.is_openable,
        "isOpen": thing.is_openable and thing.openness > OPEN_FROM,
        "openness": thing.openness if thing.is_openable else 0.0,
        "toggleable": thing.is_toggleable,
        "isToggled": thing.is_toggled,
        "pickupable": thing.is_pickupable,
        "isPickedUp": thing.id in held,
        "moveable": is_moveable(thing),
        "mass": mass_of(thing) if is_loose(thing) else 0.0,
        "salientMaterials": list(materials_of(thing.asset)) if is_loose(thing) else None,
        "axisAlignedBoundingBox": _box(thing.asset, thing.position, thing.rotation, thing.openness),
        "objectOrientedBoundingBox": _oriented_box(thing) if is_loose(thing) else None,
    }


def _oriented_box(thing: Thing) -> dict[str, Any]:
    """Return the box of a shut thing, turned as the thing is turned, in THOR's form."""
    half = np.array(thing.asset.size) / 2
    return {"cornerPoints": place_of(thing)(box_corners(-half, half)).tolist()}


@lru_cache(maxsize=1024)
def _box(asset: Asset, position: Vec3, rotation: Vec3, openness: float) -> dict[str, Any]:
    """Return the box around all parts of a thing at this openness. The box is cached, so it must not be changed."""
    thing = Thing("", asset.category, asset, position, rotation, openness=openness)
    corners = [part_motion(thing, joint)(box_corners(low, high)) for joint, low, high in part_boxes(asset)]
    half = np.array(asset.size) / 2
    return box_of_corners(np.concatenate(corners or [box_corners(-half, half) + np.array(position)]))


def box_of_corners(points: np.ndarray) -> dict[str, Any]:
    """Return the axis-aligned box around points (n, 3) in THOR's form."""
    low, high = points.min(axis=0), points.max(axis=0)
    return {
        "cornerPoints": box_corners(low, high).tolist(),
        "center": to_thor(Vec3(*((low + high) / 2).tolist())),
        "size": to_thor(Vec3(*(high - low).tolist())),
    }


def _bounds(world: World) -> dict[str, Any]:
    if not world.has_house:
        return box_of_corners(np.zeros((1, 3)))
    rooms = world.editor.scene().rooms
    floor = np.concatenate([room.polygon for room in rooms])
    height = max(room.height for room in rooms)
    return box_of_corners(np.concatenate([np.insert(floor, 1, 0.0, axis=1), np.insert(floor, 1, height, axis=1)]))
