"""Houses as documents: what is kept, what is hashed, what is refused and how that is said."""

import copy
import json
import re

import pytest

from vigil.base.geometry import Pose, Vec3
from vigil.errors import HouseError
from vigil.protocol.house import MAX_HOUSE_BYTES, MAX_MAGNITUDE, MAX_NESTING, MAX_OPENINGS, House


def point(x: float, y: float, z: float) -> dict:
    return {"x": x, "y": y, "z": z}


def thing(name: str, *children: dict) -> dict:
    place = {"position": point(1, 0.5, 1), "rotation": point(0, 0, 0)}
    return {"id": name, "assetId": name.split("|")[0], "kinematic": True, "children": list(children), **place}


@pytest.fixture
def data() -> dict:
    quad = [point(0, 0, 0), point(4, 0, 0), point(4, 3, 0), point(0, 3, 0)]
    hole = {"id": "window|1", "assetId": "Window_1", "room0": "room|1", "room1": "room|1", "wall0": "wall|1"}
    return {
        "rooms": [
            {
                "id": "room|1",
                "roomType": "Kitchen",
                "floorPolygon": [point(0, 0, 0), point(0, 0, 4), point(4, 0, 4)],
                "floorMaterial": {"name": "Wood"},
            }
        ],
        "walls": [{"id": "wall|1", "roomId": "room|1", "polygon": quad, "material": {"name": "Paint"}}],
        "doors": [],
        "windows": [{**hole, "holePolygon": [point(1, 1, 0), point(2, 2, 0)]}],
        "objects": [thing("Table|1", thing("Cup|1")), thing("Fridge|1")],
        "proceduralParameters": {"lights": [], "somethingElse": [1, 2]},
        "metadata": {"agent": {"position": point(1, 0.9, 2), "rotation": point(0, 90, 0), "horizon": 30}},
    }


def test_a_saved_house_is_the_same_document_with_its_unknown_keys(data, tmp_path):
    house = House("one", data)
    house.save(tmp_path / "two.json")
    again = House.load(tmp_path / "two.json")
    assert (again.name, again.data, again.sha256) == ("two", data, house.sha256)
    assert again.data["proceduralParameters"]["somethingElse"] == [1, 2]


def test_the_hash_is_that_of_the_content(data):
    backwards = json.loads(json.dumps(data), object_pairs_hook=lambda pairs: dict(reversed(pairs)))
    moved = copy.deepcopy(data)
    moved["objects"][0]["position"]["x"] = 1.001
    house = House("a", data)
    assert House("b", backwards).sha256 == house.sha256
    assert House("a", moved).sha256 != house.sha256


def test_objects_come_with_their_parents_and_the_start_lies_on_the_floor(data):
    house = House("h", data)
    assert [(node.id, parent) for node, parent in house.objects()] == [
        ("Table|1", None), ("Cup|1", "Table|1"), ("Fridge|1", None)
    ]  # fmt: skip
    assert house.start == Pose(position=Vec3(1, 0, 2), rotation=90, horizon=30)
    del data["metadata"]["agent"]["rotation"]
    with pytest.raises(HouseError, match="is not a start pose"):
        _ = House("h", data).start


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("walls", 0, "polygon", 2, "y"), float("nan"), "walls.0.polygon.2.y"),
        (("objects", 0, "position", "x"), 1.5 * MAX_MAGNITUDE, "objects.0.position.x: Input should be less than"),
        (("windows", 0, "holePolygon", 1, "y"), -1e308, "windows.0.holePolygon.1.y: Input should be greater than"),
        (("objects", 1, "rotation"), "north", "objects.1.rotation"),
        (("windows", 0, "wall0"), "wall|9", "'window|1' has wall0 'wall|9', absent from `walls`"),
        (("windows", 0, "room1"), "room|9", "'window|1' names room 'room|9', absent from `rooms`"),
        (("objects", 1, "id"), "Cup|1", "two objects have the id 'Cup|1'"),
    ],
    ids=["nan", "far", "far hole", "no rotation", "no wall", "no such room", "same id"],
)
def test_what_is_wrong_is_named_with_its_place(data, path, value, said):
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(HouseError, match=r"House 'h': .*" + re.escape(said)):
        House("h", data)


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"{", "is not JSON"), (b"[" * 100_000, "is not JSON"), (b"\xff", "is not JSON"), (b"[]", "holds a list")],
    ids=["cut short", "deep", "no text", "list"],
)
def test_files_that_hold_no_house(tmp_path, content, said):
    (tmp_path / "house.json").write_bytes(content)
    with pytest.raises(HouseError, match=said):
        House.load(tmp_path / "house.json")


def test_a_house_with_more_openings_than_any_has_is_refused(data):
    window = data["windows"][0]
    data["windows"] = [{**window, "id": f"window|{number}"} for number in range(MAX_OPENINGS)]
    assert len(House("h", data).document.windows) == MAX_OPENINGS
    data["doors"] = [{**window, "id": "door|1"}]
    with pytest.raises(HouseError, match=f"House 'h': {MAX_OPENINGS + 1} doors and windows, more than the limit"):
        House("h", data)


OPTIONAL = ("walls", "doors", "windows", "objects", "proceduralParameters", "metadata")


@pytest.mark.parametrize("key", OPTIONAL)
@pytest.mark.parametrize("is_null", [True, False])
def test_what_ai2thor_leaves_to_its_defaults_may_be_null_or_left_out(data, key, is_null):
    data["windows"] = []
    before = copy.deepcopy(data)
    empty = data.pop(key).__class__()
    if is_null:
        data[key] = None
    house = House("h", data)
    assert house.document.model_dump() == House("h", {**before, key: empty}).document.model_dump()
    assert house.data == data


def test_nodes_may_leave_out_what_they_need_not_say(data):
    room, wall, table = data["rooms"][0], data["walls"][0], data["objects"][0]
    for corner in room["floorPolygon"]:
        del corner["y"]
    for point_ in data["windows"][0]["holePolygon"]:
        del point_["z"]
    room |= {"roomType": None, "ceilings": None, "floorMaterial": {"name": None, "color": None}}
    wall |= {"roomId": None, "material": None, "empty": None}
    table |= {"children": None, "kinematic": None, "material": None, "openness": None, "rotation": {"y": 90}}
    document = House("h", data).document
    assert [corner.y for corner in document.rooms[0].floor_polygon] == [0.0, 0.0, 0.0]
    assert (document.walls[0].room_id, document.walls[0].empty) == ("", False)
    assert document.objects[0].rotation.vec == Vec3(0, 90, 0)
    assert document.objects[0].children == []


@pytest.mark.parametrize("outside", ["exterior", "", None])
@pytest.mark.parametrize("side", ["room0", "room1"])
def test_an_opening_may_lead_outside(data, outside, side):
    door = {**data["windows"][0], "id": "door|1", "openable": False, side: outside}
    data["doors"], data["windows"] = [door], []
    assert not House("h", data).document.doors[0].joins_rooms


@pytest.mark.parametrize(
    ("axis", "degrees", "angles"),
    [
        ((0, 1, 0), 90, (0, 90, 0)),
        ((0, -2, 0), 90, (0, -90, 0)),
        ((1, 0, 0), 30, (30, 0, 0)),
        ((0, 0, 1), -45, (0, 0, -45)),
        ((0, 0, 0), 70, (0, 70, 0)),
    ],
)
def test_a_turn_about_an_axis_is_a_rotation(data, axis, degrees, angles):
    data["objects"][0]["rotation"] = {"axis": point(*axis), "degrees": degrees}
    assert House("h", data).document.objects[0].rotation.vec == pytest.approx(angles)


def test_a_house_starts_at_the_default_of_its_poses_where_it_names_no_agent(data):
    pose = data["metadata"].pop("agent")
    data["metadata"]["agentPoses"] = {"arm": {**pose, "horizon": 0}, "default": pose}
    assert House("h", data).start == Pose(position=Vec3(1, 0, 2), rotation=90, horizon=30)


def _text_materials(data: dict) -> None:
    data["rooms"][0]["floorMaterial"] = "Wood"


def _text_ceiling(data: dict) -> None:
    data["proceduralParameters"]["ceilingMaterial"] = "PureWhite"


def _boxes(data: dict) -> None:
    low, high = data["windows"][0].pop("holePolygon")
    data["windows"][0]["boundingBox"] = {"min": low, "max": high}


def _underscores(data: dict) -> None:
    data["rooms"][0]["floor_polygon"] = data["rooms"][0].pop("floorPolygon")


def _parameters(data: dict) -> None:
    data["procedural_parameters"] = data.pop("proceduralParameters")


def _ends(data: dict) -> None:
    data["walls"][0] = {"id": "wall|1", "p0": point(0, 0, 0), "p1": point(4, 0, 0)}


@pytest.mark.parametrize(
    ("age", "place"),
    [
        (_text_materials, "rooms.0.floorMaterial is the text 'Wood'"),
        (_text_ceiling, "proceduralParameters.ceilingMaterial is the text 'PureWhite'"),
        (_boxes, "windows.0.boundingBox is an old key; in 1.0.0 it is `holePolygon`"),
        (_underscores, "rooms.0.floor_polygon is an old key; in 1.0.0 it is `floorPolygon`"),
        (_parameters, "procedural_parameters is an old key; in 1.0.0 it is `proceduralParameters`"),
        (_ends, "walls.0.p0 is an old key; in 1.0.0 it is `polygon`"),
    ],
)
def test_an_older_schema_is_told_by_its_name_and_what_to_do(data, age, place):
    age(data)
    with pytest.raises(HouseError, match=r"of an older schema than 1\.0\.0: " + re.escape(place)) as caught:
        House("h", data)
    assert "upgrade_house.py" in str(caught.value)


def test_drawers_that_the_document_does_not_name_may_be_there(data):
    house = House("h", data)
    assert house.ids == {"Table|1", "Cup|1", "Fridge|1", "window|1"}
    may_be = ("Table|1", "window|1", "Drawer|1|Table0", "Drawer|1|Table12")
    cannot = ("Table|2", "Drawer|1|Table", "Drawer|1|Tablex", "Drawer|2|Table0", "Drawer|1|Desk0")
    assert [house.may_contain(each) for each in (*may_be, *cannot)] == [True] * 4 + [False] * 5


def test_a_house_without_rooms_is_refused(data):
    data["rooms"] = []
    data["windows"] = []
    with pytest.raises(HouseError, match="House 'h' has no rooms"):
        House("h", data)


def test_files_that_are_absent_or_too_large(tmp_path):
    with pytest.raises(HouseError, match="does not exist"):
        House.load(tmp_path / "house.json")
    with (tmp_path / "house.json").open("wb") as file:
        file.truncate(MAX_HOUSE_BYTES + 1)
    with pytest.raises(HouseError, match="is over 32 MiB"):
        House.load(tmp_path / "house.json")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity"])
def test_a_number_that_is_none_is_refused_anywhere_in_a_file(data, tmp_path, number):
    data["metadata"]["note"] = "here"
    path = tmp_path / "house.json"
    path.write_text(json.dumps(data).replace('"here"', number))
    with pytest.raises(HouseError, match="is not JSON"):
        House.load(path)
    data["metadata"]["note"] = float(number.replace("Infinity", "inf"))
    with pytest.raises(HouseError, match="NaN or infinite"):
        _ = House("h", data).sha256


def test_things_in_things_without_end_are_refused(data):
    innermost = data["objects"][0]
    for depth in range(MAX_NESTING):
        innermost["children"] = [{**innermost, "id": f"Inner|{depth}", "children": []}]
        innermost = innermost["children"][0]
    message = rf"'Inner\|{MAX_NESTING - 1}' is inside or on a chain of {MAX_NESTING + 1} objects"
    with pytest.raises(HouseError, match=message):
        House("h", data)


def test_a_thing_that_is_its_own_child_is_refused(data):
    data["objects"][0]["children"] = [data["objects"][0]]
    with pytest.raises(HouseError, match=r"objects\.0"):
        House("h", data)


def test_half_a_character_has_no_hash(data, tmp_path):
    data["metadata"]["note"] = "a\ud800b"
    with pytest.raises(HouseError, match=r"'\\ud800' is an unpaired surrogate"):
        _ = House("h", data).sha256
    with pytest.raises(HouseError, match="an unpaired surrogate"):
        House("h", data).save(tmp_path / "house.json")
    assert not (tmp_path / "house.json").exists()
