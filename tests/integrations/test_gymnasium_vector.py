"""The vector of environments in a few processes: it does what Gymnasium's own does, and leaves no process behind."""

import gc
import json
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.error import ClosedEnvironmentError
from gymnasium.spaces import Discrete

import vigil.integrations.gymnasium as integration
from tests.support.tiny_pack import tiny_pack
from tests.support.waiting import HANGS_AFTER_S
from vigil.errors import SettingError, SimulatorError
from vigil.integrations.gymnasium import SharedProcessVectorEnv, make_vector

TURN = json.dumps({"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 90}})
FAIL = json.dumps({"skill_name": "report", "arguments": {"status": "fail", "summary": ""}})
OPTIONS: dict[str, Any] = {"backend": "fake", "frames": False, "evaluator": True, "profile": "action_feedback"}
COUNT = 5


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("vector") / "pack"
    tiny_pack(folder, 8)
    return str(folder)


@pytest.fixture
def vector(pack: str) -> Iterator[SharedProcessVectorEnv]:
    made = make_vector(3, processes=2, context="fork", pack=pack, **OPTIONS)
    yield made
    made.close()


def processes() -> list[Any]:
    """Return the processes of the vector environments that are running."""
    return [each for each in multiprocessing.active_children() if each.name.startswith("environments-")]


def assert_same(ours: Any, theirs: Any) -> None:
    """Compares what two vectors return, types included."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys()
        for key, value in ours.items():
            assert_same(value, theirs[key])
    elif isinstance(ours, tuple):
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)
    elif isinstance(ours, np.ndarray):
        assert ours.dtype == theirs.dtype
        if ours.dtype == object:
            assert_same(tuple(ours), tuple(theirs))
        else:
            assert np.array_equal(ours, theirs)
    else:
        assert ours == theirs


@pytest.mark.parametrize(
    ("mode", "options", "steps"),
    [
        ("NextStep", {"frames": True}, 8),
        ("NextStep", {"actions": "structured"}, 25),
        ("SameStep", {"actions": "structured"}, 25),
        ("SameStep", {"frames": True}, 8),
    ],
)
def test_it_returns_what_gymnasium_s_own_does(pack: str, mode: str, options: dict[str, Any], steps: int) -> None:
    asked = {"pack": pack, "autoreset_mode": mode, "context": "fork"}
    ours = gymnasium.make_vec(integration.ENV_ID, num_envs=COUNT, processes=2, **asked, **{**OPTIONS, **options})
    make = partial(gymnasium.make, integration.ENV_ID, pack=pack, **{**OPTIONS, **options})
    theirs = gymnasium.vector.AsyncVectorEnv([make] * COUNT, context="fork", autoreset_mode=mode)
    assert isinstance(ours, SharedProcessVectorEnv)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata == theirs.metadata
    assert_same(ours.reset(seed=3), theirs.reset(seed=3))
    ours.action_space.seed(0)
    ended = 0
    for number in range(steps):
        sampled = ours.action_space.sample()
        text = tuple(FAIL if (number + place) % 4 == 3 else TURN for place in range(COUNT))
        actions = sampled if "actions" in options else text
        found = ours.step(actions)
        assert_same(found, theirs.step(actions))
        ended += int((found[2] | found[3]).sum())
    assert ended >= COUNT
    mask = np.array([False, False, True, False, True])
    for seed, more in ((None, {"reset_mask": mask}), ([None, 1, 2, 3, 4], None), (None, {"episode_id": "tiny-DA-000"})):
        assert_same(ours.reset(seed=seed, options=more and {**more}), theirs.reset(seed=seed, options=more))
    assert ours.np_random_seed == theirs.np_random_seed
    ours.close()
    theirs.close()


def test_environments_reset_by_their_user(pack: str) -> None:
    vector = make_vector(2, processes=1, context="fork", autoreset_mode="Disabled", pack=pack, **OPTIONS)
    vector.reset(seed=0)
    assert vector.step((FAIL, TURN))[2].tolist() == [True, False]
    vector.reset(options={"reset_mask": np.array([True, False])})
    assert vector.step((FAIL, FAIL))[2].tolist() == [True, True]
    vector.close()


class Ending(gymnasium.ActionWrapper):
    """Two replies."""

    def __init__(self, env: gymnasium.Env) -> None:
        super().__init__(env)
        self.action_space = Discrete(2)

    def action(self, action: int) -> str:
        return (TURN, FAIL)[action]


def test_wrapped_environments_in_processes_started_anew(pack: str) -> None:
    asked = {**OPTIONS, "pack": pack, "frames": True, "render_mode": "rgb_array"}
    makes = [lambda: Ending(gymnasium.make(integration.ENV_ID, **asked))] * 3
    vector = SharedProcessVectorEnv(makes, processes=2, context="forkserver", copy=False)
    first, _ = vector.reset(seed=0)
    assert len(processes()) == 2
    seen, _, terminated, _, _ = vector.step(np.array([0, 1, 1]))
    assert seen["frame"] is first["frame"]
    assert terminated.tolist() == [False, True, True]
    frames = vector.render()
    assert len(frames) == 3
    assert np.array_equal(frames[0], seen["frame"][0])
    vector.set_attr("reward_offset", [1, 2, 3])
    assert vector.get_attr("reward_offset") == (1, 2, 3)
    vector.close()


def test_an_error_is_raised_with_where_it_was_and_the_vector_goes_on(vector: SharedProcessVectorEnv) -> None:
    vector.reset(seed=0)
    with pytest.raises(SettingError, match="a string, not int") as raised:
        vector.step((TURN, TURN, 3))
    assert "gymnasium/spaces.py" in raised.value.__notes__[0]
    with pytest.raises(SettingError, match="no episode 'nowhere'"):
        vector.reset(options={"episode_id": "nowhere"})
    with pytest.raises(AttributeError, match="no_such_thing"):
        vector.get_attr("no_such_thing")
    vector.reset(seed=0)
    assert vector.step((TURN, TURN, FAIL))[2].tolist() == [False, False, True]


class Unsent(Exception):
    """Cannot be made again of its arguments."""

    def __init__(self, name: str, place: int) -> None:
        super().__init__(f"{name} at {place}")


def test_errors_of_any_library_are_told(pack: str) -> None:
    main = os.getpid()

    def failing() -> gymnasium.Env:
        if os.getpid() != main:
            raise Unsent("no luck", 3)
        return gymnasium.make(integration.ENV_ID, pack=pack, **OPTIONS)

    with pytest.raises(SimulatorError, match=r"^Unsent: no luck at 3") as raised:
        SharedProcessVectorEnv([failing], context="fork")
    assert "in failing" in raised.value.__notes__[0]
    assert not processes()


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda vector: vector.reset(seed=[1, 2]), "3 environments got 2 seeds"),
        (lambda vector: vector.reset(options={"reset_mask": np.zeros(3, bool)}), "give 3 booleans, at least one of"),
        (lambda vector: vector.reset(options={"reset_mask": np.ones(2, bool)}), "give 3 booleans"),
        (lambda vector: vector.reset(options={"reset_mask": np.ones(3)}), "give 3 booleans"),
        (lambda vector: vector.set_attr("x", [1, 2]), "3 environments got 2 values"),
        (lambda vector: SharedProcessVectorEnv([]), "with 0 environments and processes=None: both"),
        (lambda vector: make_vector(2, processes=0), "with 2 environments and processes=0: both"),
    ],
)
def test_what_makes_no_sense_is_named(vector: SharedProcessVectorEnv, ask: Any, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        ask(vector)


def test_environments_with_other_spaces_are_refused(pack: str) -> None:
    makes = [partial(gymnasium.make, integration.ENV_ID, pack=pack, backend="fake", frames=each) for each in (0, 1)]
    with pytest.raises(SettingError, match="option frames"):
        SharedProcessVectorEnv(makes)
    others = [partial(gymnasium.make, integration.ENV_ID, pack=pack, **{**OPTIONS, "frames": f}) for f in (False, True)]
    with pytest.raises(
        SettingError, match=r"(?s)Environment 1 has the space Dict.*'frame'.*, but environment 0 has Dict"
    ):
        SharedProcessVectorEnv(others, processes=2, context="fork")
    assert not processes()


def test_a_lost_process_is_told_and_no_process_is_left(vector: SharedProcessVectorEnv) -> None:
    vector.reset(seed=0)
    processes()[-1].kill()
    for _ in range(2):
        with pytest.raises(SimulatorError, match=r"process of environments \d to \d died \(exit code -9\)"):
            vector.step((TURN,) * 3)
    vector.close()
    assert not processes()
    vector.close()
    with pytest.raises(ClosedEnvironmentError, match="step"):
        vector.step((TURN,) * 3)


def test_a_vector_that_nobody_has_any_more_ends(pack: str) -> None:
    vector = make_vector(2, processes=2, context="fork", pack=pack, **OPTIONS)
    vector.reset(seed=0)
    assert len(processes()) == 2
    del vector
    gc.collect()
    assert not processes()


def test_an_interrupted_call_s_answer_is_not_the_next_one_s(vector: SharedProcessVectorEnv) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    def play() -> None:
        while True:
            vector.step((TURN,) * 3)

    vector.reset(seed=0)
    before = signal.signal(signal.SIGALRM, interrupted)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            play()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert len(vector.get_attr("render_mode")) == 3
    seen, info = vector.reset(seed=0)
    assert seen["feedback"].tolist() == [[0, 0]] * 3
    assert info == {}


PROGRAM = """
import sys, psutil
from vigil.integrations.gymnasium import make_vector
vector = make_vector(4, processes=2, context="fork", pack=sys.argv[1], backend="fake", frames=False)
vector.reset(seed=0)
print(*(each.pid for each in psutil.Process().children()), flush=True)
sys.stdin.read()
"""


def test_processes_end_with_a_killed_parent(pack: str, tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, pack], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        left = [psutil.Process(int(pid)) for pid in parent.stdout.readline().split()]
        assert len(left) == 2
        os.kill(parent.pid, signal.SIGKILL)
    assert not psutil.wait_procs(left, timeout=HANGS_AFTER_S)[1]
