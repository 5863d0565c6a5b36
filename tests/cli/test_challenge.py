"""A challenge: what is published, that the seed is the promised one, and that anyone can make the pack again."""

import json
import stat
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from vigil.cli import app
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.packs.private import read_seed

QUICK = ("--family", "SV", "--per-family", "1", "--rooms", "bathroom", "--backend", "fake", "--workers", "1")


def challenge(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["challenge", *map(str, arguments)])


def fault(*arguments: str | Path) -> str:
    result = challenge(*arguments)
    assert isinstance(result.exception, SettingError), result.output
    return str(result.exception)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a challenge `spring`, its pack, and its seed."""
    here = tmp_path_factory.mktemp("challenge")
    made = challenge(
        "new", *QUICK, "--count", "2", "--name", "spring", "--deadline", "2999-01-01",
        "--seed-file", here / "seed.txt", "--out", here / "spring",
    )  # fmt: skip
    assert made.exit_code == 0, made.output
    return here


def test_only_hashes_and_a_deadline_are_published(folder: Path) -> None:
    seed, pack = read_seed(folder / "seed.txt"), Pack.load(folder / "spring")
    assert stat.S_IMODE((folder / "seed.txt").stat().st_mode) == 0o600
    text = (folder / "spring.challenge.json").read_text()
    published = json.loads(text)
    assert published["pack_sha256"] == pack.sha256
    assert published["deadline"] == "2999-01-01T00:00:00Z"
    assert "seed" not in published
    for word in (str(seed), str(folder), *(episode.id for episode in pack.episodes)):
        assert word not in text
    assert "its seed is still secret. It may be revealed from 2999-01-01" in fault(
        "check", folder / "spring.challenge.json", "--out", folder / "x"
    )


def test_only_the_promised_seed_is_revealed_and_not_before_the_deadline(folder: Path, tmp_path: Path) -> None:
    file, other = folder / "spring.challenge.json", tmp_path / "other.txt"
    other.write_text(f"{2**64 + 1}\n")
    assert "is not the seed of challenge 'spring'" in fault("reveal", file, "--seed-file", other)
    assert "give --early" in fault("reveal", file, "--seed-file", folder / "seed.txt")


def test_anyone_makes_the_pack_again_and_another_one_is_noticed(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "spring.challenge.json"
    file.write_bytes((folder / "spring.challenge.json").read_bytes())
    assert challenge("reveal", file, "--seed-file", folder / "seed.txt", "--early").exit_code == 0
    same = challenge("check", file, "--out", tmp_path / "again", "--workers", "1")
    assert same.exit_code == 0, same.output
    assert "the same bytes as the challenge's pack" in same.output
    assert Pack.load(tmp_path / "again").sha256 == Pack.load(folder / "spring").sha256
    published = json.loads(file.read_text())
    file.write_text(json.dumps({**published, "pack_sha256": "0" * 64}))
    other = challenge("check", file, "--out", tmp_path / "third", "--workers", "1")
    assert (other.exit_code, "not the challenge's pack" in other.output) == (2, True)
    file.write_text(json.dumps({**published, "seed": published["seed"] + 1}))
    lied = challenge("check", file, "--out", tmp_path / "fourth")
    assert (lied.exit_code, "is not the one that was published" in lied.output) == (2, True)


def test_bad_files_and_options_are_named(folder: Path, tmp_path: Path) -> None:
    out, seed = ("--out", tmp_path / "x"), ("--seed-file", tmp_path / "seed.txt")
    new = ("new", "--name", "spring", *out)
    assert "'soon' is not a time" in fault(*new, "--deadline", "soon", *seed)
    assert "give --seed-file" in fault(*new, "--deadline", "2999-01-01")
    assert "leave out --houses" in fault(*new, "--deadline", "2999-01-01", *seed, "--houses", "house.json")
    published = json.loads((folder / "spring.challenge.json").read_text()) | {"seed": read_seed(folder / "seed.txt")}
    file = tmp_path / "c.json"
    for change, words in (
        ({"schema_version": 9}, "schema_version"),
        ({"deadline": "2999-01-01T00:00:00"}, "deadline"),
        ({"drafts": 1}, "version 1 of the drafts"),
        ({"options": {"content": {"name": "x", "per_family": "many"}}}, "per_family"),
        ({"options": {"content": {"name": "x", "per_family": 0}}}, "--per-family is 0"),
    ):
        file.write_text(json.dumps(published | change))
        assert words in fault("check", file, *out)
    assert not (tmp_path / "seed.txt").exists()
    assert not (tmp_path / "x").exists()
