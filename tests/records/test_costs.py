"""Costs: tokens of replies, prices, and what is said when not all is known."""

import pytest

from vigil.errors import SettingError
from vigil.protocol.actions import Usage
from vigil.records.costs import Prices, RunTokens, Tokens, describe_costs, parse_prices

PRICES = Prices(input=2.5, output=10)


def usage(taken: int, given: int) -> Usage:
    return Usage(input_tokens=taken, output_tokens=given)


def run_of(*attempts: tuple[str, Tokens]) -> RunTokens:
    """What a run took whose rows came in this order, each with its key."""
    found = RunTokens()
    for key, tokens in attempts:
        found.add(key, tokens)
    return found


def test_tokens_are_added_and_unknown_ones_are_counted_apart() -> None:
    first = Tokens.of([usage(1000, 20), None, usage(2000, 30)])
    assert first == Tokens(input=3000, output=50, reported=2, unreported=1)
    assert first + Tokens.of([None]) + Tokens() == Tokens(input=3000, output=50, reported=2, unreported=2)


def test_a_cost_is_that_of_a_million_tokens() -> None:
    assert PRICES.cost_of(1_000_000, 0) == 2.5
    assert PRICES.cost_of(0, 1_000_000) == 10
    assert PRICES.cost(Tokens.of([usage(200_000, 10_000)])) == pytest.approx(0.6)


def test_no_cost_is_made_up_where_no_tokens_are_known() -> None:
    assert PRICES.cost(Tokens.of([None, None])) is None
    assert PRICES.cost(Tokens()) is None
    assert (
        describe_costs(PRICES, run_of(("a", Tokens.of([None]))))
        == "not known: no reply in the records reports its tokens"
    )


def test_a_cost_says_how_far_it_is_known() -> None:
    whole = Tokens.of([usage(200_000, 10_000)])
    assert describe_costs(PRICES, run_of(("a", whole))) == (
        "0.60 at 2.5 (input) and 10 (output) per million tokens: 200,000 input and 10,000 output tokens"
    )
    part = describe_costs(PRICES, run_of(("a", whole), ("b", Tokens.of([None]))))
    assert part.startswith("at least 0.60 at ")
    assert part.endswith("; 1 of 2 replies report none")
    said = describe_costs(None, run_of(("a", whole)))
    assert said == "200,000 input and 10,000 output tokens; --prices says what they cost"


def test_attempts_that_were_played_again_are_spent_and_named() -> None:
    failed, whole = Tokens.of([usage(40_000, 2_000)]), Tokens.of([usage(200_000, 10_000)])
    tokens = run_of(("a", failed), ("b", whole), ("a", failed), ("a", whole))
    assert (tokens.total, tokens.superseded) == (failed + failed + whole + whole, failed + failed)
    assert describe_costs(PRICES, tokens) == (
        "1.44 at 2.5 (input) and 10 (output) per million tokens: 480,000 input and 24,000 output tokens; "
        "0.24 of it for attempts that ended as errors and were played again"
    )
    assert "; 80,000 input and 4,000 output tokens of them for" in describe_costs(None, tokens)
    assert "played again" not in describe_costs(PRICES, run_of(("a", whole), ("b", failed)))


def test_prices_are_read_from_two_numbers() -> None:
    assert parse_prices("2.5,10") == PRICES
    assert parse_prices("0,0") == Prices(input=0, output=0)
    for text in ("2.5", "1,2,3", "-1,2", "nan,2", "one,2", "inf,1", ""):
        with pytest.raises(SettingError, match=r"--prices .* is not IN,OUT"):
            parse_prices(text)
