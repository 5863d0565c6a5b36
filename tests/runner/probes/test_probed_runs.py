"""Probes of real runs: real HTTP, real workers; the episodes must not notice them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, failure, serving
from tests.support.inspect_marks import INSPECT
from tests.support.quick_runs import quick, without_times
from tests.support.tiny_pack import tiny_pack
from vigil.analysis.measures.rows import read_runs
from vigil.errors import RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.records.probe import QUESTIONS, ProbeAnswer
from vigil.records.probe_file import PROBES_FILE, read_probes
from vigil.records.record import Shard, read_header
from vigil.runner.dry_run import estimate
from vigil.runner.merge import merge_runs
from vigil.runner.plan import plan_run
from vigil.runner.probes import FinishedProbeSettings, plan_probing, probe_run
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings
from vigil.scoring.probe_schedule import parse_schedule

pytestmark = INSPECT
BELIEF = '{"done": false, "report": "fail", "sure": 3, "evidence": "Nothing has moved."}'
EPISODES = ("tiny-DA-000", "tiny-AI-003")
EVERY = parse_schedule("every")


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 4)
    return folder


def settings(pack: Path, url: str, log_dir: Path, **changes: Any) -> RunSettings:
    fields = {"model": "openai/loopback", "base_url": url, "max_connections": 1, "retries": 1, "preflight": False}
    return quick(pack, log_dir, **{"episode_ids": EPISODES, **fields, **changes})


def framing_of(asked: ChatRequest) -> str:
    """Return the framing of a probe; empty for a request of a step."""
    return next((name for name, text in QUESTIONS.items() if asked.texts[-1].endswith(text)), "")


def turn_of(asked: ChatRequest) -> int:
    return (len(asked.messages) - 2) // 2 + 1


def brain(asked: ChatRequest) -> ChatAnswer:
    if framing_of(asked):
        return ChatAnswer(BELIEF)
    return ChatAnswer(REPORT if turn_of(asked) >= 3 else [LOOK, "prose"][turn_of(asked) - 1])


def comparable(asked: ChatRequest) -> bytes:
    """Return the whole request without the server's port and the number that Inspect draws for each request."""
    lines = asked.raw.split(b"\n")
    return b"\n".join(line for line in lines if not line.lower().startswith((b"host:", b"x-irid:")))


def run_probed(pack: Path, folder: Path, **changes: Any) -> tuple[RunResult, list[ChatRequest]]:
    with serving(brain) as server:
        result = run_pack(settings(pack, server.url, folder, **changes))
    return result, server.asked


def test_the_requests_of_the_steps_are_the_same_to_the_byte_with_and_without_probes(pack: Path, tmp_path: Path) -> None:
    plain, without = run_probed(pack, tmp_path / "plain")
    probed, everything = run_probed(pack, tmp_path / "probed", probe=EVERY, probe_framing="both")
    steps = [asked for asked in everything if not framing_of(asked)]
    assert list(map(comparable, steps)) == list(map(comparable, without))
    assert [without_times(row) for row in probed.records] == [without_times(row) for row in plain.records]
    assert read_header(tmp_path / "probed").spec.sha256 == read_header(tmp_path / "plain").spec.sha256
    probes = [asked for asked in everything if framing_of(asked)]
    assert len(probes) == 2 * len(steps)
    for asked in probes:
        *earlier, last = asked.messages
        bare = json.dumps({**asked.body, "messages": [*earlier, {**last, "content": last["content"][:-1]}]})
        assert bare in {json.dumps(step.body) for step in steps}
        assert [part["type"] for part in last["content"]] == ["text", "image_url", "text"]


def test_a_probe_is_a_record_of_its_own(pack: Path, tmp_path: Path) -> None:
    result, _ = run_probed(pack, tmp_path / "run", probe=EVERY)
    table = read_probes(tmp_path / "run", result.header.sha256)
    assert {key[:2] for key in table.rows} == {(episode_id, 1) for episode_id in EPISODES}
    assert [row.step for row in table.of(result.records[0])] == [1, 2, 3]
    for record in result.records:
        for row in table.of(record):
            assert row.answer == ProbeAnswer(done=False, report="fail", sure=3, evidence="Nothing has moved.")
            assert row.frame_sha256 == record.steps[row.step - 1].frame_sha256
    assert (table.tokens.input, table.tokens.reported) == (600, 6)
    assert result.tokens.total.reported == 6


def test_a_finished_run_is_asked_what_a_probed_run_was_asked(pack: Path, tmp_path: Path) -> None:
    _, during = run_probed(pack, tmp_path / "probed", probe=EVERY)
    _, _ = run_probed(pack, tmp_path / "plain")
    with serving(brain) as server:
        wanted = FinishedProbeSettings(base_url=server.url, workers=1, max_connections=1)
        probing = plan_probing(tmp_path / "plain", wanted)
        assert probing.probes == 6
        table = probe_run(probing, wanted)
        again = plan_probing(tmp_path / "plain", wanted)
        assert probe_run(again, wanted).rows == table.rows
    probes = [asked for asked in during if framing_of(asked)]
    assert sorted(map(comparable, server.asked)) == sorted(map(comparable, probes))
    assert (again.probes, len(table.rows), table.errors) == (0, 6, 0)


def test_a_server_that_fails_on_probes_leaves_the_episodes_whole(pack: Path, tmp_path: Path) -> None:
    is_out = True

    def out(asked: ChatRequest) -> ChatAnswer:
        return failure(503, "no beliefs today") if framing_of(asked) and is_out else brain(asked)

    with serving(out) as server:
        wanted = settings(pack, server.url, tmp_path / "run", probe=EVERY, retries=0)
        first = run_pack(wanted)
        assert first.is_complete
        assert first.probes is not None
        assert (len(first.probes.rows), first.probes.errors) == (5, 5)  # then nothing more is asked
        assert "no beliefs today" in str(next(iter(first.probes.rows.values())).error)
        is_out = False
        again = run_pack(wanted)
    plain, _ = run_probed(pack, tmp_path / "plain")
    assert [without_times(row) for row in first.records] == [without_times(row) for row in plain.records]
    assert again.probes is not None
    assert (again.resumed, len(again.probes.rows), again.probes.errors) == (2, 6, 0)


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (ChatAnswer(REPORT), "is_an_action"),
        (ChatAnswer("I would rather not."), "no_object"),
        (ChatAnswer(None, refusal="No."), "no_object"),
        (failure(400, "the prompt is flagged by our content policy"), "provider_rejected"),
    ],
)
def test_what_is_not_an_answer_is_recorded_and_is_no_step(
    pack: Path, tmp_path: Path, answer: ChatAnswer, reason: str
) -> None:
    with serving(lambda asked: answer if framing_of(asked) else brain(asked)) as server:
        one = settings(pack, server.url, tmp_path / "run", probe=parse_schedule("at-report"), episode_ids=EPISODES[:1])
        result = run_pack(one)
        resumed = run_pack(one)
    assert [len(record.steps) for record in result.records] == [3]
    assert result.probes is not None
    assert resumed.probes is not None
    (row,) = result.probes.rows.values()
    assert (row.step, row.answer, row.invalid and row.invalid.reason) == (3, None, reason)
    assert resumed.probes.rows == result.probes.rows  # it stays missing


def test_probes_of_an_interrupted_file_and_of_another_question_are_handled(pack: Path, tmp_path: Path) -> None:
    result, _ = run_probed(pack, tmp_path / "run", probe=EVERY)
    file = tmp_path / "run" / PROBES_FILE
    lines = file.read_text().splitlines(keepends=True)
    other = json.dumps({**json.loads(lines[1]), "question_sha256": "0" * 64}) + "\n"
    file.write_text(lines[0] + other + lines[2][:40])
    with serving(brain) as server:
        wanted = FinishedProbeSettings(base_url=server.url, workers=1)
        table = probe_run(plan_probing(tmp_path / "run", wanted), wanted)
    assert (len(server.asked), len(table.rows), table.foreign) == (5, 6, 1)
    assert (tmp_path / "run" / f"{PROBES_FILE}.partial-1").read_text() == lines[2][:40]
    (run,) = read_runs([tmp_path / "run"])
    assert "1 rows of probes.jsonl are of another run or another question, and do not count." in " ".join(run.faults)
    file.write_text(lines[0].replace('"sure":3', '"sure":33'))
    with pytest.raises(RecordError, match=r"line 1: answer.sure.*less than or equal to 20"):
        read_probes(tmp_path / "run", result.header.sha256)


def test_a_dry_run_counts_the_probes(pack: Path, tmp_path: Path) -> None:
    plain = estimate(plan_run(settings(pack, "http://127.0.0.1:9/v1", tmp_path / "run")))
    budgets = [Pack.load(pack).episode(name).max_steps for name in EPISODES]
    for text, framing, least, most in [
        ("every", "both", 4, 2 * sum(budgets)),
        ("10", "state", 2, sum(-(-budget // 10) for budget in budgets)),
        ("at-goal", "state", 0, 2),
        ("at-goal,at-report", "doubt", 2, 4),
    ]:
        wanted = settings(
            pack, "http://127.0.0.1:9/v1", tmp_path / "run", probe=parse_schedule(text), probe_framing=framing
        )
        found = estimate(plan_run(wanted))
        assert found.probes == (least, most)
        assert found.calls == (plain.calls[0] + least, plain.calls[1] + most)
        assert found.input_tokens[1] > plain.input_tokens[1]


def test_only_a_model_can_be_asked(pack: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="--probe asks a model"):
        quick(pack, None, agent="noop", probe=EVERY)
    run_pack(quick(pack, tmp_path / "noop", agent="noop", episode_ids=EPISODES[:1]))
    with pytest.raises(RecordError, match="was played by 'noop', which is not a model"):
        plan_probing(tmp_path / "noop", FinishedProbeSettings())


def test_another_model_is_refused_unless_forced(pack: Path, tmp_path: Path) -> None:
    run_probed(pack, tmp_path / "run", episode_ids=EPISODES[:1])
    with serving(lambda asked: replace(brain(asked), model="another")) as server:
        wanted = FinishedProbeSettings(base_url=server.url, workers=1)
        with pytest.raises(RecordError, match="answers as 'another' now"):
            probe_run(plan_probing(tmp_path / "run", wanted), wanted)
        forced = replace(wanted, force=True)
        assert len(probe_run(plan_probing(tmp_path / "run", forced), forced).rows) == 3


def test_probes_of_shards_are_joined_with_their_runs(pack: Path, tmp_path: Path) -> None:
    shards = [tmp_path / "1", tmp_path / "2"]
    for number, folder in enumerate(shards, start=1):
        run_probed(pack, folder, probe=parse_schedule("at-report"), shard=Shard(index=number, of=2))
    header = merge_runs(tmp_path / "whole", shards)
    table = read_probes(tmp_path / "whole", header.sha256)
    assert ({key.episode_id for key in table.rows}, table.foreign) == (set(EPISODES), 0)
