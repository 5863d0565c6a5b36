"""Verbs are listed without loading what they call."""

import subprocess
import sys

import pytest

from vigil.cli.verbs import VERBS, load

HEAVY = ("numpy", "mujoco", "matplotlib", "pandas", "inspect_ai", "fastapi")


@pytest.mark.parametrize("name", VERBS)
def test_the_list_says_what_the_verb_says_of_itself(name: str) -> None:
    assert load(name).get_short_help_str(limit=1000) == VERBS[name].help


@pytest.mark.parametrize("arguments", [["--help"], ["rnu"], []])
def test_the_list_comes_before_anything_heavy_is_loaded(arguments: list[str]) -> None:
    program = "import sys, vigil.cli\ntry: vigil.cli.main()\nfinally: print('loaded:', *sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=False)
    loaded = done.stderr.rpartition("loaded:")[2].split()
    assert "vigil.cli" in loaded
    assert not set(HEAVY) & set(loaded)
