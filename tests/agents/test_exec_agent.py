import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from vigil.agents.exec_agent import MAX_LINE_BYTES, ExecAgent
from vigil.agents.picture import encode
from vigil.errors import ModelAPIError, SettingError
from vigil.observation import Feedback, Observation
from vigil.profile import Profile
from vigil.prompt import system_prompt
from vigil.replies import parse_reply

RGB = np.full((480, 640, 3), 77, np.uint8)
HEAD = 'import sys, json, time, os\nFRAME = \'"type": "observation"\'\n'
Maker = Callable[..., ExecAgent]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Maker]:
    """Makes an agent of a program's text; all are ended afterwards."""
    agents: list[ExecAgent] = []

    def made(program: str, reply_seconds: float = 20.0) -> ExecAgent:
        script = tmp_path / f"agent{len(agents)}.py"
        script.write_text(HEAD + program)
        agent = ExecAgent(f"{sys.executable} {script}", Profile(), reply_seconds)
        agents.append(agent)
        agent.start("Find the mug.")
        return agent

    yield made
    for agent in agents:
        agent.close()


def look(feedback: Feedback | None = None) -> Observation:
    return Observation(lambda: RGB, feedback)


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
        "frame": {"media_type": "image/png", "width": 640, "height": 480, "data": encode(RGB).base64},
        "feedback": {"too_far": True, "path_blocked": False},
    }
    assert reply.seconds > 0


def test_the_start_carries_prompt_and_instruction(make: Maker) -> None:
    program = ECHO.replace("json.dumps(message)}", "json.dumps(start)}")
    start = json.loads(make(program).act(look()).text)
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
    time.sleep(0.3)
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
    assert parse_reply(reply, "pixel", "strict").reason == reason
    assert len(reply.raw) <= MAX_LINE_BYTES
    assert (reply.cut is not None and reply.cut.text_bytes >= 5_000_000) == (reason == "too_long")
    assert agent.act(look()).text == reply.text


def test_a_program_that_dies_is_an_infrastructure_failure(make: Maker) -> None:
    agent = make("sys.stdin.readline(); sys.exit(3)")
    with pytest.raises(ModelAPIError, match=r"ended without an answer \(exit code 3\)"):
        agent.act(look())
    agent.start("Another.")


def test_a_program_that_dies_over_an_observation_is_named_with_its_exit_code(make: Maker) -> None:
    agent = make("for line in sys.stdin:\n    if FRAME in line: sys.stdout.close(); time.sleep(0.3); os._exit(4)")
    with pytest.raises(ModelAPIError, match=r"ended without an answer \(exit code 4\)"):
        agent.act(look())


def test_a_program_that_hangs_is_ended(make: Maker) -> None:
    agent = make("for line in sys.stdin: pass", reply_seconds=0.5)
    with pytest.raises(ModelAPIError, match=r"does not answer for 0\.5 s"):
        agent.act(look())


def test_a_program_that_does_not_read_is_ended(make: Maker) -> None:
    agent = make("time.sleep(60)", reply_seconds=0.5)
    with pytest.raises(ModelAPIError, match="does not"):
        agent.act(look())


def test_talking_out_of_turn_is_refused(make: Maker) -> None:
    agent = make("print('Loading the model ...', flush=True)\nfor line in sys.stdin: pass")
    time.sleep(0.5)
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
    time.sleep(0.5)
    with pytest.raises(ModelAPIError):
        agent.act(look())
    pid = int((tmp_path / "pid").read_text())
    for _ in range(50):
        if not Path(f"/proc/{pid}").exists() or "Z" in Path(f"/proc/{pid}/stat").read_text().split()[2]:
            return
        time.sleep(0.05)
    raise AssertionError("the child lives on")


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
        ("", "names no command"),
        ("'unclosed", "cannot be split into words"),
        ("/no/such/program", r"'/no/such/program' cannot be started: No such file.*Give its path"),
        ("/etc/passwd", r"'/etc/passwd' cannot be started: Permission denied.*or the program that runs it"),
    ],
)
def test_commands_that_make_no_sense_are_refused(command: str, named: str) -> None:
    with pytest.raises(SettingError, match=named):
        ExecAgent(command, Profile()).start("Find the mug.")
