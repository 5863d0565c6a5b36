"""What is done with the keys of house documents: the table in docs/houses.md, the reader, and what is told."""

import copy
import re
from pathlib import Path
from typing import Any

import pytest

from tests.support.bare_house import bare_house
from vigil.assets.database import AssetDatabase
from vigil.housegen.checking.check import check_house
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.keys import IGNORED, SECTIONS, UNSUPPORTED, unsupported_keys

DOCS = Path(__file__).parents[2] / "docs" / "houses.md"
SIZES = AssetDatabase.default()
THOR = {
    "house": "proceduralParameters id rooms walls doors windows objects roof metadata",
    "rooms": "id roomType floorMaterial layer floorPolygon ceilings rooms",
    "ceilings": "id polygon material",
    "walls": "id polygon roomId thickness layer material empty unlit",
    "doors": "id room0 room1 wall0 wall1 axesXZ holePolygon assetPosition type openable openness assetId material"
    " scale color",
    "windows": "id room0 room1 wall0 wall1 axesXZ holePolygon assetPosition type openable openness assetId material"
    " scale color",
    "objects": "id position rotation kinematic boundingBox room children types assetId navmeshArea layer openness isOn"
    " isDirty unlit material collisionDetectionMode",
    "proceduralParameters": "floorColliderThickness minWallColliderThickness receptacleHeight skyboxId skyboxColor"
    " datetime lights reflections ceilingMaterial navmeshVoxelSize ceilingBackFaces unlitCeiling squareTiling"
    " collisionDetectionMode",
    "lights": "id type position localPosition cullingMaskOff rotation intensity indirectMultiplier range spotAngle rgb"
    " shadow linkedSimObj enabled parentSimObjId parentSimObjName",
    "materials": "name color shader unlit tilingDivisorX tilingDivisorY metallic smoothness",
}
"""The keys that AI2-THOR 5's own classes have."""


def read(place: str) -> set[str]:
    return {field.alias or name for name, field in SECTIONS[place].model_fields.items()}


def rows() -> dict[str, list[str]]:
    text = DOCS.read_text().partition("## Keys of a house document")[2].partition("\n## ")[0]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:2] == "| "]
    return {cell[0]: cell[1:] for cell in cells[1:]}


def keys(cell: str) -> set[str]:
    """The keys that a cell of the table is about; those that it explains others by are in brackets or after a colon."""
    return set(re.findall(r"`([^`]+)`", re.sub(r"\([^()]*\)|: [^;]*", "", cell)))


@pytest.mark.parametrize("place", SECTIONS)
def test_the_table_of_keys_is_what_the_reader_does(place):
    found_read, harmless, told = (keys(cell) for cell in rows()[place])
    if place == "lights":
        found_read -= {"point"}
    assert found_read == read(place)
    assert harmless == IGNORED[place]
    assert told == set(UNSUPPORTED.get(place, {}))


@pytest.mark.parametrize("place", SECTIONS)
def test_every_key_of_ai2thor_has_one_row(place):
    parts = [read(place), set(IGNORED[place]), set(UNSUPPORTED.get(place, {}))]
    assert sum(map(len, parts)) == len(set.union(*parts))
    assert set(THOR[place].split()) <= set.union(*parts)


def test_the_table_has_no_other_rows():
    assert set(rows()) == {*SECTIONS, "metadata"}


def test_what_is_read_is_used():
    """No model has a key that nothing in the package looks at."""
    root = DOCS.parents[1] / "src" / "vigil"
    document = root / "protocol" / "house.py"
    texts = {path: path.read_text() for path in root.rglob("*.py") if path != document}
    source = "\n".join(texts.values()) + document.read_text().partition("class House:")[2]
    own = document.read_text()
    for place, model in SECTIONS.items():
        for name in model.model_fields:
            assert f".{name}" in source or f"self.{name}" in own, (place, name)


def house(**changes: object) -> House:
    data = copy.deepcopy(bare_house("h", "Apple|1", "Apple|2").data)
    square = [(0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0)]
    data["walls"] = [
        {"id": "wall|1", "roomId": "room|1", "polygon": [dict(zip("xyz", point, strict=True)) for point in square]}
    ]
    hole = {"room0": "room|1", "wall0": "wall|1", "holePolygon": [{"x": 1, "y": 1}, {"x": 2, "y": 2}]}
    data["windows"] = [{"id": "window|1", "assetId": "Window_1", **hole}]
    data["proceduralParameters"]["lights"] = [{"id": "l", "type": "point", "position": {"x": 1, "y": 2, "z": 1}}]
    for path, value in changes.items():
        *places, key = path.split("__")
        node: Any = data
        for place in places:
            node = node[int(place[1:])] if place[0] == "_" and place[1:].isdecimal() else node[place]
        node[key] = value
    return House("h", data)


@pytest.mark.parametrize(
    ("change", "value", "told"),
    [
        ("walls___0__thickness", 0.3, "key `thickness` of walls is not followed: walls have no thickness ('wall|1')"),
        ("windows___0__openness", 1, "key `openness` of windows is not followed: windows stay shut ('window|1')"),
        ("proceduralParameters__lights___0__enabled", False, "key `enabled` of lights is not followed"),
        (
            "rooms___0__children",
            [{"id": "x"}],
            "key `children` of rooms is not followed: rooms cannot be inside other rooms",
        ),
        ("objects___0__isBroken", True, "key `isBroken` of objects is not followed: it is not understood ('Apple|1')"),
        ("rooms___0__floorMaterial__transparency", 1, "key `transparency` of materials is not followed"),
        (
            "objects___0__rotation",
            {"x": 0.0, "y": 0.7071, "z": 0.0, "w": 0.7071},
            "key `rotation.w` of objects is not followed: it is not understood ('Apple|1')",
        ),
        ("objects___0__position__unit", "cm", "key `position.unit` of objects is not followed: it is not understood"),
        ("storeys", 2, "key `storeys` of house is not followed: it is not understood"),
        ("walls___0__Empty", True, "key `Empty` of walls is not followed: it is not understood ('wall|1')"),
    ],
)
def test_what_is_not_done_is_told_by_the_check_and_at_loading(change, value, told):
    asked = house(**{change: value})
    assert [line for line in unsupported_keys(asked) if line.startswith(told)]
    assert any(note.startswith(told) for note in build_scene(asked, SIZES).notes)
    assert any(fault.rule == "key" and fault.message.startswith(told) for fault in check_house(asked, SIZES))


@pytest.mark.parametrize(
    ("change", "value"),
    [
        ("walls___0__thickness", 0.0),
        ("walls___0__layer", "Procedural1"),
        ("windows___0__openable", False),
        ("rooms___0__children", []),
        ("rooms___0__ceilings", None),
        ("objects___0__kinematic", True),
        ("proceduralParameters__skyboxId", "Sky1"),
        ("metadata__anything", 3),
    ],
)
def test_what_asks_for_nothing_is_not_told(change, value):
    assert unsupported_keys(house(**{change: value})) == []


def test_alike_keys_are_told_once():
    data = copy.deepcopy(house().data)
    for node in data["objects"]:
        node["weight"] = 1.0
    assert unsupported_keys(House("h", data)) == [
        "key `weight` of objects is not followed: it is not understood ('Apple|1' and 1 more)"
    ]
