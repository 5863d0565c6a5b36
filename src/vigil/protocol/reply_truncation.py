"""How much of a reply a record stores: all of it, unless it is far longer than any valid answer.

The whole reply is always what is parsed. The stored part of an overlong reply parses to the same result, because the
record also has the length of the whole. Source: `protocol.md` section 2.3.
"""

import hashlib

from vigil.protocol.actions import Reply, ReplyCut
from vigil.protocol.reasoning import CLOSING_MARKERS, split_reasoning
from vigil.protocol.replies import MAX_REPLY_BYTES

RECORDED_ANSWER_BYTES = 2 * MAX_REPLY_BYTES
"""Bytes stored of a reply whose answer is too long to be valid, from the closing marker of its reasoning on."""
RECORDED_REASONING_BYTES = 1024 * 1024
"""Bytes stored from the end of a reply whose answer is short enough but whose reasoning is too long."""


def truncate_for_record(reply: Reply) -> Reply:
    """Return `reply` as a record stores it, with `cut` set if it was shortened.

    The beginning of the reasoning can be dropped, because its closing marker suffices to recognize it.
    """
    raw = reply.raw
    if len(raw) <= RECORDED_ANSWER_BYTES:
        return reply
    cut = reply.cut or _full_size(reply, raw)
    is_too_long = cut.answer_bytes > MAX_REPLY_BYTES
    if not is_too_long and len(raw) <= RECORDED_REASONING_BYTES:
        return reply
    part = _answer_start(reply, raw) if is_too_long else raw[-RECORDED_REASONING_BYTES:]
    text: str | bytes = part.decode("utf-8", "ignore") if reply.is_utf8 else part
    facts = reply.model_dump(exclude={"text", "raw_base64"})
    return Reply.model_validate({**facts, "text": text, "cut": cut, "reasoning": reply.reasoning})


def _answer_start(reply: Reply, raw: bytes) -> bytes:
    answer = split_reasoning(reply.text)[0]
    reasoning = reply.text[: len(reply.text) - len(answer)]
    marker = next((marker for marker in CLOSING_MARKERS if reasoning.endswith(marker)), "") if reply.is_utf8 else ""
    start = len(reasoning.removesuffix(marker).encode()) if marker else 0
    return raw[start : start + RECORDED_ANSWER_BYTES]


def _full_size(reply: Reply, raw: bytes) -> ReplyCut:
    answer_bytes = len(split_reasoning(reply.text)[0].encode()) if reply.is_utf8 else len(raw)
    return ReplyCut(text_bytes=len(raw), answer_bytes=answer_bytes, sha256=hashlib.sha256(raw).hexdigest())
