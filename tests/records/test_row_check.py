"""Rows that are not the run's: every reader leaves them out and says why; what is left is what is scored."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.support.builders import RecordBuilder, episode, thing
from tests.support.quick_runs import claim
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import read_runs
from vigil.cli import app
from vigil.packs.pack import Pack
from vigil.records.record import EpisodeRecord
from vigil.records.row_check import protocol_violations
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import verify_run
from vigil.scoring.saved_run import read_run
from vigil.web.library import Library

Row = dict[str, Any]


def settings(pack: Pack, folder: Path) -> RunSettings:
    return RunSettings(pack=pack.folder, agent="noop", log_dir=folder, backend="fake", workers=1)


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pack, Path]:
    folder = tmp_path_factory.mktemp("rows")
    pack = tiny_pack(folder / "pack", 8)
    run_pack(settings(pack, folder / "run"))
    return pack, folder / "run"


@pytest.fixture
def run(played: tuple[Pack, Path], tmp_path: Path) -> Path:
    """A copy of the run under another name: a renamed folder is the same run."""
    return Path(shutil.copytree(played[1], tmp_path / "renamed"))


def rewrite(run: Path, change: Callable[[list[Row]], None]) -> None:
    file = run / "episodes.jsonl"
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    change(rows)
    file.write_text("".join(json.dumps(row) + "\n" for row in rows))


def set_first(**fields: Any) -> Callable[[list[Row]], None]:
    return lambda rows: rows[0].update(fields)


def double_the_report(rows: list[Row]) -> None:
    rows[0]["steps"].append(rows[0]["steps"][-1] | {"index": len(rows[0]["steps"]) + 1})


def drop_steps(rows: list[Row]) -> None:
    rows[0].update(steps=rows[0]["steps"][:1], end="fail_no_report")


def without_target(rows: list[Row]) -> None:
    rows[0]["initial"]["objects"] = {}


def not_a_number(rows: list[Row]) -> None:
    rows[0]["initial"]["agent"]["rotation"] = float("nan")


FAULTS: dict[str, tuple[Callable[[list[Row]], None], str]] = {
    "run": (set_first(run_sha256="0" * 64), "is of another run (line 1: 'run', hash 000000000000)"),
    "versions": (set_first(versions={"rules": 9, "shapes": 2, "grammar": 2}), "was played under other versions"),
    "episode": (set_first(episode_id="tiny-DA-999"), "is of an episode that this run does not have"),
    "epoch": (set_first(epoch=2), "is of an epoch that this run does not have (line 1: epoch 2 of 1)"),
    "prompt": (set_first(prompt_sha256="0" * 64), "was played with another prompt"),
    "no prompt": (set_first(prompt_sha256=""), "was played with another prompt"),
    "early end": (drop_steps, "it ended as fail_no_report after 1 of 25 steps"),
    "two ends": (double_the_report, "it has 26 steps of at most 25"),
    "no object": (without_target, "is missing from the world after step 0"),
    "NaN": (not_a_number, "cannot be read (line 1: not JSON"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_row_that_is_not_the_runs_is_not_scored_and_said(played, run, name):
    change, said = FAULTS[name]
    rewrite(run, change)
    done = CliRunner().invoke(app, ["score", str(run), "--json"])
    (found,) = json.loads(done.stdout)["runs"]
    assert found["overall"]["complete"] == "7/8"
    assert any(said in note for note in found["notes"]), found["notes"]
    (reported,) = read_runs([run])
    assert reported.n == 7
    assert any(said in fault for fault in reported.faults)
    (shown,) = Library([run], [played[0].folder]).runs()
    assert shown.table is not None
    assert len(shown.table.scores().outcomes) == 7
    assert any(said in note for note in shown.notes)


def test_an_untouched_run_under_another_name_is_whole(played, run):
    table = read_run(run).table
    assert (len(table.rows), table.left_out, table.notes) == (8, (), ())


def test_a_second_runs_rows_do_not_fill_up_the_first(played, run, tmp_path):
    run_pack(settings(played[0], tmp_path / "second"))
    with (run / "episodes.jsonl").open("ab") as file:
        file.write((tmp_path / "second" / "episodes.jsonl").read_bytes())
    table = read_run(run).table
    assert len(table.rows) == 8
    assert table.notes[0].startswith("8 rows are left out, each of which is of another run (line 9: 'second', hash ")
    assert "and 5 more" in table.notes[0]


def test_a_run_goes_on_where_rows_do_not_count(played, run):
    rewrite(run, set_first(run_sha256=""))
    again = run_pack(settings(played[0], run))
    assert (again.resumed, again.is_complete) == (7, True)
    assert "is of another run" in again.notes[0]
    table = read_run(run).table
    assert (len(table.rows), len(table.left_out)) == (8, 1)


def test_a_line_that_cannot_be_read_costs_one_row_and_not_the_run(played, run):
    file = run / "episodes.jsonl"
    lines = file.read_bytes().splitlines(keepends=True)
    lines[2] = b'{"run_id":' + b"[" * 100_000 + b"]" * 100_000 + b"}\n"
    file.write_bytes(b"".join(lines))
    table = read_run(run).table
    assert len(table.rows) == 7
    assert "line 3: not JSON: recursion limit" in table.notes[0]
    for command in (["score", str(run)], ["verify", str(run), "--workers", "1"], ["report", str(run), "--no-paper"]):
        done = CliRunner().invoke(app, command)
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        assert "line 3: not JSON" in done.output


def test_a_deeply_nested_header_is_named(played, run):
    (run / "run.json").write_bytes(b"[" * 100_000 + b"]" * 100_000)
    done = CliRunner().invoke(app, ["score", str(run)])
    assert "run.json' is not JSON: recursion limit" in str(done.exception)


def test_verify_does_not_pass_a_file_with_rows_of_others(played, run):
    assert verify_run(run).is_verified
    rewrite(run, lambda rows: rows.append(rows[0] | {"run_id": "other"}))
    found = verify_run(run)
    assert (found.checked, found.differences, found.left_out, found.is_verified) == (8, (), 1, False)


def test_other_prompts_of_the_package_are_said_and_not_held_against_the_rows(played, run):
    header = json.loads((run / "run.json").read_text())
    header["spec"]["prompt_policy_sha256"] = "0" * 64
    (run / "run.json").write_text(json.dumps(header))
    claim(run)
    table = read_run(run).table
    assert (len(table.rows), table.left_out) == (8, ())
    assert "were not checked" in table.notes[0]


def story(invalid: int = 0, steps: int = 0) -> RecordBuilder:
    found = RecordBuilder(target=thing())
    for _ in range(invalid):
        found.invalid()
    for _ in range(steps):
        found.do()
    return found


AI = episode("AI", max_steps=6, max_invalid=2)


@pytest.mark.parametrize(
    "record",
    [
        story(2, 3).report(),
        story(0, 6).end("fail_no_report"),
        story(2, 4).end("fail_no_report"),
        story(3).end("invalid_action_limit_exceeded"),
        story(2, 3).end("error"),
    ],
)
def test_what_the_protocol_brings_forth_is_not_contradicted(record: EpisodeRecord):
    assert protocol_violations(AI, record) == []


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (story(0, 5).end("fail_no_report"), "after 5 of 6 steps"),
        (story(0, 7).end("fail_no_report"), "7 steps of at most 6"),
        (story(0, 3).end("report"), "its last action is not a report"),
        (story(2, 1).end("invalid_action_limit_exceeded"), "has 2; 2 are allowed"),
        (story(3, 1).end("invalid_action_limit_exceeded"), "goes on after invalid reply 3 of step 3"),
        (story(3, 3).end("fail_no_report"), "invalid replies were used up"),
        (story(3).report(), "goes on after invalid reply 3"),
        (story(0, 6).end("error"), "after it had ended"),
    ],
)
def test_what_the_protocol_cannot_bring_forth_is_named(record: EpisodeRecord, said: str):
    assert any(said in fault for fault in protocol_violations(AI, record))


def test_a_report_amid_steps_is_named():
    found = story(0, 2)
    found.report()
    found.do()
    assert "goes on after the report of step 3" in protocol_violations(AI, found.end("fail_no_report"))[0]


def test_another_agents_rows_do_not_stand_for_a_run_of_the_same_name(played, tmp_path):
    """A run that did nothing is given the rows of one that solved everything, whose folder was called the same."""
    pack = played[0]
    mine, better = tmp_path / "mine" / "run", tmp_path / "better" / "run"
    run_pack(settings(pack, mine))
    run_pack(replace(settings(pack, better), agent="sweep"))
    shutil.copy(better / "episodes.jsonl", mine / "episodes.jsonl")
    table = read_run(mine).table
    assert (len(table.rows), len(table.left_out)) == (0, 8)
    assert not verify_run(mine).is_verified
    again = run_pack(settings(pack, mine))
    assert (again.resumed, again.is_complete) == (0, True)


def test_rows_are_not_those_of_another_run_of_the_same_name_and_settings(played, tmp_path):
    pack = played[0]
    for place in ("one", "two"):
        run_pack(settings(pack, tmp_path / place / "run"))
    shutil.copy(tmp_path / "one" / "run" / "episodes.jsonl", tmp_path / "two" / "run" / "episodes.jsonl")
    assert len(read_run(tmp_path / "two" / "run").table.left_out) == 8


def test_rows_are_not_those_of_a_run_whose_header_was_given_other_settings(run):
    header = json.loads((run / "run.json").read_text())
    header["spec"]["agent"] = "a better one"
    (run / "run.json").write_text(json.dumps(header))
    assert len(read_run(run).table.left_out) == 8
