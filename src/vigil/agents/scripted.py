"""Scripted agents, which play without looking at the frame.

Their scores show what an agent can reach if it never acts, acts at random, walks blindly, or claims success at once.
Most scripts report within the smallest budget (5 steps); `explore` and `click_around` use the whole published budget of
the family for which they are made. The authoring rule `not_blind_luck` tries these agents' actions, too.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterator
from itertools import chain, cycle, islice, repeat
from typing import Any, get_args

import numpy as np

from vigil.agents.agent import Agent
from vigil.base.numbered_list import read_list
from vigil.protocol.actions import (
    Intent,
    InteractPixel,
    LookDirection,
    Navigate,
    NavigateMode,
    ParsedReply,
    Reply,
    Report,
    Status,
)
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.protocol.replies import parse_text

REPORT_PROBABILITY = 0.05
"""Probability that a reply of the agent `random` is a report."""
PROSE = "I would turn to the right and have a look around first."

TURN_ACTIONS = tuple(Navigate(mode="turn_right", magnitude=90) for _ in range(4))
WALK_ACTIONS = tuple(Navigate(mode="forward", magnitude=3) for _ in range(4))


def _blind_walk(first: tuple[Navigate, ...], turn_deg: int) -> tuple[Navigate, ...]:
    """Return 19 actions: `first`, then a walk to the next obstacle and a turn (degrees; negative is to the left), again
    and again."""
    turn = Navigate(mode="turn_right" if turn_deg > 0 else "turn_left", magnitude=abs(turn_deg))
    return (*first, *islice(cycle((Navigate(mode="forward", magnitude=40), turn)), 19 - len(first)))


_TURN_LEFT_ACTIONS = tuple(Navigate(mode="turn_left", magnitude=90) for _ in range(3))
_TURN_TWICE_ACTIONS = tuple(Navigate(mode="turn_right", magnitude=120) for _ in range(2))
EXPLORE_ACTIONS = _blind_walk(TURN_ACTIONS[:3], 135)
BLIND_WALKS = (
    EXPLORE_ACTIONS,
    _blind_walk(_TURN_TWICE_ACTIONS, 150),
    _blind_walk((), 165),
    _blind_walk(_TURN_LEFT_ACTIONS, 120),
    _blind_walk(_TURN_TWICE_ACTIONS, -120),
    _blind_walk(TURN_ACTIONS[:3], -75),
    _blind_walk(TURN_ACTIONS[:3], -135),
)
"""Walks without sight, each of 19 actions; with a report, they take the 20 steps of a search.

About 80 sequences of turns and walks were tried on 93 searches that turning does not solve. After `explore`, these six
were chosen one by one: each found the most targets that no earlier one had found. Together they found 59 of the 93.
"""
BEST_PIXEL = (368, 272)
"""Pixel (x, y) at which the first frame most often showed the target: in 17 % of 125 pointing episodes."""
POINT_ACTIONS = (InteractPixel(intent="ground", x=BEST_PIXEL[0], y=BEST_PIXEL[1]),)
CENTRE_ACTIONS = tuple(
    InteractPixel(intent=intent, x=FRAME_WIDTH // 2, y=FRAME_HEIGHT // 2)
    for intent in ("ground", "open_access", "activate", "pick")
)
CLICK_ROW_Y = 272
CLICK_ROW_X = range(48, FRAME_WIDTH, 64)
"""The ten x coordinates (pixels) of a row of clicks across the frame.

Two rows of clicks, from the places 1 m and 2 m ahead of the start, hit 15 % of 125 targets that are in view but out of
reach at the start. Other rows and distances that fit into 25 steps were tried; none hit more targets.
"""
_INTENT_WORDS: dict[Intent, str] = {
    "deactivate": r"\boff\b|\bstop|\bextinguish|\bput out\b",
    "close_access": r"\bclos(e|ed|ing)\b|\bshut",
    "open_access": r"\bopen",
    "activate": r"\bon\b|\bstart|\blight\b",
    "pick": "",
}
"""Intent -> pattern of words that ask for the intent. The first pattern that matches decides; that of `pick` always
matches."""

Script = Callable[[np.random.Generator, str], Iterator[str]]
"""Function that yields an agent's replies; its arguments are a random generator and the instruction."""


class ScriptedAgent:
    """An agent that gives the replies of a script, one for each observation, without looking at the observation."""

    def __init__(self, name: str, script: Script, seed: int = 0) -> None:
        self.name = name
        self._script = script
        self._seed = seed
        self._replies: Iterator[str] = iter(())

    def start(self, instruction: str) -> None:
        """Restart the script; its randomness depends only on the seed and the instruction."""
        digest = hashlib.sha256(f"{self._seed}\n{instruction}".encode()).digest()
        self._replies = self._script(np.random.default_rng(int.from_bytes(digest[:16], "big")), instruction)

    def act(self, observation: Observation) -> Reply:
        """Return the script's next reply."""
        return Reply(text=next(self._replies))


class StoppingAgent:
    """An agent for profiles without reports. It plays like a scripted agent, but stops instead of reporting."""

    def __init__(self, agent: Agent) -> None:
        self.name = agent.name
        self._agent = agent

    def start(self, instruction: str) -> None:
        """Begin an episode with this instruction, and forget any earlier episode."""
        self._agent.start(instruction)

    def act(self, observation: Observation) -> Reply:
        """Return the scripted agent's reply, or a stop if this reply is a report."""
        reply = self._agent.act(observation)
        parsed = parse_text(reply.text)
        is_report = isinstance(parsed, ParsedReply) and isinstance(parsed.action, Report)
        return Reply(text=_skill("stop")) if is_report else reply


def _skill(name: str, **arguments: Any) -> str:
    return json.dumps({"skill_name": name, "arguments": arguments})


def _report(status: str = "success", summary: str = "Done.") -> str:
    return _skill("report", status=status, summary=summary)


def _reply_text(action: Navigate | InteractPixel) -> str:
    arguments = action.model_dump(exclude={"skill_name"}, exclude_none=True)
    if isinstance(action, Navigate):
        arguments["magnitude"] = int(action.magnitude)
    return _skill(action.skill_name, **arguments)


def _then_success(actions: tuple[Navigate | InteractPixel, ...]) -> Iterator[str]:
    return chain(map(_reply_text, actions), repeat(_report()))


def click_actions(instruction: str) -> tuple[Navigate | InteractPixel, ...]:
    """Return actions that walk ahead to two places and, at each place, click along a row of the frame.

    The clicks have the intent that the instruction asks for.
    """
    words = instruction.lower()
    intent: Intent = next(intent for intent, asked in _INTENT_WORDS.items() if re.search(asked, words))
    clicks = tuple(InteractPixel(intent=intent, x=x, y=CLICK_ROW_Y) for x in CLICK_ROW_X)
    ahead = Navigate(mode="forward", magnitude=4)
    return (ahead, *clicks, ahead, *clicks)


def _always(reply: str) -> Script:
    return lambda _rng, _instruction: repeat(reply)


def _random(rng: np.random.Generator, _instruction: str) -> Iterator[str]:
    while True:
        is_report = rng.random() < REPORT_PROBABILITY
        yield _report(str(rng.choice(get_args(Status))), "") if is_report else _random_action(rng)


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


def _coin(rng: np.random.Generator, _instruction: str) -> Iterator[str]:
    while True:
        yield _report(("success", "fail")[int(rng.integers(2))])


def _claims(claim_of: Callable[[np.random.Generator, str], str]) -> Script:
    """Return a script that reports at once. `claim_of` chooses the claim about each chore of a list from the chore's
    words."""

    def script(rng: np.random.Generator, instruction: str) -> Iterator[str]:
        chores = enumerate(read_list(instruction), start=1)
        claims = {str(number): claim_of(rng, chore) for number, chore in chores}
        return repeat(_skill("report", status="success", summary="Done.", claims=claims))

    return script


def _guess(rng: np.random.Generator, chore: str) -> str:
    """Return, at random, one of the two claims that fit the words of a chore, e.g. "open" or "closed"."""
    words: tuple[str, str] = ("success", "fail")
    if re.search(r"\bwhether\b|\bsay\b|\btell\b|\breport\b", chore.lower()):
        words = ("open", "closed") if re.search(r"\bopen\b|\bclosed\b|\bshut\b", chore.lower()) else ("on", "off")
    return words[int(rng.integers(2))]


SCRIPTS: dict[str, Script] = {
    "noop": _always(_skill("interact_pixel", intent="drop")),
    "random": _random,
    "sweep": lambda _, instruction: _then_success(TURN_ACTIONS),
    "forward": lambda _, instruction: _then_success(WALK_ACTIONS),
    "explore": lambda _, instruction: _then_success(EXPLORE_ACTIONS),
    "click_around": lambda _, instruction: _then_success(click_actions(instruction)),
    "point": lambda _, instruction: _then_success(POINT_ACTIONS),
    "centre": lambda _, instruction: _then_success(CENTRE_ACTIONS),
    "always_success": _always(_report()),
    "always_fail": _always(_report("fail")),
    "always_invalid": _always(_report("invalid")),
    "coin": _coin,
    "malformed": _always(PROSE),
    "claim_success": _claims(lambda _rng, _chore: "success"),
    "claim_fail": _claims(lambda _rng, _chore: "fail"),
    "claim_coin": _claims(_guess),
}


def scripted_agent(name: str, seed: int = 0) -> ScriptedAgent:
    """Return the scripted agent of that name, one of `SCRIPTS`."""
    return ScriptedAgent(name, SCRIPTS[name], seed)
