"""Whole runs of scripted agents on a tiny pack and the `fake` backend, through real worker processes."""

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support import faulty_agents
from tests.support.narrowing import present
from tests.support.quick_runs import quick, without_times
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.base.json_lines import AppendFile
from vigil.errors import InputError, RecordError, SettingError
from vigil.packs.pack import Pack
from vigil.records.costs import Prices
from vigil.records.record import EPISODES_FILE
from vigil.records.record_file import read_records
from vigil.runner import run as run_module
from vigil.runner import run_folder
from vigil.runner import verify_run as verifying
from vigil.runner.dry_run import estimate
from vigil.runner.plan import plan_run
from vigil.runner.progress import RunProgress
from vigil.runner.run import run_pack
from vigil.runner.run_folder import HEADER_FILE, RunFolder, host_facts, read_header
from vigil.runner.settings import RunSettings
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.runner.workers.frames import FrameStore

FIRST = ("tiny-AI-003", "tiny-AI-007", "tiny-DA-000", "tiny-DA-004")


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of eight episodes."""
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


@pytest.fixture(scope="module")
def played(pack: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of `noop` on the family PG; to be copied, not changed."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    run_pack(settings(pack, folder, families=("PG",)))
    return folder


def settings(pack: Path, log_dir: Path | None, **changes: Any) -> RunSettings:
    return quick(pack, log_dir, **{"agent": "noop", **changes})


def test_two_runs_give_the_same_records_and_both_verify(pack: Path, tmp_path: Path) -> None:
    told: list[RunProgress] = []
    first = run_pack(
        settings(pack, tmp_path / "a", agent="random", epochs=2, families=("DA", "AI")), on_progress=told.append
    )
    second = run_pack(settings(pack, tmp_path / "b", agent="random", epochs=2, families=("DA", "AI"), workers=2))
    assert first.is_complete
    assert len(first.records) == 8
    assert [without_times(row) for row in first.records] == [without_times(row) for row in second.records]
    by_epoch = {row.epoch: [step.reply.text for step in row.steps] for row in first.records[:2]}
    assert by_epoch[1] != by_epoch[2]
    assert all(step.frame_sha256 is None for row in first.records for step in row.steps)
    assert (told[0].done, told[-1].done, told[-1].total, told[-1].eta_s) == (0, 8, 8, 0.0)
    for folder in ("a", "b"):
        verification = verify_run(tmp_path / folder, VerifySettings(workers=1))
        assert verification.is_verified
        assert (verification.checked, verification.is_exact) == (8, True)


def test_the_header_says_what_was_run(pack: Path, tmp_path: Path) -> None:
    result = run_pack(settings(pack, tmp_path / "run", limit=1, seed=3))
    header = read_header(tmp_path / "run")
    assert header == result.header
    spec = header.spec
    assert (header.run_id, spec.agent, spec.agent_kind, spec.seed) == ("run", "noop", "scripted", 3)
    assert (header.simulator_version, header.renderer) == ("fake/1", "none")
    assert header.ended is not None
    assert header.host["pack_folder"] == str(pack)
    assert len(spec.episode_ids) == 1


def test_the_same_command_plays_nothing_twice(pack: Path, tmp_path: Path) -> None:
    run_pack(settings(pack, tmp_path / "run"))
    before = {name: (tmp_path / "run" / name).read_bytes() for name in (EPISODES_FILE, HEADER_FILE)}
    again = run_pack(settings(pack, tmp_path / "run", workers=2, timeout_s=99.0))
    assert {name: (tmp_path / "run" / name).read_bytes() for name in before} == before
    assert (again.resumed, again.partial_line_file, again.is_complete) == (8, None, True)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"agent": "sweep"}, r"agent: 'noop' there, 'sweep' here"),
        ({"families": ("SV",)}, r"episode_ids: .* there, .* here"),
        ({"prompt_variant": "neutral_report"}, r"profile.prompt_variant: 'default' there, 'neutral_report' here"),
        (
            {"prompt_template": "Do <TASK_INSTRUCTION>"},
            r"profile.prompt_variant: 'default' there, 'file-.{12}' here",
        ),
        ({"epochs": 2}, r"epochs: 1 there, 2 here"),
        ({"render_quality": "fast"}, r"render_quality"),
        ({"seed": 1}, r"seed: 0 there, 1 here"),
    ],
)
def test_another_run_in_the_folder_is_refused_by_name_of_the_difference(
    pack: Path, played: Path, tmp_path: Path, changes: dict[str, Any], named: str
) -> None:
    shutil.copytree(played, tmp_path / "run")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir() if path.is_file()}
    with pytest.raises(RecordError, match=named):
        run_pack(settings(pack, tmp_path / "run", **{"families": ("PG",), **changes}))
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir() if path.is_file()} == before


def test_rows_of_unknown_episodes_do_not_count_and_a_header_is_needed(pack: Path, played: Path, tmp_path: Path) -> None:
    shutil.copytree(played, tmp_path / "run")
    rows = (tmp_path / "run" / EPISODES_FILE).read_text()
    (tmp_path / "run" / EPISODES_FILE).write_text(rows.replace("tiny-PG-001", "tiny-PG-999"))
    again = run_pack(settings(pack, tmp_path / "run", families=("PG",)))
    assert any(
        "is of an episode that this run does not have (line" in note and "'tiny-PG-999'" in note for note in again.notes
    )
    assert again.is_complete
    (tmp_path / "run" / HEADER_FILE).unlink()
    with pytest.raises(RecordError, match=r"without run\.json"):
        run_pack(settings(pack, tmp_path / "run", families=("PG",)))


def test_a_torn_last_line_is_put_aside_and_its_episode_played_again(pack: Path, tmp_path: Path) -> None:
    whole = run_pack(settings(pack, tmp_path / "run"))
    path = tmp_path / "run" / EPISODES_FILE
    data = path.read_bytes()
    path.write_bytes(data[:-700])
    again = run_pack(settings(pack, tmp_path / "run"))
    assert (again.resumed, again.is_complete) == (7, True)
    assert again.partial_line_file == tmp_path / "run" / f"{EPISODES_FILE}.partial-1"
    assert again.header.started == whole.header.started
    assert present(again.header.ended) > present(whole.header.ended)
    torn = whole.records[-1].model_copy(update={"attempt": 2})
    assert [without_times(row) for row in again.records] == [
        *map(without_times, whole.records[:-1]),
        without_times(torn),
    ]
    assert present(again.partial_line_file).read_bytes() == data.splitlines(keepends=True)[-1][:-700]


def test_a_run_that_is_killed_loses_at_most_what_is_in_flight(pack: Path, tmp_path: Path) -> None:
    agent, shown, go = (tmp_path / name for name in ("agent.py", "shown", "go"))
    agent.write_text(
        "import os, sys, time\n"
        "for line in sys.stdin:\n"
        '    if \'"type": "observation"\' in line:\n'
        f"        with open({str(shown)!r}, 'a') as file: file.write('one')\n"
        f"        while os.path.getsize({str(shown)!r}) > 3 * len('one') and not os.path.exists({str(go)!r}):\n"
        "            time.sleep(0.01)\n"
        f"        print({faulty_agents.REPORT!r}, flush=True)\n"
    )
    command = f"exec:{sys.executable} {agent}"
    program = (
        "import sys; from pathlib import Path; from vigil.runner.run import run_pack; "
        "from vigil.runner.settings import RunSettings\n"
        f"run_pack(RunSettings(pack=Path({str(pack)!r}), agent={command!r}, log_dir=Path({str(tmp_path / 'run')!r}), "
        "backend='fake', workers=1, frame_interval_seconds=0.0))"
    )
    process = subprocess.Popen([sys.executable, "-c", program])
    path = tmp_path / "run" / EPISODES_FILE
    wait_until(lambda: path.is_file() and path.read_bytes().count(b"\n") >= 3, "the end of the third episode")
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    go.touch()
    survived = [row.key for row in read_records(path)]
    assert len(survived) == 3
    again = run_pack(settings(pack, tmp_path / "run", agent=command))
    assert (again.resumed, again.is_complete) == (len(survived), True)
    assert [row.key for row in read_records(path)][: len(survived)] == survived
    assert len({row.key for row in read_records(path)}) == len(read_records(path)) == 8


def test_a_run_that_was_killed_before_its_header_was_written_starts_anew(pack: Path, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / EPISODES_FILE).touch()
    (tmp_path / "run" / f"{HEADER_FILE}.123").write_text('{"schema_ver')
    assert run_pack(settings(pack, tmp_path / "run", limit=1)).is_complete


def test_a_run_goes_on_while_its_header_says_no_end(pack: Path, tmp_path: Path) -> None:
    run_pack(settings(pack, tmp_path / "run", limit=2))
    path = tmp_path / "run" / EPISODES_FILE
    path.write_bytes(path.read_bytes().splitlines(keepends=True)[0])
    ended = []
    wanted = settings(pack, tmp_path / "run", limit=2)
    run_pack(wanted, on_progress=lambda progress: ended.append(read_header(tmp_path / "run").ended))
    assert ended == [None, None]


def test_a_run_grows_and_what_was_played_stays(pack: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    run_pack(settings(pack, folder, limit=2))
    rows = (folder / EPISODES_FILE).read_bytes()
    grown = run_pack(settings(pack, folder, limit=5))
    assert (grown.resumed, len(grown.records), grown.is_complete) == (2, 5, True)
    assert (folder / EPISODES_FILE).read_bytes().startswith(rows)
    whole = run_pack(settings(pack, folder))
    assert (whole.resumed, len(whole.records)) == (5, 8)
    header = read_header(folder)
    assert header == whole.header
    assert [(session.rows_before, session.episodes) for session in header.resumed] == [(2, 5), (5, 8)]
    fresh = run_pack(settings(pack, tmp_path / "fresh"))
    assert fresh.header.spec == header.spec
    assert [(row.key, row.initial, row.worlds) for row in whole.records] == [
        (row.key, row.initial, row.worlds) for row in fresh.records
    ]
    with pytest.raises(RecordError, match="episode_ids: 8 of them there, 5 of them here"):
        run_pack(settings(pack, folder, limit=5))
    with pytest.raises(RecordError, match="seed"):
        run_pack(settings(pack, folder, limit=8, seed=4))


def test_a_run_that_never_started_leaves_nothing(pack: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="cannot be started"):
        run_pack(settings(pack, tmp_path / "run", agent="exec:/no/such/program"))
    assert not (tmp_path / "run").exists()


def test_the_header_says_with_what_the_rows_after_a_resumption_were_played(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_folder, "source_state", lambda: ("aaaa", False))
    run_pack(settings(pack, tmp_path / "run"))
    rows = (tmp_path / "run" / EPISODES_FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / "run" / EPISODES_FILE).write_bytes(b"".join(rows[:5]))
    monkeypatch.setattr(run_folder, "source_state", lambda: ("bbbb", True))
    monkeypatch.setattr(run_folder, "host_facts", lambda: {"machine": "another"})
    header = run_pack(settings(pack, tmp_path / "run")).header
    (later,) = header.resumed
    assert (header.commit, header.is_dirty, header.renderer) == ("aaaa", False, "none")
    assert (later.commit, later.is_dirty, later.renderer, later.rows_before) == ("bbbb", True, "none", 5)
    assert header.hosts[1] == {"machine": "another"}
    assert not verify_run(tmp_path / "run", VerifySettings(workers=1, limit=1)).is_exact


@pytest.mark.parametrize("name", ["machine", "python", "numpy", "processor"])
def test_numbers_are_compared_to_the_last_bit_only_where_the_run_was_made(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    run_pack(settings(pack, tmp_path / "run"))
    here = host_facts()
    assert verify_run(tmp_path / "run", VerifySettings(workers=1, limit=1)).is_exact
    monkeypatch.setattr(verifying, "host_facts", lambda: here | {name: "another"})
    assert not verify_run(tmp_path / "run", VerifySettings(workers=1, limit=1)).is_exact


def test_a_processor_is_told_by_its_name_and_by_what_it_can_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told = []
    for flags in ("sse avx2", "avx2 sse", "sse avx2 avx512f"):
        one = f"processor\t: 0\nmodel name\t: Fast One\nflags\t\t: {flags}\n"
        (tmp_path / "cpuinfo").write_text(f"{one}\nprocessor\t: 1\n")
        monkeypatch.setattr(run_folder, "CPU_FACTS", tmp_path / "cpuinfo")
        told.append(host_facts()["processor"])
    assert told[0] == told[1] != told[2]
    assert all(each.startswith("Fast One ") for each in told)


def test_a_run_of_which_nothing_was_played_gives_way_to_another(pack: Path, tmp_path: Path) -> None:
    mistyped = settings(pack, tmp_path / "run", agent="exec:/no/such/program")
    (tmp_path / "run").mkdir()
    with pytest.raises(SettingError, match="cannot be started"):
        run_pack(mistyped)
    assert read_header(tmp_path / "run").spec.agent == "exec:/no/such/program"
    assert run_pack(settings(pack, tmp_path / "run", limit=1)).header.spec.agent == "noop"
    with pytest.raises(RecordError, match="holds another run: agent: 'noop' there"):
        run_pack(mistyped)


def test_a_folder_that_cannot_be_made_or_written_is_named(pack: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match=r"file/run' cannot be made: Not a directory\. Choose another place"):
        run_pack(settings(pack, tmp_path / "file" / "run"))
    (tmp_path / "run" / HEADER_FILE).mkdir(parents=True)
    with pytest.raises(RecordError, match=r"Cannot write to '.*run\.json': Is a directory"):
        run_pack(settings(pack, tmp_path / "run"))


def test_a_full_disk_stops_the_run(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    really = AppendFile._write

    def fail(file: AppendFile, data: bytes) -> None:
        if file.path.name == EPISODES_FILE:
            raise OSError(28, "No space left on device")
        really(file, data)

    monkeypatch.setattr(AppendFile, "_write", fail)
    with pytest.raises(RecordError, match=r"episodes\.jsonl': No space left on device.*same command again"):
        run_pack(settings(pack, tmp_path / "run", limit=1))


def test_two_processes_cannot_write_one_run(pack: Path, tmp_path: Path) -> None:
    wanted = settings(pack, tmp_path / "run", limit=1)
    folder = RunFolder.create_or_resume(tmp_path / "run", plan_run(wanted).spec, Pack.load(pack).episodes)
    with pytest.raises(RecordError, match="being written by another process"):
        run_pack(wanted)
    folder.close()
    assert run_pack(wanted).is_complete


@pytest.mark.parametrize("deed", ["exit", "hang", "raise"])
def test_a_worker_that_fails_once_is_restarted_and_its_episode_played_again(
    pack: Path, tmp_path: Path, deed: str
) -> None:
    result = run_pack(
        settings(
            pack,
            tmp_path / "run",
            agent=f"{deed}:{tmp_path}",
            agent_factory=faulty_agents.make,
            timeout_s=10.0 if deed == "hang" else HANGS_AFTER_S,
            episode_ids=FIRST,
        )
    )
    assert result.is_complete
    assert {row.episode_id: row.attempt for row in result.records if row.attempt > 1} == {"tiny-DA-000": 2}
    assert result.header.is_privileged
    pids = {path.read_text() for path in tmp_path.glob(f"*.{deed}")}
    assert len(pids) == (1 if deed == "raise" else 2)


def test_what_keeps_failing_is_an_error_row_and_played_again_by_the_same_command(pack: Path, tmp_path: Path) -> None:
    told: list[RunProgress] = []
    wanted = settings(
        pack, tmp_path / "run", agent=f"raise!:{tmp_path}", agent_factory=faulty_agents.make, episode_ids=FIRST
    )
    result = run_pack(wanted, on_progress=told.append)
    assert (result.errors, result.is_complete, len(result.records)) == (1, False, 4)
    row = next(row for row in result.records if row.end == "error")
    assert (row.episode_id, row.attempt, present(row.error).boundary) == ("tiny-DA-000", 3, "worker")
    assert "ZeroDivisionError: a fault of the program's" in present(row.error).message
    assert (told[-1].done, told[-1].errors) == (3, 1)
    again = run_pack(wanted)
    assert (again.resumed, again.errors) == (3, 1)
    rows = read_records(tmp_path / "run" / "episodes.jsonl")
    assert [row.episode_id for row in rows if row.end == "error"] == ["tiny-DA-000"] * 2


def test_a_worker_that_keeps_dying_costs_one_episode(pack: Path, tmp_path: Path) -> None:
    factory = faulty_agents.make
    result = run_pack(
        settings(pack, tmp_path / "run", agent=f"exit!:{tmp_path}", agent_factory=factory, episode_ids=FIRST)
    )
    row = next(row for row in result.records if row.end == "error")
    error = present(row.error)
    assert (result.errors, row.episode_id, row.initial, error.boundary) == (1, "tiny-DA-000", None, "worker")
    assert "exit code 9" in error.message


def test_a_run_stops_when_nothing_works(pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_module, "MAX_ERRORS_IN_A_ROW", 2)
    with pytest.raises(run_module.InfrastructureError, match="2 episodes in a row ended as an error"):
        run_pack(settings(pack, tmp_path / "run", agent="exec:false"))
    assert len(read_records(tmp_path / "run" / "episodes.jsonl")) == 2


def test_frames_are_kept_by_content_when_asked(pack: Path, tmp_path: Path) -> None:
    result = run_pack(settings(pack, tmp_path / "run", agent="sweep", limit=2, save_frames=True))
    store = FrameStore(tmp_path / "run" / "frames")
    hashes = [step.frame_sha256 for row in result.records for step in row.steps]
    assert None not in hashes
    for sha256 in hashes:
        kept = store.frame(sha256)
        assert kept is not None
        assert store.save(kept[1]) == sha256
    assert len(list((tmp_path / "run" / "frames").rglob("*.png"))) == len(set(hashes))
    found = verify_run(tmp_path / "run", VerifySettings(workers=1, frames=True))
    assert (found.is_verified, found.frames) == (True, len(hashes))
    assert verify_run(tmp_path / "run", VerifySettings(workers=1, limit=1)).frames == 0


def test_a_run_at_which_nobody_looked_has_no_frames_to_verify(played: Path) -> None:
    found = verify_run(played, VerifySettings(workers=1, frames=True))
    assert (found.is_verified, found.frames) == (True, 0)


def test_verification_finds_what_was_altered(pack: Path, tmp_path: Path) -> None:
    run_pack(settings(pack, tmp_path / "run", agent="forward", families=("DA",)))
    path = tmp_path / "run" / EPISODES_FILE
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rows[0]["steps"][0]["effect"]["moved_m"] += 0.25
    rows[1]["steps"][1]["world"]["agent"]["position"][2] += 0.0005
    rows[1]["steps"][2]["world"]["agent"]["rotation"] += 360.005
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    exact = verify_run(tmp_path / "run", VerifySettings(workers=1))
    assert {difference.fact for difference in exact.differences} == {
        "effect.moved_m",
        "world.agent.position.2",
        "world.agent.rotation",
    }
    tolerant = verify_run(tmp_path / "run", VerifySettings(workers=1, exact=False))
    assert [str(difference) for difference in tolerant.differences] == [
        "Episode 'tiny-DA-000' (epoch 1) step 1: effect.moved_m: recorded 1.0, found 0.75"
    ]


@pytest.mark.parametrize(
    "changes",
    [
        {"agent": None},
        {"model": "openai/m"},
        {"agent": "nobody"},
        {"agent": "exec:"},
        {"backend": "unity"},
        {"epochs": 0},
        {"workers": 0},
        {"limit": 0},
        {"families": ("XX",)},
        {"episode_ids": ("tiny-PG-00",)},
        {"pack": "no-such-pack"},
        {"asset_database": Path("/no/such/file")},
        {"agent": None, "model": "nameless"},
        {"profile": "pure_depth"},
        {"prompt_variant": "shouting"},
        {"prompt_template": "no instruction"},
        {"prompt_template": "<TASK_INSTRUCTION>", "prompt_variant": "neutral_report"},
        {"image_format": "gif"},
    ],
)
def test_settings_that_make_no_sense_are_refused_before_anything_is_written(
    pack: Path, tmp_path: Path, changes: dict[str, Any]
) -> None:
    with pytest.raises(InputError):
        run_pack(replace(settings(pack, tmp_path / "run"), **changes))
    assert not (tmp_path / "run").exists()


def test_without_a_folder_the_same_settings_find_the_same_one(pack: Path) -> None:
    def folder(**changes: Any) -> Path:
        wanted = settings(pack, None, **changes)
        return plan_run(wanted).execution.folder

    assert folder() == folder(workers=2)
    assert folder().parent == Path("runs")
    assert folder().name.startswith("tiny-noop-")
    assert len({folder(), folder(agent="sweep"), folder(limit=1), folder(seed=1)}) == 4


@pytest.mark.parametrize(
    ("model", "base_url", "environment", "kept"),
    [
        ("openai/m", "http://me:secret@host:8000/v1?key=k", None, "http://host:8000/v1"),
        ("openai/m", None, "http://me:secret@host:8000/v1", "http://host:8000/v1"),
        ("anthropic/m", None, "http://host:8000/v1", None),
    ],
)
def test_the_header_says_where_the_model_is_served_and_not_how_to_log_in(
    pack: Path, monkeypatch: pytest.MonkeyPatch, model: str, base_url: str | None, environment: str | None, kept: str
) -> None:
    monkeypatch.delenv("OPENAI_BASE_URL", raising=False)
    if environment is not None:
        monkeypatch.setenv("OPENAI_BASE_URL", environment)
    assert plan_run(settings(pack, None, agent=None, model=model, base_url=base_url)).spec.base_url == kept


def test_a_dry_run_bounds_calls_and_tokens(pack: Path) -> None:
    bounds = estimate(plan_run(settings(pack, None, agent=None, model="openai/m", epochs=2)))
    assert bounds.episodes == 16
    assert bounds.calls == (16, 2 * 2 * (5 + 12 + 5 + 25))
    assert bounds.input_tokens[0] < bounds.input_tokens[1]
    low, high = bounds.cost(Prices(input=1.0, output=10.0))
    assert 0 < low < high


def test_a_dry_run_honours_the_limit_on_tokens_and_thinking(pack: Path) -> None:
    def most(model: str = "vllm/m", **changes: Any) -> float:
        bounds = estimate(plan_run(settings(pack, None, agent=None, model=model, **changes)))
        return bounds.output_tokens[1] / bounds.calls[1]

    assert most() == 400
    assert most(max_tokens=8192) == 8192
    assert most(max_tokens=30) == 30
    assert most(thinking="on") == most(reasoning_effort="high") == most("vllm/Qwen3-VL-8B-Thinking") == 8400
    assert most(thinking="on", max_tokens=2000) == 2000
    assert most("vllm/DeepSeek-R1") == most("vllm/Qwen3-VL-8B-Thinking", thinking="off") == 8400
    assert most(thinking="off") == most(reasoning_effort="none") == 400
    template = {"chat_template_kwargs": {"enable_thinking": True}}
    for body in (template, {"thinking": {"type": "enabled"}}, {"reasoning": {"effort": "high"}}):
        assert most(extra_body=body) == 8400
    for body in ({"enable_thinking": False}, {"thinking": {"type": "disabled"}}, {"reasoning": {"enabled": False}}):
        assert most(extra_body=body) == 400
    assert most(extra_body={"max_completion_tokens": 900}) == most(extra_body={"max_tokens": 900}) == 900
    plain, thinks = (
        estimate(plan_run(settings(pack, None, agent=None, model="vllm/m", thinking=one))) for one in ("off", "on")
    )
    assert plain.input_tokens == thinks.input_tokens, "reasoning enters no history"


@pytest.mark.usefixtures("started_workers")
def test_a_simulator_that_cannot_start_stops_the_run(
    pack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy.py").write_text("raise ImportError('no numpy today')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(run_module.InfrastructureError, match="no numpy today"):
        run_pack(settings(pack, tmp_path / "run"))


def test_a_setting_error_in_the_worker_reaches_the_user(pack: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="cannot be started"):
        run_pack(settings(pack, tmp_path / "run", agent="exec:/no/such/program"))
