"""Markup: replaces those characters of a text that XML, SVG, HTML and LaTeX documents cannot contain."""

import re
from typing import Any

_INVALID = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Pattern of the characters to replace: those that XML 1.0 forbids (lone surrogates, U+FFFE, U+FFFF ...), and control
characters, although XML 1.0 allows some of them."""
REPLACEMENT = "\ufffd"


def replace_invalid(text: str) -> str:
    """Return `text` with `REPLACEMENT` for each character that markup cannot contain."""
    return _INVALID.sub(REPLACEMENT, text)


def finalize(value: Any) -> Any:
    """Return a string of the same class without invalid characters; other values are returned unchanged.

    Jinja calls this function as its `finalize`.
    """
    if not isinstance(value, str) or (text := replace_invalid(value)) == value:
        return value
    return type(value)(text)
