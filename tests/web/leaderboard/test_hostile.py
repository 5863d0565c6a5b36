"""Hostile bundles: each is refused with its reason, honest ones come out, and nothing in a bundle is executed."""

import hashlib
import io
import json
import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.web.leaderboard.conftest import metadata
from vigil.packs.pack import Pack
from vigil.records.record import RunHeader
from vigil.web.leaderboard import bundle as bundles_module
from vigil.web.leaderboard.build import SiteBuild, build_site
from vigil.web.leaderboard.bundle import unpack_bundle
from vigil.web.leaderboard.settings import BuildSettings

Members = dict[str, bytes]
Edit = Callable[[Members], None]
SCRIPT = "<script>window.evil = 1</script>"


def members_of(path: Path) -> Members:
    with zipfile.ZipFile(path) as file:
        return {name: file.read(name) for name in file.namelist()}


def zipped(path: Path, members: Members) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in members.items():
            file.writestr(name, data)
    return path


def edited(source: Path, path: Path, edit: Edit, *, hashed: bool = True) -> Path:
    """Write a bundle with changed members; the hashes in its entry are made to fit unless `hashed` is false."""
    members = members_of(source)
    edit(members)
    if hashed:
        change(members, "entry.json", lambda entry: entry.update(files=hashes(members)))
    return zipped(path, members)


def hashes(members: Members) -> dict[str, str]:
    return {name: hashlib.sha256(data).hexdigest() for name, data in members.items() if name != "entry.json"}


def change(members: Members, name: str, edit: Callable[[dict[str, Any]], None]) -> None:
    found = json.loads(members[name])
    edit(found)
    members[name] = json.dumps(found).encode()


def change_row(members: Members, number: int, edit: Callable[[dict[str, Any]], None]) -> None:
    rows = [json.loads(line) for line in members["episodes.jsonl"].splitlines()]
    edit(rows[number])
    members["episodes.jsonl"] = b"".join(json.dumps(row).encode() + b"\n" for row in rows)


def restamped(members: Members) -> None:
    """Give a run another name and hash, as somebody does who hides whose run it is."""
    header = RunHeader.model_validate_json(members["run.json"]).model_copy(update={"run_id": "mine", "nonce": "0" * 32})
    members["run.json"] = header.model_dump_json().encode()
    for number in range(4):
        change_row(members, number, lambda row: row.update(run_sha256=header.sha256, run_id="mine"))
    change(members, "entry.json", lambda entry: entry["metadata"].update(model_name="mine"))


def cut_off(members: Members) -> None:
    members["episodes.jsonl"] = members["episodes.jsonl"][:-40]


def nested(members: Members) -> None:
    members["episodes.jsonl"] += b'{"a":' + b"[" * 100_000 + b"]" * 100_000 + b"}\n"


def giant(members: Members) -> None:
    change_row(members, 0, lambda row: row["steps"][0]["reply"].update(text="x" * (17 * 2**20)))


def huge(record: dict[str, Any]) -> None:
    record["steps"][0]["reply"]["usage"] = {"input_tokens": 10**30, "output_tokens": 1}


def entry_field(**fields: Any) -> Edit:
    return lambda members: change(members, "entry.json", lambda entry: entry.update(fields))


def said(**fields: Any) -> Edit:
    return lambda members: change(members, "entry.json", lambda entry: entry["metadata"].update(fields))


def spec(**fields: Any) -> Edit:
    return lambda members: change(members, "run.json", lambda header: header["spec"].update(fields))


def row(edit: Callable[[dict[str, Any]], None]) -> Edit:
    return lambda members: change_row(members, 0, edit)


def further(name: str) -> Edit:
    return lambda members: members.update({name: b"x"})


def better_figure(members: Members) -> None:
    change(members, "entry.json", lambda entry: entry["figures"].update(B=[1.0, 0.9, 1.0]))


def of_no_pack(members: Members) -> None:
    spec(pack_sha256="0" * 64)(members)
    entry_field(pack_sha256="0" * 64)(members)


def misnamed(members: Members) -> None:
    spec(pack="vigil_mini_v3")(members)
    entry_field(pack="vigil_mini_v3")(members)


def with_path(members: Members) -> None:
    change(members, "run.json", lambda header: header["host"].update(asset_database="/etc/passwd"))


HOSTILE: dict[str, tuple[Edit, str]] = {
    "edited without its hash": (row(lambda record: record.update(attempt=2)), "episodes.jsonl does not have the hash"),
    "edited figures": (better_figure, "figure B, value: claimed 1.0, found"),
    "edited frames": (
        entry_field(frames={"count": 1, "sha256": "0" * 64}),
        "the hash of frames that the bundle states",
    ),
    "a fact that its reply does not say": (
        row(lambda record: record["steps"][0].update(ignored_keys=["x"])),
        "step 1: ignored_keys: recorded",
    ),
    "another pack": (of_no_pack, "the run's pack 'tiny' with SHA-256 000000000000... is not known here"),
    "another pack's name": (misnamed, "the pack with the same hash is 'tiny'"),
    "another version": (spec(versions={"rules": 2, "shapes": 5, "grammar": 2}), "rules 2 (here"),
    "another run's rows": (spec(seed=7), "is of another run"),
    "rows left out": (lambda m: m.update({"episodes.jsonl": m["episodes.jsonl"].split(b"\n")[0] + b"\n"}), "1 of 4"),
    "half a file": (cut_off, "is incomplete and is skipped"),
    "deep nesting": (nested, "cannot be read"),
    "a giant reply": (giant, "has a row of more than 16,777,216 bytes"),
    "a simulator of its own": (spec(simulator="fake"), "'fake' does not belong to the benchmark"),
    "another's paths": (with_path, "contains paths or addresses of a machine"),
    "an absolute path": (further("/etc/cron.d/x"), "'/etc/cron.d/x'"),
    "a path upwards": (further("../x"), "'../x'"),
    "a program": (further("setup.py"), "'setup.py'"),
    "a script in a name": (said(model_name=SCRIPT), "the text contains < or >"),
    "an invisible letter in a name": (said(model_name="GPT\u202e4"), "an invisible character"),
    "a link that is none": (said(references=["javascript:alert(1)"]), "references.0"),
    "deep nesting in the entry": (
        lambda m: m.update({"entry.json": b"[" * 100_000}),
        "entry.json of the bundle is not valid",
    ),
    "a number that no table holds": (row(huge), "the check of the bundle failed with an error: "),
    "a prompt that it denies": (said(submission_type="standard"), "so it must be custom"),
}


@pytest.fixture(scope="module")
def built(
    bundles: dict[str, Path], pack: Pack, tmp_path_factory: pytest.TempPathFactory
) -> tuple[SiteBuild, dict[str, str], Path]:
    """The site of all bundles, and {name of a bundle: why it was refused}."""
    folder = tmp_path_factory.mktemp("hostile")
    hostile = [
        edited(
            bundles["random"],
            folder / f"{name}.zip",
            edit,
            hashed="without its hash" not in name and "in the entry" not in name,
        )
        for name, (edit, _) in HOSTILE.items()
    ]
    hostile.append(edited(bundles["random"], folder / "renamed.zip", said(model_name="mine")))
    hostile.append(edited(bundles["random"], folder / "restamped.zip", restamped))
    moved = row(lambda record: record["steps"][0]["world"]["agent"]["position"].__setitem__(0, 4.25))
    hostile.append(edited(bundles["random"], folder / "moved.zip", moved))
    out = folder / "site"
    builder = build_site(
        [*bundles.values(), *hostile], out, BuildSettings(packs=(pack.folder,), workers=1, shown_plays=1)
    )
    return builder, {line.bundle: line.why for line in builder.log if line.status == "refused by the check"}, out


def test_the_honest_come_out_and_nothing_else(built: tuple[SiteBuild, dict[str, str], Path]) -> None:
    builder, refused, out = built
    assert sorted(entry.metadata.model_name for entry in builder.entries) == ["always_success", "random"]
    assert len(refused) == len(HOSTILE) + 3
    text = (out / "index.html").read_text()
    for name in refused:
        assert name.replace("'", "&#39;") in text


@pytest.mark.parametrize("name", HOSTILE)
def test_each_refusal_says_why(built: tuple[SiteBuild, dict[str, str], Path], name: str) -> None:
    assert HOSTILE[name][1] in built[1][f"{name}.zip"]


def test_the_run_of_another_is_a_copy_under_any_name(built: tuple[SiteBuild, dict[str, str], Path]) -> None:
    for name in ("renamed", "restamped"):
        assert "4 of its 4 plays are those of entry" in built[1][f"{name}.zip"]


def test_an_edited_world_is_named_by_episode_step_and_field(built: tuple[SiteBuild, dict[str, str], Path]) -> None:
    said = built[1]["moved.zip"]
    assert "Episode 'tiny-" in said
    assert "step 1: world.agent.position.0: recorded 4.25, found" in said


def link(folder: Path, source: Path) -> Path:
    members, path = members_of(source), folder / "link.zip"
    with zipfile.ZipFile(path, "w") as file:
        info = zipfile.ZipInfo("episodes.jsonl")
        info.create_system, info.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
        for name in ("entry.json", "run.json"):
            file.writestr(name, members[name])
        file.writestr(info, "/etc/passwd")
    return path


def twice(folder: Path, source: Path) -> Path:
    path = zipped(folder / "twice.zip", {**members_of(source), "xxx.json": b"{}"})
    path.write_bytes(path.read_bytes().replace(b"xxx.json", b"run.json"))
    return path


def bomb(folder: Path, source: Path) -> Path:
    """A member that says it is small, and unpacks to more than the limit."""
    path = zipped(folder / "bomb.zip", {**members_of(source), "run.json": b" " * (5 * 2**20)})
    data = bytearray(path.read_bytes())
    for signature, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        start = data.find(signature)
        while start >= 0:
            if struct.unpack_from("<L", data, start + place)[0] == 5 * 2**20:
                struct.pack_into("<L", data, start + place, 1000)
            start = data.find(signature, start + 1)
    path.write_bytes(data)
    return path


def honest_bomb(folder: Path, source: Path) -> Path:
    return zipped(folder / "big.zip", {**members_of(source), "run.json": b" " * (5 * 2**20)})


def many(folder: Path, source: Path) -> Path:
    del source
    return zipped(folder / "many.zip", {f"member-{number}": b"" for number in range(2000)})


def half(folder: Path, source: Path) -> Path:
    path = folder / "half.zip"
    path.write_bytes(source.read_bytes()[:-500])
    return path


def text(folder: Path, source: Path) -> Path:
    del source
    path = folder / "text.zip"
    path.write_text("PK is not enough")
    return path


def encrypted(folder: Path, source: Path) -> Path:
    data = bytearray(source.read_bytes())
    for signature, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.find(signature) + place] |= 1
    path = folder / "encrypted.zip"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (link, "episodes.jsonl in the bundle is a link"),
        (twice, "run.json is in the bundle twice"),
        (bomb, "the bundle is not a complete zip file"),
        (honest_bomb, "run.json has 5,242,880 bytes when unpacked"),
        (many, "the bundle's directory has 2000 files"),
        (half, "the bundle is not a complete zip file"),
        (text, "the bundle is not a complete zip file"),
        (encrypted, "is encrypted"),
    ],
)
def test_a_malformed_zip_file_is_refused_before_it_is_unpacked(
    bundles: dict[str, Path], tmp_path: Path, make: Callable[[Path, Path], Path], why: str
) -> None:
    path = make(tmp_path, bundles["random"])
    (tmp_path / "out").mkdir()
    with pytest.raises(bundles_module.RecordError, match=why.replace("(", r"\(")):
        unpack_bundle(path, tmp_path / "out")
    assert sum(file.stat().st_size for file in (tmp_path / "out").iterdir()) < 2 * 2**20


def test_the_size_of_a_bundle_is_limited(
    bundles: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bundles_module, "MAX_ZIP_BYTES", 1000)
    with pytest.raises(bundles_module.RecordError, match="but may have at most 1,000"):
        unpack_bundle(bundles["random"], tmp_path)


def test_what_a_model_wrote_is_shown_and_not_executed(bundles: dict[str, Path], pack: Pack, tmp_path: Path) -> None:
    def evil(record: dict[str, Any]) -> None:
        reply = json.loads(record["steps"][-1]["reply"]["text"])
        reply["thought"] = reply["arguments"]["summary"] = SCRIPT
        record["steps"][-1]["reply"]["text"] = json.dumps(reply)
        record["steps"][-1]["action"]["summary"] = SCRIPT

    path = edited(bundles["always_success"], tmp_path / "evil.zip", row(evil))
    out = tmp_path / "site"
    built = build_site([path], out, BuildSettings(packs=(pack.folder,), workers=1, shown_plays=4))
    assert len(built.entries) == 1, built.log
    pages = {page.name: page.read_text() for page in out.rglob("*.html")}
    assert any("window.evil" in found for found in pages.values())
    assert not any(SCRIPT in found for found in pages.values())


def test_a_name_of_a_bundle_is_shown_as_text(tmp_path: Path, pack: Pack) -> None:
    path = tmp_path / "<img src=x onerror=alert(1)>.zip"
    path.write_bytes(io.BytesIO(b"nothing").getvalue())
    built = build_site([path], tmp_path / "site", BuildSettings(packs=(pack.folder,)))
    assert built.entries == []
    assert "<img src=x" not in (tmp_path / "site" / "index.html").read_text()


def test_metadata_is_the_same_after_the_bundle(bundles: dict[str, Path], tmp_path: Path) -> None:
    assert unpack_bundle(bundles["random"], tmp_path).metadata == metadata("random")
