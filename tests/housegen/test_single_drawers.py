"""Generated houses name every drawer, and each opens by itself."""

import pytest

from tools.house_measures import measure
from vigil.assets.database import AssetDatabase
from vigil.assets.drawers import drawer_names, split_drawer_id
from vigil.assets.making import make
from vigil.housegen.base.spec import spec_for
from vigil.housegen.checking.check import check_house
from vigil.housegen.document import with_merged_drawers
from vigil.housegen.generate import GENERATOR_VERSION, generate
from vigil.housegen.thor_export import export_thor
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.fidelity import mismatches_of
from vigil.scene.supports import drawers_of

ASSETS = AssetDatabase.default()
NAMES = (("bedroom", 2), ("4", 1))


@pytest.fixture(scope="module", params=NAMES, ids=lambda pair: f"{pair[0]}-{pair[1]}")
def house(request: pytest.FixtureRequest) -> House:
    spec, seed = request.param
    return generate(seed, spec_for(spec))


def held_by(house: House) -> dict[str, str | None]:
    """Return {object: receptacle that it is in or on} of a house."""
    return {node.id: parent for node, parent in house.objects()}


def test_the_version_is_said(house: House) -> None:
    assert house.document.metadata["generator"]["version"] == GENERATOR_VERSION


def test_things_lie_in_drawers_and_drawers_are_parts(house: House) -> None:
    scene = build_scene(house, ASSETS)
    inside = [thing for thing in scene.things.values() if (thing.parent_joint or "").startswith("drawer")]
    assert inside
    for thing in inside:
        assert scene.things[thing.parent or ""].is_drawer


def test_furniture_with_drawers_is_taken_apart_all_of_it(house: House) -> None:
    scene = build_scene(house, ASSETS)
    found = 0
    for node, _ in house.objects():
        entry = ASSETS.look_up(node.asset_id, node.id)
        wanted = () if split_drawer_id(node.asset_id) else drawer_names(make(entry.category, entry.size, entry.variant))
        assert len(drawers_of(scene, scene.things[node.id])) == len(wanted)
        found += len(wanted)
    assert found > 0


def test_no_faults_and_no_flaws(house: House) -> None:
    assert check_house(house, ASSETS) == []
    assert mismatches_of(build_scene(house, ASSETS), house, ASSETS) == []


def test_a_drawer_elsewhere_in_the_document_is_a_fault() -> None:
    data = generate(1, spec_for("bedroom")).data
    drawers = [child for node in data["objects"] for child in node.get("children", []) if "_drawer" in child["assetId"]]
    drawers[0]["position"]["y"] += 0.3
    (fault,) = check_house(House("moved", data), ASSETS)
    assert (fault.rule, fault.subject) == ("hovering", drawers[0]["id"])


def test_whole_furniture_names_no_drawers_and_keeps_what_lies_in_them(house: House) -> None:
    whole = with_merged_drawers(house)
    assert with_merged_drawers(whole) is whole
    assert measure(house, ASSETS) == measure(whole, ASSETS)
    parents = held_by(house)
    drawers = {node.id for node, _ in house.objects() if split_drawer_id(node.asset_id)}
    assert held_by(whole) == {
        name: parents[parent] if parent in drawers else parent
        for name, parent in parents.items()
        if name not in drawers
    }


def test_an_exported_house_names_no_drawers(thor_files) -> None:
    thor = AssetDatabase.load(thor_files / "asset-database.json")
    house = generate(4, spec_for("bedroom"))
    exported = House("exported", export_thor(house, thor, {}).data)
    assert all(split_drawer_id(node.asset_id) is None for node, _ in exported.objects())
    assert set(held_by(exported)) <= set(held_by(with_merged_drawers(house)))
