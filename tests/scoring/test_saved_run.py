"""Saved runs: one rule for all readers of which rows stand, also while the file grows; and where the pack lies."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import read_runs
from vigil.cli import app
from vigil.errors import PackMismatch, RecordError
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.records.record_file import RecordLog
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings
from vigil.scoring.saved_run import RecordTable, SavedRun, load_run_pack, pack_folder, read_run
from vigil.web.library import Library

N = 4


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pack, Path]:
    folder = tmp_path_factory.mktemp("saved")
    pack = tiny_pack(folder / "pack", N)
    run_pack(RunSettings(pack=pack.folder, agent="noop", log_dir=folder / "run", backend="fake", workers=1))
    return pack, folder / "run"


@pytest.fixture
def run(played: tuple[Pack, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(played[1], tmp_path / "run"))


def test_a_run_has_its_header_pack_rows_and_verdicts(played: tuple[Pack, Path], run: Path):
    pack, _ = played
    found = read_run(run)
    assert isinstance(found, SavedRun)
    assert (found.pack_folder, found.notes, found.table.left_out) == (pack.folder, (), ())
    assert list(found.table.episodes) == [episode.id for episode in pack.episodes]
    scores = found.table.scores()
    assert [outcome.episode_id for outcome in scores.outcomes] == list(found.table.episodes)
    assert scores.is_complete
    for key, row in found.table.rows.items():
        record = found.table.record(key)
        assert (record.key, row.outcome) == (key, next(o for o in scores.outcomes if o.episode_id == key[0]))
    with pytest.raises(RecordError, match=r"No readable record of episode 'none' \(epoch 1\)"):
        found.table.record(("none", 1))


def counts(pack: Pack, run: Path) -> dict[str, int]:
    """Return the number of episodes that each reader scores."""
    done = CliRunner().invoke(app, ["score", str(run), "--json"])
    (shown,) = Library([run], [pack.folder]).runs()
    assert shown.table is not None
    return {
        "score": json.loads(done.stdout)["runs"][0]["overall"]["episodes"],
        "report": read_runs([run])[0].n,
        "pages": len(shown.table.scores().outcomes),
    }


@pytest.mark.parametrize(("cut", "left"), [(0, N), (1, N), (2, N - 1), (200, N - 1)])
def test_all_readers_agree_on_a_last_line_without_its_end(played: tuple[Pack, Path], run: Path, cut: int, left: int):
    file = run / "episodes.jsonl"
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) - cut])
    assert set(counts(played[0], run).values()) == {left}
    assert (read_run(run).table.partial_line_number is None) == (left == N)
    log = RecordLog(file)
    log.close()
    assert (len(log.rows), log.partial_line_file is None) == (left, left == N)
    assert set(counts(played[0], run).values()) == {left}


@pytest.mark.parametrize("step", [1, 700])
def test_a_file_that_grows_comes_to_the_same_as_one_that_is_read_at_once(run: Path, step: int):
    file = run / "episodes.jsonl"
    whole = file.read_bytes()
    file.write_bytes(b"")
    growing = read_run(run).table
    ends = range(step, len(whole) + step, step) if step > 1 else (len(whole) // 2, len(whole) - 1, len(whole))
    for end in ends:
        file.write_bytes(whole[:end])  # the same file: its inode stays
        growing.refresh()
        assert growing.rows == read_run(run).table.rows
    assert (len(growing.rows), growing.partial_line_number) == (N, None)


def test_a_last_line_that_goes_on_is_read_again(run: Path):
    """What seemed whole was the beginning of a longer line, which is none."""
    file = run / "episodes.jsonl"
    whole = file.read_bytes()[:-1]
    file.write_bytes(whole)
    table = read_run(run).table
    assert (len(table.rows), table.left_out) == (N, ())
    with file.open("ab") as more:
        more.write(b"{}\n")
    table.refresh()
    assert [row.line for row in table.left_out] == [N]
    assert len(table.rows) == N - 1


def test_no_record_file_is_named(run: Path):
    (run / "episodes.jsonl").unlink()
    with pytest.raises(RecordError, match=r"episodes\.jsonl' does not exist"):
        read_run(run)
    header = read_header(run)
    table = RecordTable(run, header, [])
    table.refresh()
    assert table.is_missing


def test_a_run_whose_pack_lacks_an_episode_is_refused(run: Path):
    header = json.loads((run / "run.json").read_text())
    header["spec"]["episode_ids"].append("tiny-ZZ-999")
    (run / "run.json").write_text(json.dumps(header))
    with pytest.raises(RecordError, match="names episode 'tiny-ZZ-999', absent from its pack"):
        read_run(run)


def test_the_pack_is_where_it_lay_or_where_one_says(played: tuple[Pack, Path], run: Path, tmp_path: Path):
    pack, header = played[0], read_header(run)
    moved = Path(shutil.copytree(pack.folder, tmp_path / "moved"))
    assert pack_folder(header) == pack.folder
    assert pack_folder(header, moved) == moved
    assert load_run_pack(header, moved).sha256 == pack.sha256
    gone = header.model_copy(update={"host": {**header.host, "pack_folder": str(tmp_path / "gone")}})
    with pytest.raises(PackMismatch, match="There is no pack 'tiny'"):
        pack_folder(gone)


def test_another_pack_where_it_lay_does_not_hide_the_packaged_one(run: Path, tmp_path: Path):
    header = read_header(run)
    starter = Pack.load("starter")
    other = Path(tiny_pack(tmp_path / "other", 2).folder)
    spec = header.spec.model_copy(update={"pack": "starter", "pack_sha256": starter.sha256})
    played_on = header.model_copy(update={"spec": spec, "host": {"pack_folder": str(other)}})
    assert pack_folder(played_on) == starter.folder
    changed = played_on.model_copy(update={"spec": spec.model_copy(update={"pack_sha256": "0" * 64})})
    with pytest.raises(PackMismatch, match=r"SHA-256 000000000000\.\.\., .*other' has .*cannot be compared"):
        pack_folder(changed)
    with pytest.raises(PackMismatch, match=r"other' has .*Give the pack that the run was played on"):
        pack_folder(played_on, other)
