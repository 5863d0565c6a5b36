"""Reasoning at the start of a reply, which is not part of the answer.

Many servers send a model's reasoning in the same text as its answer, ended by a marker; several omit the opening marker
because their chat template has already written it into the prompt. Source: `protocol.md` section 2.3.
"""

import re
from collections.abc import Iterator
from typing import Literal

from vigil.base.json_text import is_one_value, object_end

Thinking = Literal["on", "off", "default"]
"""Thinking mode of a run: the model reasons before it answers, does not, or uses the provider's default."""
CLOSING_MARKERS = ("</think>", "◁/think▷")
MAX_MARKERS = 64
"""Number of closing markers that are considered, counted from the end of the text."""

_MARKER = re.compile(r"<(?:think(?:\s[^<>]*+)?|/think)>|◁/?think▷")


def split_reasoning(text: str) -> tuple[str, int]:
    """Return the answer without the reasoning before it, and the number of characters of that reasoning.

    The answer begins at the first JSON object that is at the start of the text or directly after a closing marker, and
    is not part of the reasoning. An object is part of the reasoning if a closing marker after it has no opening marker
    between them. So in `{...}</think>{...}` the first object is a draft, but in `{...}<think>...</think>{...}` both are
    answers. Without such an object the text is cut at the last closing marker that is followed by a brace; without such
    a marker, at the last draft; without a draft, at the last closing marker. A text that is one JSON value is not cut.
    """
    closings = [marker.end() for marker in _MARKER.finditer(text) if _is_closing(marker)]
    if not closings or is_one_value(text):
        return text, 0
    cut = _cut(text, closings[-MAX_MARKERS:])
    return text[cut:], len(_MARKER.sub("", text[:cut]).strip())


def is_unclosed(text: str) -> bool:
    """Whether a text begins with reasoning that is never closed."""
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
    """Yield (start, end) for each of `starts` that is directly followed by an object, which ends at `end`."""
    for start in starts:
        space = len(text) - start - len(text[start:].lstrip())
        end = object_end(text, start + space)
        if end >= 0:
            yield start, end


def _is_in_reasoning(text: str, position: int) -> bool:
    """Whether reasoning that was opened before `position` is closed after it."""
    depth = 0
    for marker in _MARKER.finditer(text, position):
        depth += -1 if _is_closing(marker) else 1
        if depth < 0:
            return True
    return False
