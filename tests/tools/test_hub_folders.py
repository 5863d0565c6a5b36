"""Folders for hubs: each pack is a data set that loads, and only a public pack is written."""

import json
import shutil
from pathlib import Path

import pytest
import yaml

from tools.hub_folders import ROOT, write_dataset_folder, write_leaderboard_results, write_register_entry
from vigil.errors import SettingError
from vigil.packs.pack import Pack

COMMIT = "0" * 40


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset_folder(Pack.load("vigil_smoke"), "somebody", tmp_path_factory.mktemp("hubs"))


def test_a_folder_is_the_pack_with_the_files_of_the_hub(folder: Path) -> None:
    pack = Pack.load("vigil_smoke")
    assert Pack.load(folder).sha256 == pack.sha256
    added = {path.name for path in folder.iterdir()} - {path.name for path in pack.folder.iterdir()}
    assert added == {"eval.yaml", "environment.yaml", "openenv.yaml"}
    configs = yaml.safe_load((folder / "README.md").read_text().split("---")[1])["configs"]
    (task,) = yaml.safe_load((folder / "eval.yaml").read_text())["tasks"]
    (environment,) = yaml.safe_load((folder / "environment.yaml").read_text())["environments"]
    for config in (task["config"], environment["config_name"]):
        assert config in [one["config_name"] for one in configs]
    assert environment["frameworks"]["openenv"]["space_id"] == "somebody/vigil"
    assert (folder / environment["frameworks"]["openenv"]["manifest"]).is_file()


@pytest.mark.filterwarnings("ignore")
def test_the_data_set_loads(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets")
    (task,) = yaml.safe_load((folder / "eval.yaml").read_text())["tasks"]
    cache = str(tmp_path / "cache")
    loaded = datasets.load_dataset(str(folder), task["config"], split=task["split"], cache_dir=cache)
    assert loaded.num_rows == len(Pack.load(folder).episodes)


def test_a_private_pack_is_refused(tmp_path: Path) -> None:
    place = shutil.copytree(Pack.load("vigil_smoke").folder, tmp_path / "private")
    manifest = json.loads((place / "manifest.json").read_text())
    manifest["meta"] |= {"seed_sha256": COMMIT}
    (place / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(SettingError, match="is private"):
        write_dataset_folder(Pack.load(place), "somebody", tmp_path / "hubs")
    assert not (tmp_path / "hubs").exists()


def test_the_register_names_the_task_of_inspect(tmp_path: Path) -> None:
    entry = yaml.safe_load(write_register_entry("somebody", "https://example.org/x", COMMIT, tmp_path).read_text())
    (task,) = entry["tasks"]
    assert f"\ndef {task['name']}(" in (ROOT / task["task_path"]).read_text()
    assert entry["source"]["repository_commit"] == COMMIT


def test_a_bundle_that_is_no_entry_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "entries.json").write_text('{"entries": []}')
    (tmp_path / "x.zip").write_text("no bundle")
    (line,) = write_leaderboard_results(tmp_path, [tmp_path / "x.zip"], (), tmp_path / "out")
    assert "x.zip: left out. the bundle is not a complete zip file" in line
    assert not (tmp_path / "out").exists()
