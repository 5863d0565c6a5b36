"""The forms in which servers send reasoning, named as in docs/models.md, and a model that uses them."""

import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.support.narrowing import present
from tests.support.quick_runs import quick
from tests.support.wire_server import ModelMessage
from vigil.assets.database import AssetDatabase
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.replies import read_reply
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.runner import run
from vigil.runner.plan import plan_run
from vigil.runner.workers.pool import SimulatorPool
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator

REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
DRAFT = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 5}}'
THOUGHT = f"I could answer {DRAFT}, but the table is near."


class Form(NamedTuple):
    """A reply in one form, and its expected parse."""

    said: ModelMessage
    reason: str | None = None
    """The reason why the reply is invalid; None if it is the report."""
    detail: str = ""


def text(*parts: str, **more: Any) -> ModelMessage:
    return ModelMessage(parts, **more)


REASONING_FORMS: dict[str, Form] = {
    "`reasoning_content`": Form(text(REPORT, reasoning=THOUGHT)),
    "`reasoning`": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="reasoning")),
    "`reasoning_details`": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="reasoning_details")),
    "parts of the content": Form(text(REPORT, reasoning=THOUGHT, reasoning_field="content")),
    "`<think>...</think>`": Form(text(f"<think>\n{THOUGHT}\n</think>\n\n{REPORT}")),
    "`</think>` alone": Form(text(f"{THOUGHT}\n</think>\n\n{REPORT}")),
    "`◁think▷...◁/think▷`": Form(text(f"◁think▷{THOUGHT}◁/think▷{REPORT}")),
    "several blocks": Form(text(f"<think>{THOUGHT}</think>\n<think>{THOUGHT}</think>{REPORT}")),
    "a block that is not closed": Form(text(f"<think>{THOUGHT}"), "unclosed_reasoning"),
    "a block cut by the token limit": Form(text(f"<think>{THOUGHT}", is_cut=True), "truncated", "unclosed_reasoning"),
    "only reasoning, sent separately": Form(
        text(reasoning=THOUGHT, is_null=True),
        "empty",
        f"all {len(THOUGHT)} characters came as reasoning, and no answer followed",
    ),
    "only reasoning, sent separately and cut": Form(
        text(reasoning=THOUGHT, is_null=True, is_cut=True),
        "truncated",
        f"empty all {len(THOUGHT)} characters came as reasoning, and no answer followed",
    ),
}


def without_pictures(assets: AssetDatabase, quality: str) -> PrivilegedSimulator:
    """Return the test simulator without pictures, which take most of its time, as a `SimulatorFactory`."""
    del quality
    simulator = make_simulator("fake", assets=assets)
    grey = np.full((FRAME_HEIGHT, FRAME_WIDTH, 3), 128, dtype=np.uint8)
    simulator.frame = lambda: grey
    return simulator


@contextmanager
def shared_simulator(pack: Pack) -> Iterator[None]:
    """Let all runs of `pack` within the block share one simulator."""
    plan = plan_run(quick(pack.folder, None, model="vllm/m", simulator_factory=without_pictures)).worker
    with SimulatorPool(plan, 1) as pool, pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "SimulatorPool", lambda *_, **__: nullcontext(pool))
        yield


class FormsInTurn:
    """Brain that answers the first request of each play in one of the forms, and reports at the next request.

    The play of a place in the pack and a time (0 for the first play of that episode) has the form number place + time:
    over as many times as there are forms, each episode is answered in each. Episodes are played one at a time, so that
    two first requests of one in a row are one that a busy machine has sent again.
    """

    def __init__(self, pack: Pack) -> None:
        self._instructions = [episode.instruction for episode in pack.episodes]
        self._places = {episode.id: place for place, episode in enumerate(pack.episodes)}
        self._times = [0] * len(pack.episodes)
        self._asked: int | None = None

    def __call__(self, wire: str, data: bytes) -> ModelMessage:
        messages = json.loads(data)["messages"]
        if any(message["role"] == "assistant" for message in messages):
            return text(REPORT)
        task = json.dumps(messages[0]["content"], ensure_ascii=False)
        (place,) = (place for place, words in enumerate(self._instructions) if words in task)
        self._times[place] += place != self._asked
        self._asked = place
        return REASONING_FORMS[_in_turn(place, self._times[place] - 1)].said

    def check(self, record: EpisodeRecord, time: int) -> str:
        """Assert that a record is that of the given play of its episode; return the form's name."""
        assert record.error is None
        assert record.end == "report"
        name = _in_turn(self._places[record.episode_id], time)
        check_judged(name, record.steps[0])
        assert len(record.steps) == (1 if REASONING_FORMS[name].reason is None else 2)
        return name


def _in_turn(place: int, time: int) -> str:
    return list(REASONING_FORMS)[(place + time) % len(REASONING_FORMS)]


def check_judged(name: str, step: StepRecord) -> None:
    """Assert that a step with a reply in this form is judged as the protocol says."""
    check_reply(name, step.reply)
    form = REASONING_FORMS[name]
    if form.reason is None:
        assert present(step.action).skill_name == "report", name
    else:
        invalid = present(step.invalid)
        assert (invalid.kind, invalid.reason) == ("protocol_failure", form.reason), name
        assert invalid.detail.startswith(form.detail)


def check_reply(name: str, reply: Reply) -> None:
    """Assert that a reply in this form is read and parsed as the protocol says."""
    form, parsed = REASONING_FORMS[name], read_reply(reply).parsed
    assert reply.text == form.said.text, name
    assert reply.reasoning_chars >= len(THOUGHT) or form.reason is not None, name
    assert getattr(parsed, "reason", None) == form.reason, name
    assert reply.finish_reason == ("length" if form.said.is_cut else "stop"), name
