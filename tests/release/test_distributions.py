"""What is in the wheel and in the source distribution, and that an installed wheel plays an episode."""

import os
import site
import subprocess
import sys
import tarfile
import venv
import zipfile
from email.parser import Parser
from pathlib import Path, PurePosixPath

import pytest

from vigil import __version__

ROOT = Path(__file__).parents[2]
MOST_WHEEL_BYTES = 15_000_000
CACHES = {"__pycache__", ".venv", ".git", ".pytest_cache", ".ruff_cache", ".hypothesis", "runs", "build", "dist"}


FOLDERS = (".github", "benchmarks", "docs", "examples", "scripts", "src", "sweeps", "tests", "tools")
FILES = ("CHANGELOG.md", "LICENSE", "Makefile", "README.md", "constraints.txt", "pyproject.toml")


def files_of(folder: Path) -> set[str]:
    """Return the files below a folder of the tree, without files that tools write there."""
    files = {path for path in folder.rglob("*") if path.is_file() and not CACHES & set(path.parts)}
    return {path.relative_to(ROOT).as_posix() for path in files if path.suffix not in {".pyc", ".pyo"}}


@pytest.fixture(scope="module")
def in_wheel(distributions) -> set[str]:
    with zipfile.ZipFile(distributions.wheel) as archive:
        return set(archive.namelist())


@pytest.fixture(scope="module")
def in_sdist(distributions) -> set[str]:
    with tarfile.open(distributions.sdist) as archive:
        names = [PurePosixPath(member.name) for member in archive if member.isfile()]
    return {str(PurePosixPath(*name.parts[1:])) for name in names}


def test_the_wheel_holds_the_whole_package_and_nothing_else(in_wheel: set[str]) -> None:
    """Packs, recipes, templates, scripts of pages, the published figures and `py.typed` are files of the package."""
    source = {name.removeprefix("src/") for name in files_of(ROOT / "src")}
    facts = {name for name in in_wheel if name.startswith(f"vigil_bench-{__version__}.dist-info/")}
    assert in_wheel - facts == source
    assert {name.partition("/")[0] for name in source} == {"vigil", "vigil_verifiers"}
    for part in ("vigil/data/packs/starter/manifest.json", "vigil/web/templates/base.html", "vigil/py.typed"):
        assert part in source
    assert f"vigil_bench-{__version__}.dist-info/licenses/LICENSE" in facts


def test_the_wheel_is_small(distributions) -> None:
    assert distributions.wheel.stat().st_size < MOST_WHEEL_BYTES


def test_the_wheel_says_what_it_is(distributions) -> None:
    assert distributions.wheel.name == f"vigil_bench-{__version__}-py3-none-any.whl"
    with zipfile.ZipFile(distributions.wheel) as archive:
        metadata = archive.read(f"vigil_bench-{__version__}.dist-info/METADATA").decode()
    said = Parser().parsestr(metadata)
    assert (said["Name"], said["Version"], said["License-Expression"]) == ("vigil-bench", __version__, "Apache-2.0")
    assert said["Description-Content-Type"] == "text/markdown"


def test_the_source_distribution_passes_the_same_commands_as_a_clone(in_sdist: set[str]) -> None:
    """Everything that `make` needs and that the tests read is there; what tools leave behind is not."""
    wanted = set().union(*(files_of(ROOT / folder) for folder in FOLDERS))
    assert not (wanted | {*FILES}) - in_sdist
    assert not [name for name in in_sdist if CACHES & set(PurePosixPath(name).parts) or name.endswith(".pyc")]


@pytest.fixture(scope="module")
def installed(distributions, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The `bin` folder of an environment of its own with the wheel; only the dependencies are those of the tests."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*install, str(distributions.wheel)], check=True)
    (packages,) = (folder / "lib").glob("python3.*/site-packages")
    # A line that is a folder adds it to the path, but not what the `.pth` files in it add: not this checkout.
    (packages / "dependencies.pth").write_text("".join(f"{place}\n" for place in site.getsitepackages()))
    return python.parent


def say(installed: Path, folder: Path, *words: str) -> str:
    """Return the output of a command of that environment, run in a folder that is not the checkout."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(installed / words[0]), *words[1:]], cwd=folder, env=clean, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


FIND = "from importlib.util import find_spec as find; "
WHERE = FIND + "print(*[find(name).origin for name in ('vigil', 'vigil_verifiers')])"


def test_an_installed_wheel_plays_reports_and_shows(installed: Path, tmp_path: Path) -> None:
    modules = [Path(name) for name in say(installed, tmp_path, "python", "-c", WHERE).split()]
    assert len(modules) == 2
    assert all(module.is_relative_to(installed.parent) for module in modules)
    assert say(installed, tmp_path, "vigil", "--version") == f"vigil {__version__}\n"
    run = ("run", "--pack", "vigil_smoke", "--agent", "solver", "--limit", "2", "--workers", "1", "--log-dir", "run")
    table = say(installed, tmp_path, "vigil", *run)
    assert "100.0" in table
    assert len((tmp_path / "run" / "episodes.jsonl").read_text().splitlines()) == 2
    say(installed, tmp_path, "vigil", "report", "run", "--out", "report")
    assert (tmp_path / "report" / "report.html").is_file()
    say(installed, tmp_path, "vigil", "export", "run", "--out", "site")
    assert (tmp_path / "site" / "index.html").is_file()
