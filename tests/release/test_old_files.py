"""Files that earlier releases wrote are read, scored and verified as they were; those of later ones are refused.

Each folder of `tests/golden` that is named by a version holds runs which that version played on the smoke pack, with
the verdicts that it gave. They are never written anew; docs/releases.md says how a release adds its own.
"""

import json
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.authoring.drafting.drafts import DraftsFile, Header
from vigil.authoring.packing.baselines import BASELINES, read_baselines
from vigil.authoring.packing.recipes import PACKAGED, Recipe
from vigil.authoring.review.reviews import Review, read_reviews
from vigil.base.json_lines import dump_line
from vigil.errors import InputError
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.saved_run import SavedRun, read_run

GOLDEN = Path(__file__).parents[1] / "golden"
OLD = sorted(path.parent for path in GOLDEN.glob("*.*.*/*/run.json"))
VERDICTS = "verdicts.jsonl"
UPGRADE = r"has schema 99, but vigil \S+ reads \d\. A newer vigil wrote it: `pip install --upgrade vigil-bench`"


def name_of(folder: Path) -> str:
    return f"{folder.parent.name} {folder.name}"


def verdicts(run: SavedRun) -> list[str]:
    return [json.dumps(asdict(outcome), sort_keys=True) for outcome in run.table.scores().outcomes]


def test_every_release_is_held_to() -> None:
    assert {folder.parent.name for folder in OLD} >= {"0.1.0"}


@pytest.mark.parametrize("folder", OLD, ids=name_of)
def test_an_old_run_gets_the_verdicts_that_it_got(folder: Path) -> None:
    """In all that was said of an episode then; what is said besides today is no matter."""
    run = read_run(folder)
    assert run.header.package_version == folder.parent.name
    assert run.table.left_out == ()
    before = [json.loads(line) for line in (folder / VERDICTS).read_text().splitlines()]
    now = [json.loads(line) for line in verdicts(run)]
    assert [{name: row[name] for name in old} for row, old in zip(now, before, strict=True)] == before


@pytest.mark.parametrize("folder", OLD, ids=name_of)
def test_an_old_run_plays_again_to_the_same_states(folder: Path) -> None:
    found = verify_run(folder, VerifySettings(workers=1))
    assert (found.differences, found.checked, found.is_verified) == ((), 8, True)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return Path(shutil.copytree(OLD[0], tmp_path / "run"))


def raise_schema(path: Path) -> None:
    """Makes a file of JSON, or its first line, say that it is of a later schema."""
    text = path.read_text()
    assert "schema_version" in text
    path.write_text(re.sub(r'("schema_version": ?)\d+', r"\g<1>99", text, count=1))
    assert path.read_text() != text


def test_a_header_of_a_newer_release_is_refused(run: Path) -> None:
    raise_schema(run / "run.json")
    with pytest.raises(InputError, match=UPGRADE):
        read_header(run)


def test_a_row_of_a_newer_release_is_left_out_and_named(run: Path) -> None:
    raise_schema(run / "episodes.jsonl")
    found = read_run(run)
    assert len(found.table.rows) == 7
    assert any("A newer vigil wrote it: `pip install --upgrade vigil-bench`" in note for note in found.notes)


def test_a_pack_of_a_newer_release_is_refused_even_with_fields_that_are_new(tmp_path: Path) -> None:
    folder = tiny_pack(tmp_path / "pack").folder
    manifest = json.loads((folder / "manifest.json").read_text()) | {"weather": "fine"}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    raise_schema(folder / "manifest.json")
    with pytest.raises(InputError, match=UPGRADE):
        Pack.load(folder)


def drafts(folder: Path) -> Path:
    header = Header(author="a", seed=1, simulator="s", per_house=1, tried=1)
    (folder / "drafts.jsonl").write_bytes(dump_line(header))
    return folder / "drafts.jsonl"


def reviews(folder: Path) -> Path:
    review = Review(
        at=datetime(2026, 1, 1, tzinfo=UTC), reviewer="ada", episode_id="a", episode_sha256="0" * 64, verdict="approve"
    )
    (folder / "reviews.jsonl").write_bytes(dump_line(review))
    return folder / "reviews.jsonl"


def recipe(folder: Path) -> Path:
    return Path(shutil.copy(next(PACKAGED.glob("*.json")), folder))


def baselines(folder: Path) -> Path:
    pack = tiny_pack(folder / "pack")
    facts: dict[str, Any] = {"pack": pack.name, "pack_sha256": pack.sha256, "vigil": "0", "agents": {}, "guesses": {}}
    (pack.folder / BASELINES).write_text(json.dumps({"schema_version": 1, **facts}))
    return pack.folder / BASELINES


OTHERS: dict[str, tuple[Callable[[Path], Path], Callable[[Path], Any]]] = {
    "drafts": (drafts, lambda path: DraftsFile(path).read()),
    "reviews": (reviews, read_reviews),
    "recipe": (recipe, lambda path: Recipe.load(str(path))),
    "baselines": (baselines, lambda path: read_baselines(Pack.load(path.parent))),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_another_file_of_a_newer_release_is_refused(tmp_path: Path, kind: str) -> None:
    write, read = OTHERS[kind]
    path = write(tmp_path)
    assert read(path) is not None
    raise_schema(path)
    with pytest.raises(InputError, match=UPGRADE):
        read(path)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        lines = verdicts(read_run(Path(name)))
        (Path(name) / VERDICTS).write_text("".join(f"{line}\n" for line in lines))
