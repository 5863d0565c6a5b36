"""`vigil pack`: from houses to drafts to a pack, verified and compared, as one would type it."""

import json
from hashlib import sha256
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from vigil.cli import app
from vigil.errors import InputError
from vigil.packs.names import other_names
from vigil.packs.pack import Pack, find_pack
from vigil.packs.private import REVEAL, is_private
from vigil.protocol.families import FAMILIES


def vigil(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["pack", *map(str, arguments)])


def test_packaged_packs_are_listed_with_their_short_names() -> None:
    listed = vigil("list")
    assert listed.exit_code == 0
    lines = {line.split()[1]: line for line in listed.stdout.splitlines() if line.startswith("│")}
    mini = find_pack("vigil_mini").name
    assert "vigil_mini " in lines[mini]
    rows = {row["name"]: row for row in json.loads(vigil("list", "--json").stdout)}
    assert set(rows) == set(lines)
    assert all(Pack.load(short).sha256 == row["sha256"] for row in rows.values() for short in row["also"][-1:])
    assert (rows[mini]["episodes"], rows[mini]["families"]) == (80, 8)


def test_levels_and_strata_are_shown_in_their_order() -> None:
    said = vigil("info", "vigil_mini").output
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in said.splitlines() if line.startswith("│")]
    assert [row for row in rows if len(row) == 5] == [[family, "3", "3", "2", "2"] for family in FAMILIES]
    assert next(row[1] for row in rows if row[0] == "rooms").startswith("1 9, 2 14, 3 12")
    assert "10 1" in next(row[1] for row in rows if row[0] == "rooms")
    assert json.loads(vigil("info", "vigil_mini", "--json").stdout)["levels"]["hard"] == 16


def test_no_other_name_is_said_twice() -> None:
    assert other_names("mine_v1", ["mine", "my_own"]) == ["mine", "my_own"]
    assert other_names("mine", ["mine"]) == []


def test_a_pack_is_proposed_built_verified_and_compared(tmp_path: Path) -> None:
    houses = sorted((find_pack("starter") / "houses").glob("bathroom*.json"))[:1]
    drafts, out = tmp_path / "drafts.jsonl", tmp_path / "mine"
    families = [f"--family={family}" for family in ("PG", "SV")]
    proposed = vigil("propose", "--houses", houses[0], *families, "--out", drafts, "--tries", "6", "--seed", "11")
    assert proposed.exit_code == 0, proposed.output
    assert "drafts in 1 houses" in proposed.stdout
    short = vigil("build", "--drafts", drafts, "--name", "mine", "--out", out, "--per-family", "2")
    assert "DA 0 of 2 (of 0 drafts)" in str(short.exception)
    arguments = [f"--family={family}" for family in ("PG", "SV")] + ["--per-family", "2", "--alias", "ours"]
    built = vigil("build", "--drafts", drafts, "--name", "mine", "--out", out, *arguments)
    assert built.exit_code == 0, built.output
    pack = Pack.load(out)
    assert pack.manifest.families == {"PG": 2, "SV": 2}
    assert pack.manifest.meta["aliases"] == ["ours"]
    verified = vigil("verify", out)
    assert verified.exit_code == 0, verified.output
    assert "4 of 4 episodes" in verified.stdout
    told = json.loads(vigil("info", out, "--json").stdout)
    assert told["episodes"] == 4
    assert told["families"] == {"PG": 2, "SV": 2}
    different = vigil("diff", out, "starter")
    assert different.exit_code == 1
    assert "4 gone, 80 new" in different.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["propose", "--out", "d.jsonl"], ["either --houses or --seeds"]),
        (["propose", "--seeds", "3", "--out", "d.jsonl"], ["'3'", "FIRST:END"]),
        (["propose", "--seeds", "1:2", "--rooms", "castle", "--out", "d.jsonl"], ["'castle'"]),
        (["make", "--name", "n", "--out", "o"], ["--seed or --seed-file", "--houses"]),
        (["make", "--name", "n", "--out", "o", "--seed", "1", "--rooms", "12"], ["'12", "1 to 10"]),
        (["make", "--name", "n", "--out", "o", "--houses", "no.json"], ["'no.json'", "does not exist"]),
        (["make", "--name", "n", "--out", "o", "--houses", "procthor-10k:trian"], ["'procthor-10k:train'"]),
        (["make", "--name", "n", "--out", "o", "--seed", "1", "--family", "XX"], ["'XX'", "PG"]),
        (["make", "--name", "a/b", "--out", "o", "--seed", "1"], ["'a/b'", "letters"]),
        (["build", "--drafts", "no.jsonl", "--name", "n", "--out", "o"], ["'no.jsonl'", "vigil pack propose"]),
    ],
    ids=[
        "no_houses",
        "no_range",
        "no_spec",
        "no_seed",
        "no_rooms",
        "no_file",
        "no_split",
        "no_family",
        "no_name",
        "no_drafts",
    ],
)
def test_bad_input_is_named(arguments: list[str], words: list[str]) -> None:
    done = vigil(*arguments)
    assert isinstance(done.exception, InputError)
    for word in words:
        assert word in str(done.exception)


SMALL = ("--family", "PG", "--family", "SV", "--per-family", "1")


def test_a_secret_seed_makes_a_pack_in_one_command_that_continues(tmp_path: Path) -> None:
    made = ("make", "--name", "held_out", "--seed", "77", "--rooms", "bathroom", "--count", "1", *SMALL)
    first = vigil(*made, "--out", tmp_path / "a")
    assert first.exit_code == 0, first.output
    pack = Pack.load(tmp_path / "a")
    assert pack.manifest.families == {"PG": 1, "SV": 1}
    assert "can be found by trying" in first.stderr
    assert "seed" not in pack.manifest.meta
    assert pack.manifest.meta["seed_sha256"] == sha256(b"held_out 77").hexdigest()
    assert is_private(pack.manifest.meta)
    assert "apache" not in (tmp_path / "a" / "README.md").read_text().lower()
    assert REVEAL in str(vigil("sheet", tmp_path / "a", "--out", tmp_path / "sheets").exception)
    drafts = (tmp_path / "a.drafts.jsonl").read_bytes()
    (tmp_path / "b.drafts.jsonl").write_bytes(drafts[: drafts.index(b'"line":"done"')])
    assert vigil(*made, "--out", tmp_path / "b").exit_code == 0
    assert Pack.load(tmp_path / "b").episodes == pack.episodes
    again = vigil(*made, "--out", tmp_path / "a")
    assert "is not an empty folder" in str(again.exception)


def test_a_pack_is_made_from_house_files(tmp_path: Path) -> None:
    house = sorted((find_pack("starter") / "houses").glob("bathroom*.json"))[0]
    made = vigil("make", "--name", "real", "--houses", house, *SMALL, "--out", tmp_path / "real")
    assert made.exit_code == 0, made.output
    assert {episode.house.name for episode in Pack.load(tmp_path / "real").episodes} == {house.stem}
