import gzip
import json
import re
import sys
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner, Result

from tests.support.fake_prior import FakePrior, as_procthor_writes
from vigil.cli import app
from vigil.errors import HouseError, SettingError
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House


@pytest.fixture(scope="module")
def bedroom() -> House:
    return generate(0, spec_for("bedroom"))


def houses(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["houses", *map(str, arguments)])


def check(*arguments: str | Path) -> tuple[int, str]:
    done = houses("check", "--no-load", *arguments)
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.output


@pytest.mark.parametrize("text", ["", "{", "[1]", "nothing", "[" * 5000, '{"rooms": 3}'])
def test_what_is_no_house_is_named(tmp_path, text):
    (tmp_path / "bad.json").write_text(text)
    code, said = check(tmp_path / "bad.json")
    assert code == 2
    assert "bad.json" in said
    assert "cannot be loaded" in said


@pytest.fixture
def bow(tmp_path, bedroom) -> Path:
    """A house with a room whose floor crosses itself."""
    data = json.loads(json.dumps(bedroom.data))
    polygon = data["rooms"][0]["floorPolygon"]
    polygon[0], polygon[1] = polygon[1], polygon[0]
    (tmp_path / "bow.json").write_text(json.dumps(data))
    return tmp_path / "bow.json"


def test_a_self_intersecting_room_is_named(bow, bedroom):
    code, said = check(bow)
    assert code == 2
    assert f"{bedroom.document.rooms[0].id}: floor is not a simple polygon" in said


def test_schemas_holes_and_assets_are_named_without_failing(tmp_path, bedroom):
    data = json.loads(json.dumps(bedroom.data))
    data["metadata"]["schema"] = "0.0.1"
    data["doors"][0]["holePolygon"][1]["x"] += 50
    data["objects"][0]["assetId"] = "vigil_Spaceship_1"
    (tmp_path / "odd.json").write_text(json.dumps(data))
    code, said = check(tmp_path / "odd.json")
    assert code == 0
    for words in ("'0.0.1', expected '1.0.0'", "is outside its wall", "'vigil_Spaceship_1'"):
        assert words in said


@pytest.mark.parametrize("content", [b"not gzip", gzip.compress(b"{}" * 999, mtime=0)[:20]], ids=["text", "cut short"])
def test_broken_archives_are_named(tmp_path, content):
    (tmp_path / "many.jsonl.gz").write_bytes(content)
    code, said = check(tmp_path / "many.jsonl.gz")
    assert code == 2
    assert "cannot be read" in said


def test_lines_that_are_no_house_are_named_by_number(tmp_path, bedroom):
    (tmp_path / "many.jsonl").write_bytes(b"nope\n\xff\xfe\n" + json.dumps(bedroom.data).encode() + b"\n")
    code, said = check(tmp_path / "many.jsonl")
    assert code == 2
    assert "line 1 of" in said
    assert "line 2 of" in said
    assert "3 houses: 1 load, 2 do not" in said


def test_a_sweep_says_what_is_rare():
    done = houses("sweep", "--seeds", "0:2", "--rooms", "1", "--no-load", "--min-count", "1", "--workers", "1")
    assert done.exit_code == 2
    assert "1 rooms: 2 houses" in done.output
    assert "fewer than 1 of:" in done.output
    assert "2 houses, 0 problems" in done.output


def test_a_sweep_is_the_same_in_several_processes():
    def swept(*options: str) -> list[str]:
        done = houses("sweep", "--seeds", "3:5", "--rooms", "1,2", *options)
        assert done.exit_code == 0, done.output
        return [re.sub(r"\d\.\d\d s", "", line) for line in done.stdout.splitlines()]

    assert swept("--workers", "1") == swept("--workers", "2")


@pytest.mark.parametrize(
    "option", [("--seeds", "6"), ("--seeds", "a:b"), ("--seeds", "5:2"), ("--seeds", "3:3"), ("--rooms", "1;2")]
)
def test_sweeps_of_another_form_are_refused(option):
    done = houses("sweep", *option)
    assert isinstance(done.exception, SettingError)
    assert option[0] in str(done.exception)


def test_show_draws_plan_and_view_side_by_side(tmp_path, bedroom):
    bedroom.save(tmp_path / "house.json")
    done = houses("show", tmp_path / "house.json", "--out", tmp_path / "plan.png")
    assert done.exit_code == 0, done.output
    with Image.open(tmp_path / "plan.png") as picture:
        assert picture.width > 1.5 * picture.height


@pytest.mark.parametrize("name", ["plan", "plan.xyz", "plan.jpg"])
def test_show_draws_only_png(tmp_path, bedroom, name):
    bedroom.save(tmp_path / "house.json")
    done = houses("show", tmp_path / "house.json", "--out", tmp_path / name)
    assert isinstance(done.exception, SettingError)
    assert "ends in .png" in str(done.exception)


def test_show_names_a_room_that_crosses_itself(tmp_path, bow):
    done = houses("show", bow, "--out", tmp_path / "plan.png")
    assert isinstance(done.exception, HouseError)
    assert "not a simple polygon" in str(done.exception)


def test_a_folder_is_no_house_file(tmp_path):
    code, said = check(tmp_path)
    assert code == 2
    assert "is a folder, not a file" in said


def test_export_writes_a_house_of_thors_assets(tmp_path, bedroom, thor_files):
    bedroom.save(tmp_path / "house.json")
    database = thor_files / "asset-database.json"
    arguments = ["export", tmp_path / "house.json", tmp_path / "thor.json", "--asset-database", database]
    assert isinstance(houses(*arguments).exception, SettingError)
    done = houses(*arguments, "--thor")
    assert done.exit_code == 0, done.output
    assert not any(node.asset_id.startswith("vigil_") for node, _ in House.load(tmp_path / "thor.json").objects())


@pytest.fixture
def dataset(tmp_path, bedroom, monkeypatch) -> FakePrior:
    """ProcTHOR-10K with two houses a split, the first of which is none."""
    stand_in = FakePrior(tmp_path / "datasets", [b"{}", as_procthor_writes(bedroom.data)])
    monkeypatch.setitem(sys.modules, "prior", stand_in)
    return stand_in


def test_houses_of_procthor_10k_are_checked_by_name(dataset):
    code, said = check("procthor-10k:test:0-1")
    assert code == 2
    assert "procthor-10k_test_0: cannot be loaded" in said
    assert "procthor-10k_test_1: 1 rooms" in said
    assert "2 houses: 1 load, 1 do not" in said
    assert "63 MB" in said


def test_a_house_of_procthor_10k_is_drawn_by_name(dataset, tmp_path):
    done = houses("show", "procthor-10k:test:1", "--out", tmp_path / "plan.png")
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(app, ["render", "--house", "procthor-10k:test:1", "--out", str(tmp_path / "view.png")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "plan.png").is_file()
    assert (tmp_path / "view.png").is_file()


def test_a_whole_split_is_not_one_house(dataset, tmp_path):
    done = houses("show", "procthor-10k:test", "--out", tmp_path / "plan.png")
    assert isinstance(done.exception, SettingError)
    assert "name one, e.g. procthor-10k:test:0" in str(done.exception)
