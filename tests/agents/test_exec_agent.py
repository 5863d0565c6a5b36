import json
import os
import re
import select
import site
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from tests.support.narrowing import present, rejected
from tests.support.tiny_pack import tiny_episode, tiny_house
from tests.support.waiting import HANGS_AFTER_S, wait_until
from vigil.agents import program
from vigil.agents.exec_agent import ExecAgent, ProgramSettings
from vigil.agents.frame_encoding import encode_frame
from vigil.agents.program import MAX_LINE_BYTES, Program, program_environment, resolve_paths
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.errors import ModelAPIError, SettingError
from vigil.protocol.observation import Feedback, Observation
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import system_prompt
from vigil.protocol.replies import read_reply
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator

RGB = np.full((480, 640, 3), 77, np.uint8)
HEAD = 'import sys, json, time, os\nFRAME = \'"type": "observation"\'\n'
Maker = Callable[..., ExecAgent]


@pytest.fixture
def ends_are_awaited(monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    """Waits for the exit code of a program that is to have one, however slow the machine is."""
    if "exit code" in how:
        monkeypatch.setattr(program, "EXIT_TIMEOUT_S", HANGS_AFTER_S)


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Maker]:
    """Makes an agent of a program's text; all are ended afterwards."""
    agents: list[ExecAgent] = []

    def made(text: str, reply_seconds: float = HANGS_AFTER_S, *, is_started: bool = True) -> ExecAgent:
        script = tmp_path / f"agent{len(agents)}.py"
        script.write_text(HEAD + text)
        agent = ExecAgent(f"{sys.executable} {script}", Profile(), plain(reply_seconds=reply_seconds))
        agents.append(agent)
        if is_started:
            agent.start("Find the mug.")
        return agent

    yield made
    for agent in agents:
        agent.close()


def look(feedback: Feedback | None = None) -> Observation:
    return Observation(lambda: RGB, feedback)


def plain(**changes: Any) -> ProgramSettings:
    """Return the settings of a program that does not have to wait between frames."""
    return ProgramSettings(**{"frame_interval_seconds": 0.0, **changes})


def running(agent: ExecAgent) -> Program:
    assert agent._program is not None
    return agent._program


def wait_until_it_has_read(agent: ExecAgent) -> None:
    """Waits until the program has read all that it was sent."""
    wait_until(lambda: running(agent).unread() == 0, "the program reads")


def wait_until_it_has_written(agent: ExecAgent) -> None:
    """Waits until the program has written something that nobody has read."""

    def has_written() -> bool:
        program = running(agent)
        return bool(program._pending or select.select([present(program._process.stdout)], [], [], 0)[0])

    wait_until(has_written, "the program writes")


def tell_and_ask(agent: ExecAgent, *, has_to_read: bool) -> None:
    """Begins an episode and shows a frame: a program that ends at once is found out by the one or the other."""
    agent.start("Find the mug.")
    if has_to_read:
        wait_until_it_has_read(agent)
    agent.act(look())


ECHO = """
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "observation":
        print(json.dumps({"text": json.dumps(message)}), flush=True)
    else:
        start = message
"""


def test_the_program_gets_frame_and_feedback_and_nothing_else(make: Maker) -> None:
    reply = make(ECHO).act(look(Feedback(too_far=True, path_blocked=False)))
    message = json.loads(reply.text)
    assert message == {
        "type": "observation",
        "frame": {"media_type": "image/png", "width": 640, "height": 480, "data": encode_frame(RGB).base64},
        "feedback": {"too_far": True, "path_blocked": False},
    }
    assert reply.seconds > 0


def test_the_start_carries_prompt_and_instruction(make: Maker) -> None:
    text = ECHO.replace("json.dumps(message)}", "json.dumps(start)}")
    start = json.loads(make(text).act(look()).text)
    assert start == {
        "type": "start",
        "protocol": 1,
        "prompt": system_prompt("Find the mug.", Profile()),
        "instruction": "Find the mug.",
    }


def test_one_program_plays_many_episodes(make: Maker) -> None:
    agent = make("""
episodes = 0
for line in sys.stdin:
    if json.loads(line)["type"] == "start":
        episodes += 1
    else:
        print(episodes, flush=True)
""")
    assert agent.act(look()).text == "1"
    agent.start("Another.")
    assert agent.act(look()).text == "2"


def test_a_program_that_ends_after_an_episode_is_started_again(make: Maker) -> None:
    agent = make('sys.stdin.readline(); sys.stdin.readline(); print("x", flush=True)')
    assert agent.act(look()).text == "x"
    wait_until(lambda: not running(agent).is_running, "the program ends")
    agent.start("Another.")
    assert agent.act(look()).text == "x"


def test_an_action_may_stand_on_the_line_itself(make: Maker) -> None:
    line = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}, "text": "kept"}'
    agent = make(f"for line in sys.stdin:\n    if FRAME in line: print({line!r}, flush=True)")
    assert agent.act(look()).text == line


@pytest.mark.parametrize(
    ("written", "reason"),
    [
        ("sys.stdout.buffer.write(b'\\xff\\xfe{}\\n')", "not_utf8"),
        ("print('x' * 5_000_000)", "too_long"),
        ("print('x' + 'é' * 5_000_000)", "too_long"),
        ("print()", "empty"),
        ('print(json.dumps({"text": chr(0xd800)}))', "not_utf8"),
    ],
)
def test_bad_lines_count_against_the_agent(make: Maker, written: str, reason: str) -> None:
    agent = make(f"for line in sys.stdin:\n    if FRAME in line: {written}; sys.stdout.flush()")
    reply = agent.act(look())
    assert rejected(read_reply(reply).parsed).reason == reason
    assert len(reply.raw) <= MAX_LINE_BYTES
    assert (reply.cut is not None and reply.cut.text_bytes >= 5_000_000) == (reason == "too_long")
    assert agent.act(look()).text == reply.text


@pytest.mark.parametrize(
    ("text", "how"),
    [
        ("sys.stdin.readline(); sys.exit(3)", r"ended without an answer \(exit code 3\)"),
        ("sys.exit(3)", r"ended without an answer \(exit code 3\)"),
        ("os.close(0); time.sleep(60)", "does not read its input"),
        ("time.sleep(60)", r"does not read its input for 1\.5 s"),
        ("sys.stdin.readline(); time.sleep(60)", r"does not answer for 1\.5 s"),
        (
            "import no_such_module",
            r"\(exit code 1\)\. Its last line of standard error: "
            r"ModuleNotFoundError: No module named 'no_such_module'$",
        ),
    ],
)
@pytest.mark.usefixtures("ends_are_awaited")
def test_a_program_that_fails_before_it_saw_a_frame_is_an_infrastructure_failure(
    make: Maker, text: str, how: str
) -> None:
    agent = make(text, reply_seconds=HANGS_AFTER_S if "exit code" in how else 1.5, is_started=False)
    with pytest.raises(ModelAPIError, match=how):
        tell_and_ask(agent, has_to_read="readline" in text and "sleep" in text)
    try:
        agent.start("Another.")
    except ModelAPIError as error:  # started again, it may have failed again before it was told
        if not re.search(how, str(error)):
            raise


@pytest.mark.parametrize(
    ("deed", "how"),
    [
        ("sys.exit(3)", r"ended without an answer \(exit code 3\)"),
        ("os.kill(os.getpid(), 9)", r"ended without an answer \(exit code -9\)"),
        ("sys.stdout.close(); time.sleep(0.3); os._exit(4)", r"ended without an answer \(exit code 4\)"),
        ("time.sleep(60)", r"does not answer for 1\.5 s"),
        ("print('half', end='', flush=True); sys.exit(0)", r"ended without an answer \(exit code 0\)"),
    ],
)
@pytest.mark.usefixtures("ends_are_awaited")
def test_a_program_that_fails_after_it_saw_a_frame_has_failed_itself(make: Maker, deed: str, how: str) -> None:
    hangs = deed == "time.sleep(60)"
    agent = make(f"for line in sys.stdin:\n    if FRAME in line: {deed}", reply_seconds=1.5 if hangs else HANGS_AFTER_S)
    wait_until_it_has_read(agent)
    for _ in range(2):
        reply = agent.act(look())
        assert re.fullmatch(how, reply.agent_ended)
        assert reply.text == ("half" if "half" in deed else "")
        invalid = rejected(read_reply(reply).parsed)
        assert (invalid.kind, invalid.reason, invalid.detail) == ("protocol_failure", "agent_ended", reply.agent_ended)


def test_a_program_that_keeps_hanging_ends_by_the_limit_of_invalid_actions(
    make: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    agent = make("for line in sys.stdin:\n    if FRAME in line: time.sleep(60)", reply_seconds=1.5, is_started=False)
    start = agent.start

    def started(instruction: str) -> None:
        start(instruction)
        wait_until_it_has_read(agent)

    monkeypatch.setattr(agent, "start", started)
    with Env(make_simulator("fake", assets=AssetDatabase.from_file(None)), lambda _: tiny_house(), Profile()) as env:
        play(tiny_episode(2, "SV"), env, agent)
        record = env.record()
    assert (record.end, len(record.steps)) == ("invalid_action_limit_exceeded", 3)
    assert {step.invalid and step.invalid.reason for step in record.steps} == {"agent_ended"}


def test_a_program_that_reads_a_part_of_a_frame_has_seen_it(make: Maker) -> None:
    agent = make("d = b''\nwhile b'\\n' not in d: d += os.read(0, 1)\nos.read(0, 200); sys.exit(3)")
    assert "exit code 3" in agent.act(look()).agent_ended


def test_a_valid_line_does_not_save_a_reply_that_was_not_finished(make: Maker) -> None:
    line = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
    agent = make(f"for line in sys.stdin:\n    if FRAME in line: print({line!r}, end='', flush=True); sys.exit(0)")
    assert rejected(read_reply(agent.act(look())).parsed).reason == "agent_ended"


def test_a_program_that_is_started_again_sees_the_current_frame_alone(make: Maker, tmp_path: Path) -> None:
    agent = make(f"""
with open({str(tmp_path / "seen")!r}, "a") as seen:
    for line in sys.stdin:
        message = json.loads(line)
        print(message["type"], message.get("feedback"), message.get("instruction"), file=seen, flush=True)
        if message["type"] == "observation":
            sys.exit(3)
""")
    agent.act(look())
    agent.act(look(Feedback(too_far=True, path_blocked=False)))
    assert (tmp_path / "seen").read_text().splitlines() == [
        "start None Find the mug.",
        "observation None None",
        "start None Find the mug.",
        "observation {'too_far': True, 'path_blocked': False} None",
    ]


def test_a_program_that_cannot_be_started_again_has_failed_itself(tmp_path: Path) -> None:
    script = tmp_path / "agent.sh"
    script.write_text("#!/bin/sh\nread start; read frame; rm $0; exit 5\n")
    script.chmod(0o755)
    agent = ExecAgent(str(script), Profile(), plain())
    agent.start("Find the mug.")
    assert agent.act(look()).agent_ended == "ended without an answer (exit code 5)"
    assert agent.act(look()).agent_ended == "cannot be started: No such file or directory"
    with pytest.raises(SettingError, match="cannot be started"):
        agent.start("Another.")
    agent.close()


def test_an_episode_taken_over_is_gone_on_with(make: Maker) -> None:
    agent = make("sys.stdin.readline(); sys.exit(3)")
    agent.resume("Find the mug.")
    assert agent.act(look()).agent_ended.startswith("ended without an answer")


def test_talking_out_of_turn_after_a_frame_is_a_failure_of_the_programs(make: Maker) -> None:
    agent = make("for line in sys.stdin:\n    if FRAME in line: print('{}', flush=True); print('more', flush=True)")
    assert agent.act(look()).text == "{}"
    wait_until_it_has_written(agent)
    reply = agent.act(look())
    assert (reply.text, rejected(read_reply(reply).parsed).reason) == ("more\n", "agent_ended")
    assert agent.act(look()).text == "{}"


def test_a_program_that_does_not_read_is_ended(make: Maker) -> None:
    agent = make("time.sleep(60)", reply_seconds=0.5)
    with pytest.raises(ModelAPIError, match="does not"):
        agent.act(look())


def test_talking_out_of_turn_is_refused(make: Maker) -> None:
    agent = make("print('Loading the model ...', flush=True)\nfor line in sys.stdin: pass")
    wait_until_it_has_written(agent)
    with pytest.raises(ModelAPIError, match=r"Loading the model.*answers only"):
        agent.act(look())


def test_what_the_program_started_is_ended_with_it(make: Maker, tmp_path: Path) -> None:
    agent = make(f"""
import subprocess
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
open({str(tmp_path / "pid")!r}, "w").write(str(child.pid))
print("started", flush=True)
time.sleep(60)
""")
    wait_until_it_has_written(agent)
    child = psutil.Process(int((tmp_path / "pid").read_text()))
    with pytest.raises(ModelAPIError):
        agent.act(look())
    wait_until(lambda: not child.is_running() or child.status() == psutil.STATUS_ZOMBIE, "the end of the child")


@pytest.mark.parametrize(
    ("answer", "chars"),
    [
        ("<think>a mug</think>{}", 5),
        (" <think>a</think> <think>b</think>", 3),
        ("{} <think>late</think>", 0),
        ("<think>on and on", 0),
    ],
)
def test_what_stands_in_a_leading_think_block_is_counted_as_reasoning(make: Maker, answer: str, chars: int) -> None:
    for written in (answer, json.dumps({"text": answer})):
        reply = make(f"for line in sys.stdin:\n    if FRAME in line: print({written!r}, flush=True)").act(look())
        assert (reply.text, reply.reasoning_chars) == (answer, chars)


@pytest.mark.parametrize(
    ("command", "named"),
    [
        ("", "has no command"),
        ("'unclosed", "cannot be split into words"),
        ("/no/such/program", r"'/no/such/program' cannot be started: No such file.*Give its path"),
        ("/etc/passwd", r"'/etc/passwd' cannot be started: Permission denied.*or the program that runs it"),
    ],
)
def test_commands_that_make_no_sense_are_refused(command: str, named: str) -> None:
    with pytest.raises(SettingError, match=named):
        ExecAgent(command, Profile()).start("Find the mug.")


FACTS = """
import subprocess
for line in sys.stdin:
    if FRAME in line:
        facts = {"cwd": os.getcwd(), "env": dict(os.environ), "argv": sys.argv,
                 "fds": {name: os.readlink("/proc/self/fd/" + name) for name in os.listdir("/proc/self/fd")
                         if os.path.lexists("/proc/self/fd/" + name)},
                 "files": os.listdir(".")}
        print(json.dumps({"text": json.dumps(facts)}), flush=True)
"""


def test_nothing_that_a_program_is_handed_leads_anywhere(
    make: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    run.mkdir()
    monkeypatch.chdir(run)
    monkeypatch.setenv("VIGIL_ASSETS", str(run / "assets"))
    monkeypatch.setenv("INSPECT_LOG_DIR", str(run / "inspect"))
    monkeypatch.setenv("OLDPWD", str(run))
    monkeypatch.setenv("MY_MODEL_KEY", "stays")
    with (run / "run.json").open("w") as open_file:
        os.set_inheritable(open_file.fileno(), True)
        facts = json.loads(make(FACTS).act(look()).text)
    folder = Path(facts["cwd"])
    assert facts["files"] == []
    assert folder.name.startswith("agent-")
    assert str(run) not in json.dumps(facts)
    assert facts["env"]["MY_MODEL_KEY"] == "stays"
    assert facts["env"]["PWD"] == str(folder)
    pipes = {name: place for name, place in facts["fds"].items() if not place.startswith("/proc/")}
    assert {"0", "1", "2"} == set(pipes)
    assert all(place.startswith("pipe:") for place in pipes.values())


def test_a_programs_folder_goes_with_it(tmp_path: Path) -> None:
    script = tmp_path / "agent.py"
    script.write_text(HEAD + FACTS)
    agent = ExecAgent(f"{sys.executable} {script}", Profile(), plain())
    agent.start("Find the mug.")
    folder = Path(json.loads(agent.act(look()).text)["cwd"])
    assert folder.is_dir()
    agent.close()
    assert not folder.exists()


def test_what_a_program_says_is_passed_on_without_secrets(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    script = tmp_path / "agent.py"
    script.write_text(
        HEAD + "print('using', sys.argv[1], file=sys.stderr)\nfor line in sys.stdin: print(1, flush=True)"
    )
    redact = plain(redact=lambda text: text.replace("word", "-"))
    agent = ExecAgent(f"{sys.executable} {script} word", Profile(), redact)
    agent.start("Find the mug.")
    agent.close()
    assert capfd.readouterr().err == "using -\n"


def test_relative_paths_in_a_command_are_the_users_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "agent.sh").write_text("#!/bin/sh\nread start; read frame; cat $1; cat\n")
    (tmp_path / "bin" / "agent.sh").chmod(0o755)
    (tmp_path / "words").write_text("found\n")
    agent = ExecAgent("./bin/agent.sh words", Profile(), plain())
    agent.start("Find the mug.")
    assert agent.act(look()).text == "found"
    agent.close()


def test_only_words_that_name_what_exists_are_made_absolute(tmp_path: Path) -> None:
    (tmp_path / "a.py").touch()
    words = ["python", "a.py", "--config=a.py", "--name=b.py", "b.py", "-c", "", "x" * 5000, "./a.py"]
    here = str(tmp_path)
    expected = ["python", f"{here}/a.py", f"--config={here}/a.py", *words[3:-1], f"{here}/a.py"]
    assert resolve_paths(words, tmp_path) == expected
    assert resolve_paths(["bin/run", "/etc/passwd"], tmp_path) == [f"{here}/bin/run", "/etc/passwd"]


def test_the_environment_is_the_users_without_what_is_vigils(tmp_path: Path) -> None:
    given = {"VIGIL_X": "1", "INSPECT_Y": "2", "PWD": "/a", "HOME": "/h", "PATH": "bin:/usr/bin", "PYTHONPATH": "src:"}
    given |= {"TMPDIR": "/t", "XDG_CACHE_HOME": "/h/.cache", "MPLCONFIGDIR": "/h/mpl"}
    here, folder = tmp_path / "here", tmp_path / "own"
    kept = {"PATH": f"{here}/bin:/usr/bin", "PYTHONPATH": f"{here}/src", "MPLCONFIGDIR": "/h/mpl"}
    kept |= {"PYTHONUSERBASE": site.getuserbase()} | dict.fromkeys(
        ("PWD", "HOME", "TMPDIR", "TMP", "TEMP"), str(folder)
    )
    assert program_environment(given, here, folder) == kept
    assert program_environment({**given, "PYTHONUSERBASE": "/u"}, here, folder)["PYTHONUSERBASE"] == "/u"
