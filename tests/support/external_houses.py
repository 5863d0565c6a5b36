"""Small made-up houses in the formats of other tools, each with one oddity of such a format."""

import copy
import json
import math
from collections.abc import Callable
from typing import Any

from tests.support.two_rooms import BETWEEN, door_between, point, two_rooms

Document = dict[str, Any]
DRESSER_ID, TABLE_ID, APPLE_ID = "Dresser|2|0", "DiningTable|3|0", "Apple|3|1"


def furnished(**between: Any) -> Document:
    """Return two rooms with a dresser, a table with an apple on it, and an open door between."""
    data = two_rooms(**between)
    data["doors"] = [door_between(openness=1.0)]
    data["objects"] = [
        thing(DRESSER_ID, "Dresser_213_1", (1.5, 0.45, 3.6), 180),
        thing(TABLE_ID, "Dining_Table_2_1", (6.2, 0.375, 2.0)) | {"children": [apple()]},
        thing("Fridge|3|2", "Fridge_5", (7.5, 0.9, 3.5), 180),
    ]
    return data


def thing(name: str, asset_id: str, at: tuple[float, float, float], yaw: float = 0.0) -> Document:
    """Return an object of a house document."""
    return {"id": name, "assetId": asset_id, "kinematic": True, "position": point(*at), "rotation": point(0, yaw, 0)}


def apple(name: str = APPLE_ID) -> Document:
    """Return an apple on the table."""
    return thing(name, "Apple_4", (6.1, 0.8, 2.1)) | {"kinematic": False}


def _open_plan() -> Document:
    data = furnished(empty=True)
    data["doors"] = []
    return data


def _open_in_part() -> Document:
    """Return a house whose inner wall has two pieces, one of them empty."""
    data = _open_plan()
    for wall in [wall for wall in data["walls"] if wall["id"] in BETWEEN]:
        standing = copy.deepcopy(wall) | {"id": wall["id"] + "|2", "empty": False}
        for corner, rest in zip(wall["polygon"], standing["polygon"], strict=True):
            corner["z"], rest["z"] = min(corner["z"], 2.0), max(rest["z"], 2.0)
        data["walls"].append(standing)
    return data


def _all_null() -> Document:
    """Return a house as from AI2-THOR's GetHouseFromTemplate: with every key, and null for missing values."""
    data = _open_plan()
    for wall in data["walls"]:
        wall |= {"thickness": 0.0, "layer": None, "unlit": False}
        wall["material"] |= {"color": None, "shader": "Standard", "tilingDivisorX": 1.0, "metallic": None}
    for room in data["rooms"]:
        room |= {"ceilings": None, "children": None, "layer": None, "rooms": None}
    for node in data["objects"]:
        node |= {"boundingBox": None, "room": None, "types": None, "openness": None, "isOn": None, "material": None}
        node["rotation"] = {"axis": point(0, 1, 0), "degrees": node["rotation"]["y"]} | dict.fromkeys("xyz")
        node.setdefault("children", None)
    pose = data["metadata"].pop("agent")
    data["metadata"] |= {"agentPoses": {"default": pose, "arm": pose}, "navMeshes": None}
    return data | {"id": "house_0", "windows": None, "doors": None, "roof": None}


def _prefixed() -> Document:
    """Return a house as in files with several AI2-THOR houses: every id begins with the house's id."""
    text = json.dumps(furnished())
    for word in ("room|", "wall|", "door|"):
        text = text.replace(f'"{word}', f'"h0_{word}')
    return json.loads(text)


def _front_door() -> Document:
    """Return ProcTHOR's front door: it has the same room twice; its second wall is outside, top corners first."""
    data = furnished()
    inner = next(wall for wall in data["walls"] if wall["id"] == "wall|2|w")
    outer = {**inner, "id": "wall|exterior|0", "roomId": "exterior", "polygon": inner["polygon"][::-1]}
    data["walls"].append(outer)
    front = {"id": "door|1|2", "room1": "room|2", "wall0": "wall|2|w", "wall1": outer["id"], "openable": False}
    data["doors"].append(door_between(**front))
    return data


def _exterior_door() -> Document:
    """Return Holodeck's front door: first room "exterior", first wall outside; windows name their room twice."""
    data = _front_door()
    data["doors"][-1] |= {"room0": "exterior", "wall0": "wall|exterior|0", "wall1": "wall|2|w"}
    window = door_between(id="window|1", assetId="Window_Fixed_1", room1="room|2", wall0="wall|2|n", wall1=None)
    data["windows"] = [window | {"holePolygon": [point(1, 1, 0), point(2, 2, 0)], "openable": None, "roomId": "room|2"}]
    return data


def _round_corners() -> Document:
    data = furnished()
    for wall in data["walls"]:
        low_a, low_b, top_a, top_b = wall["polygon"]
        wall["polygon"] = [low_a, top_a, top_b, low_b]
    return data


def _one_sided() -> Document:
    """Return a house with a single wall between rooms, and a door without its second wall."""
    data = furnished()
    data["walls"] = [wall for wall in data["walls"] if wall["id"] != BETWEEN[1]]
    data["doors"][0]["wall1"] = ""
    return data


def _unnamed_rooms() -> Document:
    """Return a house whose walls do not name rooms, as in AI2-THOR's first houses."""
    data = furnished()
    for wall in data["walls"]:
        del wall["roomId"]
    for room in data["rooms"]:
        del room["roomType"]
    return data


def _frame() -> Document:
    data = furnished()
    data["doors"] = [door_between(assetId="Doorframe_Double_5", openable=None)]
    return data


def _leaves_apart() -> Document:
    """Return a double door whose leaves are open to different degrees, one of them by more than 100 %."""
    data = furnished()
    data["doors"][0] |= {"openness": 1.4, "opennessByParts": {"a": 0.5, "b": 1.2}, "assetId": "Doorway_Double_2"}
    return data


def _flat() -> Document:
    """Return Holodeck's flat list: objects on furniture follow it in the list; assets are hashes, with other names."""
    data = furnished()
    names = {DRESSER_ID: "dresser-0", TABLE_ID: "dining table-0", "Fridge|3|2": "refrigerator-0"}
    table = next(node for node in data["objects"] if node["id"] == TABLE_ID)
    del table["children"]
    for index, node in enumerate(data["objects"]):
        name = names[node["id"]]
        extra = {"roomId": "room|2", "vertices": [[0, 0], [1, 1]], "material": None}
        node |= {"id": f"{name} (kitchen)", "assetId": f"{index}bed0cd{'0' * 25}", "object_name": name, **extra}
    small = apple("apple-0|dining table-0 (kitchen)") | {"assetId": "9bed0cd" + "1" * 25, "roomId": "room|3"}
    data["objects"].insert(0, small)
    data["rooms"][0] |= {"roomType": "living room", "vertices": [[0, 0]], "floor_design": "oak"}
    data["rooms"][1]["roomType"] = "kitchen"
    return data | {"query": "a flat", "wall_height": 2.6, "room_pairs": [], "open_walls": {"segments": []}}


def _objaverse() -> Document:
    """Return a ProcTHOR house with Objaverse assets: types begin with Obja, and asset ids are hashes."""
    data = furnished()
    data["objects"][0] |= {"id": "ObjaDresser|2|0", "assetId": "4bed" + "7c" * 14}
    data["objects"].append(thing("ObjaHamburger|2|1", "c0ffee" + "0" * 26, (2.5, 0.05, 3.5)))
    return data


def _ithor_ids() -> Document:
    """Return a house like iTHOR's scenes: it lies on both sides of the origin, and ids contain positions."""
    data = furnished()
    _shift(data, -5.3, -2.2)
    for node in data["objects"]:
        kind, place = node["id"].split("|")[0], node["position"]
        node["id"] = "|".join([kind, *(f"{place[axis]:+06.2f}" for axis in "xyz")])
    return data


def _turned() -> Document:
    """Return a house that is rotated by 30 degrees, so that no wall is parallel to an axis."""
    data = furnished()
    sin, cos = math.sin(math.radians(30)), math.cos(math.radians(30))

    def turn(place: Document) -> None:
        x, z = place["x"], place["z"]
        place["x"], place["z"] = x * cos + z * sin, z * cos - x * sin

    for place in _places(data):
        turn(place)
    for node in data["objects"]:
        node["rotation"]["y"] += 30
    return data


def _far() -> Document:
    data = furnished()
    _shift(data, 120.0, -90.0)
    return data


def _closed_floors() -> Document:
    """Return floors that repeat the first corner at the end, have corners on straight edges, in reverse order."""
    data = furnished()
    for room in data["rooms"]:
        corners = room["floorPolygon"][::-1]
        middle = {"x": corners[0]["x"], "z": (corners[0]["z"] + corners[1]["z"]) / 2}
        if corners[0]["x"] == corners[1]["x"]:
            corners.insert(1, middle)
        room["floorPolygon"] = [*corners, dict(corners[0])]
    return data


def _gable() -> Document:
    """Return a house whose outer wall has a fifth corner, under the roof."""
    data = furnished()
    wall = next(wall for wall in data["walls"] if wall["id"] == "wall|2|w")
    low_a, low_b, top_a, top_b = wall["polygon"]
    wall["polygon"] = [low_a, low_b, top_b, point(0.0, 3.2, 2.0), top_a]
    return data


def _uneven() -> Document:
    """Return a house whose walls have bottoms that differ by rounding."""
    data = furnished()
    for index, wall in enumerate(data["walls"]):
        wall["polygon"][index % 2]["y"] = 2e-5
    return data


def _more_keys() -> Document:
    """Return a house with keys of a future simulator."""
    data = furnished()
    data["objects"][0] |= {"isCooked": True, "category": "dresser"}
    data["walls"][0]["thickness"] = 0.15
    return data | {"version": 3}


def _silent_parameters() -> Document:
    """Return a house whose writer left the light, the ceiling and the size of the colliders to the simulator."""
    silent = dict.fromkeys(("lights", "ceilingMaterial", "skyboxId", "reflections"))
    return furnished() | {"proceduralParameters": silent}


def _no_parameters() -> Document:
    data = furnished()
    data.pop("proceduralParameters", None)
    return data


def _holes_from_the_top() -> Document:
    """Return a house whose holes are given from the upper right corner to the lower left one."""
    data = furnished()
    data["doors"][0]["holePolygon"].reverse()
    return data


def _whole_turns() -> Document:
    """Return a house with angles beyond one turn, and a start that is turned by a plain number, as an agent's is."""
    data = furnished()
    for node, turns in zip(data["objects"], (-3, 1, 2), strict=True):
        node["rotation"]["y"] += 360 * turns
    data["metadata"]["agent"]["rotation"] = 90
    return data


def _numbers_as_text() -> Document:
    """Return a house that went through a spreadsheet: its objects' coordinates are text."""
    data = furnished()
    for node in data["objects"]:
        node["position"] = {axis: str(value) for axis, value in node["position"].items()}
    return data


def _unnamed_assets() -> Document:
    """Return a house whose objects name no assets, so that only the ids say what the objects are."""
    data = furnished()
    for node in data["objects"]:
        node["assetId"] = ""
    return data


def _added_by_hand() -> Document:
    """Return a house to which a user has added an own asset: its id is a number and a word, its name one long word."""
    data = furnished()
    own = thing("ikeacoffeetable-0 (living room)", "40562244_original", (1.2, 0.4, 1.2))
    data["objects"].append(own | {"object_name": "ikeacoffeetable-0", "material": None})
    return data


def _places(data: Document) -> list[Document]:
    nodes = [*data["objects"], *(child for node in data["objects"] for child in node.get("children") or [])]
    polygons = [*(room["floorPolygon"] for room in data["rooms"]), *(wall["polygon"] for wall in data["walls"])]
    places = [place for polygon in polygons for place in polygon] + [node["position"] for node in nodes]
    return [*places, data["metadata"]["agent"]["position"]]


def _shift(data: Document, x: float, z: float) -> None:
    for place in _places(data):
        place["x"] += x
        place["z"] += z


FORMS: dict[str, Callable[[], Document]] = {
    "as ProcTHOR": furnished,
    "open plan": _open_plan,
    "open in part": _open_in_part,
    "all null": _all_null,
    "ids of several houses": _prefixed,
    "front door": _front_door,
    "door to exterior": _exterior_door,
    "corners go round": _round_corners,
    "one-sided walls": _one_sided,
    "unnamed rooms": _unnamed_rooms,
    "frame without openable": _frame,
    "leaves apart": _leaves_apart,
    "flat": _flat,
    "Objaverse": _objaverse,
    "iTHOR's ids": _ithor_ids,
    "turned": _turned,
    "far from the origin": _far,
    "closed floors": _closed_floors,
    "gable": _gable,
    "uneven": _uneven,
    "more keys": _more_keys,
    "silent parameters": _silent_parameters,
    "no parameters": _no_parameters,
    "holes from the top": _holes_from_the_top,
    "whole turns": _whole_turns,
    "numbers as text": _numbers_as_text,
    "unnamed assets": _unnamed_assets,
    "added by hand": _added_by_hand,
}
