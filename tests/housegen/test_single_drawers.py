"""Generator version 5: the houses of version 4 with drawers that open one by one."""

import pytest

from vigil.assets.drawers import named_drawer
from vigil.assets.sizes import AssetDatabase
from vigil.house import House
from vigil.housegen import GENERATOR_VERSION, check_house, generate, spec_for
from vigil.housegen.base.whole_furniture import with_whole_furniture
from vigil.housegen.checking.statistics import measure
from vigil.housegen.thor_export import export_thor
from vigil.scene.build import build_scene
from vigil.scene.supports import parts_of
from vigil.sim.showcase.fidelity import mismatches_of

ASSETS = AssetDatabase.default()
NAMES = (("bedroom", 4), ("4", 1))


@pytest.fixture(scope="module", params=NAMES, ids=lambda pair: f"{pair[0]}-{pair[1]}")
def pair(request: pytest.FixtureRequest) -> tuple[House, House]:
    """The same seed under version 4 and 5."""
    spec, seed = request.param
    return generate(seed, spec_for(spec), "4"), generate(seed, spec_for(spec), "5")


def held_by(house: House) -> dict[str, tuple[str | None, str, float | None]]:
    """Returns in or on what each object of a house is, its asset and its openness."""
    return {node.id: (parent, node.asset_id, node.openness) for node, parent in house.objects()}


def test_the_version_is_said(pair: tuple[House, House]) -> None:
    assert [house.document.metadata["generator"]["version"] for house in pair] == ["4", "5"]
    assert generate(1, spec_for("bathroom")).document.metadata["generator"]["version"] == GENERATOR_VERSION


def test_what_is_there_and_where_stays(pair: tuple[House, House]) -> None:
    before, after = pair
    drawers = {node.id for node, _ in after.objects() if named_drawer(node.asset_id)}
    assert drawers
    found = {node.id: (node.asset_id, node.position, node.rotation) for node, _ in after.objects()}
    wanted = {node.id: (node.asset_id, node.position, node.rotation) for node, _ in before.objects()}
    assert {name: place for name, place in found.items() if name not in drawers} == wanted


def test_things_lie_in_the_drawer_that_carried_them(pair: tuple[House, House]) -> None:
    before, after = (build_scene(house, ASSETS) for house in pair)
    carried = {thing.id: thing.surface for thing in before.things.values() if thing.parent_joint is not None}
    inside = {thing.id: thing for thing in after.things.values() if thing.parent_joint is not None}
    assert {name: thing.surface for name, thing in inside.items()} == carried
    for thing in inside.values():
        drawer = after.things[thing.parent or ""]
        assert drawer.is_part
        assert drawer.parent == before.things[thing.id].parent


def test_furniture_with_drawers_is_taken_apart_all_of_it(pair: tuple[House, House]) -> None:
    before, after = (build_scene(house, ASSETS) for house in pair)
    for thing in before.things.values():
        is_chest = any(joint.name.startswith("drawer") for joint in thing.asset.joints)
        parts = parts_of(after, after.things[thing.id])
        assert len(parts) == (len(thing.asset.joints) if is_chest else 0)


def test_no_faults_and_no_flaws(pair: tuple[House, House]) -> None:
    _, after = pair
    assert check_house(after, ASSETS) == []
    assert mismatches_of(build_scene(after, ASSETS), after, ASSETS) == []


def test_a_drawer_elsewhere_in_the_document_is_a_fault() -> None:
    data = generate(1, spec_for("bedroom"), "5").data
    drawers = [child for node in data["objects"] for child in node.get("children", []) if "_drawer" in child["assetId"]]
    drawers[0]["position"]["y"] += 0.3
    (fault,) = check_house(House("moved", data), ASSETS)
    assert (fault.rule, fault.subject) == ("hovering", drawers[0]["id"])


def test_statistics_and_export_have_the_furniture_whole(pair: tuple[House, House]) -> None:
    before, after = pair
    assert measure(after, ASSETS) == measure(before, ASSETS)
    assert with_whole_furniture(before) is before
    assert held_by(with_whole_furniture(after)) == held_by(before)


def test_an_exported_house_names_no_drawers(thor_files) -> None:
    thor = AssetDatabase.load(thor_files / "asset-database.json")
    houses = [generate(4, spec_for("bedroom"), version) for version in ("4", "5")]
    before, after = (House("exported", export_thor(house, thor, {}).data) for house in houses)
    assert held_by(after) == held_by(before)
