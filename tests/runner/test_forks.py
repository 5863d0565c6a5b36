"""Forks: plays of a recorded run, continued by another agent."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support.chat_server import REPORT, ChatAnswer, ChatRequest, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import claim, quick
from tests.support.tiny_pack import tiny_pack
from vigil.errors import RecordError, SettingError, VigilError
from vigil.packs.pack import Pack
from vigil.records.record import EpisodeRecord, read_header
from vigil.runner.forks import parse_at
from vigil.runner.plan import plan_run
from vigil.runner.probes import FinishedProbeSettings, plan_probing
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.goal_check import check

WALK = '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 1}}'
CLICK = '{"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": 320, "y": 240}}'
EPISODE = "tiny-DA-000"


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 4)
    return folder


def brain(asked: ChatRequest) -> ChatAnswer:
    turn = (len(asked.messages) - 2) // 2 + 1
    return ChatAnswer(REPORT if turn >= 5 else [WALK, "prose", CLICK, WALK][turn - 1])


@pytest.fixture(scope="module")
def source(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """A run of a model, five steps in each episode, one of them invalid."""
    with serving(brain) as server:
        return run_pack(asked_at(server.url, pack, tmp_path_factory.mktemp("runs") / "source"))


def asked_at(url: str, pack: Path, folder: Path, **changes: Any) -> Any:
    fields = {"model": "openai/loopback", "base_url": url, "max_connections": 1, "retries": 0, "preflight": False}
    return quick(pack, folder, **{**fields, **changes})


def same_steps(fork: EpisodeRecord, original: EpisodeRecord, count: int) -> bool:
    first, second = ([step.model_dump_json() for step in record.steps[:count]] for record in (fork, original))
    return first == second and len(first) == count


pytestmark = INSPECT


@pytest.mark.parametrize("step", [0, 1, 3, 4])
def test_a_fork_equals_the_original_up_to_the_step_to_the_byte(
    pack: Path, source: RunResult, tmp_path: Path, step: int
) -> None:
    one = quick(pack, tmp_path / "fork", agent="noop", fork_from=source.folder, fork_at=step, frame_interval_seconds=0)
    result = run_pack(one)
    assert result.is_complete
    for fork, original in zip(result.records, source.records, strict=True):
        assert same_steps(fork, original, step)
        assert fork.initial == original.initial
        assert fork.fork is not None
        assert (fork.fork.step, fork.fork.run_sha256, fork.fork.epoch) == (step, source.header.sha256, 1)
        assert len(fork.steps) > step
    assert verify_run(tmp_path / "fork", VerifySettings(workers=1, frames=True)).is_verified
    assert verify_run(tmp_path / "fork", VerifySettings(records_only=True)).is_verified


def test_another_model_goes_on_with_the_history_of_the_first(pack: Path, source: RunResult, tmp_path: Path) -> None:
    with serving(lambda _: ChatAnswer(REPORT)) as server:
        changes = {"fork_from": source.folder, "fork_at": 3, "profile": "action_feedback", "episode_ids": (EPISODE,)}
        wanted = asked_at(server.url, pack, tmp_path / "fork", coordinates="normalized_1000", **changes)
        record = run_pack(wanted).records[0]
        assert run_pack(wanted).resumed == 1
    (asked,) = server.asked
    assert asked.texts[2:-1:2] == [WALK, "prose", CLICK]
    calm = {"too_far": False, "path_blocked": False}
    stubs = [json.loads(text).get("feedback") for text in asked.texts[1::2]]
    assert stubs == [None, calm, calm, calm]
    assert (len(record.steps), record.end) == (4, "report")
    original = next(each for each in source.records if each.episode_id == EPISODE)
    assert same_steps(record, original, 3)  # the click was in pixels, and stays where it was
    assert record.tokens.reported == 1
    assert verify_run(tmp_path / "fork", VerifySettings(workers=1, frames=True)).is_verified
    assert verify_run(tmp_path / "fork", VerifySettings(records_only=True)).is_verified
    assert plan_probing(tmp_path / "fork", FinishedProbeSettings()).probes == 1  # not of the first model's steps


def test_at_goal_every_play_that_attained_it_is_continued(pack: Path, source: RunResult, tmp_path: Path) -> None:
    episodes = {episode.id: episode for episode in Pack.load(pack).episodes}
    attained = {row.episode_id: check(episodes[row.episode_id].goal, row).first_row for row in source.records}
    expected = {name: step for name, step in attained.items() if step is not None and step < 5}
    assert expected
    assert len(expected) < len(attained)
    result = run_pack(quick(pack, tmp_path / "fork", agent="noop", fork_from=source.folder, fork_at="goal"))
    assert {row.episode_id: row.replayed_steps for row in result.records} == expected


def test_a_program_goes_on_from_the_frame_of_the_fork(pack: Path, source: RunResult, tmp_path: Path) -> None:
    program = tmp_path / "agent.py"
    program.write_text(
        "import json, sys\n"
        "for line in sys.stdin:\n"
        "    if json.loads(line)['type'] == 'observation':\n"
        f"        print({REPORT!r}, flush=True)\n"
    )
    wanted = quick(
        pack, tmp_path / "fork", agent=f"exec:python {program}", fork_from=source.folder, fork_at=2,
        episode_ids=(EPISODE,),
    )  # fmt: skip
    (record,) = run_pack(wanted).records
    assert (len(record.steps), record.end, record.steps[2].frame_sha256 is not None) == (3, "report", True)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (
            {"fork_at": 5, "episode_ids": (EPISODE,)},
            RecordError,
            "has only 5 steps, so it cannot be continued after step 5",
        ),
        ({"fork_at": 9}, RecordError, "No play of run 'source' can be continued at 9"),
        ({"fork_at": "goal", "episode_ids": ("tiny-AI-003",)}, RecordError, "its goal was never attained"),
        ({"fork_at": None}, SettingError, "--from and --at belong together"),
        (
            {"fork_at": 1, "backend": "mujoco"},
            SettingError,
            "was played with simulator 'fake', but the new run has 'muj",
        ),
        ({"fork_at": 1, "render_quality": "fast"}, SettingError, "set --render-quality"),
    ],
)
def test_what_cannot_be_continued_is_refused_with_the_reason(
    pack: Path, source: RunResult, tmp_path: Path, changes: dict[str, Any], error: type[VigilError], message: str
) -> None:
    with pytest.raises(error, match=message):
        plan_run(quick(pack, tmp_path / "fork", agent="noop", fork_from=source.folder, **changes))


def test_a_run_of_other_rules_or_of_another_pack_is_refused(pack: Path, source: RunResult, tmp_path: Path) -> None:
    other = tmp_path / "other"
    tiny_pack(other, 2)
    with pytest.raises(VigilError, match="was played on pack 'tiny' with SHA-256"):
        plan_run(quick(other, tmp_path / "fork", agent="noop", fork_from=source.folder, fork_at=1))
    fields = {"agent": "noop", "fork_from": source.folder, "fork_at": 1, "backend": "fake"}
    with pytest.raises(VigilError, match="was played on pack 'tiny' with SHA-256"):
        plan_run(RunSettings(pack="".join(("star", "ter")), **fields))
    assert plan_run(RunSettings(**fields)).pack.manifest.name == "tiny"  # no pack is given: that of the run
    old = tmp_path / "old"
    old.mkdir()
    header = json.loads((source.folder / "run.json").read_text())
    header["spec"]["versions"]["rules"] -= 1
    (old / "run.json").write_text(json.dumps(header))
    (old / "episodes.jsonl").write_bytes((source.folder / "episodes.jsonl").read_bytes())
    claim(old)
    with pytest.raises(RecordError, match=r"was played with other versions: .*rules"):
        plan_run(quick(pack, tmp_path / "fork", agent="noop", fork_from=old, fork_at=1))


def test_a_play_that_cannot_be_repeated_exactly_is_refused(pack: Path, source: RunResult, tmp_path: Path) -> None:
    moved = tmp_path / "moved"
    moved.mkdir()
    (moved / "run.json").write_bytes((source.folder / "run.json").read_bytes())
    rows = [json.loads(line) for line in (source.folder / "episodes.jsonl").read_text().splitlines()]
    for row in rows:
        row["steps"][0]["world"]["agent"]["position"][0] += 0.001
    (moved / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    with pytest.raises(RecordError, match="Step 1 of the record was carried out again, but differs in world"):
        run_pack(quick(pack, tmp_path / "fork", agent="noop", fork_from=moved, fork_at=2))


def test_rows_of_a_fork_belong_to_its_source(pack: Path, source: RunResult, tmp_path: Path) -> None:
    wanted = quick(pack, tmp_path / "fork", agent="noop", fork_from=source.folder, fork_at=1, episode_ids=(EPISODE,))
    run_pack(wanted)
    header = read_header(tmp_path / "fork")
    assert header.spec.fork is not None
    assert header.notes[-1] == "Run 'fork' continues plays of run 'source' after step 1."
    with pytest.raises(RecordError, match=r"fork.at: 1 there, 2 here"):
        run_pack(replace(wanted, fork_at=2))
    file = tmp_path / "fork" / "episodes.jsonl"
    row = json.loads(file.read_text())
    del row["fork"]
    file.write_text(json.dumps(row) + "\n")
    again = run_pack(wanted)
    assert "continues another play than its run says" in " ".join(again.notes)
    assert again.is_complete


def test_a_step_is_read_from_the_text_of_the_option() -> None:
    assert (parse_at("goal"), parse_at(" 7 ")) == ("goal", 7)
    for text in ("-1", "end", "1.5", "", "٣"):
        with pytest.raises(SettingError, match="is not a step"):
            parse_at(text)
