import copy
import gzip
import json

import pytest

from vigil.assets.database import AssetDatabase
from vigil.housegen.checking.check import MAX_OVERLAPS, Fault, check_house
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.supports import surface_frame


def rules(data: dict) -> list[str]:
    return [fault.rule for fault in faults(data)]


def faults(data: dict) -> list[Fault]:
    return check_house(House("broken", data), AssetDatabase.default())


@pytest.fixture
def data(bedroom):
    return copy.deepcopy(bedroom.data)


def find(data: dict, category: str) -> dict:
    return next(node for node in data["objects"] if node["id"].startswith(category))


def test_a_generated_house_is_clean(data):
    assert faults(data) == []


def test_wrong_schema(data):
    data["metadata"]["schema"] = "0.0.1"
    assert rules(data) == ["schema"]


def test_missing_wall(data):
    data["doors"][0]["wall1"] = "wall|9|0|0|1|1"
    assert "reference" in rules(data)


def test_self_intersecting_room(data):
    polygon = data["rooms"][0]["floorPolygon"]
    polygon[0], polygon[1] = polygon[1], polygon[0]
    assert "room-shape" in rules(data)


def test_rooms_that_overlap(data):
    data["rooms"].append({**copy.deepcopy(data["rooms"][0]), "id": "room|99"})
    assert "rooms-overlap" in rules(data)


def test_hole_outside_its_wall(data):
    data["doors"][0]["holePolygon"][1]["x"] += 50
    found = next(fault for fault in faults(data) if fault.rule == "hole")
    assert "outside its wall" in found.message


def test_unknown_asset(data):
    find(data, "Bed")["assetId"] = "vigil_Spaceship_1"
    assert "asset" in rules(data)


def test_drawers_of_another_asset_than_their_furniture(data):
    find(data, "Dresser")["assetId"] = "vigil_Spaceship_1"
    (fault,) = faults(data)
    assert fault.rule == "load"
    assert "has the same id as a drawer of 'Dresser|2|" in fault.message


def test_hovering(data):
    find(data, "Bed")["position"]["y"] += 0.5
    found = [fault.subject for fault in faults(data) if fault.rule == "hovering"]
    assert find(data, "Bed")["id"] in found


def test_outside_its_room(data):
    find(data, "Bed")["position"]["x"] += 30
    assert "outside-room" in rules(data)


def test_things_that_share_room(data):
    bed, dresser = find(data, "Bed"), find(data, "Dresser")
    dresser["position"]["x"], dresser["position"]["z"] = bed["position"]["x"], bed["position"]["z"]
    pairs = [{fault.subject, fault.other} for fault in faults(data) if fault.rule == "overlap"]
    assert {bed["id"], dresser["id"]} in pairs


def test_a_house_with_very_many_overlaps_is_not_checked_further(data):
    bed = find(data, "Bed")
    data["objects"] += [bed | {"id": f"Bed|copy|{number}", "children": []} for number in range(50)]
    found = faults(data)
    assert sum(fault.rule == "overlap" for fault in found) == MAX_OVERLAPS + 1
    assert str(found[-1]).endswith("further pairs and the space of openable things are not checked")


def test_misplaced_and_missing_furniture(data):
    data["rooms"][0]["roomType"] = "Kitchen"
    assert {"misplaced", "room-lacks"} <= set(rules(data))


def test_start_in_the_bed(data):
    position = find(data, "Bed")["position"]
    data["metadata"]["agent"]["position"].update(x=position["x"], z=position["z"])
    assert rules(data) == ["start"]


def test_no_start(data):
    del data["metadata"]["agent"]
    assert rules(data) == ["start"]


def test_a_closed_off_room(thor_files):
    data = json.loads((thor_files / "house_1.json").read_bytes())
    inner = next(door for door in data["doors"] if door["room0"] != door["room1"])
    data["doors"].remove(inner)
    assert "unreachable-room" in rules(data)


def test_something_before_a_drawer(data):
    dresser = find(data, "Dresser")
    box = copy.deepcopy(dresser)
    yaw = dresser["rotation"]["y"] % 360
    step = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}[round(yaw)]
    box.update(id="Safe|2|999", assetId="vigil_Safe_1", children=[])
    box["position"] = {
        "x": dresser["position"]["x"] + 0.5 * step[0],
        "y": 0.19,
        "z": dresser["position"]["z"] + 0.5 * step[1],
    }
    data["objects"].append(box)
    assert any(fault.rule == "blocked-opening" and fault.subject.startswith("Drawer|2|") for fault in faults(data))


def book_at(x: float, y: float, z: float) -> dict:
    """A book, 3 cm thick, on y; its cover opens to -x."""
    asset = "vigil_Book_1"
    size = AssetDatabase.default().look_up(asset, "Book|2|999").size
    place, turn = {"x": x, "y": y + size.y / 2, "z": z}, {"x": 0, "y": 0, "z": 0}
    return {"id": "Book|2|999", "assetId": asset, "position": place, "rotation": turn, "kinematic": False}


def kept_books(data: dict) -> list[tuple[str, str | None]]:
    return [(each.rule, each.other) for each in faults(data) if each.subject == "Book|2|999" and "open" in each.message]


def test_a_cover_that_reaches_through_a_wall(data):
    corners = [(point["x"], point["z"]) for point in data["rooms"][0]["floorPolygon"]]
    left, width = min(x for x, _ in corners), AssetDatabase.default().look_up("vigil_Book_1", "Book|2|999").size.x
    front, back = (end(z for x, z in corners if x == left) for end in (min, max))
    for away, expected in ((0.05, [("blocked-opening", None)]), (1.5 * width, [])):
        book = book_at(left + away + width / 2, 2.2, (front + back) / 2)  # over all that stands and hangs there
        assert kept_books({**data, "objects": [*data["objects"], book]}) == expected


def test_a_cover_that_hits_the_drawer_that_its_book_lies_in(data):
    dresser = find(data, "Dresser")
    scene = build_scene(House("bedroom", data), AssetDatabase.default())
    drawer = scene.things[dresser["children"][0]["id"]]
    (surface,) = drawer.asset.surfaces
    dresser["children"][0]["children"] = [book_at(*surface_frame(drawer, surface).shift.tolist())]
    assert kept_books(data) == [("blocked-opening", drawer.id)]


@pytest.mark.parametrize("name", ["house_0", "house_1", "house_2"])
def test_houses_of_thors_assets_are_checked_without_failing(thor_files, name):
    house = House.load(thor_files / f"{name}.json")
    found = check_house(house, AssetDatabase.load(thor_files / "asset-database.json"))
    assert all(fault.rule not in ("schema", "reference", "room-shape", "hole", "asset") for fault in found)


def test_more_houses_of_thors_assets_are_checked_without_failing(thor_files):
    assets = AssetDatabase.load(thor_files / "asset-database.json")
    with gzip.open(thor_files / "one_room_train.jsonl.gz", "rt") as lines:
        for number, line in zip(range(5), lines, strict=False):
            check_house(House(f"train_{number}", json.loads(line)), assets)


def test_a_room_without_shape_is_looked_at_no_further(data):
    polygon = data["rooms"][0]["floorPolygon"]
    polygon[0], polygon[1] = polygon[1], polygon[0]
    assert rules(data) == ["room-shape"]


def test_walls_without_length(data):
    wall = data["walls"][0]
    wall["polygon"] = [wall["polygon"][0]] * 4
    found = [(fault.rule, fault.subject) for fault in faults(data)]
    assert ("wall-shape", wall["id"]) in found


def test_walls_that_stand_on_one_point(data):
    wall = data["walls"][0]
    wall["polygon"][1]["y"] = 1.0
    assert ("wall-shape", wall["id"]) in [(fault.rule, fault.subject) for fault in faults(data)]


def test_walls_that_are_no_rectangles(data):
    wall = data["walls"][0]
    wall["polygon"][2]["x"] += 0.5
    assert ("wall-outline", wall["id"]) in [(fault.rule, fault.subject) for fault in faults(data)]


def test_things_far_away(data):
    find(data, "Bed")["position"]["x"] = 300.0
    assert rules(data) == ["extent"]


def test_holes_far_away(data):
    data["windows"][0]["holePolygon"][0]["y"] = -300.0
    assert ("extent", data["windows"][0]["id"]) in [(fault.rule, fault.subject) for fault in faults(data)]


@pytest.mark.parametrize("openness", [-0.5, 7.0])
def test_states_out_of_range(data, openness):
    door, dresser = data["doors"][0], find(data, "Dresser")
    door["openness"] = dresser["openness"] = openness
    assert [(fault.rule, fault.subject) for fault in faults(data)] == [("state", door["id"]), ("state", dresser["id"])]


def test_holes_without_width(data):
    corner = data["doors"][0]["holePolygon"][0]
    data["doors"][0]["holePolygon"] = [corner, corner]
    assert "hole" in rules(data)


def test_rooms_of_one_name(data):
    data["rooms"].append(copy.deepcopy(data["rooms"][0]))
    assert ("reference", data["rooms"][0]["id"]) in [(fault.rule, fault.subject) for fault in faults(data)]


@pytest.mark.parametrize("agent", [{"position": None}, {"position": {"x": 1}, "rotation": 0}, {}])
def test_starts_that_are_no_pose(data, agent):
    data["metadata"]["agent"] = agent
    found = next(fault for fault in faults(data) if fault.rule == "start")
    assert "is not a start pose" in found.message


def test_a_house_that_does_not_load_for_another_reason(data):
    data["objects"][0]["id"] = data["doors"][0]["id"]
    (found,) = [fault for fault in faults(data) if fault.rule == "load"]
    assert "ids must be unique" in found.message


def test_a_frame_that_names_a_leaf_is_the_door_that_the_simulator_makes_of_it(data):
    door = data["doors"][0]
    door.update(assetId="vigil_Doorframe_1", openable=True, openness=0.0)
    thing = build_scene(House("broken", data), AssetDatabase.default()).things[door["id"]]
    assert (thing.category, thing.is_openable) == ("Doorway", True)
