"""How tasks are said: sentences of every family, varied and natural, with slots for referring expressions.

No sentence gives away where a thing is beyond its phrase, nor, in state verification, which state it is in. A thing is
opened, lit and spoken of as a person would: the lid of a toilet, the drawers of a dresser, the flame of a candle.
"""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vigil.authoring.language.referring import ROOM_NAMES

Act = Literal["open", "close", "turn_on", "turn_off", "pick"]
Asked = Literal["is_toggled", "is_open"]

POINT = (
    "Point at {target}.",
    "Where is {target}? Point at it.",
    "Show me {target} by pointing at it in the picture.",
    "Put your pointer on {target}.",
    "I am looking for {target}. Point it out to me.",
    "Can you see {target}? Point at it.",
    "Please point to {target}.",
    "Indicate where {target} is.",
    "Which of the things in front of you is {target}? Point at it.",
    "Mark {target} in the picture.",
)

APPROACH = (
    "Walk up to {target}: come to within about one and a half metres of it and stop there.",
    "Go and stand near {target}, to within about one and a half metres of it.",
    "Approach {target} until you are within about one and a half metres of it.",
    "Move to within about one and a half metres of {target}.",
    "Get closer to {target}. Stop once you are within about one and a half metres of it.",
    "Please go over to {target} and halt within about one and a half metres of it.",
    "Come to within about one and a half metres of {target}, then stop.",
    "I want you to be within about one and a half metres of {target}.",
)

SEARCH = (
    "Find {target}. You are done once you have it clearly in view.",
    "Look around for {target} until you can see it.",
    "Search for {target} and bring it into view.",
    "Somewhere in this home is {target}. Find it and look at it.",
    "Where is {target}? Look for it until you have it in front of you.",
    "Go looking for {target}; stop when you see it clearly.",
    "Please locate {target} and get a clear view of it.",
    "I cannot find {target}. Have a look around until you see it.",
)

OPENED_PARTS = {
    "Dresser": "drawers",
    "LaundryHamper": "lid",
    "Stove": "oven door",
    "Toilet": "lid",
}
"""Category -> the part that a person opens; the thing itself for all others."""

QUESTIONS: dict[Asked, tuple[str, ...]] = {
    "is_toggled": (
        "Is {whole} on or off? Report its state.",
        "Check whether {whole} is switched on or off, and report which.",
        "Tell me whether {whole} is on or off.",
        "Look at {whole}. Is it on or off?",
        "Without touching it, find out whether {whole} is on or off.",
        "Report the state of {whole}: is it on or off?",
    ),
    "is_open": (
        "{Is} {whole} open or closed? Report {its} state.",
        "Check whether {whole} {is} open or closed, and report which.",
        "Tell me whether {whole} {is} open or closed.",
        "Look at {whole}. {Is} {they} open or closed?",
        "Without touching {it}, find out whether {whole} {is} open or closed.",
        "Report the state of {whole}: {is} {they} open or closed?",
    ),
}
CANDLE_QUESTIONS = (
    "Is the flame of {target} on or off? Report its state.",
    "Look at {target}: is its flame on or off?",
    "Check whether {target} is burning, and report on or off.",
    "Tell me whether {target} is lit: on or off?",
)

VERBS: dict[Act, tuple[str, ...]] = {
    "open": ("open {}",),
    "close": ("close {}", "shut {}"),
    "turn_on": ("turn on {}", "switch on {}"),
    "turn_off": ("turn off {}", "switch off {}"),
    "pick": ("pick up {}", "take {} in your hand"),
}
VERBS_OF: dict[str, dict[Act, tuple[str, ...]]] = {
    "Candle": {"turn_on": ("light {}",), "turn_off": ("put out {}", "extinguish {}")},
    "Faucet": {"turn_on": ("turn on {}",), "turn_off": ("turn off {}",)},
    "ShowerHead": {"turn_on": ("turn on {}",), "turn_off": ("turn off {}",)},
}
"""What people say otherwise of some categories."""
PARTICLES = ("turn on", "turn off", "switch on", "switch off", "put out", "pick up")
"""Verbs that take "it" in their middle."""

ORDERS = (
    "{Order}.",
    "Please {order}.",
    "Go to {target} and {order_it}.",
    "Walk over to {target} and {order_it}.",
    "Could you {order}?",
    "I would like you to {order}.",
    "Your task: {order}.",
)

SEARCH_ORDERS = (
    "Find {target} and {order_it}.",
    "Look for {target}, then {order_it}.",
    "Search the home for {target}. When you have found it, {order_it}.",
    "Somewhere in this home is {target}. Find it and {order_it}.",
    "Locate {target} and {order_it}, please.",
    "I need you to find {target} and {order_it}.",
    "Go looking for {target}. Once you see it, {order_it}.",
)

SEQUENCES = {
    "reveal_pick": (
        "Open {whole} and take out {target}.",
        "{Target} should be in {container}. Open {piece} and take {target} out.",
        "First open {whole}, then pick up {target}.",
        "Get {target} from inside {container}: open {piece}, then pick up {target}.",
        "Please open {whole} and pick up {target}, which is inside.",
    ),
    "put_into": (
        "Pick up {target} and put it {into} {receptacle}.",
        "Take {target}, then put it {into} {receptacle}.",
        "Please put {target} {into} {receptacle}.",
        "Bring {target} to {receptacle} and put it in.",
    ),
    "put_into_closed": (
        "Open {whole}, then pick up {target} and put it inside.",
        "Put {target} into {receptacle}. You have to open {whole} first.",
        "First open {whole}; then fetch {target} and put it in there.",
        "Please open {whole}, pick up {target} and put it inside.",
    ),
    "rearrange": (
        "Take {target} from {source} and put it {into} {receptacle}.",
        "Pick up {target} from {source}, then place it {in_} {receptacle}.",
        "{Target} is on {source}. Put it {into} {receptacle} instead.",
        "Move {target} from {source} to {receptacle}.",
    ),
    "open_pick_place": (
        "Open {whole}, take out {target} and put it {into} {receptacle}.",
        "First open {whole}, then pick up {target} and place it {in_} {receptacle}.",
        "{Target} is in {container}. Open {whole}, take {target} out and put it {into} {receptacle}.",
        "Please get {target} out of {container}, which you have to open, and put it {into} {receptacle}.",
    ),
}

CONSTRAINTS = {
    "obstacle": (
        "{Obstacle} is in the way: pick it up first. Then {order}.",
        "To get through, first pick up {obstacle}, which blocks the way. Then {order}.",
        "You cannot get past {obstacle}. Pick it up, then {order}.",
        "Clear the way by picking up {obstacle}, and then {order}.",
    ),
    "leaf": (
        "{Blocker} {stands} open in your way: close {it} first. Then {order}.",
        "First close {blocker}, which {stands} open and {blocks} the way. Then {order}.",
        "You cannot get past {blocker} while {they} {stands} open. Close {it}, then {order}.",
        "Make way by closing {blocker}, and then {order}.",
    ),
    "swing": (
        "{Obstacle} keeps {whole} from opening. Pick it up first, then {order}.",
        "First pick up {obstacle}, which stands right in front of {target}. Then {order}.",
        "{Whole} cannot open because {obstacle} is in the way. Pick up {obstacle}, then {order}.",
    ),
    "close_first": (
        "{Target} does not start while it is open. Close it first, then {order_it}.",
        "Close {target}, which does not run while open, and then {order_it}.",
        "{Target} has been left open. Shut it, and then {order_it}.",
        "Get {target} running: close it first, because it does not start while open.",
    ),
    "stop_first": (
        "{Target} does not open while it is running. Turn it off first, then {order_it}.",
        "Switch off {target}, which stays locked while it runs, and then {order_it}.",
        "{Target} is still running. Stop it, and then {order_it}.",
        "I need {target} open, but it is locked while it runs: switch it off first.",
    ),
    "hand": (
        "Your hand is full: put {obstacle} down first. Then {order}.",
        "Put down {obstacle}, which you are holding. Then {order}.",
        "You are holding {obstacle}. Put it down and {order} instead.",
        "Free your hand by putting down {obstacle}, and then {order}.",
    ),
}


_PUT_IN = r"(?:put|place|drop|leave)\b[^.;]*?\bin\b(?! the (?:{rooms})\b)"
INTO = re.compile(rf"\b(?:into|(?<!from )inside|{_PUT_IN.format(rooms='|'.join(sorted(ROOM_NAMES.values())))})\b")
"""Words that ask for something to be put into a receptacle: "put it in the sink", but "on the bed in the bedroom"."""


def asks_inside(instruction: str) -> bool:
    """Whether an instruction says that something is to be put inside a receptacle."""
    return INTO.search(instruction.lower()) is not None


def sequence(template: str, *, inside: bool) -> tuple[str, ...]:
    """Returns the sentences of a template; with `inside`, those alone that say so."""
    sentences = SEQUENCES[template]
    slots = {"into": "into", "in_": "in"}
    return tuple(each for each in sentences if not inside or asks_inside(each.format_map(_Blank(slots))))


class _Blank(dict[str, str]):
    """Slots of which the unknown ones stay empty."""

    def __missing__(self, _: str) -> str:
        return ""


@dataclass(frozen=True, slots=True)
class Opened:
    """What to call a thing when it is about opening it, in words that agree in number."""

    whole: str
    """Of a stove: "the oven door of the stove"."""
    piece: str
    """After the thing has been named: "its oven door"; "it" for what opens as a whole."""
    is_plural: bool

    def slots(self, whole: str = "whole") -> dict[str, str]:
        """Returns the slots of a sentence about it; `whole` names the first."""
        words = ("are", "they", "them", "their", "stand", "block")
        if not self.is_plural:
            words = ("is", "it", "it", "its", "stands", "blocks")
        names = ("is", "they", "it", "its", "stands", "blocks")
        return {whole: self.whole, "piece": self.piece, **dict(zip(names, words, strict=True))}


def opened(category: str, phrase: str) -> Opened:
    """Returns what to call a thing of a category that `phrase` refers to when it is about opening it."""
    part = OPENED_PARTS.get(category)
    if part is None:
        return Opened(phrase, "it", is_plural=False)
    return Opened(f"the {part} of {phrase}", f"its {part}", is_plural=part.endswith("s"))


def order(act: Act, category: str, phrase: str, rng: np.random.Generator) -> dict[str, str]:
    """Returns an order in full, and as it is said after the thing has been named, as slots `order`, `order_it`."""
    verbs = VERBS_OF.get(category, {}).get(act, VERBS[act])
    verb = verbs[int(rng.integers(len(verbs)))]
    parts = opened(category, phrase) if act in ("open", "close") else Opened(phrase, "it", is_plural=False)
    particle = next((each for each in PARTICLES if verb.startswith(each)), None)
    it = particle.replace(" ", " it ") if particle and parts.piece == "it" else verb.format(parts.piece)
    return {"order": verb.format(parts.whole), "order_it": it}


def question(asked: Asked, category: str, phrase: str, rng: np.random.Generator) -> str:
    """Returns a question about a thing's state that names both answers."""
    if category == "Candle":
        return say(CANDLE_QUESTIONS, rng, target=phrase)
    parts = opened(category, phrase) if asked == "is_open" else Opened(phrase, "it", is_plural=False)
    return say(QUESTIONS[asked], rng, **parts.slots())


def say(sentences: tuple[str, ...], rng: np.random.Generator, **slots: str) -> str:
    """Returns one of several sentences with its slots filled; a slot in capitals starts a sentence."""
    sentence = sentences[int(rng.integers(len(sentences)))]
    capitals = {name.capitalize(): text[:1].upper() + text[1:] for name, text in slots.items()}
    return sentence.format(**slots, **capitals)
