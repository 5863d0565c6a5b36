"""Scripted agents without any sight: they do not even look at the frame.

They bound what a metric can be worth: an agent that never acts, acts at random, walks blindly, or claims
success at once. None of them knows its budget, so those that report do so within the smallest one (5 steps).
"""

import hashlib
import json
from collections.abc import Callable, Iterator
from typing import Any, get_args

import numpy as np

from vigil.actions import Intent, LookDirection, NavigateMode, Reply, Status
from vigil.errors import SettingError
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation

REPORT_PROBABILITY = 0.05
PROSE = "I would turn to the right and have a look around first."

Script = Callable[[np.random.Generator], Iterator[str]]


class ScriptedAgent:
    """Writes out the replies of a script, one for each observation, whatever it shows."""

    def __init__(self, name: str, script: Script, seed: int = 0) -> None:
        self.name = name
        self._script = script
        self._seed = seed
        self._replies: Iterator[str] = iter(())

    def start(self, instruction: str) -> None:
        """Starts the script anew; its randomness is a function of the seed and the instruction alone."""
        digest = hashlib.sha256(f"{self._seed}\n{instruction}".encode()).digest()
        self._replies = self._script(np.random.default_rng(int.from_bytes(digest[:16], "big")))

    def act(self, observation: Observation) -> Reply:
        """Returns the script's next reply."""
        return Reply(text=next(self._replies))


def _skill(name: str, **arguments: Any) -> str:
    return json.dumps({"skill_name": name, "arguments": arguments})


def _report(status: str = "success", summary: str = "Done.") -> str:
    return _skill("report", status=status, summary=summary)


def _noop(_: np.random.Generator) -> Iterator[str]:
    while True:
        yield _skill("interact_pixel", intent="drop")


def _random(rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield _random_report(rng) if rng.random() < REPORT_PROBABILITY else _random_action(rng)


def _random_report(rng: np.random.Generator) -> str:
    return _report(str(rng.choice(get_args(Status))), "")


def _random_action(rng: np.random.Generator) -> str:
    skill = rng.choice(["navigate", "look", "interact_pixel"])
    if skill == "look":
        direction = str(rng.choice(get_args(LookDirection)))
        return _skill("look", direction=direction, magnitude=int(rng.integers(1, 91)))
    if skill == "interact_pixel":
        intent = str(rng.choice(get_args(Intent)))
        return _skill(
            "interact_pixel",
            intent=intent,
            x=int(rng.integers(FRAME_WIDTH)),
            y=int(rng.integers(FRAME_HEIGHT)),
        )
    mode = str(rng.choice(get_args(NavigateMode)))
    most = 180 if mode.startswith("turn") else 12
    return _skill("navigate", mode=mode, magnitude=int(rng.integers(1, most + 1)))


def _sweep(_: np.random.Generator) -> Iterator[str]:
    for _turn in range(4):
        yield _skill("navigate", mode="turn_right", magnitude=90)
    while True:
        yield _report()


def _forward(_: np.random.Generator) -> Iterator[str]:
    for _walk in range(4):
        yield _skill("navigate", mode="forward", magnitude=3)
    while True:
        yield _report()


def _centre(_: np.random.Generator) -> Iterator[str]:
    for intent in ("ground", "open_access", "activate", "pick"):
        yield _skill("interact_pixel", intent=intent, x=FRAME_WIDTH // 2, y=FRAME_HEIGHT // 2)
    while True:
        yield _report()


def _always_success(_: np.random.Generator) -> Iterator[str]:
    while True:
        yield _report()


def _always_fail(_: np.random.Generator) -> Iterator[str]:
    while True:
        yield _report("fail")


def _always_invalid(_: np.random.Generator) -> Iterator[str]:
    while True:
        yield _report("invalid")


def _coin(rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield _report(("success", "fail")[int(rng.integers(2))])


def _malformed(_: np.random.Generator) -> Iterator[str]:
    while True:
        yield PROSE


SCRIPTS: dict[str, Script] = {
    "noop": _noop,
    "random": _random,
    "sweep": _sweep,
    "forward": _forward,
    "centre": _centre,
    "always_success": _always_success,
    "always_fail": _always_fail,
    "always_invalid": _always_invalid,
    "coin": _coin,
    "malformed": _malformed,
}


def scripted_agent(name: str, seed: int = 0) -> ScriptedAgent:
    """Returns the scripted agent of that name. Raises SettingError on an unknown one."""
    script = SCRIPTS.get(name)
    if script is None:
        raise SettingError(f"Scripted agent {name!r} does not exist. Choose one of: {', '.join(SCRIPTS)}.")
    return ScriptedAgent(name, script, seed)
