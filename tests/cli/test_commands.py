"""The command line, as a newcomer would use and misuse it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.support.commands import Vigil
from vigil.packs.pack import Pack


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--agent", "solvr"], ["'solvr'", "Did you mean 'solver'?"]),
        (["run", "--pack", "startr", "--agent", "noop"], ["'startr'", "Did you mean 'starter'?"]),
        (["run"], ["--agent", "--model"]),
        (["run", "--agent", "noop", "--model", "openai/x"], ["exactly one"]),
        (["run", "--agent", "noop", "--family", "XY"], ["'XY'", "PG, DA, VS, SV, AI, SI, SM, CR"]),
        (["run", "--model", "openai/x", "--extra-body", "[1]", "--dry-run"], ["--extra-body", "JSON object"]),
        (["run", "--model", "openai/x", "--model-arg", "k", "--dry-run"], ["--model-arg 'k'", "K=V"]),
        (["score", "no_such_run"], ["'no_such_run'", "run.json"]),
        (["verify", "no_such_run"], ["'no_such_run'", "run.json"]),
        (["render", "--out", "x.png"], ["--house", "--episode", "--asset"]),
        (["render", "--asset", "Mug", "--catalog", "--out", "x"], ["exactly one", "--catalog"]),
        (["render", "--asset", "Frigde", "--out", "x.png"], ["'Frigde'", "Did you mean 'Fridge'?"]),
        (["render", "--episode", "nothing_like_it", "--out", "x.png"], ["'nothing_like_it'", "starter/episodes.jsonl"]),
        (["render", "--house", "no.json", "--out", "x.png"], ["'no.json'", "does not exist"]),
        (["houses", "check", "no.json"], ["no.json", "cannot be loaded"]),
        (["houses", "generate", "--seed", "1", "--out", "no/such/folder/h.json"], ["does not exist"]),
        (["pack", "info", "no_such_pack"], ["'no_such_pack'"]),
    ],
    ids=lambda value: "_".join(value[:3]) if isinstance(value, list) else None,
)
def test_bad_input_is_named_and_exits_with_2(
    vigil: Vigil, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: list[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    done = vigil(*arguments)
    said = done.out + done.err
    assert done.code == 2, said
    assert "Traceback" not in said
    for word in words:
        assert word in said
    assert list(tmp_path.iterdir()) == []


def test_help_of_the_installed_command_names_every_verb() -> None:
    command = Path(sys.executable).with_name("vigil")
    done = subprocess.run([command, "--help"], capture_output=True, text=True, check=True)
    for verb in ("run", "score", "verify", "render", "doctor", "houses", "pack"):
        assert verb in done.stdout


def test_a_run_is_scored_verified_and_resumed(vigil: Vigil, tmp_path: Path) -> None:
    arguments = ("run", "--agent", "always_success", "--family", "PG", "--limit", "3", "--log-dir", tmp_path / "run")
    first = vigil(*arguments)
    assert first.code == 0, first.err
    assert "3/3" in first.out
    rows = (tmp_path / "run" / "episodes.jsonl").read_bytes()
    again = vigil(*arguments)
    assert again.code == 0, again.err
    assert (tmp_path / "run" / "episodes.jsonl").read_bytes() == rows

    document = json.loads(vigil("score", tmp_path / "run", "--json").out)
    assert document["schema_version"] == 1
    (scored,) = document["runs"]
    assert scored["overall"]["episodes"] == 3
    assert scored["families"]["PG"]["FR"] == 1.0
    assert scored["overall"]["errors"] == 0

    verified = vigil("verify", tmp_path / "run", "--workers", "1")
    assert verified.code == 0, verified.out
    assert "0 differences" in verified.out

    other = vigil(*arguments[:-4], "--limit", "2", "--log-dir", tmp_path / "run")
    assert other.code == 2
    assert "episode" in other.err


def test_a_dry_run_sends_nothing_and_leaves_nothing(
    vigil: Vigil, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    done = vigil("run", "--model", "openai/gpt-4o", "--dry-run")
    assert done.code == 0, done.err
    steps = sum(episode.max_steps for episode in Pack.load("starter").episodes)
    assert f"{steps:,}" in done.out
    assert list(tmp_path.iterdir()) == []


def test_houses_are_generated_checked_and_drawn(vigil: Vigil, tmp_path: Path) -> None:
    house = tmp_path / "house.json"
    assert vigil("houses", "generate", "--seed", "5", "--rooms", "2", "--out", house).code == 0
    checked = vigil("houses", "check", house)
    assert checked.code == 0, checked.out
    assert "2 rooms" in checked.out
    assert "1 load, 0 do not" in checked.out
    drawn = vigil("render", "--house", house, "--out", tmp_path / "view.png")
    assert drawn.code == 0, drawn.err
    picture = np.asarray(Image.open(tmp_path / "view.png"))
    assert picture.shape == (480, 640, 3)
    assert picture.std() > 10


def test_one_bad_house_does_not_hide_the_others(vigil: Vigil, tmp_path: Path) -> None:
    good = tmp_path / "good.json"
    assert vigil("houses", "generate", "--seed", "6", "--out", good).code == 0
    bad = tmp_path / "bad.json"
    document = json.loads(good.read_text())
    document["objects"][0]["position"]["x"] = "wide"
    bad.write_text(json.dumps(document))
    done = vigil("houses", "check", bad, good)
    assert done.code == 2
    assert "objects.0.position.x" in done.out
    assert "2 houses: 1 load, 1 do not" in done.out


def test_pack_info_counts_families(vigil: Vigil) -> None:
    found = json.loads(vigil("pack", "info", "starter", "--json").out)
    assert found["episodes"] == 80
    assert set(found["families"].values()) == {10}


def test_an_asset_is_drawn_open_and_closed(vigil: Vigil, tmp_path: Path) -> None:
    pictures = []
    for state in ("open", "closed"):
        out = tmp_path / f"{state}.png"
        assert vigil("render", "--asset", "Fridge", "--state", state, "--out", out).code == 0
        pictures.append(np.asarray(Image.open(out)).astype(int))
    assert (abs(pictures[0] - pictures[1]) > 30).any(axis=2).sum() > 2000
