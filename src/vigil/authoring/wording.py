"""How tasks are said: sentences of every family, varied and natural, with slots for referring expressions.

No sentence gives away where a thing is beyond its phrase, nor, in state verification, which state it is in.
"""

from typing import Literal

import numpy as np

Act = Literal["open", "close", "turn_on", "turn_off", "pick"]

POINT = (
    "Point at {target}.",
    "Where is {target}? Point at it.",
    "Show me {target} by pointing at it in the picture.",
    "Put your pointer on {target}.",
    "I am looking for {target}. Point it out to me.",
)

APPROACH = (
    "Walk up to {target}: come to within about one and a half metres of it and stop there.",
    "Go and stand near {target}, to within about one and a half metres of it.",
    "Approach {target} until you are within about one and a half metres of it.",
    "Move to within about one and a half metres of {target}.",
)

SEARCH = (
    "Find {target}. You are done once you have it clearly in view.",
    "Look around for {target} until you can see it.",
    "Search for {target} and bring it into view.",
    "Somewhere in this home there is something I need: {target}. Find it with your eyes.",
)

QUESTIONS = {
    "is_toggled": (
        "Is {target} on or off? Report its state.",
        "Check whether {target} is switched on or off, and report which.",
        "Tell me if {target} is on or off.",
    ),
    "is_open": (
        "Is {target} open or closed? Report its state.",
        "Check whether {target} is open or closed, and report which.",
        "Tell me if {target} is open or closed.",
    ),
}

ORDERS: dict[Act, tuple[str, ...]] = {
    "open": ("Open {target}.", "Please open {target}.", "Go to {target} and open it."),
    "close": ("Close {target}.", "Please shut {target}.", "Go to {target} and close it."),
    "turn_on": ("Turn on {target}.", "Please switch {target} on.", "Go to {target} and turn it on."),
    "turn_off": ("Turn off {target}.", "Please switch {target} off.", "Go to {target} and turn it off."),
    "pick": ("Pick up {target}.", "Please take {target} in your hand.", "Go and get {target}: pick it up."),
}

SEARCH_ORDERS: dict[Act, tuple[str, ...]] = {
    "open": ("Find {target} and open it.", "Look for {target}, then open it."),
    "close": ("Find {target} and close it.", "Look for {target}, then shut it."),
    "turn_on": ("Find {target} and turn it on.", "Look for {target}, then switch it on."),
    "turn_off": ("Find {target} and turn it off.", "Look for {target}, then switch it off."),
    "pick": ("Find {target} and pick it up.", "Look for {target}, then take it in your hand."),
}

SEQUENCES = {
    "reveal_pick": (
        "Open {container} and take out {target}.",
        "{Target} should be in {container}. Open {container} and pick up {target}.",
        "First open {container}, then pick up {target}.",
    ),
    "put_into": (
        "Pick up {target} and put it {into} {receptacle}.",
        "Take {target}, then put it {into} {receptacle}.",
    ),
    "put_into_closed": (
        "Open {receptacle}, then pick up {target} and put it into {receptacle}.",
        "Put {target} into {receptacle}. You have to open {receptacle} first.",
    ),
    "rearrange": (
        "Take {target} from {source} and put it {into} {receptacle}.",
        "Pick up {target} from {source}, then place it {into} {receptacle}.",
    ),
    "open_pick_place": (
        "Open {container}, take out {target} and put it {into} {receptacle}.",
        "First open {container}, then pick up {target} and place it {into} {receptacle}.",
    ),
}

CONSTRAINTS = {
    "obstacle": (
        "{Obstacle} is in the way: pick it up first. Then {order}.",
        "To get through, first pick up {obstacle}, which blocks the way. Then {order}.",
    ),
    "leaf": (
        "{Obstacle} stands open in your way: close it first. Then {order}.",
        "First close {obstacle}, which stands open and blocks the way. Then {order}.",
    ),
    "swing": (
        "{Obstacle} is standing where {target} has to swing open. Pick it up first, then {order}.",
        "First pick up {obstacle}: it keeps {target} from opening. Then {order}.",
    ),
    "close_first": (
        "{Target} does not start while it is open. Close it first, then {order}.",
        "Close {target}, which does not run while open, and then {order}.",
    ),
    "stop_first": (
        "{Target} does not open while it is running. Turn it off first, then {order}.",
        "Switch off {target}, which stays locked while it runs, and then {order}.",
    ),
    "hand": (
        "Your hand is full: put {obstacle} down first. Then {order}.",
        "Put down {obstacle}, which you are holding. Then {order}.",
    ),
}

SHORT_ORDERS: dict[Act, str] = {
    "open": "open {target}",
    "close": "close {target}",
    "turn_on": "turn {target} on",
    "turn_off": "turn {target} off",
    "pick": "pick up {target}",
}


def say(sentences: tuple[str, ...], rng: np.random.Generator, **slots: str) -> str:
    """Returns one of several sentences with its slots filled; a slot in capitals starts a sentence."""
    sentence = sentences[int(rng.integers(len(sentences)))]
    capitals = {name.capitalize(): text[:1].upper() + text[1:] for name, text in slots.items()}
    return sentence.format(**slots, **capitals)
