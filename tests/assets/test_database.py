"""Sizes: own ids, a database file, and guesses from words."""

import gzip
import json
import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase, own_asset_id
from vigil.base.geometry import Vec3
from vigil.errors import SettingError

DEFAULT = AssetDatabase.default()


@pytest.mark.parametrize("category", sorted(CATALOG))
def test_own_ids_vary_within_the_spread_and_repeat(category: str) -> None:
    row = CATALOG[category]
    sizes = set()
    for number in range(40):
        asset_id = own_asset_id(category, number)
        entry = DEFAULT.look_up(asset_id, "Thing|1")
        assert entry == AssetDatabase.default().look_up(asset_id, "Other|2")
        assert entry.category == category
        for side, typical in zip(entry.size, row.typical_size, strict=True):
            assert abs(side / typical - 1) <= row.size_spread + 0.05 * (typical < 0.005) + 1e-3
        sizes.add(entry.size)
    assert len(sizes) == 1 if row.size_spread == 0 else len(sizes) > 10


def test_own_sizes_are_pinned() -> None:
    """Houses of packs depend on these figures: a change here changes every house."""
    assert DEFAULT.look_up("vigil_Sofa_3", "Sofa|1").size == Vec3(1.8951, 0.802, 0.8603)
    assert DEFAULT.look_up("vigil_Sofa_3", "Sofa|1").variant == 1321925914


@pytest.mark.parametrize(
    ("asset_id", "object_id", "nearest"),
    [
        ("vigil_Spaceship_1", "x|1", "Box"),
        ("vigil_Tabel_3", "x|2", "DiningTable"),
        ("Fridgge_3", "Frigde|1", "Fridge"),
        ("qwxyz_77", "zz|1", "Box"),
        ("", "", "Box"),
    ],
)
def test_what_is_unknown_is_shown_as_the_nearest_with_a_note(asset_id: str, object_id: str, nearest: str) -> None:
    entry = DEFAULT.look_up(asset_id, object_id)
    assert entry.category == nearest
    assert entry.size == CATALOG[nearest].typical_size
    assert entry.note is not None
    assert repr(asset_id) in entry.note
    assert nearest in entry.note


def test_an_asset_that_a_database_lacks_is_noted_and_one_that_it_has_is_not() -> None:
    database = AssetDatabase({"Chair_9": ("Chair", Vec3(0.5, 1.0, 0.5))})
    assert database.look_up("Chair_9", "Chair|1").note is None
    assert "'Chair_10'" in (database.look_up("Chair_10", "Chair|2").note or "")
    assert DEFAULT.look_up("Chair_10", "Chair|2").note is None


@pytest.mark.parametrize(
    ("asset_id", "category"),
    [
        ("Alarm_Clock_15", "AlarmClock"),
        ("RoboTHOR_cellphone_blackberry_v", "CellPhone"),
        ("Remote_2", "RemoteControl"),
        ("TV_Stand_212_1", "TVStand"),
        ("pillow_19", "Pillow"),
        ("bin_9", "GarbageCan"),
        ("Countertop_I_8x8", "CounterTop"),
        ("RoboTHOR_salt_pepper_shaker_bnyd_pepper_v", "PepperShaker"),
        ("Toilet_Paper_Hanger_3", "ToiletPaperHanger"),
        ("Toilet_Paper_Used_Up", "ToiletPaper"),
        ("Towel_Statue_2", "Statue"),
        ("Wall_Decor_Photo_3V", "Painting"),
        ("Tennis_Racquet_1", "TennisRacket"),
        ("RoboTHOR_side_table_nested_havsta_v", "SideTable"),
        ("RoboTHOR_television_props_america_1_v", "Television"),
        ("RoboTHOR_basketball_rhode_island_novelty_v", "BasketBall"),
        ("DecorativeBox3", "Box"),
        ("Dish_Sponge_1", "DishSponge"),
        ("Bathroom_Faucet_15", "Faucet"),
        ("Paper_Towel_1", "PaperTowelRoll"),
        ("Bath_Towel_Holder1", "TowelHolder"),
        ("Apples_7", "Apple"),
        ("Some_Nice_Armchairs", "ArmChair"),
    ],
)
def test_words_of_an_asset_id(asset_id: str, category: str) -> None:
    entry = DEFAULT.look_up(asset_id, "small|3|1")
    assert (entry.category, entry.note) == (category, None)


@pytest.mark.parametrize(
    ("asset_id", "name", "category", "note"),
    [
        ("Mystery_1", "Chair|7|0", "Chair", None),
        ("Sofa_1", "ArmChair|7|0", "ArmChair", None),
        ("0a1b2c", "coffee_table_1|2", "CoffeeTable", "a guess by the name 'coffee_table_1'"),
        ("0000b0e0d00000000000000000000001", "bookshelf-0 (living room)", "ShelvingUnit", "by the name 'bookshelf-0'"),
        ("00000000000000000000000000cd0000", "tv-0 (living room)", "Television", "by the name 'tv-0'"),
        ("b0e0d0f1-4bed-00cd-9c0d-0123456789ab", "sofa-0", "Sofa", "by the name 'sofa-0'"),
        ("objaverse_0BED00CD0000", "mug-1|desk-0 (study)", "Mug", "by the name 'mug-1'"),
        ("12bed34", "x", "Box", "no known category"),
        ("4bed56cd78bed90a", "0bed0cd0", "Box", "no known category"),
        ("Bed_3", "sofa-0", "Sofa", "though its id speaks of Bed"),
        ("Bed001", "small|1|2", "Bed", None),
        ("a1", "plant-0 (shower room)", "HousePlant", "by the name 'plant-0'"),
    ],
)
def test_the_objects_own_name_decides_and_a_guess_is_said(asset_id, name, category, note) -> None:
    entry = DEFAULT.look_up(asset_id, name)
    assert entry.category == category
    assert (entry.note is None) if note is None else note in (entry.note or "")


def test_random_hashes_are_no_words() -> None:
    rng = random.Random(0)
    for _ in range(2000):
        asset_id = f"{rng.getrandbits(128):032x}"
        assert DEFAULT.look_up(asset_id, "obj|1").category == "Box", asset_id
        assert DEFAULT.look_up(f"objaverse_{asset_id.upper()}", "obj|1").category == "Box", asset_id


def test_a_database_decides_over_all_names() -> None:
    database = AssetDatabase({"0000b0e0d00000": ("Chair", Vec3(0.5, 1.0, 0.5))})
    assert database.look_up("0000b0e0d00000", "Sofa|1").category == "Chair"


def test_sizes_that_ids_state() -> None:
    window = DEFAULT.look_up("Window_Hung_48x32", "window|1").size
    assert (window.x, window.y) == pytest.approx((48 * 0.0254, 32 * 0.0254))
    counter = DEFAULT.look_up("Countertop_I_8x2", "2|1").size
    assert (counter.x, counter.z) == pytest.approx((2.44, 0.61), abs=0.01)
    assert DEFAULT.look_up("Doorway_Double_3", "door|1").size.x == 2 * DEFAULT.look_up("Doorway_3", "door|1").size.x


def test_u_shaped_countertops_differ_from_l_shaped_ones() -> None:
    u_shaped, l_shaped = (DEFAULT.look_up(f"Countertop_{plan}_8x10", "2|0").size for plan in "CL")
    assert u_shaped.z == pytest.approx(l_shaped.z + 0.02)


def write(path: Path, data: Any) -> Path:
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return path


def box(x: Any = 1.0, y: Any = 2.0, z: Any = 3.0) -> dict[str, Any]:
    return {"Chair": [{"assetId": "C_1", "boundingBox": {"x": x, "y": y, "z": z}}]}


def test_database_file_wins_over_words(tmp_path: Path) -> None:
    data = {"Chair": [{"assetId": "Sofa_1", "boundingBox": {"x": 0.5, "y": 0, "z": 0.6}, "objectType": "Chair"}]}
    database = AssetDatabase.load(write(tmp_path / "db.json", data))
    assert len(database) == 1
    entry = database.look_up("Sofa_1", "2|3")
    assert (entry.category, entry.size) == ("Chair", Vec3(0.5, 0.001, 0.6))
    assert database.look_up("Mug_2", "small|1").category == "Mug"
    assert database.look_up("vigil_Mug_2", "small|1").category == "Mug"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("{", "not JSON"),
        ("[]", "categories"),
        ("{}", "categories"),
        ({"Chair": 3}, "'Chair' is not a list"),
        ({"Chair": ["C_1"]}, r"Chair\[0\] has no `assetId`"),
        ({"Chair": [{"assetId": "C_1"}]}, r"Chair\[0\] \(C_1\): `boundingBox`"),
        (box(x="1"), "boundingBox"),
        (box(x=True), "boundingBox"),
        (box(y=-1.0), "boundingBox"),
        (box(z=1000), "boundingBox"),
        (box(z=math.nan), "boundingBox"),
    ],
)
def test_bad_database_file(tmp_path: Path, content: Any, reason: str) -> None:
    path = write(tmp_path / "db.json", content)
    with pytest.raises(SettingError, match=reason) as caught:
        AssetDatabase.load(path)
    assert str(path) in str(caught.value)


def test_missing_database_file(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"none\.json' does not exist"):
        AssetDatabase.load(tmp_path / "none.json")


def names(house: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the asset id and the name of everything in a house; an opening has only the name of its asset."""
    yield from ((node["assetId"], node["assetId"]) for node in [*house["doors"], *house["windows"]])
    stack = [*house["objects"]]
    while stack:
        node = stack.pop()
        stack.extend(node.get("children") or [])
        yield node["assetId"], node["id"]


def test_every_object_of_thors_is_known_with_and_without_the_database(thor_files: Path) -> None:
    database = AssetDatabase.load(thor_files / "asset-database.json")
    with gzip.open(thor_files / "one_room_train.jsonl.gz") as lines:
        houses = [json.loads(line) for line in lines]
    houses += [json.loads((thor_files / f"house_{k}.json").read_bytes()) for k in range(3)]
    seen = {name for house in houses for name in names(house)}
    for asset_id, object_id in sorted(seen):
        known, guessed = database.look_up(asset_id, object_id), DEFAULT.look_up(asset_id, object_id)
        assert known.category == guessed.category, (asset_id, object_id)
        assert known.variant == guessed.variant
        assert (known.note, guessed.note) == (None, None)
