"""A dataset's folder has what its card names, and nothing hidden."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

from tests.support.published_runs import Write, small_records
from vigil.analysis.measures.columns import without_answer_key
from vigil.analysis.measures.rows import combined_rows, read_runs
from vigil.errors import SettingError
from vigil.integrations.exports.dataset import write_dataset
from vigil.integrations.exports.options import Disclosure
from vigil.integrations.exports.steps import EXTRA_COLUMNS, STEP_COLUMNS, columns_with
from vigil.protocol.actions import Reply
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord
from vigil.runner.workers.frames import FrameStore

FRAME = np.full((480, 640, 3), 7, dtype=np.uint8)


def exported(out: Path, *runs: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Exports runs; returns what the card says to machines, and the rows of `steps`."""
    card = write_dataset(read_runs(runs), None, out)
    head = yaml.safe_load(card.read_text(encoding="utf-8").split("---\n")[1])
    configs = {each["config_name"]: each["data_files"] for each in head["configs"]}
    files = sorted(out.glob(configs["steps"]))
    return head, [row for file in files for row in pq.read_table(file).to_pylist()]


def with_frame(record: EpisodeRecord, sha256: str) -> EpisodeRecord:
    """The record, its first reply with a frame."""
    first, *others = record.steps
    return record.model_copy(update={"steps": (first.model_copy(update={"frame_sha256": sha256}), *others)})


def test_the_card_names_every_file_and_says_what_each_column_is(write: Write, tmp_path: Path) -> None:
    runs = [write("a"), write("b", agent="vllm/Other")]
    head, steps = exported(tmp_path / "out", *runs)
    named = {each["config_name"]: each["data_files"] for each in head["configs"]}
    found = {path for pattern in named.values() for path in (tmp_path / "out").glob(pattern)}
    assert found == set((tmp_path / "out").rglob("*.parquet"))
    assert "license" not in head
    card = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert all(f"- `{name}`: " in card for name in steps[0])
    assert "16 of 16 episodes scored, W 100.0 %, B 100.0 %" in card


def test_episodes_are_the_rows_of_a_report_and_steps_join_them(write: Write, tmp_path: Path) -> None:
    runs = [write("a"), write("b")]
    _, steps = exported(tmp_path / "out", *runs)
    whole = combined_rows(read_runs(runs))
    rows = whole.reindex(columns=without_answer_key(whole.columns))
    written = pq.read_table(tmp_path / "out" / "episodes.parquet").to_pandas()
    assert written.equals(rows.astype(written.dtypes))
    for row in rows.to_dict("records"):
        mine = [step for step in steps if (step["run"], step["episode_id"]) == (row["run"], row["episode_id"])]
        assert [step["step"] for step in mine] == list(range(1, row["steps"] + 1))
        assert {step["label"] for step in mine} == {row["label"]}


@pytest.mark.parametrize("has_key", [False, True], ids=["without", "with"])
def test_the_answer_key_is_left_out_unless_asked_for_and_the_card_says_which(
    write: Write, tmp_path: Path, has_key: bool
) -> None:
    runs = read_runs([write("a")])
    card = write_dataset(runs, None, tmp_path / "out", Disclosure(answer_key=has_key)).read_text(encoding="utf-8")
    columns = pq.read_schema(tmp_path / "out" / "episodes.parquet").names
    key = {"target", "distance_m", "expected", "first_goal_step", "lag", "lag_from_reset", "actions_after_goal.look"}
    assert key & set(columns) == (key if has_key else set())
    assert ("- `expected`: " in card) == has_key
    assert ("**The answer key is here in part**" in card) == has_key
    assert {"W", "B", "label", "reported", "actions.look"} <= set(columns)
    if has_key:
        assert columns == list(combined_rows(runs).columns)


def test_a_kept_frame_is_a_picture_and_one_that_was_not_kept_is_none(write: Write, tmp_path: Path) -> None:
    sha256 = FrameStore(tmp_path / "a" / "frames").save(FRAME)
    records = small_records()
    records["AI-000"] = with_frame(records["AI-000"], sha256)
    linked = hashlib.sha256(b"linked").hexdigest()
    records["AI-001"] = with_frame(records["AI-001"], linked)
    secret, link = tmp_path / "secret.png", FrameStore(tmp_path / "a" / "frames").path(linked)
    secret.write_bytes(b"private")
    link.parent.mkdir()
    link.symlink_to(secret)
    run = write("a", records)
    _, steps = exported(tmp_path / "out", run, write("b"))
    pictures = {(step["run"], step["episode_id"], step["step"]): step["image"] for step in steps if step["image"]}
    (key,) = pictures
    assert key[1:] == ("AI-000", 1)
    assert pictures[key] == {
        "bytes": FrameStore(run / "frames").path(sha256).read_bytes(),
        "path": f"{sha256}.png",
    }
    schema = pq.read_schema(tmp_path / "out" / "steps" / "0001.parquet")
    told = json.loads((schema.metadata or {})[b"huggingface"])["info"]["features"]
    assert list(told) == schema.names == list(columns_with({"image"}))
    assert told["image"] == {"_type": "Image"}
    assert told["seconds"] == {"dtype": "float64", "_type": "Value"}


def test_without_kept_frames_there_is_no_column_of_pictures(write: Write, tmp_path: Path) -> None:
    _, steps = exported(tmp_path / "out", write("a"))
    assert list(steps[0]) == list(columns_with(()))
    assert STEP_COLUMNS.keys() - steps[0].keys() == EXTRA_COLUMNS


def test_feedback_is_that_which_was_shown_with_the_frame(write: Write, tmp_path: Path) -> None:
    records = small_records()
    first, *others = records["AI-000"].steps
    bumped = first.model_copy(update={"effect": Effect(path_blocked=True)})
    records["AI-000"] = records["AI-000"].model_copy(update={"steps": (bumped, *others)})
    _, told = exported(tmp_path / "told", write("a", records, profile=Profile(name=ACTION_FEEDBACK)))
    _, untold = exported(tmp_path / "untold", write("b", records))
    shown = [step["shown_path_blocked"] for step in told if step["episode_id"] == "AI-000"]
    assert shown == [None, True, *[False] * (len(shown) - 2)]
    assert {step["shown_path_blocked"] for step in untold} == {None}


def test_no_hidden_state_and_no_address_is_written(write: Write, tmp_path: Path) -> None:
    _, steps = exported(tmp_path / "out", write("a", base_url="http://10.1.2.3:8000/v1"))
    assert not {"effect", "world", "goal"} & set(steps[0])
    rows = pq.read_table(tmp_path / "out" / "episodes.parquet").to_pylist()
    card = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert "10.1.2.3" not in f"{steps}{rows}{card}"
    assert str(tmp_path) not in f"{steps}{rows}{card}"


def test_a_reply_of_any_text_and_an_invalid_one_are_kept(write: Write, tmp_path: Path) -> None:
    records = small_records()
    first, *others = records["PG-000"].steps
    odd = first.model_copy(update={"reply": Reply(text="\u2028\x00\ud83d\ude00")})
    records["PG-000"] = records["PG-000"].model_copy(update={"steps": (odd, *others)})
    _, steps = exported(tmp_path / "out", write("a", records))
    assert next(step for step in steps if step["episode_id"] == "PG-000")["reply"] == odd.reply.text


def test_a_run_without_a_scored_episode_has_no_rows_and_the_card_says_so(write: Write, tmp_path: Path) -> None:
    _, steps = exported(tmp_path / "out", write("a", {}))
    assert steps == []
    assert "no episode is scored" in (tmp_path / "out" / "README.md").read_text(encoding="utf-8")


def test_the_same_runs_give_the_same_bytes_and_a_full_folder_is_left_alone(write: Write, tmp_path: Path) -> None:
    run = write("a")
    for out in ("one", "two"):
        exported(tmp_path / out, run)
    files = [sorted(path for path in (tmp_path / out).rglob("*") if path.is_file()) for out in ("one", "two")]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]
    with pytest.raises(SettingError, match="not empty"):
        exported(tmp_path / "one", run)
