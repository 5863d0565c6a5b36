"""Reasoning at the head of a reply, which is not part of the answer.

Many servers send a model's reasoning in the same text as its answer, closed by a marker; several leave out the opening
marker, which their chat template has written into the prompt. Source: `protocol.md` section 2.3.
"""

import re
from collections.abc import Iterator
from typing import Literal

from vigil.protocol.json_text import is_one_value, object_end

Thinking = Literal["on", "off", "default"]
"""What a run asks of a model: to reason before it answers, not to, or as the provider has it."""
CLOSING_MARKERS = ("</think>", "◁/think▷")
MAX_MARKERS = 64
"""Closing markers that are looked at, the last ones: more of them are no reasoning."""

_MARKER = re.compile(r"<(?:think(?:\s[^<>]*+)?|/think)>|◁/?think▷")


def split_reasoning(text: str) -> tuple[str, int]:
    """Return the answer without the reasoning at its head, and the number of characters in that.

    The answer begins at the first JSON object that stands at the start of the text or directly after a closing marker,
    and is not part of a reasoning. It is part of one when a closing marker after it has no opening marker after it. So
    in `{...}</think>{...}` the first object is a draft, but in `{...}<think>...</think>{...}` both are answers. Without
    such an object the text is cut at the last closing marker that a brace follows; if there is none, at the draft at
    its start or, without a draft, at its last closing marker. A text that is one JSON value is never cut.
    """
    closings = [marker.end() for marker in _MARKER.finditer(text) if _is_closing(marker)]
    if not closings or is_one_value(text):
        return text, 0
    cut = _cut(text, closings[-MAX_MARKERS:])
    return text[cut:], len(_MARKER.sub("", text[:cut]).strip())


def is_unclosed(text: str) -> bool:
    """Whether a text begins with a reasoning that never ends."""
    head = len(text) - len(text.lstrip())
    return _MARKER.match(text, head) is not None and not any(marker in text for marker in CLOSING_MARKERS)


def _is_closing(marker: re.Match[str]) -> bool:
    return marker[0][1] == "/"


def _cut(text: str, closings: list[int]) -> int:
    objects = list(_objects(text, (0, *closings)))
    for start, end in objects:
        if not _is_in_reasoning(text, end):
            return start
    behind = next((closing for closing in reversed(closings) if "{" in text[closing:]), None)
    if behind is not None:
        return behind
    return objects[-1][0] if objects else closings[-1]


def _objects(text: str, starts: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Yield each of `starts` with an object directly behind it, and the end of that object."""
    for start in starts:
        space = len(text) - start - len(text[start:].lstrip())
        end = object_end(text, start + space)
        if end >= 0:
            yield start, end


def _is_in_reasoning(text: str, position: int) -> bool:
    """Whether a reasoning that was opened before `position` is closed behind it."""
    depth = 0
    for marker in _MARKER.finditer(text, position):
        depth += -1 if _is_closing(marker) else 1
        if depth < 0:
            return True
    return False
