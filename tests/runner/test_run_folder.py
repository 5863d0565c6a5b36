"""A run's folder: who may take it away, and who notices."""

import fcntl
import os
from pathlib import Path

import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.base import json_lines as jsonl
from vigil.packs.pack import Pack
from vigil.records.record import EPISODES_FILE, HEADER_FILE, RunSpec
from vigil.records.record_file import RecordLog, read_records
from vigil.runner import run_folder
from vigil.runner.plan import plan_run
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import RunSettings


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pack, RunSpec]:
    pack = tiny_pack(tmp_path_factory.mktemp("pack") / "tiny", 2)
    return pack, plan_run(RunSettings(pack=pack.folder, agent="noop", backend="fake")).spec


def test_an_empty_folder_is_taken_away_while_it_is_locked(planned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pack, spec = planned
    was_free: list[bool] = []
    really = run_folder.shutil.rmtree

    def removed(path: Path) -> None:
        with (Path(path) / EPISODES_FILE).open("ab") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                was_free.append(True)
            except BlockingIOError:
                was_free.append(False)
        really(path)

    monkeypatch.setattr(run_folder.shutil, "rmtree", removed)
    RunFolder.create_or_resume(tmp_path / "run", spec, pack.episodes).close()
    assert was_free == [False]
    assert list(tmp_path.iterdir()) == []


def test_who_waits_for_a_folder_that_goes_gets_one_of_its_own(planned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The second run has opened the file when the first one takes folder and file away."""
    pack, spec = planned
    path = tmp_path / "run"
    first = RunFolder.create_or_resume(path, spec, pack.episodes)
    really = fcntl.flock
    waiting = [first]

    def lock(file, how: int) -> None:
        if waiting:
            waiting.pop().close()
        really(file, how)

    monkeypatch.setattr(jsonl.fcntl, "flock", lock)
    second = RunFolder.create_or_resume(path, spec, pack.episodes)
    assert (path / HEADER_FILE).is_file()
    held = os.fstat(second.log._file.fileno())
    assert os.path.samestat(held, (path / EPISODES_FILE).stat())
    second.close()
    assert not path.exists()


def test_a_log_is_written_to_the_file_that_is_there(tmp_path: Path):
    log = RecordLog(tmp_path / "new" / EPISODES_FILE)
    assert log.made_folder
    log.close()
    assert read_records(tmp_path / "new" / EPISODES_FILE) == []
    again = RecordLog(tmp_path / "new" / EPISODES_FILE)
    assert not again.made_folder
    again.close()


def test_a_folder_of_the_users_stays(planned, tmp_path: Path):
    pack, spec = planned
    (tmp_path / "mine").mkdir()
    RunFolder.create_or_resume(tmp_path / "mine", spec, pack.episodes).close()
    assert (tmp_path / "mine").is_dir()
