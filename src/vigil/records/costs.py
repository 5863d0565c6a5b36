"""Costs: the tokens of a run's replies, and their cost at given prices.

Only the tokens that providers reported for the replies in records are counted. The check before a run, failed requests
and repeated attempts also used tokens, but these are not in any record.
"""

import math
from collections.abc import Hashable, Iterable
from dataclasses import astuple, dataclass
from operator import add

from pydantic import Field

from vigil.base.models import FrozenModel
from vigil.errors import SettingError
from vigil.protocol.actions import Usage

TOKENS_PER_PRICE = 1_000_000
"""Number of tokens that a price refers to."""


@dataclass(frozen=True, slots=True)
class Tokens:
    """The tokens of some replies, and the number of replies whose tokens are unknown."""

    input: int = 0
    output: int = 0
    reported: int = 0
    """Number of replies whose tokens are known."""
    unreported: int = 0
    """Number of replies whose tokens are unknown, because scripts, programs and some servers do not report tokens."""

    @classmethod
    def of(cls, usages: Iterable[Usage | None]) -> "Tokens":
        """Return the sum of the usages of replies. A usage is None if the provider did not report it."""
        found = list(usages)
        reported = [usage for usage in found if usage is not None]
        return cls(
            sum(usage.input_tokens for usage in reported),
            sum(usage.output_tokens for usage in reported),
            len(reported),
            len(found) - len(reported),
        )

    def __add__(self, other: "Tokens") -> "Tokens":
        return Tokens(*map(add, astuple(self), astuple(other)))

    def __str__(self) -> str:
        return f"{self.input:,} input and {self.output:,} output tokens"


class RunTokens:
    """The tokens of a run's replies, summed while rows are read."""

    def __init__(self) -> None:
        self.total = Tokens()
        self.superseded = Tokens()
        """Tokens of superseded rows: rows of episodes that ended as an error and were then played again."""
        self._effective: dict[Hashable, Tokens] = {}

    def add(self, key: Hashable, tokens: Tokens) -> None:
        """Add the tokens of a row. The row replaces any earlier row with the same `key` (episode and epoch), which then
        counts as superseded."""
        self.total += tokens
        self.superseded += self._effective.get(key, Tokens())
        self._effective[key] = tokens


class Prices(FrozenModel):
    """Prices of a million input tokens and of a million output tokens, in any currency."""

    input: float = Field(ge=0)
    output: float = Field(ge=0)

    def cost(self, tokens: Tokens) -> float | None:
        """Return the cost of the known tokens; None if no reply has known tokens."""
        return self.cost_of(tokens.input, tokens.output) if tokens.reported else None

    def cost_of(self, input_tokens: int, output_tokens: int) -> float:
        """Return the cost of these numbers of tokens."""
        return (input_tokens * self.input + output_tokens * self.output) / TOKENS_PER_PRICE

    def __str__(self) -> str:
        return f"{self.input:g} (input) and {self.output:g} (output) per million tokens"


def parse_prices(text: str) -> Prices:
    """Return the prices in a text such as "2.5,10" (input, output). Raises SettingError."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = -1.0
    if not (math.isfinite(low + high) and min(low, high) >= 0):
        raise SettingError(f"--prices {text!r} is not IN,OUT in money per million tokens, e.g. --prices 2.5,10.")
    return Prices(input=low, output=high)


def describe_costs(prices: Prices | None, tokens: RunTokens) -> str:
    """Return a text with the tokens of a run's replies, their cost (if there are prices), and what is unknown."""
    total = tokens.total
    if not total.reported:
        return "not known: no reply in the records reports its tokens"
    least = "at least " if total.unreported else ""
    unreported = (
        f"; {total.unreported} of {total.reported + total.unreported} replies report none" if total.unreported else ""
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
