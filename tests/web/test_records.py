"""Broken, half-written and growing record files."""

import json
import shutil
from pathlib import Path

import pytest

from tests.support.narrowing import present
from tests.support.web_server import served
from vigil.packs.files import MANIFEST
from vigil.packs.pack import Pack
from vigil.records.record import SCHEMA_VERSION, read_header
from vigil.records.record_file import RecordLog
from vigil.records.row_check import RowCheck
from vigil.scoring.saved_run import RecordTable
from vigil.web.drawing import RenderService
from vigil.web.export import export_site
from vigil.web.library import Library
from vigil.web.tables import sorted_run_rows
from vigil.web.view import make_view


@pytest.fixture
def rows(runs: Path, tmp_path: Path) -> Path:
    shutil.copy(runs / "random" / "run.json", tmp_path / "run.json")
    return Path(shutil.copy(runs / "random" / "episodes.jsonl", tmp_path / "episodes.jsonl"))


def table_of(rows: Path, pack: Pack) -> RecordTable:
    table = RecordTable(rows.parent, read_header(rows.parent), pack.episodes)
    table.refresh()
    return table


def test_a_broken_line_is_named_and_the_rest_is_shown(rows: Path, pack: Pack) -> None:
    lines = rows.read_bytes().splitlines(keepends=True)
    lines[2] = b'{"episode_id": "tiny-PG-001", "steps": 7}\n'
    lines[4] = b"\x00\xff no json\n"
    rows.write_bytes(b"".join(lines))
    table = table_of(rows, pack)
    assert [row.line for row in table.left_out] == [3, 5]
    assert table.left_out[0].episode_id == "tiny-PG-001"
    assert len(table.scores().outcomes) == len(lines) - 2


def test_a_record_of_no_known_end_or_schema_is_left_out(rows: Path, pack: Pack) -> None:
    lines = rows.read_bytes().splitlines(keepends=True)
    lines[0] = lines[0].replace(b'"end":"fail_no_report"', b'"end":"report"').replace(b'"end":"report"', b'"end":"IL"')
    current = b'"schema_version":%d' % SCHEMA_VERSION
    lines[1] = lines[1].replace(current, b'"schema_version":9')
    rows.write_bytes(b"".join(lines))
    table = table_of(rows, pack)
    assert [row.line for row in table.left_out] == [1, 2]
    assert "schema 9" in table.left_out[1].detail


def test_a_file_is_read_on_as_it_grows(rows: Path, pack: Pack) -> None:
    whole = rows.read_bytes()
    cut = whole[: len(whole) * 2 // 3]
    rows.write_bytes(cut)
    table = table_of(rows, pack)
    seen = len(table.rows)
    assert 0 < seen < len(pack.episodes)
    assert table.partial_line_number is not None
    with rows.open("ab") as file:
        file.write(whole[len(cut) :])
    table.refresh()
    assert table.partial_line_number is None
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


def test_a_run_that_grows_has_nothing_left_out_and_one_that_was_cut_has(runs: Path, pack: Pack, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(runs / "random", tmp_path / "run"))
    rows = folder / "episodes.jsonl"
    rows.write_bytes(rows.read_bytes()[:-100])
    library = Library([folder], [pack.folder])
    (row,) = sorted_run_rows(library.runs(), "", "B", descending=True)
    assert row.left_out == 1
    header = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**header, "ended": None}))
    (row,) = sorted_run_rows(library.runs(), "", "B", descending=True)
    assert (row.left_out, present(row.rates)["complete"]) == (0, f"{len(pack.episodes) - 1}/{len(pack.episodes)}")


def test_a_run_is_opened_without_reading_the_others(runs: Path, pack: Pack) -> None:
    library = Library([runs], [pack.folder])
    assert library.run("sweep").table is not None
    assert [run.slug for run in library.known_runs() if run.table is None] == ["random"]


def test_a_run_of_another_pack_says_which(runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "random", tmp_path / "run")
    (run,) = Library([tmp_path]).runs()
    assert "'tiny'" in run.fault
    assert "--pack" in run.fault


def test_a_runs_pack_is_read_where_it_was_noted_and_only_if_it_is_the_runs(
    runs: Path, pack: Pack, tmp_path: Path
) -> None:
    root = tmp_path / "root"
    header_file = Path(shutil.copytree(runs / "random", root / "run")) / "run.json"
    inside = Path(shutil.copytree(pack.folder, root / "packs" / "tiny"))
    header = json.loads(header_file.read_text())
    header["host"]["pack_folder"] = str(inside)
    header_file.write_text(json.dumps(header))
    assert Library([root]).run("run").table is not None
    outside = (inside / MANIFEST).rename(tmp_path / "manifest.json")
    (inside / MANIFEST).symlink_to(outside)
    assert "--pack" in Library([root]).run("run").fault
    header["host"]["pack_folder"] = str(pack.folder)
    header_file.write_text(json.dumps(header))
    assert Library([root]).run("run").table is not None
    header["spec"]["pack_sha256"] = "0" * 64
    header_file.write_text(json.dumps(header))
    assert "--pack" in Library([root]).run("run").fault


@pytest.fixture
def strange(runs: Path, tmp_path: Path) -> Path:
    """A run most of whose rows are not its own, or impossible; its last line is cut off."""
    folder = Path(shutil.copytree(runs / "random", tmp_path / "strange"))
    rows = [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]
    rows[0]["run_sha256"] = "a" * 64
    rows[1]["epoch"] = 2
    rows[2]["prompt_sha256"] = "0" * 64
    rows[3] |= {"end": "fail_no_report", "steps": rows[3]["steps"][:1]}
    rows[4] |= {"end": "error", "steps": [], "attempt": 3, "error": {"boundary": "worker", "message": "gone"}}
    again = {**rows[5], "run_sha256": "a" * 64}
    lines = [json.dumps(row).encode() + b"\n" for row in (*rows, again, rows[5])]
    (folder / "episodes.jsonl").write_bytes(b"".join(lines) + b'{"episode_id": "ti')
    return folder


REASONS = (
    "is of another run (line 1: &#39;random&#39;, hash aaaaaaaaaaaa; line 9: &#39;random&#39;, hash aaaaaaaaaaaa)",
    "is of an epoch that this run does not have (line 2: epoch 2 of 1)",
    "was played with another prompt (line 3: ",
    "contradicts the protocol (line 4: it ended as fail_no_report after 1 of ",
    "repeats an earlier row that counts (line 10: ",
    "Line 11 of its records is incomplete",
    "1 of 4 episodes were started more than once (more than 1 %), one of them 3 times",
)


def test_each_page_with_figures_says_which_rows_it_leaves_out(
    strange: Path, runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    library = Library([strange, runs / "sweep"], [pack.folder])
    with served(make_view(library, render_service)) as site:
        pages = [
            site.get("/runs/strange").text,
            export_site(library.run("strange"), tmp_path / "site", render_service).read_text(),
        ]
        for text in pages:
            assert "3/8 episodes scored" in text
            assert [reason for reason in REASONS if reason not in text] == []
        for text in (site.get("/compare?a=sweep&b=strange").text, site.get("/compare?a=strange&b=strange").text):
            assert [reason for reason in REASONS[:-1] if text.count(reason) != 1] == []
        assert "7 left out" in site.get("/").text


def test_the_pages_and_the_other_readers_leave_out_the_same(strange: Path, pack: Pack) -> None:
    table = table_of(strange / "episodes.jsonl", pack)
    log = RecordLog(strange / "episodes.jsonl")
    log.check(RowCheck(read_header(strange), pack.episodes))
    log.close()
    assert table.left_out == log.left_out
    assert sorted(table.rows) == list(log.rows)
    assert table.scores().attempts == (1, 1, 1, 3)


def test_rows_after_a_lone_carriage_return_are_read(rows: Path, pack: Pack) -> None:
    lines = rows.read_bytes().splitlines()
    rows.write_bytes(b"\r".join(lines) + b"\n")
    table = table_of(rows, pack)
    assert (len(table.rows), table.partial_line_number) == (len(lines), None)


def test_a_folder_that_now_holds_another_run_is_read_afresh(runs: Path, pack: Pack, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(runs / "random", tmp_path / "run"))
    library = Library([folder], [pack.folder])
    assert library.run("run").notes == ()
    shutil.rmtree(folder)
    shutil.copytree(runs / "sweep", folder)
    run = library.run("run")
    assert run.table is not None
    assert (run.name, run.notes, len(run.table.rows)) == ("sweep", (), len(pack.episodes))
