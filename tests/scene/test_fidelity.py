"""What a scene shows is what its house asks for; sampled here, swept over files by `vigil houses check --shapes`."""

import gzip
import itertools
import json
from dataclasses import replace

import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House
from vigil.scene.build import build_scene
from vigil.scene.fidelity import mismatches_of, too_many_triangles
from vigil.scene.things import Scene
from vigil.sim.conformance.reference_house import reference_house
from vigil.sim.engines.mujoco.compiled.model import build

SIZES = AssetDatabase.default()
SMALL_MOST, FURNITURE_MOST = 800, 3000


@pytest.fixture
def house() -> House:
    return reference_house()


@pytest.fixture
def scene(house: House) -> Scene:
    return build_scene(house, SIZES)


def _rules(scene: Scene, house: House) -> set[tuple[str, str]]:
    return {(flaw.rule, flaw.thing) for flaw in mismatches_of(scene, house, SIZES)}


def test_the_trial_house_has_no_flaws(scene: Scene, house: House) -> None:
    assert mismatches_of(scene, house, SIZES) == []


def test_a_stand_in_is_named(scene: Scene, house: House) -> None:
    scene.things["Apple|1"].asset = make("Zeppelin", scene.things["Apple|1"].asset.size, 0)
    assert _rules(scene, house) == {("stand-in", "Apple|1")}


def test_a_shape_of_another_size_is_named(scene: Scene, house: House) -> None:
    thing = scene.things["Painting|1"]
    x, y, z = thing.asset.size
    thing.asset = make("Painting", Vec3(1.05 * x, y, z), 3)
    assert _rules(scene, house) == {("box", "Painting|1")}


@pytest.mark.parametrize("rise_m", [0.004, -0.004])
@pytest.mark.parametrize("thing_id", ["Mug|1", "Fridge|1"])
def test_what_hovers_or_sinks_is_named(scene: Scene, house: House, thing_id: str, rise_m: float) -> None:
    thing = scene.things[thing_id]
    thing.position = Vec3(thing.position.x, thing.position.y + rise_m, thing.position.z)
    assert ("gap", thing_id) in _rules(scene, house)


def test_a_state_that_no_part_shows_is_named(scene: Scene, house: House) -> None:
    lamp, box = scene.things["FloorLamp|1"], scene.things["Box|1"]
    lamp.asset = replace(lamp.asset, parts=tuple(replace(part, material_on=None) for part in lamp.asset.parts))
    box.asset = replace(box.asset, parts=tuple(replace(part, bears_open=False) for part in box.asset.parts))
    assert _rules(scene, house) == {("state", "FloorLamp|1"), ("state", "Box|1")}


@pytest.mark.parametrize(("rooms", "seed"), [("1", 5), ("4", 6)])
def test_own_houses_have_no_flaws_and_few_triangles(rooms: str, seed: int) -> None:
    house = generate(seed, spec_for(rooms))
    scene = build_scene(house, SIZES)
    assert mismatches_of(scene, house, SIZES) == []
    assert too_many_triangles(house.name, build(scene).triangles, len(scene.rooms)) == []


def test_houses_of_thors_assets_have_no_flaws_and_few_triangles(thor_files) -> None:
    assets = AssetDatabase.load(thor_files / "asset-database.json")
    with gzip.open(thor_files / "one_room_train.jsonl.gz", "rt") as lines:
        houses = [House(f"train_{n}", json.loads(line)) for n, line in enumerate(itertools.islice(lines, 0, None, 60))]
    for house in [House.load(thor_files / "house_1.json"), *houses]:
        scene = build_scene(house, assets)
        assert mismatches_of(scene, house, assets) == []
        assert scene.notes == []
        assert too_many_triangles(house.name, build(scene).triangles, len(scene.rooms)) == []


def test_triangles_are_limited() -> None:
    assert too_many_triangles("h", 30_001, 1)
    assert not too_many_triangles("h", 30_001, 4)
    assert too_many_triangles("h", 100_001, 4)


@pytest.mark.parametrize("category", sorted(CATALOG))
def test_things_have_few_triangles(category: str) -> None:
    row = CATALOG[category]
    is_small = row.is_pickupable and max(row.typical_size) < 0.75 and category not in ("Box", "Footstool")
    for variant in range(12):
        parts = make(category, row.typical_size, variant).parts
        assert sum(len(part.mesh.faces) for part in parts) <= (SMALL_MOST if is_small else FURNITURE_MOST)
