"""Fixtures for tests of what is released: built once, as they come out of this tree."""

import shutil
import subprocess
import sys
import tarfile
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Distributions:
    """What would be uploaded."""

    sdist: Path
    wheel: Path
    """Built from the source distribution, as an installer does."""


def build(source: Path, target: str, out: Path) -> Path:
    """Builds with the back end that pyproject.toml names, without the network. Returns the file."""
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(out)], cwd=source, check=True)
    (built,) = out.iterdir()
    return built


@pytest.fixture(scope="session")
def distributions(tmp_path_factory: pytest.TempPathFactory) -> Distributions:
    folder = tmp_path_factory.mktemp("dist")
    sdist = build(ROOT, "sdist", folder / "sdist")
    with tarfile.open(sdist) as archive:
        # Python before 3.11.4, which Debian 12 has, knows no filters.
        if hasattr(tarfile, "data_filter"):
            archive.extraction_filter = tarfile.data_filter
        archive.extractall(folder / "source")
    (source,) = (folder / "source").iterdir()
    wheel = build(source, "wheel", folder / "wheel")
    shutil.rmtree(folder / "source")
    return Distributions(sdist, wheel)
