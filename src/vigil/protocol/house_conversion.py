"""Detection of house documents with a schema older than 1.0.0, and conversion of rotations about an axis."""

import math
from collections.abc import Iterator
from typing import Any

from pydantic.alias_generators import to_camel

from vigil.base.geometry import Vec3
from vigil.base.json_files import is_array, is_object

_MATERIALS = ("floorMaterial", "ceilingMaterial", "material")
"""Keys of materials. In schema 1.0.0 the value is an object with a name; in older schemas it is only the name."""
_RENAMED = {"polygon": "p0", "holePolygon": "boundingBox"}
"""Key in 1.0.0 -> the older key that it replaced."""
_CAMEL = frozenset(["proceduralParameters", "floorPolygon", "floorMaterial", "holePolygon", "assetId", "roomType"])
"""Keys that older schemas wrote with underscores."""
_LISTS = ("rooms", "walls", "doors", "windows", "objects")


def find_outdated_part(data: dict[str, Any]) -> str | None:
    """Return a description of the first part of a house document that is older than schema 1.0.0; None if no part is
    older."""
    for place, node in _nodes(data):
        for key in _MATERIALS:
            if isinstance(node.get(key), str):
                return f"{place}{key} is the text {node[key][:40]!r}, but in 1.0.0 it is an object with a `name`"
        for now, before in _RENAMED.items():
            if before in node and now not in node:
                return f"{place}{before} is an old key; in 1.0.0 it is `{now}`"
        for before in node:
            if "_" in before and (now := to_camel(before)) in _CAMEL and now not in node:
                return f"{place}{before} is an old key; in 1.0.0 it is `{now}`"
    return None


def _nodes(data: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (place, part) for those parts of a document that are written differently in old and new schemas."""
    yield "", data
    parameters = data.get("proceduralParameters")
    if is_object(parameters):
        yield "proceduralParameters.", parameters
    for key in _LISTS:
        nodes = data.get(key)
        for index, node in enumerate(nodes if is_array(nodes) else ()):
            if is_object(node):
                # In 1.0.0 an object may have a box as well.
                yield f"{key}.{index}.", node if key != "objects" else {**node, "holePolygon": None}


def euler_from_axis_angle(axis: Vec3, degrees: float) -> Vec3:
    """Return the Euler angles (deg; about z, then x, then y) of a rotation about `axis`, a vector of any length."""
    length = math.hypot(*axis)
    x, y, z = (side / length for side in axis) if length > 0.0 else (0.0, 1.0, 0.0)
    sin, cos = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    rest = 1.0 - cos
    pitch_sin = sin * x - rest * y * z
    if abs(pitch_sin) > 1.0 - 1e-9:
        yaw, roll = math.atan2(sin * y - rest * x * z, cos + rest * x * x), 0.0
    else:
        yaw = math.atan2(sin * y + rest * x * z, cos + rest * z * z)
        roll = math.atan2(sin * z + rest * x * y, cos + rest * y * y)
    pitch = math.asin(max(-1.0, min(1.0, pitch_sin)))
    return Vec3(*(math.degrees(angle) for angle in (pitch, yaw, roll)))
