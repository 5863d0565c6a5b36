import hashlib
from typing import Any

import pytest

from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import is_truncated_in_history, past_turn
from vigil.protocol.replies import MAX_REPLY_BYTES, read_reply
from vigil.records.reply_truncation import RECORDED_ANSWER_BYTES, RECORDED_REASONING_BYTES, truncate_for_record

LOOK = '{"skill_name": "look", "arguments": {"direction": "up", "magnitude": 1}}'
EXACT = LOOK + " " * (MAX_REPLY_BYTES - len(LOOK))


def truncated(reply: Reply) -> Reply:
    return truncate_for_record(reply, read_reply(reply).answer)


def parsed(reply: Reply) -> Any:
    return read_reply(reply).parsed


@pytest.mark.parametrize(
    "text",
    [
        LOOK,
        EXACT,
        EXACT + "x" * MAX_REPLY_BYTES,
        f"<think>{'x' * 900_000}</think>{EXACT}",
        b"\xff" * RECORDED_ANSWER_BYTES,
        LOOK + "\ud800",
    ],
)
def test_a_reply_of_no_great_length_is_kept_whole(text: str | bytes) -> None:
    reply = Reply.model_validate({"text": text})
    assert truncated(reply) is reply
    assert reply.raw == (text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text)


@pytest.mark.parametrize(
    ("text", "most", "reason"),
    [
        (LOOK + " " * 10_000_000, RECORDED_ANSWER_BYTES, "too_long"),
        ("é" * 5_000_000, RECORDED_ANSWER_BYTES, "too_long"),
        (f"<think>{'é' * 5_000_000}", RECORDED_ANSWER_BYTES, "too_long"),
        (f"<think>{'é' * 5_000_000}</think>{LOOK}", RECORDED_REASONING_BYTES, None),
        (f"{'{}' * 5_000_000}</think>{LOOK}", RECORDED_REASONING_BYTES, None),
        (f"<think>{'é' * 5_000_000}</think>No.", RECORDED_REASONING_BYTES, "no_object"),
        (b"\xff" * 10_000_000, RECORDED_ANSWER_BYTES, "not_utf8"),
        (b" " * 10_000_000 + b"\xff", RECORDED_ANSWER_BYTES, "not_utf8"),
    ],
)
def test_an_overlong_reply_is_cut_as_a_fact_and_judged_as_the_whole_was(
    text: str | bytes, most: int, reason: str | None
) -> None:
    reply = Reply.model_validate({"text": text, "finish_reason": "stop", "reply_source": "server"})
    short = truncated(reply)
    raw = text.encode() if isinstance(text, str) else text
    assert most - 4 < len(short.raw) <= most
    assert (raw.startswith if most == RECORDED_ANSWER_BYTES else raw.endswith)(short.raw)
    assert short.cut is not None
    assert (short.cut.text_bytes, short.cut.sha256) == (len(raw), hashlib.sha256(raw).hexdigest())
    assert (short.finish_reason, short.reply_source) == ("stop", "server")
    read = Reply.model_validate_json(short.model_dump_json())
    assert read == short == truncated(short)
    assert parsed(read) == parsed(reply)
    assert is_truncated_in_history(read_reply(read).answer, Profile()) == is_truncated_in_history(
        read_reply(reply).answer, Profile()
    )
    found = parsed(reply)
    assert (found.reason if isinstance(found, InvalidAction) else None) == reason


@pytest.mark.parametrize("marker", ["</think>", "◁/think▷"])
@pytest.mark.parametrize("length", [65_536, 10_000_000])
def test_of_a_long_reasoning_and_a_long_answer_the_answers_beginning_is_kept(marker: str, length: int) -> None:
    """So that the history of a run that is gone on with is that of one that was never stopped."""
    reply = Reply(text=f"{'é' * 100_000}{marker}{LOOK}{' ' * length}")
    short = truncated(reply)
    assert short.text.startswith(f"{marker}{LOOK} ")
    assert len(short.raw) <= RECORDED_ANSWER_BYTES
    assert parsed(short) == parsed(reply)
    assert truncated(short) == short
    assert is_truncated_in_history(read_reply(short).answer, Profile())
    assert past_turn(None, short.text, Profile()) == past_turn(None, reply.text, Profile())
