"""Shards of a run, played apart, joined into the run that is played in one go; and what is no such thing, refused."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.support.commands import Vigil, command_runner
from tests.support.quick_runs import quick, without_times
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S
from vigil.base.json_lines import AppendFile, dump_line
from vigil.errors import RecordError
from vigil.records.record import EPISODES_FILE, HEADER_FILE, Shard, read_header
from vigil.records.record_file import read_records
from vigil.runner.attempts import ATTEMPTS_FILE, Attempt, AttemptLog
from vigil.runner.dry_run import estimate
from vigil.runner.merge import MergeSettings, merge_runs
from vigil.runner.plan import plan_run
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import summarise

SCALING = Path(__file__).parents[2] / "docs" / "scaling.md"
PLAYED: dict[str, Any] = {"agent": "random", "epochs": 2}


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 7)
    return folder


@pytest.fixture(scope="module")
def whole(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """The run in one go."""
    return run_pack(quick(pack, tmp_path_factory.mktemp("whole") / "run", **PLAYED))


@pytest.fixture(scope="module")
def played(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of shards 1, 2 and 3; to be copied, not changed."""
    folder = tmp_path_factory.mktemp("played")
    for index in (1, 2, 3):
        result = run_pack(quick(pack, folder / str(index), shard=Shard(index=index, of=3), **PLAYED))
        assert result.is_complete
    return folder


@pytest.fixture
def shards(played: Path, tmp_path: Path) -> list[Path]:
    """Copies of the three shards."""
    folder = Path(shutil.copytree(played, tmp_path / "shards"))
    return [folder / str(index) for index in (1, 2, 3)]


@pytest.fixture
def vigil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vigil:
    return command_runner(monkeypatch, capsys)


def rewrite_header(shard: Path, change: Callable[[dict[str, Any]], None]) -> None:
    fields = json.loads((shard / HEADER_FILE).read_text())
    change(fields)
    (shard / HEADER_FILE).write_text(json.dumps(fields))


def spoil_first_row(shard: Path, **fields: Any) -> None:
    first, *others = (shard / EPISODES_FILE).read_text().splitlines(keepends=True)
    (shard / EPISODES_FILE).write_text("".join([json.dumps(json.loads(first) | fields) + "\n", *others]))


def drop_last_row(shard: Path) -> None:
    rows = (shard / EPISODES_FILE).read_bytes().splitlines(keepends=True)
    (shard / EPISODES_FILE).write_bytes(b"".join(rows[:-1]))


def refused(out: Path, shards: list[Path], **options: Any) -> str:
    """Return why shards are not joined; assert that no file is left over and that the shards are unchanged."""
    before = {file: file.read_bytes() for folder in shards for file in folder.rglob("*") if file.is_file()}
    beside = set(out.parent.iterdir())
    with pytest.raises(RecordError) as error:
        merge_runs(out, shards, MergeSettings(**options))
    assert set(out.parent.iterdir()) == beside
    assert {file: file.read_bytes() for file in before} == before
    return str(error.value)


def test_joined_shards_are_the_run_that_was_played_in_one_go(
    whole: RunResult, shards: list[Path], tmp_path: Path
) -> None:
    header = merge_runs(tmp_path / "run", shards[::-1])
    assert header == read_header(tmp_path / "run")
    assert (header.run_id, header.spec) == ("run", whole.header.spec)
    records = sorted(read_records(tmp_path / "run" / EPISODES_FILE), key=lambda row: row.key)
    assert {row.run_id for row in records} == {"run"}
    assert [without_times(row) for row in records] == [without_times(row) for row in whole.records]
    joined, alone = read_run(tmp_path / "run"), read_run(whole.folder)
    assert joined.notes == alone.notes == ()
    assert summarise(joined.table.scores()) == summarise(alone.table.scores())
    found = verify_run(tmp_path / "run", VerifySettings(workers=1))
    assert (found.is_verified, found.checked, found.is_exact) == (True, 14, True)


def test_the_header_names_the_sessions_of_all_shards(shards: list[Path], tmp_path: Path) -> None:
    rewrite_header(shards[1], lambda fields: fields["host"].update(machine="another"))
    header = merge_runs(tmp_path / "run", shards)
    headers = [read_header(shard) for shard in shards]
    counts = [len(read_records(shard / EPISODES_FILE)) for shard in shards]
    assert (header.started, header.ended) == (headers[0].started, headers[2].ended)
    assert [(one.started, one.rows_before, one.episodes) for one in header.resumed] == [
        (headers[1].started, counts[0], 7),
        (headers[2].started, counts[0] + counts[1], 7),
    ]
    assert [host["machine"] for host in header.hosts].count("another") == 1


def test_attempts_frames_and_logs_are_joined(shards: list[Path], tmp_path: Path) -> None:
    for shard in shards:
        (shard / "frames" / "ab").mkdir(parents=True)
        (shard / "frames" / "ab" / "same.png").write_bytes(b"same")
        (shard / "frames" / "ab" / f"{shard.name}.png").write_bytes(shard.name.encode())
        (shard / "logs" / "worker-1.log").write_text(shard.name)
    stray = Attempt.model_validate_json((shards[0] / ATTEMPTS_FILE).read_bytes().splitlines()[0])
    with AppendFile(shards[0] / ATTEMPTS_FILE) as file:
        file.append(dump_line(stray), dump_line(stray.model_copy(update={"spec_sha256": "of another run"})))
    header = merge_runs(tmp_path / "run", shards)
    names = {path.name: path.read_bytes() for path in (tmp_path / "run" / "frames").rglob("*.png")}
    assert names == {"same.png": b"same", "1.png": b"1", "2.png": b"2", "3.png": b"3"}
    assert [(tmp_path / "run" / "logs" / f"shard-{n}-of-3" / "worker-1.log").read_text() for n in "123"] == [*"123"]
    attempts = AttemptLog(tmp_path / "run" / ATTEMPTS_FILE, header.spec)
    counts = {row.key: attempts.count(row.key) for row in read_records(tmp_path / "run" / EPISODES_FILE)}
    assert counts.pop(stray.key) == 2
    assert set(counts.values()) == {1}
    lines = (tmp_path / "run" / ATTEMPTS_FILE).read_bytes().splitlines()
    times = [Attempt.model_validate_json(line).started for line in lines]
    assert (len(times), times) == (15, sorted(times))


def test_a_joined_run_goes_on_like_any_other(whole: RunResult, pack: Path, shards: list[Path], tmp_path: Path) -> None:
    drop_last_row(shards[0])
    merge_runs(tmp_path / "run", shards[:2], MergeSettings(partial=True))
    joined = read_run(tmp_path / "run")
    assert not joined.table.scores().is_complete
    assert joined.header.ended is None
    result = run_pack(quick(pack, tmp_path / "run", **PLAYED))
    assert (result.is_complete, result.resumed) == (True, len(joined.table.rows))
    rows = [without_times(row) | {"attempt": 1} for row in result.records]
    assert rows == [without_times(row) for row in whole.records]
    again = run_pack(quick(pack, tmp_path / "run", **PLAYED))
    assert (again.resumed, again.header) == (14, result.header)


def test_a_shard_is_told_as_what_it_is(pack: Path, shards: list[Path], vigil: Vigil) -> None:
    run = read_run(shards[1])
    note = "This run '2' is shard 2/3 of a run: it plays 2 of the 7 episodes. `vigil merge` joins the shards."
    assert run.notes == (note,)
    assert not run.table.scores().is_complete
    said = vigil("score", shards[1])
    assert note in said.out + said.err
    assert "INCOMPLETE, 4 of 14 episodes scored" in said.out
    wanted = quick(pack, shards[1], shard=Shard(index=2, of=3), **PLAYED)
    assert run_pack(wanted).resumed == 4
    assert estimate(plan_run(wanted)).episodes == 4


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"shard": Shard(index=1, of=3)}, "shard.index: 2 there, 1 here"),
        ({"shard": Shard(index=2, of=4)}, "shard.of: 3 there, 4 here"),
        ({"shard": None}, "shard: .* there, None here"),
        ({"limit": 6}, "episode_ids: 7 of them there, 6 of them here"),
    ],
    ids=lambda value: "",
)
def test_a_shards_folder_is_no_other_shards(pack: Path, shards: list[Path], changes: dict[str, Any], said: str) -> None:
    with pytest.raises(RecordError, match=said):
        run_pack(quick(pack, shards[1], **{"shard": Shard(index=2, of=3), **PLAYED, **changes}))


def test_a_shard_does_not_grow(pack: Path, tmp_path: Path) -> None:
    first = {"shard": Shard(index=1, of=2), "agent": "noop"}
    run_pack(quick(pack, tmp_path / "run", limit=2, **first))
    with pytest.raises(RecordError, match="episode_ids"):
        run_pack(quick(pack, tmp_path / "run", limit=4, **first))


def test_a_row_of_another_shards_episode_is_not_counted(shards: list[Path]) -> None:
    foreign = read_records(shards[2] / EPISODES_FILE)[0]
    with AppendFile(shards[1] / EPISODES_FILE) as file:
        file.append(dump_line(read_header(shards[1]).stamp(foreign)))
    run = read_run(shards[1])
    assert len(run.table.rows) == 4
    assert "is of an episode of another shard" in run.notes[1]


def test_each_shard_has_a_folder_of_its_own(pack: Path) -> None:
    parts = [RunSettings(pack=pack, agent="noop", shard=Shard(index=index, of=2)) for index in (1, 2)]
    names = [plan_run(one).execution.folder.name for one in (*parts, RunSettings(pack=pack, agent="noop"))]
    assert len(set(names)) == 3
    assert "-shard-2-of-2-" in names[1]


def test_missing_shards_are_named(shards: list[Path], tmp_path: Path) -> None:
    said = refused(tmp_path / "run", [shards[1]])
    assert "Of 3 shards, 2 are missing: 1/3, 3/3." in said


@pytest.mark.parametrize("partial", [False, True])
def test_overlapping_shards_are_refused(shards: list[Path], tmp_path: Path, partial: bool) -> None:
    copy = Path(shutil.copytree(shards[0], tmp_path / "copy"))
    said = refused(tmp_path / "run", [*shards, copy], partial=partial)
    assert f"{str(copy)!r} and {str(shards[0])!r} overlap: both are shard 1/3" in said
    assert "given twice" in refused(tmp_path / "run", [*shards, shards[0]], partial=partial)


OTHERS: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "pack": (lambda fields: fields["spec"].update(pack_sha256="0" * 64), "pack_sha256"),
    "settings": (lambda fields: fields["spec"].update(seed=7), "seed: 0 in '{0}', 7 in '{2}'"),
    "prompt": (lambda fields: fields["spec"].update(prompt_policy_sha256="0" * 64), "prompt_policy_sha256"),
    "versions": (lambda fields: fields["spec"]["versions"].update(rules=99), "versions.rules"),
    "agent": (lambda fields: fields["spec"].update(agent="noop"), "agent: 'random' in '{0}', 'noop' in '{2}'"),
    "package": (lambda fields: fields.update(package_version="9"), "package_version"),
    "simulator": (lambda fields: fields.update(simulator_version="fake/2"), "simulator_version: 'fake/1' in"),
    "count": (lambda fields: fields["spec"]["shard"].update(of=4), "shard.of: 3 in '{0}', 4 in '{2}'"),
    "whole": (lambda fields: fields["spec"].update(shard=None), "'{2}' is a whole run, not a shard"),
    "episodes": (lambda fields: fields["spec"]["episode_ids"].pop(), "episode_ids: 7 of them in"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_shards_of_different_runs_are_refused(shards: list[Path], tmp_path: Path, name: str) -> None:
    change, said = OTHERS[name]
    rewrite_header(shards[2], change)
    for options in ({}, {"partial": True, "force": True}):
        assert said.format(*shards) in refused(tmp_path / "run", shards, **options)


ANSWERS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "agent_files": lambda fields: fields["spec"].update(agent_files={"agent.py": "0" * 64}),
    "answering models": lambda fields: fields.update(answered={"models": {"another": 4}}),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_another_program_or_answering_model_is_joined_when_that_is_asked_for(
    shards: list[Path], tmp_path: Path, name: str
) -> None:
    for shard in shards:
        rewrite_header(shard, lambda fields: fields.update(answered={"models": {"one": 4}}))
    rewrite_header(shards[2], ANSWERS[name])
    said = refused(tmp_path / "run", shards)
    assert re.search(rf"{name}.*Join them anyway with --force", said)
    merge_runs(tmp_path / "run", shards, MergeSettings(force=True))
    assert len(read_records(tmp_path / "run" / EPISODES_FILE)) == 14


DAMAGE: dict[str, tuple[Callable[[Path], Any], str]] = {
    "unfinished": (drop_last_row, "ended as errors: 2/3 (1, in "),
    "error": (
        lambda shard: spoil_first_row(
            shard, end="error", error={"boundary": "worker", "message": "gone"}, steps=[], initial=None
        ),
        "ended as errors: 2/3 (1, in ",
    ),
}
ALWAYS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "value": (lambda shard: spoil_first_row(shard, epoch=0), f"{EPISODES_FILE}' line 1 cannot be read: epoch"),
    "row of another run": (lambda shard: spoil_first_row(shard, run_sha256="0" * 64), "line 1 is of another run: "),
    "torn": (
        lambda shard: (shard / EPISODES_FILE).write_bytes((shard / EPISODES_FILE).read_bytes()[:-9]),
        "line 4 is incomplete",
    ),
    "no rows": (lambda shard: (shard / EPISODES_FILE).unlink(), f"has no {EPISODES_FILE}"),
    "no header": (lambda shard: (shard / HEADER_FILE).unlink(), f"has no {HEADER_FILE}"),
    "attempts": (lambda shard: (shard / ATTEMPTS_FILE).write_text("{}\n"), f"{ATTEMPTS_FILE}' line 1"),
}


@pytest.mark.parametrize("name", [*DAMAGE, *ALWAYS])
def test_a_shard_with_damage_is_refused(shards: list[Path], tmp_path: Path, name: str) -> None:
    spoil, said = (DAMAGE | ALWAYS)[name]
    spoil(shards[1])
    assert said in refused(tmp_path / "run", shards)
    if name in ALWAYS:
        assert said in refused(tmp_path / "run", shards, partial=True)


def test_a_shard_that_is_being_played_is_refused(shards: list[Path], tmp_path: Path) -> None:
    with AppendFile(shards[1] / EPISODES_FILE):
        assert "is being written by another process" in refused(tmp_path / "run", shards)


def test_a_place_that_is_taken_is_refused(shards: list[Path], tmp_path: Path) -> None:
    assert "exists already" in refused(tmp_path / "shards", shards)
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError, match=r"cannot be joined into .*The folder was not created"):
        merge_runs(tmp_path / "file" / "run", shards)


def test_an_error_before_a_success_stays_in_the_file(shards: list[Path], tmp_path: Path) -> None:
    first = read_records(shards[0] / EPISODES_FILE)[0]
    lost = {"end": "error", "error": {"boundary": "worker", "message": "gone"}, "steps": [], "initial": None}
    failed = first.model_validate(first.model_dump() | lost)
    rows = (shards[0] / EPISODES_FILE).read_bytes()
    (shards[0] / EPISODES_FILE).write_bytes(dump_line(failed) + rows)
    merge_runs(tmp_path / "run", shards)
    assert len(read_records(tmp_path / "run" / EPISODES_FILE)) == 15
    assert read_run(tmp_path / "run").table.scores().is_complete


def test_the_command_joins_and_tells(shards: list[Path], tmp_path: Path, vigil: Vigil) -> None:
    said = vigil("merge", tmp_path / "run", *shards)
    assert (said.code, f"Records: {tmp_path / 'run'}" in said.out) == (0, True)
    again = vigil("merge", tmp_path / "run", *shards)
    assert (again.code, "exists already" in again.err) == (2, True)


@pytest.mark.parametrize("text", ["0/3", "4/3", "x"])
def test_a_bad_shard_is_refused_before_anything_is_played(pack: Path, tmp_path: Path, vigil: Vigil, text: str) -> None:
    said = vigil("run", "--pack", pack, "--agent", "noop", "--log-dir", tmp_path / "run", "--shard", text)
    assert said.code == 2
    assert f"--shard {text!r} is not I/N" in said.err
    assert not (tmp_path / "run").exists()


def test_the_script_of_the_docs_plays_and_joins(pack: Path, whole: RunResult, tmp_path: Path) -> None:
    """Both scripts of the page, with what a cluster sets; `vigil` is this tree's."""
    array, join = re.findall(r"^```bash\n(#!.*?)^```", SCALING.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    command = f"#!/bin/sh\nexec {sys.executable} -c 'from vigil.cli import main; main()' \"$@\"\n"
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "vigil").write_text(command)
    (tmp_path / "bin" / "vigil").chmod(0o755)
    paths = {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": os.pathsep.join(sys.path)}
    options = ["--pack", pack, "--agent", "random", "--epochs", "2", "--backend", "fake", "--workers", "1"]

    def bash(script: str, *arguments: object, **variables: str) -> None:
        (tmp_path / "script").write_text(script)
        words = ["bash", "script", "random", *map(str, arguments)]
        subprocess.run(words, cwd=tmp_path, env={**os.environ, **paths, **variables}, check=True, timeout=HANGS_AFTER_S)

    for index in "12":
        bash(array, *options, SLURM_ARRAY_TASK_ID=index, SLURM_ARRAY_TASK_COUNT="2")
    bash(join)
    records = read_run(tmp_path / "runs" / "random").table.rows
    assert set(records) == {row.key for row in whole.records}


@pytest.mark.parametrize("place", ["logs/worker-1.log", "frames/ab/secret.png", "inspect"])
def test_what_a_link_leads_to_is_not_joined(shards: list[Path], tmp_path: Path, place: str) -> None:
    secret = tmp_path / "secret"
    secret.write_text("private")
    link = shards[1] / place
    link.parent.mkdir(parents=True, exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(secret)
    assert "is a link that leads out of" in refused(tmp_path / "run", shards)


def test_a_run_that_goes_on_does_not_write_through_a_link(pack: Path, tmp_path: Path) -> None:
    secret, run = tmp_path / "secret", tmp_path / "run"
    secret.write_text("private")
    run_pack(quick(pack, run, limit=1, agent="noop"))
    (run / "logs").mkdir(exist_ok=True)
    (run / "logs" / "worker-1.log").unlink(missing_ok=True)
    (run / "logs" / "worker-1.log").symlink_to(secret)
    with pytest.raises(RecordError, match=r"worker-1\.log' is a link that leads out of"):
        run_pack(quick(pack, run, limit=2, agent="noop"))
    assert secret.read_text() == "private"
