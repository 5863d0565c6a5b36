"""Numbered list in a text: an opening line, then one line for each entry, "1. ...", "2. ..."."""

import re
from collections.abc import Sequence

_LINE = re.compile(r"([1-9][0-9]*)\. (\S.*)")


def write_list(opening: str, entries: Sequence[str]) -> str:
    """Return a text with a list: its opening, then each entry on a line with its number, from 1."""
    return "\n".join([opening, *(f"{number}. {entry}" for number, entry in enumerate(entries, start=1))])


def read_list(text: str) -> tuple[str, ...]:
    """Return the entries of the list in a text, in the order of their numbers; empty if the text is not such a list.

    The first line is the opening. Every other line must have the next number, from 1.
    """
    lines = [_LINE.fullmatch(line) for line in text.split("\n")[1:]]
    entries = tuple(line[2] for number, line in enumerate(lines, start=1) if line and line[1] == str(number))
    return entries if len(entries) == len(lines) else ()
