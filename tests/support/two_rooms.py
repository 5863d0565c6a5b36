"""Two adjacent rooms, with a pair of walls between them or, as in an open plan, without."""

from typing import Any

from vigil.protocol.house import House

WIDTH_M, HEIGHT_M = 4.0, 2.6
BETWEEN = ("wall|2|e", "wall|3|w")
"""The pair of walls between the rooms."""


def two_rooms(**between: Any) -> dict[str, Any]:
    """Return the document of a living room (x 0 to 4) and a kitchen (4 to 8); `between` changes the walls between."""
    walls = [wall for room, left in (("2", 0.0), ("3", WIDTH_M)) for wall in _walls(room, left)]
    return {
        "rooms": [_room("2", "LivingRoom", 0.0), _room("3", "Kitchen", WIDTH_M)],
        "walls": [wall | between if wall["id"] in BETWEEN else wall for wall in walls],
        "doors": [],
        "windows": [],
        "objects": [],
        "proceduralParameters": {"lights": [], "ceilingMaterial": {"name": "PureWhite"}},
        "metadata": {
            "schema": "1.0.0",
            "agent": {"position": point(1.0, 0.95, 2.0), "rotation": point(0, 90, 0), "horizon": 30},
        },
    }


def without_walls_between() -> House:
    """Return the same house without the walls between its rooms."""
    data = two_rooms()
    return House("left_out", {**data, "walls": [wall for wall in data["walls"] if wall["id"] not in BETWEEN]})


def door_between(**changes: Any) -> dict[str, Any]:
    """Return a door in the middle of the pair of walls, seen from the living room."""
    hole = [point(1.5, 0, 0), point(2.5, 2.1, 0)]
    rooms = {"room0": "room|2", "room1": "room|3", "wall0": BETWEEN[0], "wall1": BETWEEN[1]}
    return {"id": "door|2|3", "assetId": "Doorway_1", "openable": True, "holePolygon": hole, **rooms, **changes}


def point(x: float, y: float, z: float) -> dict[str, float]:
    """Return a point of a house document."""
    return {"x": x, "y": y, "z": z}


def _room(number: str, kind: str, left: float) -> dict[str, Any]:
    right = left + WIDTH_M
    corners = [(left, 0.0), (left, WIDTH_M), (right, WIDTH_M), (right, 0.0)]
    polygon = [point(x, 0.0, z) for x, z in corners]
    return {"id": f"room|{number}", "roomType": kind, "floorPolygon": polygon, "floorMaterial": {"name": "wood/oak"}}


def _walls(number: str, left: float) -> list[dict[str, Any]]:
    right = left + WIDTH_M
    corners = [(left, 0.0), (left, WIDTH_M), (right, WIDTH_M), (right, 0.0)]
    return [
        {
            "id": f"wall|{number}|{side}",
            "roomId": f"room|{number}",
            "material": {"name": "PureWhite"},
            "polygon": [point(x, y, z) for y in (0.0, HEIGHT_M) for x, z in (start, end)],
        }
        for side, start, end in zip("wnes", corners, [*corners[1:], corners[0]], strict=True)
    ]
