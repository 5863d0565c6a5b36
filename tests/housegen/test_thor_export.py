import copy
import json
import re

import pytest

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.errors import SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.checking.check import check_house
from vigil.housegen.document import with_merged_drawers
from vigil.housegen.generate import generate
from vigil.housegen.thor_export import export_thor, load_materials
from vigil.protocol.house import House

BOX = {"x": 0.5, "y": 0.5, "z": 0.5}
SAID_TO_BE_MISSING = {"Cabinet", "Drawer", "Shelf", "Stove", "Curtains", "Bathtub", "Mirror", "CeilingLamp", "Rug"}


@pytest.fixture(scope="module")
def thor(thor_files):
    return AssetDatabase.load(thor_files / "asset-database.json")


@pytest.fixture(scope="module")
def materials(thor_files):
    return load_materials(thor_files / "material-database.json")


@pytest.fixture(scope="module", params=["kitchen", "bathroom", "2"])
def pair(request, thor, materials):
    house = generate(4, spec_for(request.param))
    result = export_thor(house, thor, materials)
    return house, House("exported", result.data), result


def test_every_asset_is_one_of_thors_of_the_same_type(pair, thor):
    before, after, _ = pair
    types = {node.id: AssetDatabase.default().look_up(node.asset_id, node.id).category for node, _ in before.objects()}
    for node, _ in after.objects():
        assert node.asset_id in {asset_id for asset_id, _ in thor.of_category(types[node.id])}
    for opening in [*after.document.doors, *after.document.windows]:
        kinds = ("Doorway", "Doorframe", "Window")
        assert opening.asset_id in {asset_id for kind in kinds for asset_id, _ in thor.of_category(kind)}


def test_nothing_is_lost_but_what_thor_has_no_type_for(pair, thor):
    before, after, result = pair
    missing = {category for category in SAID_TO_BE_MISSING if not thor.of_category(category)}
    lost = {*result.left_out, *result.removed_collisions}
    before = with_merged_drawers(before)
    assert {node.id for node, _ in before.objects()} == {node.id for node, _ in after.objects()} | lost
    assert len(result.removed_collisions) <= 0.1 * len(before.objects())
    parents = {node.id: parent for node, parent in before.objects()}
    for name in result.left_out:
        line = [name]
        while parents[line[-1]] is not None:
            line.append(parents[line[-1]])
        assert any(each.split("|")[0] in missing for each in line)


def test_the_exported_house_is_sound(pair, thor):
    _, after, _ = pair
    faults = check_house(after, thor)
    assert [str(fault) for fault in faults if fault.rule in ("schema", "reference", "hole", "asset", "overlap")] == []
    assert len([fault for fault in faults if fault.rule != "hovering"]) <= 0.1 * len(after.objects())


def test_sizes_are_near_those_before(thor):
    house = generate(4, spec_for("bedroom"))
    result = export_thor(house, thor, {})
    before = {node.id: AssetDatabase.default().look_up(node.asset_id, node.id).size for node, _ in house.objects()}
    for node, _ in House("exported", result.data).objects():
        if node.id.startswith(("Bed|", "Dresser|")):
            after = thor.look_up(node.asset_id, node.id).size
            assert all(0.7 < a / b < 1.45 for a, b in zip(after, before[node.id], strict=True)), node.id


def test_the_house_itself_stays_as_it_was(thor):
    house = generate(4, spec_for("bathroom"))
    data = copy.deepcopy(house.data)
    export_thor(house, thor, {})
    assert house.data == data


def test_unknown_materials_become_names_alike(thor, materials):
    house = generate(4, spec_for("bathroom"))
    data = copy.deepcopy(house.data)
    data["rooms"][0]["floorMaterial"] = {"name": "wood/oak"}
    data["walls"][0]["material"] = {"name": "no such thing"}
    result = export_thor(House("odd", data), thor, materials)
    known = {name for names in materials.values() for name in names}
    floor = result.data["rooms"][0]["floorMaterial"]["name"]
    assert floor in known
    assert "wood" in floor.lower()
    assert {wall["material"]["name"] for wall in result.data["walls"]} <= known


@pytest.mark.parametrize("text", ["[]", "{}", "nothing", '{"Wood": "oak"}', '{"Wood": [3]}'])
def test_material_databases_of_another_form_are_refused(tmp_path, text):
    path = tmp_path / "materials.json"
    path.write_text(text)
    with pytest.raises(SettingError, match=r"materials\.json.*Expected AI2-THOR's form"):
        load_materials(path)


def test_a_small_database_is_enough_to_export(tmp_path):
    rows = {"Toilet": [{"assetId": "Toilet_9", "boundingBox": BOX}]}
    (tmp_path / "assets.json").write_text(json.dumps(rows))
    small = AssetDatabase.load(tmp_path / "assets.json")
    house = generate(4, spec_for("bathroom"))
    result = export_thor(house, small, {})
    exported = House("exported", result.data)
    assert {node.asset_id for node, _ in exported.objects()} == {"Toilet_9"}
    toilet = next(node for node, _ in exported.objects())
    assert toilet.position.y == pytest.approx(0.25, abs=0.01)


def test_windows_and_front_doors_that_nothing_fits_are_left_out(tmp_path):
    rows = {"Toilet": [{"assetId": "Toilet_9", "boundingBox": BOX}]}
    (tmp_path / "assets.json").write_text(json.dumps(rows))
    house = generate(4, spec_for("bathroom"))
    result = export_thor(house, AssetDatabase.load(tmp_path / "assets.json"), {})
    openings = {opening.id for opening in [*house.document.doors, *house.document.windows]}
    assert openings <= set(result.left_out)
    assert result.data["doors"] == result.data["windows"] == []


def test_inner_doors_that_nothing_fits_are_named(thor):
    beds = AssetDatabase({name: ("Bed", size) for name, size in thor.of_category("Bed")})
    house = generate(0, spec_for("bedroom-living"))
    inner = next(door.id for door in house.document.doors if door.room0 != door.room1)
    with pytest.raises(
        SettingError, match=rf"does not have a Door\w+ that fits {re.escape(repr(inner))}.*whole asset-database"
    ):
        export_thor(house, beds, {})


def test_a_database_without_any_of_the_types_is_refused():
    beds = AssetDatabase({"Bed_1": ("Bed", Vec3(1.5, 0.6, 2.0))})
    with pytest.raises(SettingError, match=r"does not have an asset for any of its objects.*whole asset-database"):
        export_thor(generate(0, spec_for("kitchen")), beds, {})


@pytest.mark.parametrize("name", ["house_0", "house_1", "house_2"])
def test_a_house_of_thors_assets_stays_as_it_is(thor_files, thor, materials, name):
    house = House.load(thor_files / f"{name}.json")
    result = export_thor(house, thor, materials)
    assert result.left_out == result.removed_collisions == []
    assert result.data == house.data


def test_things_of_thor_on_changed_furniture_stay_themselves(thor_files, thor):
    house = House.load(thor_files / "house_1.json")
    data = copy.deepcopy(house.data)
    carrier = next(node for node in data["objects"] if node.get("children") and "Table" in node["id"])
    held = {node["id"]: node["assetId"] for node in carrier["children"]}
    carrier["assetId"] = "vigil_DiningTable_3"
    result = export_thor(House("mixed", data), thor, {})
    assert result.data["objects"][data["objects"].index(carrier)]["assetId"] != "vigil_DiningTable_3"
    after = {node.id: node.asset_id for node, _ in House("after", result.data).objects()}
    assert all(after.get(name, asset) == asset for name, asset in held.items())
