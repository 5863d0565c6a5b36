"""Keys of a house document that VIGIL does not use: some are ignored safely, the others are reported.

The models in `vigil.protocol.house` declare the keys that are used. This module lists the other keys of AI2-THOR's
schema and of Holodeck's houses; docs/houses.md has a table of all keys. An unknown key is reported. A known key is also
reported if it would change where an agent can walk, what is there or what can be done, unless its value has no effect.
"""

from collections.abc import Iterator

from pydantic import BaseModel

from vigil.protocol import house as documents

SECTIONS: dict[str, type[BaseModel]] = {
    "house": documents.HouseDocument,
    "rooms": documents.Room,
    "ceilings": documents.Ceiling,
    "walls": documents.Wall,
    "doors": documents.Door,
    "windows": documents.Window,
    "objects": documents.HouseObject,
    "proceduralParameters": documents.ProceduralParameters,
    "lights": documents.Light,
    "materials": documents.MaterialRef,
}
"""Model of each part of a house document; the keys of these parts are checked."""
IGNORED: dict[str, frozenset[str]] = {
    place: frozenset(keys.split())
    for place, keys in {
        "house": "id query wall_height raw_floor_plan raw_doorway_plan room_pairs open_room_pairs open_walls"
        " raw_window_plan object_selection_plan selected_objects floor_objects wall_objects small_objects"
        " receptacle2small_objects ceiling_objects raw_ceiling_plan",
        "rooms": "layer vertices full_vertices floor_design wall_design wallMaterial",
        "ceilings": "id",
        "walls": "layer unlit connected_rooms connect_exterior width height direction segment",
        "doors": "assetPosition type material color axesXZ roomId doorBoxes doorSegment",
        "windows": "assetPosition type material color axesXZ roomId windowBoxes windowSegment",
        "objects": "kinematic layer material color unlit room roomId types navmeshArea collisionDetectionMode vertices",
        "proceduralParameters": "floorColliderThickness minWallColliderThickness receptacleHeight skyboxId skyboxColor"
        " datetime reflections navmeshVoxelSize ceilingBackFaces unlitCeiling squareTiling collisionDetectionMode"
        " ceilingColor",
        "lights": "indirectMultiplier range spotAngle rotation shadow layer cullingMaskOff roomId localPosition"
        " linkedObjectId linkedSimObj parentSimObjId parentSimObjName objectId",
        "materials": "shader unlit tilingDivisorX tilingDivisorY metallic smoothness",
    }.items()
}
"""Keys of each part that are ignored: they say how AI2-THOR draws or computes, or repeat what other keys say."""
UNSUPPORTED: dict[str, dict[str, tuple[object, str]]] = {
    "house": {"roof": (None, "houses have no roof")},
    "rooms": {
        "rooms": ([], "rooms cannot be inside other rooms"),
        "children": ([], "rooms cannot be inside other rooms"),
    },
    "ceilings": {"polygon": ([], "the ceiling is over the room's whole floor, as high as its walls")},
    "walls": {"thickness": (0, "walls have no thickness")},
    "doors": {
        "scale": ({"x": 1, "y": 1, "z": 1}, "what fills a hole is as large as the hole"),
        "opennessByParts": ({}, "all leaves of a door are open alike; `openness` says how far"),
    },
    "windows": {
        "scale": ({"x": 1, "y": 1, "z": 1}, "what fills a hole is as large as the hole"),
        "openable": (False, "windows stay shut"),
        "openness": (0, "windows stay shut"),
    },
    "objects": {"boundingBox": ({}, "sizes are those of the assets")},
    "lights": {"enabled": (True, "the room is lit anyway")},
}
"""Keys of each part that are reported: key -> (value without an effect, phrase that says what happens instead)."""


def unsupported_keys(house: documents.House) -> list[str]:
    """Return a line for each key of a house that is unsupported or unknown."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for place, node in _nodes(house.document):
        for key, value in _other_keys(node):
            default, instead = UNSUPPORTED.get(place, {}).get(key, (None, "it is not understood"))
            if key not in IGNORED[place] and value != default:
                found.setdefault((place, key, instead), []).append(str(getattr(node, "id", place)))
    return [
        f"key `{key}` of {place} is not followed: {instead} ({names[0]!r}"
        + (")" if len(names) == 1 else f" and {len(names) - 1} more)")
        for (place, key, instead), names in found.items()
    ]


def _other_keys(node: BaseModel) -> Iterator[tuple[str, object]]:
    """Yield (key, value) for each undeclared key of a node and of its points and rotations (as `rotation.w`)."""
    yield from (node.model_extra or {}).items()
    for name, part in node:
        if isinstance(part, documents.Point):
            yield from ((f"{name}.{key}", value) for key, value in (part.model_extra or {}).items())


def _nodes(document: documents.HouseDocument) -> Iterator[tuple[str, BaseModel]]:
    """Yield (key of `SECTIONS`, node) for every part of a document."""
    parameters = document.procedural_parameters
    yield "house", document
    yield "proceduralParameters", parameters
    yield from (("lights", light) for light in parameters.lights)
    yield from _materials(parameters.ceiling_material)
    for room in document.rooms:
        yield "rooms", room
        yield from (("ceilings", ceiling) for ceiling in room.ceilings)
        yield from _materials(room.floor_material, *(ceiling.material for ceiling in room.ceilings))
    for wall in document.walls:
        yield "walls", wall
        yield from _materials(wall.material)
    yield from (("doors", door) for door in document.doors)
    yield from (("windows", window) for window in document.windows)
    stack = list(reversed(document.objects))
    while stack:
        node = stack.pop()
        yield "objects", node
        stack.extend(reversed(node.children))


def _materials(*materials: documents.MaterialRef | None) -> Iterator[tuple[str, BaseModel]]:
    yield from (("materials", material) for material in materials if material is not None)
