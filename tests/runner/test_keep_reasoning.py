"""`--keep-reasoning`: what came apart from the replies is kept beside the records, and goes nowhere else."""

import json
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import read_runs
from vigil.cli import app
from vigil.errors import RecordError
from vigil.integrations.exports.dataset import write_dataset
from vigil.records.reasoning_file import MAX_CHARS, REASONING_FILE, read_reasoning, reasoning_by_step
from vigil.runner.run import RunResult, run_pack
from vigil.web.library import Library
from vigil.web.timeline import episode_of, episode_timeline

pytestmark = INSPECT
SECRET_THOUGHT = "I reason that the box is red"


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 2)
    return folder


def brain(asked: ChatRequest) -> ChatAnswer:
    return ChatAnswer(LOOK if asked.turn < 3 else REPORT, reasoning=f"{SECRET_THOUGHT}, at turn {asked.turn}")


def play(pack: Path, folder: Path, **changes: object) -> tuple[RunResult, list[bytes]]:
    with serving(brain) as server:
        told = {"agent": None, "model": "vllm/m", "base_url": server.url, "max_connections": 1, **changes}
        result = run_pack(quick(pack, folder, **told))
        return result, [json.dumps(asked.body).encode() for asked in server.asked]


@pytest.fixture(scope="module")
def kept(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[RunResult, list[bytes]]:
    return play(pack, tmp_path_factory.mktemp("runs") / "kept", keep_reasoning=True)


def test_requests_are_the_same_byte_for_byte_with_and_without(
    pack: Path, tmp_path: Path, kept: tuple[RunResult, list[bytes]]
) -> None:
    plain, requests = play(pack, tmp_path / "plain")
    assert requests == kept[1]
    assert len(requests) > 4
    assert not any(SECRET_THOUGHT.encode() in request for request in requests)
    assert not (plain.folder / REASONING_FILE).exists()


def test_it_stands_beside_the_records_and_nowhere_else(kept: tuple[RunResult, list[bytes]]) -> None:
    result = kept[0]
    holding = {path.name for path in result.folder.rglob("*") if path.is_file() and holds(path)}
    assert holding == {REASONING_FILE}
    for record in result.records:
        found = reasoning_by_step(result.folder, record)
        assert found == {step.index: f"{SECRET_THOUGHT}, at turn {step.index}" for step in record.steps}
        assert {step.index: len(found[step.index]) for step in record.steps} == {
            step.index: step.reply.reasoning_chars for step in record.steps
        }


def holds(path: Path) -> bool:
    return SECRET_THOUGHT.encode() in path.read_bytes()


def test_the_viewer_shows_it(pack: Path, kept: tuple[RunResult, list[bytes]]) -> None:
    folder = kept[0].folder
    run = Library([folder.parent], [pack]).run(folder.name)
    episode, record, _ = episode_of(run, kept[0].records[0].key)
    steps = episode_timeline(run, episode, record)["steps"]
    assert [step["reasoning"] for step in steps] == [f"{SECRET_THOUGHT}, at turn {step['index']}" for step in steps]


def test_a_dataset_holds_it_where_it_is_asked_for(kept: tuple[RunResult, list[bytes]], tmp_path: Path) -> None:
    runs = read_runs([kept[0].folder])
    write_dataset(runs, None, tmp_path / "plain")
    write_dataset(runs, None, tmp_path / "with", with_reasoning=True)
    assert not any(holds(path) for path in (tmp_path / "plain").rglob("*") if path.is_file())
    (table,) = (pq.read_table(path) for path in (tmp_path / "with" / "steps").glob("*.parquet"))
    assert {text.partition(",")[0] for text in table["reasoning"].to_pylist()} == {SECRET_THOUGHT}
    assert "`reasoning`" in (tmp_path / "with" / "README.md").read_text()
    asked = ["export", str(kept[0].folder), "--out", str(tmp_path / "x"), "--reasoning"]
    assert "--reasoning is for --format hf only" in str(CliRunner().invoke(app, asked).exception)


def test_a_file_that_is_no_such_file_is_named(kept: tuple[RunResult, list[bytes]], tmp_path: Path) -> None:
    shutil.copytree(kept[0].folder, tmp_path / "run")
    (tmp_path / "run" / REASONING_FILE).write_text('{"episode_id": 7}\n')
    with pytest.raises(RecordError, match=r"reasoning\.jsonl' line 1: .*or remove it"):
        read_reasoning(tmp_path / "run")


def test_what_is_too_long_or_no_utf8_is_kept_as_far_as_it_goes(pack: Path, tmp_path: Path) -> None:
    long = "x" * (MAX_CHARS + 5) + "\ud800 end"
    with serving(lambda asked: ChatAnswer(REPORT, reasoning=long)) as server:
        told = {"agent": None, "model": "vllm/m", "base_url": server.url, "keep_reasoning": True, "limit": 1}
        result = run_pack(quick(pack, tmp_path / "run", **told))
    (text,) = reasoning_by_step(result.folder, result.records[0]).values()
    assert len(text) == MAX_CHARS
    assert text.endswith("x? end")
