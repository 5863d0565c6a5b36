"""Strict JSON: the only reader of JSON files that may come from outside this package.

It accepts only standard JSON (no NaN, Infinity or lone surrogates), nested at most 201 levels deep. The parser sets
this limit, which does not depend on Python's stack. The project's own files are much less deep.
"""

import codecs
from typing import Any, TypeGuard

from pydantic_core import from_json


def read_json(data: bytes | str) -> Any:
    """Return the JSON value in `data`. Raises ValueError, whose message says what is wrong and where."""
    try:
        raw = data.encode() if isinstance(data, str) else data
    except UnicodeEncodeError as error:
        raise ValueError(f"an unpaired surrogate at position {error.start}") from None
    try:
        return from_json(raw, allow_inf_nan=False)
    except ValueError as error:
        raise ValueError(f"{error}{_hint(raw)}") from None


def is_object(value: object) -> TypeGuard[dict[str, Any]]:
    """Return whether a JSON value is an object."""
    return isinstance(value, dict)


def is_array(value: object) -> TypeGuard[list[Any]]:
    """Return whether a JSON value is an array."""
    return isinstance(value, list)


def _hint(data: bytes) -> str:
    """Return what to do, in parentheses, if the encoding of `data` is wrong or if only its numbers are; else ""."""
    if data.startswith((codecs.BOM_UTF8, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return " (it begins with a byte order mark: save it as UTF-8 without one)"
    try:
        from_json(data, allow_inf_nan=True)
    except ValueError:
        return ""
    return " (NaN and Infinity are not JSON)"
