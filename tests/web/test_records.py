"""Broken, half-written and growing record files."""

import json
import shutil
from pathlib import Path

import pytest

from vigil.pack import Pack
from vigil.record import read_header
from vigil.row_check import RowCheck
from vigil.web.library import Library
from vigil.web.records import RecordTable
from vigil.web.tables import run_rows


@pytest.fixture
def rows(runs: Path, tmp_path: Path) -> Path:
    shutil.copy(runs / "random" / "run.json", tmp_path / "run.json")
    return Path(shutil.copy(runs / "random" / "episodes.jsonl", tmp_path / "episodes.jsonl"))


def table_of(rows: Path, pack: Pack) -> RecordTable:
    header = read_header(rows.parent)
    table = RecordTable(rows, {one.id: one for one in pack.episodes}, RowCheck(header, pack.episodes))
    table.refresh()
    return table


def test_a_broken_line_is_named_and_the_rest_is_shown(rows: Path, pack: Pack) -> None:
    lines = rows.read_bytes().splitlines(keepends=True)
    lines[2] = b'{"episode_id": "tiny-PG-001", "steps": 7}\n'
    lines[4] = b"\x00\xff no json\n"
    rows.write_bytes(b"".join(lines))
    table = table_of(rows, pack)
    assert [row.line for row in table.broken] == [3, 5]
    assert table.broken[0].episode_id == "tiny-PG-001"
    assert len(table.settlement().outcomes) == len(lines) - 2


def test_a_record_that_contradicts_itself_is_broken(rows: Path, pack: Pack) -> None:
    lines = rows.read_bytes().splitlines(keepends=True)
    lines[0] = lines[0].replace(b'"end":"fail_no_report"', b'"end":"report"').replace(b'"end":"report"', b'"end":"IL"')
    lines[1] = lines[1].replace(b'"schema_version":1', b'"schema_version":9')
    rows.write_bytes(b"".join(lines))
    table = table_of(rows, pack)
    assert [row.line for row in table.broken] == [1, 2]
    assert "schema 9" in table.broken[1].detail


def test_a_file_is_read_on_as_it_grows(rows: Path, pack: Pack) -> None:
    whole = rows.read_bytes()
    cut = whole[: len(whole) * 2 // 3]
    rows.write_bytes(cut)
    table = table_of(rows, pack)
    seen = len(table.rows)
    assert 0 < seen < len(pack.episodes)
    assert table.torn is not None
    with rows.open("ab") as file:
        file.write(whole[len(cut) :])
    table.refresh()
    assert table.torn is None
    assert len(table.rows) == len(pack.episodes)
    for key in table.rows:
        assert table.record(key).key == key


def test_a_replaced_file_is_read_afresh(rows: Path, pack: Pack) -> None:
    table = table_of(rows, pack)
    first = rows.read_bytes().splitlines(keepends=True)[0]
    rows.write_bytes(first)
    table.refresh()
    assert len(table.rows) == 1


def test_a_first_row_without_error_stands(rows: Path, pack: Pack) -> None:
    data = rows.read_bytes()
    rows.write_bytes(data + data.splitlines(keepends=True)[0])
    table = table_of(rows, pack)
    assert min(row.line for row in table.rows.values()) == 1
    assert len(table.rows) == len(pack.episodes)


def test_a_run_without_rows_or_header_does_not_stop_the_others(runs: Path, pack: Pack, tmp_path: Path) -> None:
    shutil.copytree(runs / "random", tmp_path / "good")
    (tmp_path / "empty").mkdir()
    shutil.copy(runs / "random" / "run.json", tmp_path / "empty" / "run.json")
    (tmp_path / "headless").mkdir()
    shutil.copy(runs / "random" / "episodes.jsonl", tmp_path / "headless" / "episodes.jsonl")
    (tmp_path / "nonsense").mkdir()
    (tmp_path / "nonsense" / "run.json").write_text("{")
    found = {run.slug: run for run in Library([tmp_path], [pack.folder]).runs()}
    assert list(found) == ["empty", "good", "headless", "nonsense"]
    assert found["good"].fault == ""
    assert found["empty"].table is not None
    assert found["empty"].table.is_missing
    assert "run.json" in found["headless"].fault
    assert "not JSON" in found["nonsense"].fault


def test_a_run_that_grows_is_not_broken_and_one_that_was_cut_is(runs: Path, pack: Pack, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(runs / "random", tmp_path / "run"))
    rows = folder / "episodes.jsonl"
    rows.write_bytes(rows.read_bytes()[:-100])
    library = Library([folder], [pack.folder])
    (row,) = run_rows(library.runs(), "", "B", descending=True)
    assert row.broken == 1
    header = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**header, "ended": None}))
    (row,) = run_rows(library.runs(), "", "B", descending=True)
    assert (row.broken, row.complete) == (0, f"{len(pack.episodes) - 1}/{len(pack.episodes)}")


def test_a_run_is_opened_without_reading_the_others(runs: Path, pack: Pack) -> None:
    library = Library([runs], [pack.folder])
    assert library.run("sweep").table is not None
    assert [run.slug for run in library.found() if run.table is None] == ["random"]


def test_a_run_of_another_pack_says_which(runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "random", tmp_path / "run")
    (run,) = Library([tmp_path]).runs()
    assert "'tiny'" in run.fault
    assert "--pack" in run.fault
