import copy
import json

import pytest

from vigil.assets.sizes import AssetDatabase
from vigil.errors import SettingError
from vigil.house import House
from vigil.housegen import check_house, generate, spec_for
from vigil.housegen.thor_export import export_thor, load_materials

BOX = {"x": 0.5, "y": 0.5, "z": 0.5}
SAID_TO_BE_MISSING = {"Cabinet", "Drawer", "Shelf", "Stove", "Curtains", "Bathtub", "Mirror", "CeilingLamp", "Rug"}


@pytest.fixture(scope="module")
def thor(procthor):
    return AssetDatabase.load(procthor / "asset-database.json")


@pytest.fixture(scope="module")
def materials(procthor):
    return load_materials(procthor / "material-database.json")


@pytest.fixture(scope="module", params=["kitchen", "bathroom", "2"])
def pair(request, thor, materials):
    house = generate(4, spec_for(request.param))
    result = export_thor(house, AssetDatabase.default(), thor, materials)
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
    lost = {*result.left_out, *result.crowded_out}
    assert {node.id for node, _ in before.objects()} == {node.id for node, _ in after.objects()} | lost
    assert len(result.crowded_out) <= 0.1 * len(before.objects())
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
    result = export_thor(house, AssetDatabase.default(), thor, {})
    before = {node.id: AssetDatabase.default().look_up(node.asset_id, node.id).size for node, _ in house.objects()}
    for node, _ in House("exported", result.data).objects():
        if node.id.startswith(("Bed|", "Dresser|")):
            after = thor.look_up(node.asset_id, node.id).size
            assert all(0.7 < a / b < 1.45 for a, b in zip(after, before[node.id], strict=True)), node.id


def test_the_house_itself_stays_as_it_was(thor):
    house = generate(4, spec_for("bathroom"))
    data = copy.deepcopy(house.data)
    export_thor(house, AssetDatabase.default(), thor, {})
    assert house.data == data


def test_unknown_materials_become_names_alike(thor, materials):
    house = generate(4, spec_for("bathroom"))
    data = copy.deepcopy(house.data)
    data["rooms"][0]["floorMaterial"] = {"name": "wood/oak"}
    data["walls"][0]["material"] = {"name": "no such thing"}
    result = export_thor(House("odd", data), AssetDatabase.default(), thor, materials)
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
    result = export_thor(house, AssetDatabase.default(), small, {})
    exported = House("exported", result.data)
    assert {node.asset_id for node, _ in exported.objects()} == {"Toilet_9"}
    toilet = next(node for node, _ in exported.objects())
    assert toilet.position.y == pytest.approx(0.25, abs=0.01)
