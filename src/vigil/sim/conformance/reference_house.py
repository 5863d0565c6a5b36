"""The reference house of the conformance checks: a small house of two rooms, built by code.

The kitchen is in the west (x from 0 to 6 m), the bedroom in the east (x from 6 to 10 m); z is from 0 to 5 m in both. A
door and an inner window connect them.
"""

from typing import Any

from vigil.assets.database import AssetDatabase
from vigil.assets.drawers import drawer_asset_id
from vigil.protocol.house import House

NORTH, EAST, SOUTH, WEST = 0.0, 90.0, 180.0, 270.0
HEIGHT_M = 2.5
KITCHEN, BEDROOM = "room|1", "room|2"
DOOR, PANE = "door|1|2", "window|1|2"
START = {"x": 3.5, "y": 0.95, "z": 2.5}
_PLASTER = {"name": "plaster/white"}
_SIZES = AssetDatabase.default()
_TABLE_M, _COUNTER_M = 0.7111, 0.9225

Node = dict[str, Any]


DRESSER, WATCH = "Dresser|1", "Watch|1"
DRAWER, SIBLING, LOWEST = (f"Drawer|1|Dresser{number}" for number in (4, 5, 0))
"""Ids of three drawers: the drawer with the watch in it, the drawer next to it, and a drawer near the floor."""


def reference_house() -> House:
    """Return the house, named "trial"."""
    agent = {"position": START, "rotation": {"x": 0, "y": 0, "z": 0}, "horizon": 30, "standing": True}
    door = _opening(DOOR, "Doorway_1", (2.0, 3.0), (0.0, 2.1)) | {"openable": True, "openness": 0.0}
    return House(
        "trial",
        {
            "rooms": [_room(KITCHEN, "Kitchen", 0.0, 6.0), _room(BEDROOM, "Bedroom", 6.0, 10.0)],
            "walls": [*_walls(KITCHEN, 0.0, 6.0), *_walls(BEDROOM, 6.0, 10.0)],
            "doors": [door],
            "windows": [_opening(PANE, "Window_Fixed_1", (0.5, 1.5), (0.9, 2.0))],
            "objects": [*_kitchen(), *_bedroom()],
            "proceduralParameters": {"lights": [], "ceilingMaterial": _PLASTER},
            "metadata": {"schema": "1.0.0", "agent": agent},
        },
    )


def _kitchen() -> list[Node]:
    bowl = _thing("Bowl|1", (2.2, _TABLE_M, 2.0), children=[_thing("Egg|1", (2.2, _TABLE_M + 0.02, 2.0))])
    on_table = [_thing("Apple|1", (1.4, _TABLE_M, 2.4)), _thing("Mug|1", (1.8, _TABLE_M, 2.4)), bowl]
    on_counter = [
        _thing("Microwave|1", (2.6, _COUNTER_M, 4.65), SOUTH),
        _thing("Plate|1", (3.3, _COUNTER_M + 0.05, 4.6)),
    ]
    return [
        _thing("DiningTable|1", (1.8, 0.0, 2.2), children=on_table),
        _thing("CounterTop|1", (3.0, 0.0, 4.65), SOUTH, on_counter),
        _thing("Fridge|1", (5.2, 0.0, 4.6), SOUTH, [_thing("Lettuce|1", (5.2, 0.75, 4.68))]),
        _thing("GarbageCan|1", (0.35, 0.0, 4.6)),
        _thing("FloorLamp|1", (0.35, 0.0, 0.35)),
        _thing("Rug|1", (4.2, 0.0, 1.2)),
        _thing("Box|1", (3.5, 0.0, 0.3)),
        _thing("CeilingLamp|1", (3.5, 2.16, 2.5)),
    ]


def _bedroom() -> list[Node]:
    drawer = _thing(DRAWER, (7.76, 0.46, 0.25), children=[_thing(WATCH, (7.76, 0.46, 0.25))])
    on_dresser = [
        drawer | {"assetId": drawer_asset_id("vigil_Dresser_1", "drawer4")},
        _thing("DeskLamp|1", (7.7, 0.8438, 0.25)),
        _thing("Statue|1", (8.3, 0.8438, 0.25)),
    ]
    book = _thing("Book|1", (9.6, 0.7778, 2.4), WEST, [_thing("Pen|1", (9.6, 0.81, 2.4))])
    return [
        _thing(DRESSER, (8.0, 0.0, 0.25), children=on_dresser),
        _thing("Desk|1", (9.6, 0.0, 2.2), WEST, [book, _thing("Laptop|1", (9.6, 0.7778, 1.8), WEST)]),
        _thing("Bed|1", (8.0, 0.0, 3.98), SOUTH, [_thing("Pillow|1", (8.0, 0.55, 4.4))]),
        _thing("FloorLamp|2", (6.9, 0.0, 1.0)),
        _thing("Painting|1", (9.98, 1.3, 4.0), WEST),
    ]


def _thing(
    object_id: str, foot: tuple[float, float, float], yaw: float = NORTH, children: list[Node] | None = None
) -> Node:
    """Return an object whose box has the middle of its bottom at `foot` (x, y, z)."""
    x, bottom, z = foot
    category = object_id.partition("|")[0]
    asset_id = f"vigil_{category}_1"
    height = _SIZES.look_up(asset_id, object_id).size.y
    return {
        "id": object_id,
        "assetId": asset_id,
        "position": _point(x, bottom + height / 2, z),
        "rotation": _point(0, yaw, 0),
        "kinematic": not children,
        "children": children or [],
    }


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _room(room_id: str, kind: str, left: float, right: float) -> Node:
    corners = [_point(left, 0, 0), _point(left, 0, 5), _point(right, 0, 5), _point(right, 0, 0)]
    return {"id": room_id, "roomType": kind, "floorPolygon": corners, "floorMaterial": {"name": "wood/oak"}}


def _walls(room_id: str, left: float, right: float) -> list[Node]:
    corners = [(left, 0.0), (left, 5.0), (right, 5.0), (right, 0.0)]
    sides = dict(zip("wnes", zip(corners, [*corners[1:], corners[0]], strict=True), strict=True))
    return [_wall(f"wall|{room_id[-1]}|{side}", room_id, start, end) for side, (start, end) in sides.items()]


def _wall(wall_id: str, room_id: str, start: tuple[float, float], end: tuple[float, float]) -> Node:
    polygon = [_point(x, y, z) for y in (0.0, HEIGHT_M) for x, z in (start, end)]
    return {"id": wall_id, "roomId": room_id, "polygon": polygon, "material": _PLASTER}


def _opening(opening_id: str, asset_id: str, along: tuple[float, float], up: tuple[float, float]) -> Node:
    """Return an opening in the wall between the rooms; `along` is its extent (m) from the wall's south end."""
    return {
        "id": opening_id,
        "assetId": asset_id,
        "room0": BEDROOM,
        "room1": KITCHEN,
        "wall0": "wall|2|w",
        "wall1": "wall|1|e",
        "holePolygon": [_point(along[0], up[0], 0), _point(along[1], up[1], 0)],
        "assetPosition": _point(sum(along) / 2, sum(up) / 2, 0),
    }
