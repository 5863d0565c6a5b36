"""Reasoning at the start of a reply, which is not part of the answer.

Many servers send a model's reasoning in the same text as its answer, and a closing marker between the two. Several
servers omit the opening marker, because their chat template has already written it into the prompt. Source:
`protocol.md` section 2.3.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal

from vigil.base.json_files import is_object
from vigil.base.json_text import is_one_value, object_end

Thinking = Literal["on", "off", "default"]
"""Thinking mode of a run: the model reasons before it answers, does not, or uses the provider's default."""
CLOSING_MARKERS = ("</think>", "◁/think▷")
MAX_MARKERS = 64
"""Maximum number of closing markers that are considered, counted from the end of the text."""

_THINKS = re.compile(r"thinking|reason|\br1\b")
_ANSWERS_AT_ONCE = re.compile(r"(?<![a-z])instruct(?![a-z])")
_SWITCHES = {"thinking", "enable_thinking", "reasoning", "reasoning_effort"}
"""Fields by which requests to servers turn thinking on or off."""
_MARKER = re.compile(r"<(?:think(?:\s[^<>]*+)?|/think)>|◁/?think▷")


def split_reasoning(text: str) -> tuple[str, int]:
    """Return the answer without the reasoning before it, and the number of characters of the reasoning.

    A candidate is a JSON object at the start of the text or directly after a closing marker. If another closing marker
    follows the candidate, without an opening marker between them, the candidate is a draft, i.e. part of the reasoning.
    The answer begins at the first candidate that is not a draft. So in `{...}</think>{...}` the first object is a
    draft, but in `{...}<think>...</think>{...}` both objects belong to the answer.

    If every candidate is a draft, or there are none, the answer begins after the last closing marker that has a brace
    somewhere after it. If no closing marker has a brace after it, the answer begins at the last draft or, without a
    draft, after the last closing marker. A text that is one JSON value is not cut.
    """
    ends = [marker.end() for marker in _MARKER.finditer(text) if _is_closing(marker)]
    if not ends or is_one_value(text):
        return text, 0
    cut = _cut(text, ends[-MAX_MARKERS:])
    return text[cut:], len(_MARKER.sub("", text[:cut]).strip())


def declared_thinking(agent: str, thinking: Thinking, sampling: Mapping[str, Any]) -> bool | None:
    """Return whether a model thinks, by its name and by the settings of its run; None if neither says."""
    name = agent.rpartition("/")[2].casefold()
    if _THINKS.search(name):
        return True
    if thinking != "default":
        return thinking == "on"
    sent = _switch_in(sampling)
    return False if sent is None and _ANSWERS_AT_ONCE.search(name) else sent


def _switch_in(fields: Mapping[str, Any]) -> bool | None:
    """Return whether the fields of a request turn thinking on; None if they do not say."""
    for name, value in fields.items():
        if name in _SWITCHES and value is not None:
            inner = [value.get(key) for key in ("enabled", "type", "effort")] if is_object(value) else [value]
            return not any(each in (False, "disabled", "none") for each in inner)
        if is_object(value) and (found := _switch_in(value)) is not None:
            return found
    return None


def is_unclosed(text: str) -> bool:
    """Return whether a text begins with reasoning that is never closed."""
    head = len(text) - len(text.lstrip())
    return _MARKER.match(text, head) is not None and not any(marker in text for marker in CLOSING_MARKERS)


def _is_closing(marker: re.Match[str]) -> bool:
    return marker[0][1] == "/"


def _cut(text: str, ends: list[int]) -> int:
    objects = list(_objects(text, (0, *ends)))
    for start, end in objects:
        if not _is_in_reasoning(text, end):
            return start
    behind = next((closing for closing in reversed(ends) if "{" in text[closing:]), None)
    if behind is not None:
        return behind
    return objects[-1][0] if objects else ends[-1]


def _objects(text: str, starts: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """Yield (start, end) for each position in `starts` at which a JSON object begins; the object ends at `end`."""
    for start in starts:
        space = len(text) - start - len(text[start:].lstrip())
        end = object_end(text, start + space)
        if end >= 0:
            yield start, end


def _is_in_reasoning(text: str, position: int) -> bool:
    """Return whether reasoning that was opened before `position` is closed after it."""
    depth = 0
    for marker in _MARKER.finditer(text, position):
        depth += -1 if _is_closing(marker) else 1
        if depth < 0:
            return True
    return False
