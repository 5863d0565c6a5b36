"""Strict parsing of JSON in a reply: no duplicate keys, no NaN, no lone surrogates, at most MAX_DEPTH levels.

The nesting depth is found by scanning the brackets before anything is decoded, so that the limit is the same on every
machine and does not depend on Python's stack. Source: `protocol.md` section 2.3.
"""

import json
import re
from typing import Any

from vigil.base.json_files import is_array, is_object

MAX_DEPTH = 64
"""Maximum nesting of objects and lists; the outermost is level 1, and numbers and strings add no level."""
MAX_INT_DIGITS = 300
"""Maximum number of digits of an integer. A longer integer becomes an infinite float, which no argument accepts."""

_TOKEN = re.compile(r'"(?:[^"\\]++|\\.)*+"?|[\[\]{}]', re.DOTALL)
"""Pattern of a bracket or a whole string, which may hold brackets. Possessive quantifiers prevent backtracking."""


class JsonFault(Exception):
    """Error for a text that is not strict JSON; its message is a short code of the reason."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(reason)
        self.reason = reason
        self.detail = detail


def extent(text: str, start: int) -> tuple[int, int]:
    """Return the end of the object or list that opens at `start` (-1 if it never closes), and its nesting depth."""
    depth = deepest = 0
    for token in _TOKEN.finditer(text, start):
        mark = text[token.start()]
        if mark in "[{":
            depth += 1
            deepest = max(deepest, depth)
        elif mark in "]}":
            depth -= 1
            if depth == 0:
                return token.end(), deepest
    return -1, deepest


def decode(text: str, start: int = 0) -> tuple[Any, int]:
    """Return the JSON value that begins at `start`, and the position where the value ends. Raises JsonFault."""
    if text[start : start + 1] in ("{", "[") and extent(text, start)[1] > MAX_DEPTH:
        raise JsonFault("too_deep", f"more than {MAX_DEPTH} levels")
    try:
        value, end = _STRICT.raw_decode(text, start)
    except ValueError as error:
        raise JsonFault("not_json", str(error)) from None
    _refuse_lone_surrogates(value)
    return value, end


def object_end(text: str, start: int) -> int:
    """Return the end of the JSON object that begins at `start`; -1 if no object begins there.

    An object that has duplicate keys, NaN or too many levels is invalid, but still counts as an object here.
    """
    if not text.startswith("{", start):
        return -1
    end, deepest = extent(text, start)
    if end < 0 or deepest > MAX_DEPTH:
        return end
    return end if _value_end(text, start) == end else -1


def is_one_value(text: str) -> bool:
    """Return whether the whole text, without surrounding white space, is one JSON value."""
    text = text.strip()
    if text.startswith(("{", "[")):
        end, deepest = extent(text, 0)
        if end != len(text):
            return False
        if deepest > MAX_DEPTH:
            return True
    return bool(text) and _value_end(text, 0) == len(text)


def _value_end(text: str, start: int) -> int:
    try:
        return _LAX.raw_decode(text, start)[1]
    except ValueError:
        return -1


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) <= MAX_INT_DIGITS else float(digits)


def _refuse_constant(name: str) -> None:
    raise JsonFault("not_a_number", name)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise JsonFault("duplicate_key", ascii(name)[:80])
        fields[name] = value
    return fields


def _refuse_lone_surrogates(value: Any) -> None:
    stack = [value]
    while stack:
        item = stack.pop()
        if is_object(item):
            stack.extend(item.keys())
            stack.extend(item.values())
        elif is_array(item):
            stack.extend(item)
        elif isinstance(item, str) and not item.isascii() and any("\ud800" <= char <= "\udfff" for char in item):
            raise JsonFault("lone_surrogate")


_STRICT = json.JSONDecoder(object_pairs_hook=_object, parse_int=_integer, parse_constant=_refuse_constant)
_LAX = json.JSONDecoder(parse_int=_integer)
