"""Strict JSON: the one way in which files that others may have written are read.

Standard JSON only (no NaN, no Infinity, no half characters), and nested no deeper than 200: the parser's own fixed
bound, whatever Python's stack is, and far more than any of the project's files has.
"""

from typing import Any

from pydantic_core import from_json


def read_json(data: bytes | str) -> Any:
    """Returns the JSON value that `data` is. Raises ValueError with what is wrong and where."""
    try:
        return from_json(data, allow_inf_nan=False)
    except UnicodeEncodeError as error:
        raise ValueError(f"half a character (a lone surrogate) at place {error.start}") from None
