"""Rewording: reads an instruction back into a sentence form and the words in its slots, and says it in another form.

The words for the things do not change, so the new sentence asks for the same. See `vigil.authoring.language.sentences`.
"""

import re
import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from vigil.authoring.language.sentences import Sentences
from vigil.authoring.language.wording import PARTICIPLES, PARTICIPLES_OF, VERBS, VERBS_OF

_PHRASE = r"(?:the|this|your|its)\b[^.?]*"
_VERB = "|".join(
    sorted({verb.split()[0] for verbs in (VERBS, *VERBS_OF.values()) for of_act in verbs.values() for verb in of_act})
)
_DONE = "|".join(sorted({word for words in (PARTICIPLES, *PARTICIPLES_OF.values()) for word in words.values()}))
_ORDER = rf"(?:{_VERB})\b[^.?]*"
_WORDS: dict[str, str] = {
    **dict.fromkeys(("order", "order_it", "order_a", "order_b"), _ORDER),
    **dict.fromkeys(("it", "target_it", "obstacle_it"), "it|them"),
    **dict.fromkeys(("target_it_is", "obstacle_it_is", "it_is"), "it is|they are"),
    **dict.fromkeys(("piece", "shut"), rf"it|{_PHRASE}"),
    "other": rf"on|off|open|closed|{_ORDER}|{_PHRASE}",
    "verb": "[a-z]+(?: on| off| up)?",
    "done": _DONE,
    **dict.fromkeys(("into", "in_"), "into|onto|in|on"),
    "one": "on|off|open|closed",
    "label": "(?:fully )?closed|open(?:, even a little)?|on|off",
    **dict.fromkeys(("room", "name"), "[a-z][a-z -]*"),
    "obstacle_blocks": "blocks?",
    "obstacle_stands": "stands?",
}
"""Slot -> pattern of its words. The other slots have phrases for things."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A sentence form, with the words for its slots."""

    sentences: Sentences
    form: str
    slots: dict[str, str]
    """Name of each slot, in lower case -> its words."""

    def said_as(self, form: str) -> str | None:
        """Return the sentence in another form; None if words for one of the form's slots are not known."""
        words = self.slots | {name.capitalize(): text[:1].upper() + text[1:] for name, text in self.slots.items()}
        return form.format(**words) if _slots(form) <= words.keys() else None


def read(text: str, tables: Sequence[Sentences]) -> Reading | None:
    """Return the sentence form that a text has, with the words for its slots.

    Of several forms, return the one with the most words outside its slots. None if no form fits, or if the text could
    be divided into slots in two ways.
    """
    found = [reading for table in tables for form in table.of("all") if (reading := _match(text, table, form))]
    return max(found, key=lambda reading: len(_literal(reading.form)), default=None)


def rewordings(text: str, tables: Sequence[Sentences], rng: np.random.Generator) -> Iterator[str]:
    """Yield the text in other forms of the same meaning, in random order, but held-out forms first.

    Each new text must read back to its form and to the words of the original.
    """
    reading = read(text, tables)
    if reading is None:
        return
    halves = (reading.sentences.held_out, reading.sentences.public)
    for form in (half[index] for half in halves for index in rng.permutation(len(half))):
        again = reading.said_as(form)
        if again is None or again == text:
            continue
        back = read(again, tables)
        if back is not None and back.form == form and back.slots.items() <= reading.slots.items():
            yield again


def _match(text: str, table: Sentences, form: str) -> Reading | None:
    lazy, greedy = (_pattern(form, star).fullmatch(text) for star in ("*?", "*"))
    if lazy is None or greedy is None or lazy.groupdict() != greedy.groupdict():
        return None
    words = {}
    for name, said in lazy.groupdict().items():
        words[name.lower()] = said[:1].lower() + said[1:] if name[0].isupper() else said
    return Reading(table, form, words)


@cache
def _pattern(form: str, star: str) -> re.Pattern[str]:
    """Return the pattern of a form. A slot takes as few words as possible if `star` is "*?", as many if it is "*"."""
    parts, seen = [], dict[str, str]()
    for literal, name, _, _ in string.Formatter().parse(form):
        parts.append(re.escape(literal))
        if name is None:
            continue
        slot = name.lower()
        if slot in seen:
            parts.append(f"(?i:(?P={seen[slot]}))")
            continue
        seen[slot] = name
        words = _WORDS.get(slot, _PHRASE).replace("*", star)
        parts.append(f"(?P<{name}>(?i:{words}))")
    return re.compile("".join(parts))


def _literal(form: str) -> str:
    return "".join(literal for literal, *_ in string.Formatter().parse(form))


def _slots(form: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(form) if name is not None}
