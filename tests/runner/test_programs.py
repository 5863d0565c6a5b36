"""Whole runs of programs that end, hang, or end what runs them: nothing is to be gained by it."""

import json
import subprocess
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from tests.support.faulty_agents import REPORT
from tests.support.narrowing import present
from tests.support.quick_runs import quick
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import wait_until
from vigil.analysis.measures.models import agent_of
from vigil.cli.scores import run_label
from vigil.errors import RecordError
from vigil.records.record_file import read_records
from vigil.runner.attempts import ATTEMPTS_FILE, AttemptLog
from vigil.runner.run import RunResult, run_pack
from vigil.runner.run_folder import read_header
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.saved_run import read_run
from vigil.scoring.summary import score_run, summarise

TURN = '{"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 90}}'
HEAD = f"""
import json, os, pathlib, signal, sys, time
TURN, REPORT = {TURN!r}, {REPORT!r}
def say(line): print(line, flush=True)
notes = pathlib.Path(sys.argv[1])
seen = 0
for line in sys.stdin:
    if json.loads(line)["type"] == "start":
        seen = 0
        continue
    seen += 1
    with notes.open("a") as file: file.write("frame\\n")
    frames = len(notes.read_text().splitlines())
"""


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack of one episode, AI, with 25 steps and 8 invalid actions."""
    folder = tmp_path_factory.mktemp("packs") / "tiny"
    tiny_pack(folder, 8)
    return folder


def played(pack: Path, tmp_path: Path, body: str, **changes: Any) -> RunResult:
    agent = tmp_path / "agent.py"
    agent.write_text(HEAD + "".join(f"    {line}\n" for line in body.splitlines()))
    fields = {"agent": f"exec:{sys.executable} {agent} {tmp_path / 'notes'}", "episode_ids": ("tiny-AI-003",)}
    log_dir = changes.pop("log_dir", tmp_path / "run")
    return run_pack(quick(pack, log_dir, **{**fields, **changes}))


def test_a_program_that_looks_round_and_ends_goes_on_where_it_was(pack: Path, tmp_path: Path) -> None:
    result = played(pack, tmp_path, "if frames == 5: sys.exit(0)\nsay(TURN if frames < 5 else REPORT)")
    (record,) = result.records
    assert [step.invalid.reason if step.invalid else present(step.action).skill_name for step in record.steps] == [
        *["navigate"] * 4,
        "agent_ended",
        "report",
    ]
    assert present(record.steps[4].invalid).detail == "ended without an answer (exit code 0)"
    assert (record.attempt, record.steps[4].world.agent, record.steps[5].world.agent) == (
        1,
        record.steps[3].world.agent,
        record.steps[3].world.agent,
    )
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def test_a_program_that_keeps_failing_ends_by_the_limit_of_invalid_actions(pack: Path, tmp_path: Path) -> None:
    (record,) = played(pack, tmp_path, "sys.exit(1)", episode_ids=("tiny-SV-002",)).records
    assert (record.end, len(record.steps), record.attempt) == ("invalid_action_limit_exceeded", 3, 1)
    assert {step.invalid and step.invalid.reason for step in record.steps} == {"agent_ended"}


def test_a_program_that_ends_its_worker_gets_no_second_look(pack: Path, tmp_path: Path) -> None:
    body = "if frames == 3: os.kill(os.getppid(), signal.SIGKILL); time.sleep(60)\nsay(TURN if seen < 3 else REPORT)"
    (record,) = played(pack, tmp_path, body).records
    assert (record.end, record.attempt) == ("report", 1)
    turned = [step.world.agent.rotation for step in record.steps]
    assert turned == [90.0, 180.0, 270.0, 0.0, 0.0]
    (attempt,) = (tmp_path / "run" / ATTEMPTS_FILE).read_text().splitlines()
    assert record.started <= datetime.fromisoformat(json.loads(attempt)["started"])
    assert verify_run(tmp_path / "run", VerifySettings(workers=1)).is_verified


def test_a_program_that_keeps_ending_its_worker_is_an_error_and_its_attempts_are_counted(
    pack: Path, tmp_path: Path
) -> None:
    body = "if frames < 4: os.kill(os.getppid(), signal.SIGKILL); time.sleep(60)\nsay(REPORT)"
    result = played(pack, tmp_path, body)
    assert [(row.end, present(row.error).boundary, row.attempt) for row in result.records] == [("error", "worker", 1)]
    (record,) = played(pack, tmp_path, body).records
    assert (record.end, record.attempt) == ("report", 2)


def test_an_episode_that_was_killed_and_begun_again_is_counted(pack: Path, tmp_path: Path) -> None:
    body = "if frames < 3: time.sleep(60)\nsay(REPORT)"
    (tmp_path / "run").mkdir()
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path; from tests.runner.test_programs import played\n"
        f"played(Path({str(pack)!r}), Path({str(tmp_path)!r}), {body!r})"
    )
    for begun in (1, 2):
        process = subprocess.Popen([sys.executable, "-c", program, str(Path(__file__).parents[2])])
        notes = tmp_path / "notes"
        wait_until(lambda: notes.is_file() and len(notes.read_text().splitlines()) == begun, "a frame is shown")  # noqa: B023
        process.kill()
        process.wait()
    result = played(pack, tmp_path, body)
    (record,) = result.records
    assert (record.end, record.attempt) == ("report", 3)
    scores = score_run(result.episodes, result.records)
    assert scores.repeats == "1 of 1 episodes were started more than once (more than 1 %), one of them 3 times"
    assert scores.has_many_repeats
    overall = summarise(scores)["overall"]
    assert (overall["repeated"], overall["most_attempts"]) == (1, 3)


def test_what_a_program_says_stands_in_the_log(pack: Path, tmp_path: Path) -> None:
    played(pack, tmp_path, "print('saw', frames, sys.argv[3], file=sys.stderr, flush=True)\nsay(REPORT)")
    log = (tmp_path / "run" / "logs").glob("*.log")
    assert "IndexError" in "".join(path.read_text() for path in log)


def test_attempts_are_counted_by_run_and_survive_a_torn_line(pack: Path, tmp_path: Path) -> None:
    played(pack, tmp_path, "say(REPORT)")
    spec = read_header(tmp_path / "run").spec
    path = tmp_path / "run" / ATTEMPTS_FILE
    key = ("tiny-AI-003", 1)
    with path.open("ab") as file:
        file.write(path.read_bytes()[:-20])
    log = AttemptLog(path, spec)
    assert log.count(key) == 1
    log.begin(key)
    assert [json.loads(line)["attempt"] for line in path.read_text().splitlines()] == [1, 2]
    assert AttemptLog(path, spec.model_copy(update={"base_url": "http://elsewhere"})).count(key) == 2
    grown = {"episode_ids": (*spec.episode_ids, "another"), "agent_files": {"agent.py": "0" * 64}}
    assert AttemptLog(path, spec.model_copy(update=grown)).count(key) == 2
    assert AttemptLog(path, spec.model_copy(update={"seed": 5})).count(key) == 0
    path.write_text("{}\n")
    with pytest.raises(RecordError, match=r"attempts\.jsonl' line 1: episode_id: Field required\. Restore"):
        AttemptLog(path, spec)
    assert len(read_records(tmp_path / "run" / "episodes.jsonl")) == 1


def test_a_program_that_has_changed_goes_on_only_when_told_to(pack: Path, tmp_path: Path) -> None:
    first = played(pack, tmp_path, "say(REPORT)")
    assert set(first.header.spec.agent_files) == {Path(sys.executable).name, "agent.py"}
    more = {"episode_ids": ("tiny-AI-003", "tiny-DA-004")}
    with pytest.raises(RecordError, match=r"has changed since it was begun: agent_files\.agent\.py: .*--force"):
        played(pack, tmp_path, "say(TURN)", **more)
    assert len(read_records(tmp_path / "run" / "episodes.jsonl")) == 1
    header = played(pack, tmp_path, "say(TURN if frames < 3 else REPORT)", force=True, **more).header
    files = (header.spec.agent_files["agent.py"], header.resumed[0].agent_files["agent.py"])
    assert files[0] == first.header.spec.agent_files["agent.py"] != files[1]
    assert len(read_records(tmp_path / "run" / "episodes.jsonl")) == 2


MEMORY = """
import json, os, pathlib, sys, tempfile
REPORT = {report!r}
places = [pathlib.Path(folder) / "memory" for folder in (".", os.environ["HOME"], "~", tempfile.gettempdir())]
places = [place.expanduser() for place in places]
begun = 0
for line in sys.stdin:
    if json.loads(line)["type"] == "start":
        begun += 1
        kept = [place.read_text() for place in places if place.exists()]
        for place in places:
            place.write_text("what is true of the twin")
        told = {{"begun": begun, "kept": kept, "pid": os.getpid(), "folder": os.getcwd()}}
        with open(sys.argv[1], "a") as notes:
            notes.write(json.dumps(told) + "\\n")
    else:
        print(REPORT, flush=True)
"""


@pytest.mark.parametrize("keep_program", [False, True])
def test_a_program_remembers_nothing_of_other_episodes_unless_it_is_kept(
    pack: Path, tmp_path: Path, keep_program: bool
) -> None:
    (tmp_path / "agent.py").write_text(MEMORY.format(report=REPORT))
    agent = f"exec:{sys.executable} {tmp_path / 'agent.py'} {tmp_path / 'notes'}"
    wanted = quick(pack, tmp_path / "run", agent=agent, limit=3, epochs=2, workers=2, keep_program=keep_program)
    result = run_pack(wanted)
    told = [json.loads(line) for line in (tmp_path / "notes").read_text().splitlines()]
    assert len(told) == len(result.records) == 6
    assert not any(Path(each["folder"]).exists() for each in told)
    processes = len({(each["pid"], each["folder"]) for each in told})
    if keep_program:
        assert processes <= 2
        assert sum(len(each["kept"]) == 4 for each in told) == sum(each["begun"] > 1 for each in told) == 6 - processes
    else:
        assert processes == 6
        assert [(each["begun"], each["kept"]) for each in told] == [(1, [])] * 6
    assert read_header(tmp_path / "run").spec.keep_program is keep_program


def test_tables_say_which_programs_could_remember_or_take_the_time(pack: Path, tmp_path: Path) -> None:
    shown = {}
    for name, changes in (("fresh", {"frame_interval_seconds": 0.01}), ("kept", {"keep_program": True})):
        played(pack, tmp_path, "say(REPORT)", log_dir=tmp_path / name, **changes)
        run = read_run(tmp_path / name)
        shown[name] = (run_label(run.header), agent_of(run.header.spec).name, " ".join(run.notes))
    label, model, notes = shown["fresh"]
    assert "kept" not in label + model
    assert not notes
    label, model, notes = shown["kept"]
    assert label.endswith(" (program kept)")
    assert model.endswith(" (program kept)")
    assert "could remember the other twin of a pair" in notes
    assert "time could reveal whether an action was carried out" in notes


def test_the_first_error_is_said_at_once_with_the_programs_last_words(pack: Path, tmp_path: Path) -> None:
    agent, said = tmp_path / "agent.py", []
    agent.write_text("import no_such_module")
    wanted = quick(pack, tmp_path / "run", agent=f"exec:{sys.executable} {agent}", limit=3)
    run_pack(wanted, on_progress=lambda progress: said.append(progress.warning))
    (warning,) = [each for each in said if each is not None]
    assert "ended as an error at the agent: Agent program 'exec:" in warning
    assert warning.endswith("Its last line of standard error: ModuleNotFoundError: No module named 'no_such_module'")
