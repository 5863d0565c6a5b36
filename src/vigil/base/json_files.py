"""Strict JSON: the one way in which files that others may have written are read.

Standard JSON only (no NaN, no Infinity, no half characters), and nested no deeper than 201: the parser's own fixed
bound, whatever Python's stack is, and far more than any of the project's files has.
"""

from typing import Any

from pydantic_core import from_json


def read_json(data: bytes | str) -> Any:
    """Return the JSON value that `data` is. Raises ValueError with what is wrong and where."""
    try:
        raw = data.encode() if isinstance(data, str) else data
    except UnicodeEncodeError as error:
        raise ValueError(f"half a character (a lone surrogate) at place {error.start}") from None
    try:
        return from_json(raw, allow_inf_nan=False)
    except ValueError as error:
        raise ValueError(f"{error}{_hint(raw)}") from None


def _hint(data: bytes) -> str:
    """Return what is likely meant when all that is wrong are numbers that JSON does not have."""
    try:
        from_json(data, allow_inf_nan=True)
    except ValueError:
        return ""
    return " (NaN and Infinity are no JSON)"
