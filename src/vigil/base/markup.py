"""Markup: what documents of XML, SVG, HTML and LaTeX cannot hold is taken out of a text before it enters one."""

import re
from typing import Any

_INVALID = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What is no character of XML 1.0, or a control character all the same: halves of characters, U+FFFE, U+FFFF too."""
REPLACEMENT = "\ufffd"


def replace_invalid(text: str) -> str:
    """Return a text in which a mark stands for each character that no document of markup can hold."""
    return _INVALID.sub(REPLACEMENT, text)


def finalize(value: Any) -> Any:
    """Return a value as a template may put it out, a text of markup as such: Jinja's `finalize`."""
    if not isinstance(value, str) or (text := replace_invalid(value)) == value:
        return value
    return type(value)(text)
