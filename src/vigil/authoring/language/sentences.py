"""Sentence forms in two halves (public and held-out), and the forms of orders that several families use.

Packaged packs, recipes and streams use only the public half, so that private packs can use forms that are not
published. Both halves vary in the same ways: questions, requests, statements of a need, two sentences, purposes, the
passive. The forms are rows of TOML files: those that only one family uses are in its folder in
`vigil.authoring.families`.

Slots: `target`, the phrase for the thing; `it` and `it_is`, its pronoun; `order`, an act in full ("open the box");
`order_it`, the act after the thing has been named ("open it"); `acted` and `done`, the act in the passive. The name of
a slot has a capital if the slot begins a sentence.
"""

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
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

    def with_halves(self, change: Callable[[tuple[str, ...]], Iterable[str]]) -> "Sentences":
        """Return the forms that `change` makes of each half."""
        return Sentences(tuple(change(self.public)), tuple(change(self.held_out)))


def read_sentences(path: Path) -> dict[str, Sentences]:
    """Return name -> sentence forms, from a TOML file that has the lists `public` and `held_out` for each name."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return {name: Sentences(**{half: tuple(forms) for half, forms in each.items()}) for name, each in tables.items()}


_FORMS = read_sentences(Path(__file__).with_name("sentences.toml"))
ORDERS, SEARCH_ORDERS = _FORMS["orders"], _FORMS["search_orders"]
"""Orders about a thing in view, and orders to search for a thing first."""
