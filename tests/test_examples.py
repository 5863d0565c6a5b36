"""The examples that extend VIGIL do what they say, each in a process of its own, as a reader starts them."""

import ast
import base64
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

import vigil
from tests.support.published_runs import SMALL, make_episodes, small_records, write_pack, write_run

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
TRAINING = {"learn_to_point.py": "--demos", "train_tiny_vlm.py": "--supervised"}
"""Examples that train, on pages of their own -> one of their options."""
OF_A_SERVER = "remote_client.py"
"""Example that `tests/integrations/serve` plays."""
EXTENDING = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


def started(script: str, *arguments: object, given: str = "") -> str:
    words = [sys.executable, str(EXAMPLES / script), *map(str, arguments)]
    done = subprocess.run(words, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_table_of_ones_own_is_printed_and_reported(tmp_path: Path) -> None:
    write_pack(tmp_path / "pack", make_episodes(SMALL))
    run = write_run(tmp_path / "run", tmp_path / "pack", "vllm/model", small_records(), planned=sorted(small_records()))
    printed = started("custom_table.py", run, "--out", tmp_path / "report").splitlines()
    assert printed[0].split() == ["family", *sorted(vigil.load_pack("vigil_smoke").manifest.families)]
    assert printed[2].split()[0] == "model"
    report = (tmp_path / "report" / "report.md").read_text(encoding="utf-8")
    assert report.index("## Protocol and pack") < report.index("## Own tables") < report.index("`overtime`")


def test_a_family_of_ones_own_is_drafted_solved_and_told_from_a_claim() -> None:
    said = started("new_family.py").splitlines()
    assert re.match(r"solver: B after \d+ steps, W True, family SA", said[1])
    assert re.match(r"always_success: FR after 1 steps, W False, family SA", said[2])


def test_a_thing_of_ones_own_stands_in_a_house_and_is_taken() -> None:
    said = started("new_asset.py").splitlines()
    assert said[0].endswith(": 0 things are not as the house asks")
    assert "globe" in said[1]
    assert re.search(r" B after \d+ steps$", said[1])


def test_an_agent_of_ones_own_plays() -> None:
    said = started("new_agent.py").splitlines()
    assert len(said) == 3
    assert all(re.match(r"(B|FR) +\d steps  .*metres", line) for line in said)


def test_an_agent_of_ones_own_is_a_program_too() -> None:
    def seen(grey: int) -> dict:
        picture = io.BytesIO()
        Image.new("RGB", (640, 480), (grey, grey, grey)).save(picture, "PNG")
        return {"type": "observation", "frame": {"data": base64.b64encode(picture.getvalue()).decode()}}

    lines = [{"type": "start", "instruction": "Go to within two metres of it."}, seen(90), seen(120), seen(120)]
    lines += [{"type": "start", "instruction": "Open it."}, seen(120)]
    said = started("new_agent.py", "--program", given="".join(json.dumps(line) + "\n" for line in lines))
    replies = [json.loads(line) for line in said.splitlines()]
    assert [reply["skill_name"] for reply in replies] == ["navigate", "navigate", "report", "report"]
    assert [reply["arguments"]["status"] for reply in replies[2:]] == ["success", "fail"]


def test_a_back_end_of_ones_own_passes_the_checks() -> None:
    said = started("new_backend.py", "--engine", "fake")
    held, known = re.search(r"noise 12: (\d+) of (\d+) checks hold", said).groups()  # type: ignore[union-attr]
    assert int(held) == int(known) > 40


def test_the_page_names_every_example() -> None:
    scripts = {path.name for path in EXAMPLES.glob("*.py")} - TRAINING.keys() - {OF_A_SERVER}
    assert set(re.findall(r"examples/(\w+\.py)", EXTENDING)) == scripts


FILES_OF_GOALS = (
    "protocol/goals.py",
    "scoring/goal_words.py",
    "scoring/goal_check.py",
    "authoring/solving/goal_actions.py",
    "authoring/review/goal_controls.py",
)
PLACES = re.findall(r"^\| `([\w/]+\.py)` \| `(\w+)` \|", EXTENDING, re.MULTILINE)


@pytest.mark.parametrize(("file", "name"), PLACES)
def test_the_page_names_where_a_kind_of_goal_stands(file: str, name: str) -> None:
    text = (ROOT / "src" / "vigil" / file).read_text(encoding="utf-8")
    defined = [node for node in ast.parse(text).body if getattr(node, "name", None) == name]
    assert len(defined) == 1
    assert "ObjectHeld" in ast.unparse(defined[0])


def test_the_page_names_all_places_of_a_kind_of_goal() -> None:
    named = {
        (file, node.name)
        for file in FILES_OF_GOALS
        for node in ast.parse((ROOT / "src" / "vigil" / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and "ObjectHeld" in ast.unparse(node)
    }
    helpers = {("authoring/review/goal_controls.py", name) for name in ("_applied_to", "_allows", "_neighbour")}
    helpers.add(("authoring/solving/goal_actions.py", "resolve_constraint"))
    assert named - helpers == set(PLACES)


@pytest.mark.parametrize(("script", "option"), TRAINING.items())
def test_the_options_of_a_training_are_explained_without_what_it_needs(
    script: str, option: str, tmp_path: Path
) -> None:
    (tmp_path / "torch.py").write_text("raise ModuleNotFoundError('it is not here', name='torch')")
    words = [sys.executable, str(EXAMPLES / script)]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    helped = subprocess.run([*words, "--help"], env=environment, capture_output=True, text=True, check=False)
    assert (helped.returncode, helped.stderr) == (0, "")
    assert option in helped.stdout
    assert "https://download.pytorch.org/whl/cpu" in helped.stdout
    begun = subprocess.run([*words, "--out", "x"], env=environment, capture_output=True, text=True, check=False)
    assert begun.stderr == "torch is not installed. The docstring of this file says how to install it.\n"
