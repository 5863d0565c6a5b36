"""Questions about belief are frozen, and their answers are read as strictly as replies."""

import json
from typing import Any

import pytest

from vigil.protocol.actions import InvalidAction, Reply
from vigil.records.probe import FRAMINGS, QUESTIONS, ProbeAnswer, question_sha256, read_probe_answer

ANSWER: dict[str, Any] = {"done": True, "report": "success", "sure": 17, "evidence": "The lamp glows."}


def read(text: str, **facts: Any) -> ProbeAnswer | InvalidAction:
    return read_probe_answer(Reply(text=text, **facts))


def test_an_answer_is_read() -> None:
    assert read(json.dumps(ANSWER)) == ProbeAnswer(**ANSWER)
    assert read(f"<think>hm</think> {json.dumps(ANSWER)}\n") == ProbeAnswer(**ANSWER)
    loose = json.dumps({**ANSWER, "sure": 17.0, "report": " Success ", "why": 1})
    assert read(loose) == ProbeAnswer(**ANSWER, ignored_keys=("why",))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("I cannot say.", "no_object"),
        (f"```json\n{json.dumps(ANSWER)}\n```", "code_fence"),
        (json.dumps(ANSWER) * 2, "several_objects"),
        (json.dumps([ANSWER]), "not_an_object"),
        ('{"done": true, "done": false, "report": "success", "sure": 1, "evidence": ""}', "duplicate_key"),
        ('{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}', "is_an_action"),
        (json.dumps({**ANSWER, "skill_name": "look"}), "is_an_action"),
        (json.dumps({key: ANSWER[key] for key in ("done", "report", "sure")}), "missing_key"),
        (json.dumps({**ANSWER, "done": "true"}), "ill_typed"),
        (json.dumps({**ANSWER, "done": 1}), "ill_typed"),
        (json.dumps({**ANSWER, "sure": True}), "ill_typed"),
        (json.dumps({**ANSWER, "sure": "17"}), "ill_typed"),
        (json.dumps({**ANSWER, "sure": 17.5}), "ill_typed"),
        (json.dumps({**ANSWER, "sure": 21}), "out_of_range"),
        (json.dumps({**ANSWER, "sure": -1}), "out_of_range"),
        (json.dumps({**ANSWER, "report": "done"}), "not_in_vocabulary"),
        (json.dumps({**ANSWER, "evidence": None}), "ill_typed"),
        (json.dumps({**ANSWER, "sure": 10**400}), "ill_typed"),
        ("x" * 70_000, "too_long"),
    ],
)
def test_anything_else_is_missing_with_its_reason(text: str, reason: str) -> None:
    found = read(text)
    assert isinstance(found, InvalidAction)
    assert found.reason == reason


def test_facts_of_the_provider_count_as_for_replies() -> None:
    rejected = read("", provider_rejected=True)
    cut = read('{"done": tr', finish_reason="length")
    assert isinstance(rejected, InvalidAction)
    assert isinstance(cut, InvalidAction)
    assert (rejected.reason, cut.reason) == ("provider_rejected", "truncated")


def test_a_lenient_profile_takes_an_answer_out_of_a_fence() -> None:
    fenced = Reply(text=f"Here: ```json\n{json.dumps(ANSWER)}\n```")
    assert read_probe_answer(fenced, "lenient") == ProbeAnswer(**ANSWER)


def test_the_questions_are_frozen() -> None:
    assert {framing: question_sha256(framing)[:12] for framing in FRAMINGS} == {
        "state": "e93442f090d1",
        "doubt": "14363e581f0f",
    }
    for text in QUESTIONS.values():
        assert "0 to 20" in text
        assert "not a step" in text
