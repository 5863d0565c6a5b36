"""Prompt file: a custom system prompt with placeholders, and the name of its prompt variant.

A placeholder is a word in capitals within angle brackets. The four placeholders stand for the instruction and for the
three blocks that every agent gets. None of them reveals hidden state.
"""

import hashlib
import re
from pathlib import Path
from typing import Final

from vigil.base.files import read_file
from vigil.errors import SettingError, did_you_mean

INSTRUCTION_SLOT: Final = "<TASK_INSTRUCTION>"
ACTIONS_SLOT: Final = "<ALLOWED_ACTIONS>"
GROUNDING_SLOT: Final = "<GROUNDING_RULES>"
OUTPUT_SLOT: Final = "<OUTPUT_FORMAT>"
MAX_BYTES = 64_000
_SLOT = re.compile(r"<[A-Z][A-Z0-9_]*>")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


def variant_of(template: str) -> str:
    """Return the name of a template's prompt variant. The name depends only on the template's text."""
    return f"file-{hashlib.sha256(template.encode()).hexdigest()[:12]}"


def read_prompt_file(name: str) -> str:
    """Return the template in a file, without byte order mark and trailing newlines. Raises SettingError."""
    path = Path(name)
    if not path.is_file():
        raise SettingError(f"Prompt file {name!r} does not exist, or is not a file. Give the path of a text file.")
    try:
        data = read_file(path, f"Prompt file {name!r}", SettingError, 2 * MAX_BYTES)
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise SettingError(f"Prompt file {name!r}: line {line} is not UTF-8. Save it as UTF-8.") from None
    template = text.replace("\r\n", "\n").rstrip("\n")
    try:
        check_template(template)
    except ValueError as error:
        raise SettingError(f"Prompt file {name!r}: {error}") from None
    return template


def check_template(template: str) -> None:
    """Raise ValueError unless a template has the instruction's placeholder exactly once, each other known placeholder
    at most once, and no unknown placeholder."""
    size = len(template.encode("utf-8", "surrogatepass"))
    if size > MAX_BYTES:
        raise ValueError(f"{size:,} bytes are too many for a prompt. The limit is {MAX_BYTES:,}.")
    fault = _CONTROL.search(template) or re.search(r"[\ud800-\udfff]", template)
    if fault is not None:
        raise ValueError(f"{_place(template, fault)}: {fault[0]!r} is not allowed in a text. Remove it.")
    seen: set[str] = set()
    for slot in _SLOT.finditer(template):
        known = (INSTRUCTION_SLOT, ACTIONS_SLOT, GROUNDING_SLOT, OUTPUT_SLOT)
        if slot[0] not in known:
            raise ValueError(
                f"{_place(template, slot)}: {slot[0]} is not a placeholder.{did_you_mean(slot[0], known)} The "
                f"placeholders are {', '.join(known)}; write other words in angle brackets in lower case."
            )
        if slot[0] in seen:
            raise ValueError(f"{_place(template, slot)}: {slot[0]} occurs twice. Remove one of them.")
        seen.add(slot[0])
    if INSTRUCTION_SLOT not in seen:
        raise ValueError(f"{INSTRUCTION_SLOT} is missing. Put it where an episode's instruction belongs.")


def _place(template: str, found: re.Match[str]) -> str:
    return f"line {template.count(chr(10), 0, found.start()) + 1}"
