"""Truncation of replies that are far longer than any valid answer, so that a record stays small."""

import hashlib

from vigil.protocol.actions import Reply, ReplyCut
from vigil.protocol.reasoning import CLOSING_MARKERS
from vigil.protocol.replies import MAX_REPLY_BYTES

RECORDED_ANSWER_BYTES = 2 * MAX_REPLY_BYTES
"""Number of bytes stored of a reply whose answer is too long to be valid. They begin where the reasoning ends."""
RECORDED_REASONING_BYTES = 1024 * 1024
"""Number of bytes stored from the end of a reply whose reasoning is too long, although its answer is not."""


def truncate_for_record(reply: Reply, answer: str) -> Reply:
    """Return `reply` as a record stores it: whole, or with `cut` set if it is far longer than any valid answer.

    During a run, the whole reply is parsed. If the stored part is parsed later, the result is the same, because the
    record also has the length of the whole reply. The beginning of the reasoning can be dropped, because its closing
    marker suffices to recognize it. `answer` is the text without reasoning.
    """
    raw = reply.raw
    if len(raw) <= RECORDED_ANSWER_BYTES:
        return reply
    answer_bytes = len(answer.encode()) if reply.is_utf8 else len(raw)
    cut = reply.cut or ReplyCut(text_bytes=len(raw), answer_bytes=answer_bytes, sha256=hashlib.sha256(raw).hexdigest())
    if cut.answer_bytes > MAX_REPLY_BYTES:
        reasoning = reply.text[: len(reply.text) - len(answer)] if reply.is_utf8 else ""
        marker = next((marker for marker in CLOSING_MARKERS if reasoning.endswith(marker)), "")
        start = len(reasoning.removesuffix(marker).encode()) if marker else 0
        part = raw[start : start + RECORDED_ANSWER_BYTES]
    elif len(raw) <= RECORDED_REASONING_BYTES:
        return reply
    else:
        part = raw[-RECORDED_REASONING_BYTES:]
    text: str | bytes = part.decode("utf-8", "ignore") if reply.is_utf8 else part
    facts = reply.model_dump(exclude={"text", "raw_base64"})
    return Reply.model_validate({**facts, "text": text, "cut": cut, "reasoning": reply.reasoning})
