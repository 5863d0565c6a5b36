"""Modules of one's own that a command imports: their families are known wherever it works."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from vigil.base.imports import import_modules
from vigil.errors import SettingError
from vigil.scoring.saved_run import read_run

EXAMPLES = Path(__file__).parents[2] / "examples"
FREEZE = """
import pathlib
import sys
import new_family
import vigil
from vigil.assets.database import AssetDatabase
from vigil.authoring.solving.solvers import privileged_agent
from vigil.env import Env
from vigil.protocol.episode import Solution
from vigil.packs.freeze import freeze
from vigil.sim import make_simulator

house = vigil.generate_house(12, "3")
simulator = make_simulator("fake", assets=AssetDatabase.default())
with Env(simulator, lambda episode: house, vigil.Profile()) as env:
    episode = new_family.first_valid(simulator, house)
    record = vigil.play(episode, env, privileged_agent("solver", episode, simulator))
solved = Solution(episode_id=episode.id, actions=tuple(step.action for step in record.steps))
freeze(pathlib.Path(sys.argv[1]), [episode], [solved], [house], name="own")
"""
VIGIL = (sys.executable, "-c", "from vigil.cli import main; main()")


def said(*words: str | Path, imported: str = "") -> subprocess.CompletedProcess[str]:
    """Runs a command in the folder of the examples, where `new_family` lies."""
    environment = {name: value for name, value in os.environ.items() if name != "VIGIL_IMPORT"}
    environment |= {"VIGIL_IMPORT": imported} if imported else {}
    command = [*map(str, words)]
    return subprocess.run(command, cwd=EXAMPLES, env=environment, capture_output=True, text=True, check=False)


def test_a_family_of_ones_own_is_run_and_scored(tmp_path: Path) -> None:
    pack, run = tmp_path / "own", tmp_path / "run"
    frozen = said(sys.executable, "-c", FREEZE, pack)
    assert frozen.returncode == 0, frozen.stderr
    asked = (*VIGIL, "run", "--family", "SA", "--pack", pack, "--agent", "solver", "--backend", "fake")
    played = said(*asked, "--import", "new_family", "--log-dir", run)
    assert played.returncode == 0, played.stderr
    assert "SA" in played.stdout
    scored = said(*VIGIL, "score", run, imported="new_family")
    assert scored.returncode == 0, scored.stderr
    assert "100.0" in scored.stdout
    unknown = said(*VIGIL, "score", run)
    assert unknown.returncode == 2
    assert "there is no family 'SA'" in unknown.stderr
    assert "VIGIL_IMPORT=MODULE" in unknown.stderr
    with pytest.raises(Exception, match="SA"):
        read_run(run)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("no_such_module", "There is no module 'no_such_module' to import"),
        ("no_such_module.py", "Give the module's name, without .py: no_such_module."),
    ],
)
def test_a_module_that_is_not_there_is_named(name: str, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        import_modules([name])
    assert "VIGIL_IMPORT" not in os.environ


def test_what_a_module_lacks_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "needs_more.py").write_text("import no_such_library\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(SettingError, match="needs 'no_such_library', which is not installed"):
        import_modules(["needs_more"])
