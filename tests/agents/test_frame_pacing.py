"""When frames are handed over: nothing of how long an act took to carry out is to be told by it.

No test here takes the machine's clock: time passes where a test says so.
"""

import sys
from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.tiny_pack import tiny_episode, tiny_house
from vigil.agents import exec_agent
from vigil.agents.exec_agent import ExecAgent, ProgramSettings
from vigil.agents.program import FramePacer, Program
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.profile import Profile
from vigil.protocol.world import Effect
from vigil.runner.workers.worker import play
from vigil.sim import make_simulator

CLICKS = """
import json, sys
OPEN = {"skill_name": "interact_pixel", "arguments": {"x": 320, "y": 240, "intent": "open_access"}}
REPORT = {"skill_name": "report", "arguments": {"status": "success", "summary": ""}}
frames = 0
for line in sys.stdin:
    if json.loads(line)["type"] == "observation":
        frames += 1
        print(json.dumps(OPEN if frames < 5 else REPORT), flush=True)
"""


class Clock:
    """A clock that stands still but for what is said to take time."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.mark.parametrize(("took", "beats"), [(0.0, 1), (0.01, 1), (0.5, 1), (0.51, 2), (1.2, 3)])
def test_a_frame_goes_at_a_whole_number_of_beats(took: float, beats: int) -> None:
    clock = Clock()
    beat = FramePacer(0.5, clock, clock.sleep)
    for _ in range(3):
        began = clock.now
        beat.begin()
        clock.sleep(took)
        beat.wait()
        assert clock.now - began == pytest.approx(beats * 0.5)


def test_a_sleep_that_ends_early_is_gone_on_with() -> None:
    clock = Clock()
    beat = FramePacer(0.5, clock, lambda seconds: clock.sleep(seconds / 2 + 1e-6))
    beat.wait()
    assert clock.now >= 100.5


def released(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, frame_interval_seconds: float, took: list[float]
) -> list[float]:
    """Return the time at which a program got each frame; each of its actions takes `took`."""
    clock, times = Clock(), []
    simulator = make_simulator("fake", assets=AssetDatabase.from_file(None))
    step, left = simulator.step, iter(took)

    def slow_step(action: PhysicalAction) -> Effect:
        clock.sleep(next(left))
        return step(action)

    def noted(program: Program, data: bytes, deadline: float) -> None:
        times.append(clock.now)
        send(program, data, deadline)

    monkeypatch.setattr(simulator, "step", slow_step)
    send = Program.send
    (tmp_path / "agent.py").write_text(CLICKS)
    agent = ExecAgent(
        f"{sys.executable} {tmp_path / 'agent.py'}",
        Profile(),
        ProgramSettings(),
        FramePacer(frame_interval_seconds, clock, clock.sleep),
    )
    with monkeypatch.context() as patch, Env(simulator, lambda _: tiny_house(), Profile()) as env:
        patch.setattr(exec_agent.Program, "send", noted)
        play(tiny_episode(0, "AI"), env, agent)
        agent.close()
        assert env.end == "report"
    return [after - before for before, after in pairwise(times)]


def test_the_time_until_a_frame_does_not_tell_whether_an_act_was_carried_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    refused, carried_out = [0.02] * 4, [0.02, 0.3, 0.45, 0.02]
    for frame_interval_seconds, tells in ((0.0, True), (0.5, False)):
        one, other = (released(monkeypatch, tmp_path, frame_interval_seconds, took) for took in (refused, carried_out))
        assert len(one) == len(other) == 5
        assert (one != pytest.approx(other)) == tells
        assert tells or one == pytest.approx([0.5] * 5)
