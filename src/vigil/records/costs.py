"""Costs: the tokens that replies took, and what they come to at given prices.

What is counted is what providers said of each reply that is in a record. The check before a run, and requests and
attempts that failed and were made again, took tokens too, but are in no record.
"""

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, Field

from vigil.errors import SettingError
from vigil.protocol.actions import Usage

PER = 1_000_000
"""Tokens for which a price is given."""


@dataclass(frozen=True, slots=True)
class Tokens:
    """The tokens of some replies; of those that the provider told none for, only the number is known."""

    input: int = 0
    output: int = 0
    told: int = 0
    """Replies whose tokens are known."""
    untold: int = 0
    """Replies whose tokens are not known: of scripted agents and programs, and of servers that do not count."""

    @classmethod
    def of(cls, usages: Iterable[Usage | None]) -> "Tokens":
        """Returns the tokens of replies, given what was told of each."""
        found = list(usages)
        told = [usage for usage in found if usage is not None]
        return cls(
            sum(usage.input_tokens for usage in told),
            sum(usage.output_tokens for usage in told),
            len(told),
            len(found) - len(told),
        )

    def __add__(self, other: "Tokens") -> "Tokens":
        return Tokens(
            self.input + other.input, self.output + other.output, self.told + other.told, self.untold + other.untold
        )

    def __str__(self) -> str:
        return f"{self.input:,} input and {self.output:,} output tokens"


class RunTokens:
    """What the replies of a run took, told as its rows come in."""

    def __init__(self) -> None:
        self.total = Tokens()
        self.replaced = Tokens()
        """Of rows whose place another has taken: an episode that ended as an error and was played again costs twice."""
        self._standing: dict[Hashable, Tokens] = {}

    def add(self, key: Hashable, tokens: Tokens) -> None:
        """Takes in what a row took that stands from now on, in the place of any row of its key before it."""
        self.total += tokens
        self.replaced += self._standing.get(key, Tokens())
        self._standing[key] = tokens


class Prices(BaseModel):
    """What a million tokens cost, in whatever money."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    input: float = Field(ge=0)
    output: float = Field(ge=0)

    def cost(self, tokens: Tokens) -> float | None:
        """Returns what the tokens that are known cost; None when those of no reply are."""
        return self.of(tokens.input, tokens.output) if tokens.told else None

    def of(self, input_tokens: int, output_tokens: int) -> float:
        """Returns what so many tokens cost."""
        return (input_tokens * self.input + output_tokens * self.output) / PER

    def __str__(self) -> str:
        return f"{self.input:g} (input) and {self.output:g} (output) per million tokens"


def read_prices(text: str) -> Prices:
    """Returns the prices that a text such as 2.5,10 gives. Raises SettingError."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = -1.0
    if not (math.isfinite(low + high) and min(low, high) >= 0):
        raise SettingError(f"--prices {text!r} is not IN,OUT in money per million tokens, e.g. --prices 2.5,10.")
    return Prices(input=low, output=high)


def cost_words(prices: Prices | None, tokens: RunTokens) -> str:
    """Says what a run's replies took and cost, and how far that is known; without prices, the tokens alone."""
    total = tokens.total
    if not total.told:
        return "not known: no reply in the records tells its tokens"
    least = "at least " if total.untold else ""
    untold = f"; {total.untold} of {total.told + total.untold} replies tell none" if total.untold else ""
    told = f"{total}{untold}{_replaced_words(prices, tokens.replaced)}"
    if prices is None:
        return f"{least}{told}; --prices says what they cost"
    return f"{least}{prices.of(total.input, total.output):,.2f} at {prices}: {told}"


def _replaced_words(prices: Prices | None, replaced: Tokens) -> str:
    if not replaced.told:
        return ""
    part = f"{replaced} of them" if prices is None else f"{prices.of(replaced.input, replaced.output):,.2f} of it"
    return f"; {part} for attempts that ended as errors and were played again"
