"""Reasoning at the head of a reply, which is not part of the answer.

Many servers send a model's reasoning in the same text as its answer, closed by a marker; several leave out the opening
marker, which their chat template has written into the prompt. Source: `protocol.md` section 2.3.
"""

import re
from collections.abc import Iterator

from vigil.json_text import is_one_value, object_end

MAX_CUTS = 64
"""Closing markers that are looked at, the last ones: more of them are no reasoning."""

_MARKER = re.compile(r"<(?:think(?:\s[^<>]*+)?|/think)>|◁/?think▷")
_CLOSING = re.compile(r"</think>|◁/think▷")


def split_reasoning(text: str) -> tuple[str, int]:
    """Returns the answer without the reasoning at its head, and the number of characters in that.

    The reasoning goes from the start up to and including the last closing marker before the object. The object is the
    first that stands at the start or directly behind a closing marker and is not inside a reasoning itself: a closing
    marker further on that was never opened tells that the text up to it still belonged to one. So `{...}</think>{...}`
    is a draft and an answer, but `{...}<think>...</think>{...}` two objects with a reasoning between them. A text that
    is one JSON value as a whole is never cut; one without any object is cut at its last closing marker.
    """
    closings = [marker.end() for marker in _MARKER.finditer(text) if _is_closing(marker)]
    if not closings or is_one_value(text):
        return text, 0
    cut = _cut(text, closings[-MAX_CUTS:])
    return text[cut:], len(_MARKER.sub("", text[:cut]).strip())


def is_unclosed(text: str) -> bool:
    """Whether a text begins with a reasoning that never ends."""
    head = len(text) - len(text.lstrip())
    return _MARKER.match(text, head) is not None and _CLOSING.search(text) is None


def _is_closing(marker: re.Match[str]) -> bool:
    return marker[0][1] == "/"


def _cut(text: str, closings: list[int]) -> int:
    objects = list(_objects(text, (0, *closings)))
    for start, end in objects:
        if not _is_inside(text, end):
            return start
    behind = next((closing for closing in reversed(closings) if "{" in text[closing:]), None)
    if behind is not None:
        return behind
    return objects[-1][0] if objects else closings[-1]


def _objects(text: str, starts: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Yields each of `starts` with an object directly behind it, and the end of that object."""
    for start in starts:
        space = len(text) - start - len(text[start:].lstrip())
        end = object_end(text, start + space)
        if end >= 0:
            yield start, end


def _is_inside(text: str, position: int) -> bool:
    """Whether a reasoning that was opened before `position` is closed behind it."""
    depth = 0
    for marker in _MARKER.finditer(text, position):
        depth += -1 if _is_closing(marker) else 1
        if depth < 0:
            return True
    return False
