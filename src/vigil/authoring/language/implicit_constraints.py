"""Instructions that do not state their constraint: how their kinds are named, and which words reveal a constraint."""

import re
from collections.abc import Iterator

IMPLICIT_SUFFIX = "_implicit"
_IN_THE_WAY = r"in (?:the|your|its) way|make way|block(?:s|ed|ing)?\b|barred\b|get (?:past|through)\b|clear\b|obstacle"
GIVEAWAY_WORDS = {
    "object_moved": rf"{_IN_THE_WAY}|from opening\b|\baside\b|in front of it|stands before",
    "object_closed": (
        rf"{_IN_THE_WAY}|(?:left|stands?|is|while) open\b|only when\b|can start\b|(?:close|shut) it before\b"
    ),
    "object_off": r"while\b|running\b|runs\b|locked\b|stop it\b|off\b",
    "object_released": r"down\b|full\b|(?<!take )hold(?:ing)?\b|free your\b|drop\b|let go\b|empty\b",
}
"""Kind of constraint -> regular expression of words that reveal it. The name of the obstacle is checked separately."""


def implicit_kind(kind: str) -> str:
    """Return the name of the kind that is like `kind` but does not state the constraint in its instructions."""
    return f"{kind}{IMPLICIT_SUFFIX}"


def is_implicit(template: str) -> bool:
    """Return whether instructions of this template do not state the constraint."""
    return template.endswith(IMPLICIT_SUFFIX)


def constraint_giveaways(instruction: str, constraint: str, obstacle: str | None) -> Iterator[str]:
    """Yield messages about words of an instruction that reveal the constraint.

    `constraint` is the kind of constraint. `obstacle` is the name of the obstacle; None if the obstacle is the target
    itself.
    """
    text = instruction.lower()
    if obstacle is not None and re.search(rf"\b{re.escape(obstacle.lower())}\b", text):
        yield f"the instruction mentions {obstacle!r}, which agents must find themselves"
    found = re.search(rf"\b(?:{GIVEAWAY_WORDS[constraint]})", text) if constraint in GIVEAWAY_WORDS else None
    if found is not None:
        yield f"the instruction says {found[0]!r}, which gives the constraint away"
