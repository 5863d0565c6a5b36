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

TOKENS_PER_PRICE = 1_000_000
"""Tokens for which a price is given."""


@dataclass(frozen=True, slots=True)
class Tokens:
    """The tokens of some replies; of those that the provider told none for, only the number is known."""

    input: int = 0
    output: int = 0
    reported: int = 0
    """Replies whose tokens are known."""
    unreported: int = 0
    """Replies whose tokens are not known: of scripted agents and programs, and of servers that do not count."""

    @classmethod
    def of(cls, usages: Iterable[Usage | None]) -> "Tokens":
        """Return the tokens of replies, given what was told of each."""
        found = list(usages)
        reported = [usage for usage in found if usage is not None]
        return cls(
            sum(usage.input_tokens for usage in reported),
            sum(usage.output_tokens for usage in reported),
            len(reported),
            len(found) - len(reported),
        )

    def __add__(self, other: "Tokens") -> "Tokens":
        return Tokens(
            self.input + other.input,
            self.output + other.output,
            self.reported + other.reported,
            self.unreported + other.unreported,
        )

    def __str__(self) -> str:
        return f"{self.input:,} input and {self.output:,} output tokens"


class RunTokens:
    """What the replies of a run took, told as its rows come in."""

    def __init__(self) -> None:
        self.total = Tokens()
        self.superseded = Tokens()
        """Of rows whose place another has taken: an episode that ended as an error and was played again costs twice."""
        self._effective: dict[Hashable, Tokens] = {}

    def add(self, key: Hashable, tokens: Tokens) -> None:
        """Take in what a row took that stands from now on, in the place of any row of its key before it."""
        self.total += tokens
        self.superseded += self._effective.get(key, Tokens())
        self._effective[key] = tokens


class Prices(BaseModel):
    """What a million tokens cost, in whatever money."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    input: float = Field(ge=0)
    output: float = Field(ge=0)

    def cost(self, tokens: Tokens) -> float | None:
        """Return what the tokens that are known cost; None when those of no reply are."""
        return self.cost_of(tokens.input, tokens.output) if tokens.reported else None

    def cost_of(self, input_tokens: int, output_tokens: int) -> float:
        """Return what so many tokens cost."""
        return (input_tokens * self.input + output_tokens * self.output) / TOKENS_PER_PRICE

    def __str__(self) -> str:
        return f"{self.input:g} (input) and {self.output:g} (output) per million tokens"


def parse_prices(text: str) -> Prices:
    """Return the prices that a text such as 2.5,10 gives. Raises SettingError."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = -1.0
    if not (math.isfinite(low + high) and min(low, high) >= 0):
        raise SettingError(f"--prices {text!r} is not IN,OUT in money per million tokens, e.g. --prices 2.5,10.")
    return Prices(input=low, output=high)


def describe_costs(prices: Prices | None, tokens: RunTokens) -> str:
    """Say what a run's replies took and cost, and how far that is known; without prices, the tokens alone."""
    total = tokens.total
    if not total.reported:
        return "not known: no reply in the records tells its tokens"
    least = "at least " if total.unreported else ""
    unreported = (
        f"; {total.unreported} of {total.reported + total.unreported} replies tell none" if total.unreported else ""
    )
    reported = f"{total}{unreported}{_describe_superseded(prices, tokens.superseded)}"
    if prices is None:
        return f"{least}{reported}; --prices says what they cost"
    return f"{least}{prices.cost_of(total.input, total.output):,.2f} at {prices}: {reported}"


def _describe_superseded(prices: Prices | None, superseded: Tokens) -> str:
    if not superseded.reported:
        return ""
    part = (
        f"{superseded} of them"
        if prices is None
        else f"{prices.cost_of(superseded.input, superseded.output):,.2f} of it"
    )
    return f"; {part} for attempts that ended as errors and were played again"
