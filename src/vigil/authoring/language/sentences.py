"""Sentence forms in two halves (public and held-out), and the forms of orders that several families use.

Packaged packs, recipes and streams use only the public half, so that private packs can use forms that are not
published. Both halves vary in the same ways: questions, requests, statements of a need, two sentences, purposes, the
passive. Forms that only one family uses are in its folder in `vigil.authoring.families`.

Slots: `target`, the phrase for the thing; `it` and `it_is`, its pronoun; `order`, an act in full ("open the box");
`order_it`, the act after the thing has been named ("open it"); `acted` and `done`, the act in the passive. The name of
a slot has a capital if the slot begins a sentence.
"""

from dataclasses import dataclass
from typing import Literal, get_args

Forms = Literal["public", "held_out", "all"]
"""Which sentence forms to use: one of the two halves, or all."""
FORMS: tuple[Forms, ...] = get_args(Forms)


@dataclass(frozen=True, slots=True)
class Sentences:
    """Sentence forms with the same meaning, in two halves."""

    public: tuple[str, ...]
    held_out: tuple[str, ...]

    def of(self, forms: Forms) -> tuple[str, ...]:
        """Return the forms of the requested half, or all forms."""
        halves = {"public": self.public, "held_out": self.held_out, "all": (*self.public, *self.held_out)}
        return halves[forms]


ORDERS = Sentences(
    public=(
        "{Order}.",
        "Please {order}.",
        "Go to {target} and {order_it}.",
        "Could you {order}?",
        "Your task is to {order}.",
        "I would like you to {order}.",
        "Go to {target} and {order_it}, so that I do not have to.",
        "What I need you to do is {order}.",
        "{Target} is over there. Go and {order_it}.",
        "There is one thing to do: {order}.",
        "I cannot get up right now. Please {order} for me.",
        "Make your way to {target}, then {order_it}.",
        "{Acted} has to be {done}.",
        "Do me a favour and {order}.",
        "You can see {target} from here. Go there and {order_it}.",
    ),
    held_out=(
        "Walk over to {target} and {order_it}.",
        "Would you {order}, please?",
        "I want you to {order}.",
        "It is time to {order}.",
        "Head for {target} and {order_it} once you are there.",
        "Can you get to {target} and {order_it}?",
        "All I ask is that you {order}.",
        "Be so kind as to {order}.",
        "First go to {target}; then {order_it}.",
        "You see {target}: {order_it}, please.",
        "Would you mind going over to {target}? I need you to {order_it}.",
        "Step up to {target} and {order_it}.",
        "{Acted} should be {done}. Please see to that.",
        "I want {acted} to be {done}: go there and do it.",
        "The next thing to do is to {order}.",
    ),
)

SEARCH_ORDERS = Sentences(
    public=(
        "Find {target} and {order_it}.",
        "Look for {target}, then {order_it}.",
        "Search the home for {target}. When you have found {it}, {order_it}.",
        "I need you to find {target} and {order_it}.",
        "Go looking for {target}. Once you see {it}, {order_it}.",
        "Please find {target} and {order_it}, so that I do not have to.",
        "Could you look for {target} and {order_it}?",
        "I do not know where {target} is. Find {it} and {order_it}.",
        "{Acted} has to be {done}. Have a look around first.",
        "Your task is to find {target} and to {order_it}.",
        "Explore until you come upon {target}, and then {order_it}.",
        "{Target} is not in sight from here. Look for {it} and {order_it}.",
        "Where is {target}? Find {it} and {order_it}.",
        "I would like you to {order}. You will have to search first.",
        "Have a look around for {target}; when you get there, {order_it}.",
    ),
    held_out=(
        "Locate {target} and {order_it}, please.",
        "Go and find {target}. Then {order_it}.",
        "Look everywhere for {target}, and {order_it} when you have found {it}.",
        "Would you find {target} for me and {order_it}?",
        "Make your way to {target}, wherever that may take you, and {order_it}.",
        "You cannot see {target} yet. Find {it} and {order_it}.",
        "I want you to {order}. Search until you get there.",
        "First find {target}; then {order_it}.",
        "Track down {target} and {order_it}.",
        "{Target} cannot be seen from where you stand. Go and find {it}, then {order_it}.",
        "Please {order}. Finding your way there is part of the task.",
        "Once you have found {target}, {order_it}.",
        "You will have to search for {target}. When you see {it}, {order_it}.",
        "{Acted} has to be {done}, wherever you have to go for that.",
        "Help me with {target}: find {it} and {order_it}.",
    ),
)
