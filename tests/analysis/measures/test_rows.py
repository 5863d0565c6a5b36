"""Rows: settling, the cache, names, and every kind of bad input."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support.builders import RecordBuilder, thing
from tests.support.published_runs import Write, make_episodes, small_records, write_pack, write_run
from vigil.analysis.measures import rows
from vigil.analysis.measures.columns import COLUMNS
from vigil.analysis.measures.rows import combined_rows, read_runs
from vigil.errors import PackMismatch, RecordError
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.scoring.outcomes import score

ERROR = RecordBuilder(target=thing()).end("error").model_copy(update={"episode_id": "@"})


def append(run: Path, text: str) -> None:
    with (run / "episodes.jsonl").open("a", encoding="utf-8") as file:
        file.write(text)


def test_a_row_says_what_settling_says(write: Write):
    records = small_records()
    (run,) = read_runs([write("run")])
    episode = next(one for one in make_episodes(2) if one.id == "CR-001")
    outcome = score(episode, records["CR-001"].model_copy(update={"episode_id": "CR-001"}))
    row = run.rows.set_index("episode_id").loc["CR-001"]
    assert (row["W"], row["B"], row["label"], row["lag"], row["house"]) == (True, True, "B", outcome.lag, "house_1")
    assert row["actions.report"] == outcome.actions["report"] == 1
    assert row["actions_after_goal.report"] == 1


def test_a_table_beside_a_run_is_not_believed(write: Write):
    run = write("run")
    (before,) = read_runs([run])
    before.rows.assign(W=False, B=False).to_parquet(run / "settled.parquet")
    (again,) = read_runs([run])
    pd.testing.assert_frame_equal(again.rows, before.rows)
    assert set(run.iterdir()) == {run / name for name in ("run.json", "episodes.jsonl", "settled.parquet")}


def test_a_torn_last_line_is_passed_over_and_said(write: Write):
    run = write("run")
    append(run, '{"schema_version":1,"run_id"')
    (found,) = read_runs([run])
    assert found.n == 16
    assert any("incomplete and is skipped" in fault for fault in found.faults)


def test_doubled_episodes_count_once_and_are_said(write: Write):
    run = write("run")
    line = (run / "episodes.jsonl").read_text(encoding="utf-8").splitlines()[0]
    append(run, f"{line}\n{line}\n")
    (found,) = read_runs([run])
    assert found.n == 16
    assert any(
        "2 rows are left out, each of which repeats an earlier row that counts" in fault for fault in found.faults
    )


def test_an_error_is_superseded_and_never_scored(write: Write):
    records = {"PG-000": ERROR, "PG-001": ERROR}
    run = write("run", records)
    text = (run / "episodes.jsonl").read_text(encoding="utf-8")
    write("run", {"PG-000": small_records()["PG-000"]})
    good = (run / "episodes.jsonl").read_text(encoding="utf-8")
    (run / "episodes.jsonl").write_text(text + good, encoding="utf-8")
    (found,) = read_runs([run])
    assert found.n == 1
    assert found.errors["episode_id"].tolist() == ["PG-001"]
    assert any("1 of 2 episodes ended as errors" in fault for fault in found.faults)


def test_an_empty_run_is_named(write: Write):
    (found,) = read_runs([write("run", {})])
    assert found.n == 0
    assert found.faults == ("model: no episode is scored: the run is empty.",)


def test_missing_families_and_episodes_are_named(write: Write):
    planned = ["PG-000", "PG-001", "DA-000"]
    (found,) = read_runs([write("run", {"PG-000": small_records()["PG-000"]}, planned=planned)])
    assert "INCOMPLETE: 1 of 3 episodes are scored, none of DA" in found.faults[0]
    assert "without episodes of VS, SV, AI, SI, SM, CR" in found.faults[1]


def test_a_row_of_another_schema_version_is_left_out_by_line(write: Write):
    run = write("run")
    line = json.loads((run / "episodes.jsonl").read_text(encoding="utf-8").splitlines()[0])
    append(run, json.dumps({**line, "schema_version": 99}) + "\n")
    (found,) = read_runs([run])
    assert (found.n, "line 17: it has schema 99, but vigil " in found.faults[0]) == (16, True)


def test_a_broken_line_amid_others_is_left_out(write: Write):
    run = write("run")
    append(run, "{oops\n")
    append(run, (run / "episodes.jsonl").read_text(encoding="utf-8").splitlines()[0] + "\n")
    (found,) = read_runs([run])
    assert found.n == 16
    assert "1 row is left out, which cannot be read (line 17: not JSON" in found.faults[0]


def test_records_of_no_planned_episode_are_left_out(write: Write):
    (found,) = read_runs([write("run", planned=["PG-000"])])
    assert found.n == 1
    assert any(
        "15 rows are left out, each of which is of an episode that this run does not have" in fault
        for fault in found.faults
    )


def test_a_run_of_another_pack_is_refused(write: Write, tmp_path: Path):
    write_pack(tmp_path / "other", make_episodes(1))
    with pytest.raises(PackMismatch, match="results on another pack cannot be compared"):
        read_runs([write("run")], pack=str(tmp_path / "other"))


def test_a_mistyped_pack_is_named(write: Write):
    with pytest.raises(PackMismatch, match=r"There is no pack 'startr'.*Did you mean 'starter'"):
        read_runs([write("run")], pack="startr")


def test_a_changed_pack_is_refused(tmp_path: Path, small_pack: Path):
    pack = shutil.copytree(small_pack, tmp_path / "changed")
    run = write_run(tmp_path / "run", pack, "vllm/model", small_records())
    (pack / "episodes.jsonl").write_bytes((pack / "episodes.jsonl").read_bytes() + b"\n")
    with pytest.raises(PackMismatch, match="changed after freezing"):
        read_runs([run])


def test_a_folder_without_a_run_is_refused(tmp_path: Path, write: Write):
    with pytest.raises(RecordError, match=r"has no run\.json"):
        read_runs([tmp_path])
    run = write("run")
    (run / "episodes.jsonl").unlink()
    with pytest.raises(RecordError, match="does not exist"):
        read_runs([run])


def test_neither_order_of_runs_nor_of_episodes_matters(write: Write):
    records = small_records()
    one = write("one", records, agent="vllm/a")
    two = write("two", dict(reversed(records.items())), agent="vllm/b")
    first, second = read_runs([one, two]), read_runs([two, one, two])
    assert [run.name for run in first] == [run.name for run in second] == ["a", "b"]
    pd.testing.assert_frame_equal(first[0].rows, first[1].rows)
    assert len(combined_rows(first)) == 32
    assert combined_rows(first).columns[:3].tolist() == ["run", "model", "run_id"]


def test_every_column_is_described_in_order(write: Write):
    table = combined_rows(read_runs([write("a"), write("b")]))
    names = [re.sub(r"^(actions|actions_after_goal)\..*", r"\1.KIND", name) for name in table.columns]
    names = [re.sub(r"^credit\..*", "credit.POLICY", name) for name in names]
    assert list(dict.fromkeys(names)) == list(COLUMNS)
    assert set(table["backend"]) == {"mujoco"}
    assert set(table["prompt_variant"]) == {"default"}
    assert table["temperature"].dtype == "float64"


def test_runs_of_one_model_get_names_of_their_own(write: Write):
    feedback = Profile(name=ACTION_FEEDBACK)
    folders = [
        write("a"),
        write("b", profile=feedback),
        write("c", profile=feedback),
        write("deep/c", profile=feedback),
    ]
    names = [run.name for run in read_runs(folders)]
    assert names[:2] == ["model", "model [+FB] · b"]
    assert names[2:] == ["model [+FB] · c · c", "model [+FB] · c · deep/c"]


def test_large_runs_are_settled_side_by_side(write: Write, monkeypatch: pytest.MonkeyPatch):
    folders = [write("one", agent="vllm/a"), write("two", agent="vllm/b")]
    alone = read_runs(folders)
    monkeypatch.setattr(rows, "_PARALLEL_FROM_BYTES", 0)
    for one, two in zip(alone, read_runs(folders), strict=True):
        pd.testing.assert_frame_equal(one.rows, two.rows)


def test_types_of_columns_do_not_depend_on_the_rows(write: Write):
    full, empty = read_runs([write("full", agent="vllm/a"), write("empty", {}, agent="vllm/b")])
    pd.testing.assert_series_equal(full.rows.dtypes, empty.rows.dtypes)
    assert full.rows["W"].dtype == np.bool_
    assert full.rows["steps"].dtype == np.int64
    assert full.rows["lag"].dtype == np.float64
