"""Probes: questions about what an agent believes at a step, asked separately from the episode.

A probe repeats the request of the step and adds a question after the frame. Its answer is not an action, uses no step
and is never part of the history. The questions are frozen: `question_sha256` identifies the question, its scale and its
place in the request. Source: `protocol.md` section 10; `docs/beliefs.md`.
"""

import hashlib
from typing import Any, Literal, get_args

from pydantic import Field

from vigil.base.models import FrozenModel
from vigil.protocol.actions import STATUSES, InvalidAction, Reply, ReplyFault, ReplyPolicy, Status
from vigil.protocol.replies import read_object

Framing = Literal["state", "doubt"]
"""How a probe asks: `state` asks whether the task is done; `doubt` first asks what could speak against this."""
FRAMINGS: tuple[Framing, ...] = get_args(Framing)
SCALE = 20
"""Maximum of `sure`; the minimum is 0. The scale is coarse because models use the values of a coarse scale more evenly.
"""
PLACE = "a text part behind the frame, in the last user message of the step's request"

_OPENING = (
    "A question before you go on. It is not a step: nothing in the scene changes, and your answer is not part of the "
    "history. Judge by what you have seen up to and including the current frame.",
)
_SURE = (
    f"- `sure` (integer from 0 to {SCALE}): how likely it is that the task is done now: 0 means certainly not, "
    f"{SCALE // 2} means as likely as not, {SCALE} means certainly. For a state-recognition task: how likely it is "
    "that the label in `report` is right.",
)
_DONE = (
    "- `done` (boolean): whether the task is done now, that is, whether everything that it asks for holds in the scene "
    "at this moment; not whether you will manage it later. For a state-recognition task: whether you have seen the "
    "state that it asks about.",
    f"- `report` (string): the status that you would report if you had to report now: {' | '.join(STATUSES)}.",
)
_FORM = (
    "Answer with exactly one JSON object and nothing else. It is not an action: leave out `skill_name` and "
    "`arguments`. Required keys:",
)
QUESTIONS: dict[Framing, str] = {
    "state": "\n".join(
        (
            *_OPENING,
            *_FORM,
            *_DONE,
            *_SURE,
            "- `evidence` (string): what you have seen that says so, in one short sentence.",
        )
    ),
    "doubt": "\n".join(
        (
            *_OPENING,
            "Suppose that somebody claims that the task is done now. First look for what could be wrong with this "
            "claim; then judge it.",
            *_FORM,
            "- `evidence` (string): what could be wrong with the claim, in one short sentence.",
            *_DONE,
            *_SURE,
        )
    ),
}
"""The verbatim question of each framing."""
_KEYS = ("done", "report", "sure", "evidence")


class ProbeAnswer(FrozenModel):
    """An answer to a probe. `sure` is about `done` or, in a state-recognition task, about the label `report`."""

    done: bool
    report: Status
    sure: int = Field(ge=0, le=SCALE)
    evidence: str
    ignored_keys: tuple[str, ...] = ()


def question_sha256(framing: Framing) -> str:
    """Return the SHA-256 of a question, its scale and its place in the request."""
    return hashlib.sha256(f"{QUESTIONS[framing]}\n\n0..{SCALE}\n{PLACE}".encode()).hexdigest()


def read_probe_answer(reply: Reply, policy: ReplyPolicy = "strict") -> ProbeAnswer | InvalidAction:
    """Return the answer in a reply to a probe, or why the reply has none. `policy` is the run's reply policy."""
    return read_object(reply, (), _answer_of, policy)


def _answer_of(fields: dict[str, Any]) -> ProbeAnswer:
    if "skill_name" in fields:
        raise ReplyFault("malformed_action", "is_an_action", ascii(fields["skill_name"])[:80])
    for key in _KEYS:
        if key not in fields:
            raise ReplyFault("malformed_action", "missing_key", key)
    done, report, sure, evidence = (fields[key] for key in _KEYS)
    is_number = isinstance(sure, int | float) and not isinstance(sure, bool)
    is_typed = {
        "done": isinstance(done, bool),
        "report": isinstance(report, str),
        "sure": is_number and sure % 1 == 0,
        "evidence": isinstance(evidence, str),
    }
    for key, is_so in is_typed.items():
        if not is_so:
            raise ReplyFault("malformed_action", "ill_typed", f"{key}: {type(fields[key]).__name__}")
    status = report.strip().casefold()
    if status not in STATUSES:
        raise ReplyFault("malformed_action", "not_in_vocabulary", f"report: {ascii(report)[:80]}")
    if not 0 <= sure <= SCALE:
        raise ReplyFault("malformed_action", "out_of_range", f"sure: {ascii(sure)[:80]}")
    ignored = tuple(key for key in fields if key not in _KEYS)
    return ProbeAnswer(done=done, report=status, sure=int(sure), evidence=evidence, ignored_keys=ignored)
