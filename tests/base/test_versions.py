"""The versions of rules, shapes and grammar: named in all that is made, told when they differ, raised when they change.

The rules are pinned by the golden records (`tests/test_golden_records.py`), whose rows name the version.
"""

import copy
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.fingerprints import REPLIES, SHAPES, read, replies, shape_differences, shapes
from tests.support.quick_runs import claim
from tests.support.tiny_pack import tiny_pack
from vigil.base.versions import GRAMMAR_VERSION, RULES_VERSION, SHAPES_VERSION, PackVersions, Versions
from vigil.cli import app
from vigil.errors import RecordError
from vigil.records.record import read_header
from vigil.records.record_file import read_records
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings

GOLDEN_RECORDS = Path(__file__).parents[1] / "golden" / "records" / "episodes.jsonl"
ANEW = "Is it meant? Raise {} in vigil.base.versions (see its docstring), then: python -m tests.support.fingerprints"


@pytest.fixture(scope="module")
def made() -> dict:
    return shapes()


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> tuple[Path, Path]:
    """A tiny pack, and a run of it by an agent."""
    folder = tmp_path_factory.mktemp("versions")
    pack = tiny_pack(folder / "pack")
    settings = RunSettings(pack=pack.folder, agent="forward", log_dir=folder / "run", backend="fake", workers=1)
    run_pack(settings)
    return pack.folder, folder / "run"


def test_no_shape_changes_unless_its_version_is_raised(made):
    pinned = json.loads(SHAPES.read_text())
    assert pinned["shapes_version"] == SHAPES_VERSION, ANEW.format("SHAPES_VERSION")
    assert shape_differences(pinned["shapes"], made) == [], ANEW.format("SHAPES_VERSION")


@pytest.mark.parametrize("kind", ["parts", "solids", "surfaces", "joints"])
def test_the_fingerprint_notices_a_moved_and_a_missing_thing(made, kind):
    other = copy.deepcopy(made)
    other["Fridge"][kind][-1] += 0.005
    assert shape_differences(made, other) == [f"Fridge: {kind}"]
    other["Fridge"][kind] = []
    assert shape_differences(made, other) == [f"Fridge: {kind}"]


def test_a_new_category_is_not_a_change_of_shapes_but_a_missing_one_is(made):
    other = {**made, "Globe": copy.deepcopy(made["Fridge"])}
    assert shape_differences(made, other) == []
    other["Fridge"] = {**made["Fridge"], "parts": [*made["Fridge"]["parts"][:-1], 7.0]}
    assert shape_differences(made, other) == ["Fridge: parts"]
    assert shape_differences({"Globe": other["Globe"]}, made) == [f"Globe: {kind}" for kind in sorted(other["Globe"])]


def test_an_interior_that_becomes_a_top_is_another_shape(made):
    """The flag `is_inside` is in the sums of surfaces: place 7 after the count."""
    other = copy.deepcopy(made)
    assert made["Fridge"]["surfaces"][7] > 0
    other["Fridge"]["surfaces"][7] -= 1.0
    assert shape_differences(made, other) == ["Fridge: surfaces"]


def test_another_machines_last_digit_is_no_other_shape(made):
    other = copy.deepcopy(made)
    for numbers in other.values():
        for row in numbers.values():
            row[:] = [number + 1e-5 for number in row]
    assert shape_differences(made, other) == []


def test_no_reply_is_judged_otherwise_unless_the_grammars_version_is_raised():
    pinned = json.loads(REPLIES.read_text())
    assert pinned["grammar_version"] == GRAMMAR_VERSION, ANEW.format("GRAMMAR_VERSION")
    changed = [row["text"] for row in pinned["replies"] if read(row["text"], row) != row["is"]]
    assert changed == [], ANEW.format("GRAMMAR_VERSION")
    assert len(pinned["replies"]) == len(replies())


def test_the_golden_records_are_of_the_rules_that_the_package_has():
    found = {record.versions.rules for record in read_records(GOLDEN_RECORDS)}
    assert found == {RULES_VERSION}, ANEW.format("RULES_VERSION")


def test_packs_headers_and_records_name_the_versions(folders):
    pack, run = folders
    manifest = json.loads((pack / "manifest.json").read_text())
    assert manifest["versions"] == {"rules": RULES_VERSION, "shapes": SHAPES_VERSION}
    spec = read_header(run).spec
    assert spec.versions == Versions.current()
    assert spec.pack_versions == PackVersions.current()
    records = read_records(run / "episodes.jsonl")
    assert records
    assert all(record.versions == Versions.current() for record in records)


def test_what_names_no_version_is_of_the_first():
    assert Versions.model_validate({}) == Versions(rules=1, shapes=1, grammar=1)
    note = Versions().note("Run 'x'") or ""
    for said in ("rules 1 (here", "shapes 1 (here", "grammar 1 (here", "before versions were recorded", "verdicts"):
        assert said in note
    assert "\n" not in note
    assert Versions.current().note("Run 'x'") is None


def unname(folder: Path, name: str, *keys: str) -> None:
    """Takes out of a JSON file what names versions, as a file from before has it."""
    data = json.loads((folder / name).read_text())
    for key in keys:
        (data["spec"] if name == "run.json" else data).pop(key)
    (folder / name).write_text(json.dumps(data))


@pytest.fixture
def old_run(folders, tmp_path) -> Path:
    """The run as it would be from before versions were recorded."""
    run = folders[1]
    old = tmp_path / "old"
    old.mkdir()
    (old / "run.json").write_bytes((run / "run.json").read_bytes())
    unname(old, "run.json", "versions")
    rows = [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]
    (old / "episodes.jsonl").write_text("".join(json.dumps(row | {"versions": {}}) + "\n" for row in rows))
    claim(old)
    return old


@pytest.mark.parametrize(
    "command",
    [
        ["score", "RUN"],
        ["score", "RUN", "--json"],
        ["verify", "RUN", "--workers", "1"],
        ["report", "RUN", "--no-paper"],
        ["export", "RUN", "--pack", "PACK", "--out", "SITE"],
    ],
    ids=lambda command: " ".join(command[:3]),
)
def test_every_reader_of_a_run_says_that_it_was_made_under_other_versions(folders, old_run, tmp_path, command):
    places = {"RUN": old_run, "SITE": tmp_path / "site", "PACK": folders[0]}
    words = [str(places.get(word, word)) for word in command]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert f"rules 1 (here {RULES_VERSION})" in done.output
    if command[0] == "export":
        assert "was made under other versions" in (tmp_path / "site" / "index.html").read_text()
    if "--json" in command:
        assert f"rules 1 (here {RULES_VERSION})" in json.loads(done.stdout)["runs"][0]["notes"][0]


def test_a_run_of_other_versions_is_not_continued(folders, old_run):
    settings = RunSettings(pack=folders[0], agent="forward", log_dir=old_run, backend="fake", workers=1)
    with pytest.raises(RecordError, match=r"rules 1 \(here .*another --log-dir"):
        run_pack(settings)


@pytest.mark.parametrize("command", ["info", "validate", "verify"])
def test_every_reader_of_a_pack_says_that_it_was_made_under_other_versions(tmp_path, command):
    pack = tiny_pack(tmp_path / "pack", count=1, families=("PG",)).folder
    unname(pack, "manifest.json", "versions")
    words = ["pack", command, str(pack), *(["--backend", "fake"] if command != "info" else [])]
    assert f"shapes 1 (here {SHAPES_VERSION})" in CliRunner().invoke(app, words).output
    played = CliRunner().invoke(
        app, ["run", "--pack", str(pack), "--agent", "noop", "--backend", "fake", "--log-dir", str(tmp_path / "run")]
    )
    assert f"shapes 1 (here {SHAPES_VERSION})" in played.output


def test_a_run_of_a_newer_version_is_told_too():
    note = Versions.current().model_copy(update={"grammar": GRAMMAR_VERSION + 1}).note("Run 'x'") or ""
    assert f"grammar {GRAMMAR_VERSION + 1} (here {GRAMMAR_VERSION})" in note
    assert "before versions were recorded" not in note
