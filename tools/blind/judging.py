"""Judges readers' answers.

Only the best guess counts. It is right when it is the catalogue's name of the category, or one of its accepted words,
which mean the same thing. A state is right when the answer names it and not its opposite.
"""

import json
import re
from functools import cache
from pathlib import Path

from vigil.assets.catalog import CATALOG

WORDS = Path(__file__).with_name("accepted_words.json")
OPPOSITES = {"open": "closed", "closed": "open", "on": "off", "off": "on"}
STATE_SYNONYMS = {"shut": "closed", "opened": "open"}
"""Other words for a state."""


@cache
def accepted() -> dict[str, frozenset[str]]:
    """Return the names that are right for each category."""
    listed: dict[str, list[str]] = json.loads(WORDS.read_text(encoding="utf-8"))
    return {
        name: frozenset({normalized(row.display_name), *map(normalized, listed.get(name, ()))})
        for name, row in CATALOG.items()
    }


def normalized(words: str) -> str:
    """Return words without an article, capitals, hyphens and space around."""
    return re.sub(r"^(a|an|the) ", "", " ".join(words.casefold().replace("-", " ").split()))


def is_named(category: str, best: str) -> bool:
    """Whether a best guess names a category."""
    return normalized(best) in accepted()[category]


def is_state_named(state: str, answer: str) -> bool:
    """Whether an answer names a state."""
    words = {STATE_SYNONYMS.get(word, word) for word in re.findall(r"[a-z]+", answer.casefold())}
    return state in words and OPPOSITES.get(state) not in words
