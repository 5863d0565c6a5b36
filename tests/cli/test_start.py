"""What the help of a verb loads, in modules outside the standard library. `modules.toml` holds the greatest counts."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from vigil.analysis.plots.belief_figures import BELIEF_FIGURES
from vigil.analysis.plots.figures import FIGURES
from vigil.cli.reports import OF_RUNS
from vigil.cli.verbs import VERBS, Verb

LIMITS: dict[str, int] = tomllib.loads((Path(__file__).parent / "modules.toml").read_text(encoding="utf-8"))
HEAVY = {"fastapi", "inspect_ai", "jinja2", "matplotlib", "mujoco", "pandas", "scipy", "shapely", "uvicorn"}
NAMES = [
    f"{name} {inner}".strip()
    for name, verb in VERBS.items()
    for inner in ([""] if isinstance(verb, Verb) else verb.verbs)
]
PROGRAM = """
import json, os, sys
import vigil.cli.options, vigil.runner.shared_settings  # every verb loads these: loaded once
from vigil.cli.verbs import VERBS, load

def modules(name):
    verb, *inner = name.split()
    reader, writer = os.pipe()
    if not os.fork():
        load(VERBS[verb].verbs[inner[0]] if inner else VERBS[verb])
        with open(writer, "w") as answer:
            json.dump([name for name in sys.modules if name.split(".")[0] not in sys.stdlib_module_names], answer)
        os._exit(0)
    os.close(writer)
    with open(reader) as answer:
        found = json.load(answer)
    os.wait()
    return found

print(json.dumps({name: modules(name) for name in sys.argv[1:]}))
"""


@pytest.fixture(scope="module")
def modules() -> dict[str, list[str]]:
    """The modules that a process has loaded when it shows the help of each verb; each process has loaded no other."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, *NAMES], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_every_verb_has_a_limit() -> None:
    assert list(LIMITS) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_a_verb_loads_few_modules(name: str, modules: dict[str, list[str]]) -> None:
    found = modules[name]
    assert not HEAVY & set(found)
    assert len(found) <= LIMITS[name], f"vigil {name} --help loads {len(found)} modules: load them where they are used"


def test_the_help_names_every_figure() -> None:
    assert (*FIGURES, *BELIEF_FIGURES) == OF_RUNS
