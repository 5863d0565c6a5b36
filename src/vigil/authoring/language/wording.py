"""Wording of tasks: the words that fill the slots of a sentence form, and agree with the things that they mean.

The forms are in `sentences` and in the folders of the families. The words for a thing do not say more about its place
than its phrase does. In state verification, the words do not say in which state the thing is. The words are those that
people use: the lid of a toilet is opened, a candle is lit.
"""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vigil.authoring.language.referring import ROOM_NAMES

Act = Literal["open", "close", "turn_on", "turn_off", "pick"]

OPENED_PARTS = {
    "LaundryHamper": "lid",
    "Stove": "oven door",
    "Toilet": "lid",
}
"""Category -> name of the part that people open; in other categories they open the thing itself."""

VERBS: dict[Act, tuple[str, ...]] = {
    "open": ("open {}",),
    "close": ("close {}", "shut {}"),
    "turn_on": ("turn on {}", "switch on {}"),
    "turn_off": ("turn off {}", "switch off {}"),
    "pick": ("pick up {}", "take hold of {}"),
}
VERBS_OF: dict[str, dict[Act, tuple[str, ...]]] = {
    "Candle": {"turn_on": ("light {}",), "turn_off": ("put out {}", "extinguish {}")},
    "Faucet": {"turn_on": ("turn on {}",), "turn_off": ("turn off {}",)},
    "ShowerHead": {"turn_on": ("turn on {}",), "turn_off": ("turn off {}",)},
}
"""Category -> act -> the verbs used instead of those in `VERBS`."""
PARTICLES = ("turn on", "turn off", "switch on", "switch off", "put out", "pick up")
"""Verbs with the pronoun between their two words: "turn it on"."""

PARTICIPLES: dict[Act, str] = {
    "open": "opened",
    "close": "closed",
    "turn_on": "turned on",
    "turn_off": "turned off",
    "pick": "picked up",
}
PARTICIPLES_OF: dict[str, dict[Act, str]] = {"Candle": {"turn_on": "lit", "turn_off": "put out"}}
"""Category -> act -> the participle used instead of the one in `PARTICIPLES`."""
PAIRS = frozenset({"Boots"})
"""Categories with the pronoun "them"."""

_PUT_IN = r"(?:put|place|drop|leave)\b[^.;]*?\bin\b(?! the (?:{rooms})\b)"
INTO = re.compile(rf"\b(?:into|(?<!from )inside|{_PUT_IN.format(rooms='|'.join(sorted(ROOM_NAMES.values())))})\b")
"""Pattern of words that ask to put an object into a receptacle: "in the sink", but not "in the bedroom" (a room)."""


def asks_inside(instruction: str) -> bool:
    """Return whether an instruction asks to put an object inside a receptacle."""
    return INTO.search(instruction.lower()) is not None


@dataclass(frozen=True, slots=True)
class OpeningPhrase:
    """Words for the part of a thing that people open; if they open the thing as a whole, for the thing itself."""

    whole: str
    """Full phrase, e.g. "the oven door of the stove"."""
    piece: str
    """Phrase to use after the thing has been named, e.g. "its oven door"; "it" for a thing that opens as a whole."""

    def slots(self, whole: str = "whole") -> dict[str, str]:
        """Return the words for the slots of a sentence. `whole` is the name of the slot for the full phrase."""
        return {whole: self.whole, "piece": self.piece, "it": "it"}


def opening_phrase(category: str, phrase: str) -> OpeningPhrase:
    """Return the words for opening a thing of this category; `phrase` means the thing."""
    part = OPENED_PARTS.get(category)
    if part is None:
        return OpeningPhrase(phrase, "it")
    return OpeningPhrase(f"the {part} of {phrase}", f"its {part}")


def pronoun_slots(category: str, role: str = "") -> dict[str, str]:
    """Return slot -> word for a thing's pronoun and verbs. Names of slots begin with `role`, e.g. `obstacle_it`."""
    words = ("them", "they are", "block", "stand") if category in PAIRS else ("it", "it is", "blocks", "stands")
    return {f"{role}{name}": word for name, word in zip(("it", "it_is", "blocks", "stands"), words, strict=True)}


def order_slots(act: Act, category: str, phrase: str, rng: np.random.Generator) -> dict[str, str]:
    """Return slot -> words for an order: the order in full, the order after the thing has been named, and the passive.

    `phrase` means the thing; `rng` chooses the verb.
    """
    verbs = VERBS_OF.get(category, {}).get(act, VERBS[act])
    verb = verbs[int(rng.integers(len(verbs)))]
    again = pronoun_slots(category)["it"]
    parts = opening_phrase(category, phrase) if act in ("open", "close") else OpeningPhrase(phrase, again)
    particle = next((each for each in PARTICLES if verb.startswith(each)), None)
    it = particle.replace(" ", f" {again} ") if particle and parts.piece == again else verb.format(parts.piece)
    return {
        "order": verb.format(parts.whole),
        "order_it": it,
        "acted": parts.whole,
        "done": PARTICIPLES_OF.get(category, {}).get(act, PARTICIPLES[act]),
    }


def say(sentences: tuple[str, ...], rng: np.random.Generator, **slots: str) -> str:
    """Return one of the sentences at random, with its slots filled. A slot with a capital begins a sentence."""
    sentence = sentences[int(rng.integers(len(sentences)))]
    capitals = {name.capitalize(): text[:1].upper() + text[1:] for name, text in slots.items()}
    return sentence.format(**slots, **capitals)
