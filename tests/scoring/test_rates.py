"""Rates: what each counts and among which episodes, their intervals, and the identities that guard them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.episode_strategies import EPISODES, SCRIPTS
from tests.support.published_runs import EpisodeScript, record_of
from vigil.analysis.measures.metrics import rate_columns
from vigil.analysis.measures.rows import outcome_table
from vigil.scoring.outcomes import NEGATIVE, Outcome, score
from vigil.scoring.rates import (
    CONDITIONAL,
    RATES,
    broken_identities,
    count,
    effective_sample_size,
    outcome_columns,
    rate_of,
    rows_where,
    wilson,
)

RATE_OF: dict[str, tuple[Callable[[Outcome], bool], Callable[[Outcome], bool]]] = {
    "W": (lambda o: o.W, lambda o: True),
    "W_strict": (lambda o: o.W_strict, lambda o: True),
    "B": (lambda o: o.B, lambda o: True),
    "Delta": (lambda o: o.W and not o.B, lambda o: True),
    "FR": (lambda o: o.label == "FR", lambda o: True),
    "NR": (lambda o: o.end == "fail_no_report", lambda o: True),
    "IL": (lambda o: o.end == "invalid_action_limit_exceeded", lambda o: True),
    "Other": (lambda o: o.label == "Other", lambda o: True),
    "NoRep": (lambda o: o.end != "report", lambda o: True),
    "Stop": (lambda o: o.end == "report", lambda o: True),
    "P_B_W1": (lambda o: o.B, lambda o: o.W),
    "P_FR_W0": (lambda o: o.label == "FR", lambda o: not o.W),
    "P_rep_W0": (lambda o: o.end == "report", lambda o: not o.W),
    "P_norep_W1": (lambda o: o.end != "report", lambda o: o.W),
    "P_zero_FS": (lambda o: o.progress_at_report == 0, lambda o: o.subtype == "false_success"),
    "P_high_FS": (lambda o: (o.progress_at_report or 0) > 0.75, lambda o: o.subtype == "false_success"),
}
"""Each rate in plain words: what it counts, and among which episodes."""


def outcomes_of(plots: list[EpisodeScript]) -> list[Outcome]:
    outcomes = []
    for number, plot in enumerate(plots):
        episode = EPISODES[plot.family].model_copy(update={"id": f"e{number:03}"})
        outcomes.append(score(episode, record_of(plot).model_copy(update={"episode_id": episode.id})))
    return outcomes


@given(st.lists(SCRIPTS, max_size=20))
def test_each_rate_counts_what_it_says_among_those_it_says(plots: list[EpisodeScript]):
    outcomes = outcomes_of(plots)
    found = count(outcome_columns(outcomes))
    assert set(RATE_OF) == {*RATES, *CONDITIONAL}
    for name, (counts, among) in RATE_OF.items():
        trials = [outcome for outcome in outcomes if among(outcome)]
        rate = found.rate(name)
        assert (rate.hits, rate.n) == (sum(map(counts, trials)), len(trials)), name
        assert rate.value == (sum(map(counts, trials)) / len(trials) if trials else None)
        assert rate.interval == (wilson(rate.hits, rate.n) if trials else None)


@given(st.lists(SCRIPTS, max_size=20))
def test_a_table_of_rows_has_the_rates_of_its_outcomes(plots: list[EpisodeScript]):
    outcomes = outcomes_of(plots)
    ours, theirs = outcome_columns(outcomes), rate_columns(outcome_table(outcomes))
    assert count(ours) == count(theirs)
    assert broken_identities(ours) == broken_identities(theirs) == []


def test_a_part_has_the_counts_of_its_episodes():
    outcomes = outcomes_of(
        [EpisodeScript("PG", True, "success"), EpisodeScript("AI", False, "success"), EpisodeScript("AI", True, "NR")]
    )
    whole = outcome_columns(outcomes)
    part = count(rows_where(whole, whole["family"] == "AI"))
    assert (part.n, part.counts["W"], part.counts["FR"], part.counts["NR"]) == (2, 1, 1, 1)


@pytest.mark.parametrize(
    ("change", "identity"),
    [
        ({"B": False}, "B = label B"),
        ({"label": "NR"}, "Stop + NR + IL = all"),
        ({"W": False}, "B <= W on every episode"),
        ({"W_strict": True, "W": False}, "W_strict <= W on every episode"),
        ({"end": "fail_no_report"}, "Stop = B + FR + Other"),
        ({"label": "none"}, "B + FR + NR + IL + Other = all"),
        ({"category": "nothing"}, "the four categories = all"),
        ({"lag": None}, "lag >= 0 and only where B"),
        ({"lag": -1}, "lag >= 0 and only where B"),
    ],
)
def test_a_broken_identity_is_named(change: dict, identity: str):
    right, other = outcomes_of([EpisodeScript("AI", True, "success"), EpisodeScript("PG", False, "NR")])
    assert broken_identities(outcome_columns([right, other])) == []
    assert identity in broken_identities(outcome_columns([replace(right, **change), other]))


@pytest.mark.parametrize("policy", ["actual", "always_success", "random", "oracle"])
def test_a_credit_that_departs_from_its_policy_is_named(policy: str):
    broken = outcome_columns(
        outcomes_of([EpisodeScript("AI", True, "success"), EpisodeScript("SV", False, sorted(NEGATIVE)[0])])
    )
    broken[f"credit.{policy}"] = broken[f"credit.{policy}"] + 0.25
    named = {"actual": "Actual = B", "always_success": "Always =", "random": "Random =", "oracle": "Oracle = W"}[policy]
    assert any(name.startswith(named) for name in broken_identities(broken))


@given(st.lists(st.booleans(), min_size=1, max_size=40))
def test_single_plays_are_worth_their_number(hits: list[bool]):
    assert effective_sample_size([int(hit) for hit in hits], [1] * len(hits)) == len(hits)


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)).map(sorted), min_size=1, max_size=30))
def test_plays_are_worth_between_wholly_alike_and_independent(counts: list[list[int]]):
    hits, trials = [hit for hit, _ in counts], [count for _, count in counts]
    n, squares = sum(trials), sum(count * count for count in trials)
    assert n * n / max(squares, 1) <= effective_sample_size(hits, trials) + 1e-9 <= n + 2e-9


@pytest.mark.parametrize(("episodes", "epochs"), [(8, 3), (10, 5), (125, 3)])
def test_each_hit_more_raises_both_ends(episodes: int, epochs: int):
    ends = []
    for hits in range(episodes):
        n = effective_sample_size([1] * hits + [0] * (episodes - hits), [epochs] * episodes)
        ends.append(wilson(n * hits / (episodes * epochs), n))
    assert ends == sorted(ends)
    assert [high for _, high in ends] == sorted(high for _, high in ends)


@pytest.mark.parametrize("rate", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("spread", [0.3, 3.0, 300.0])
def test_intervals_over_epochs_hold_the_truth_as_often_as_they_say(rate: float, spread: float):
    """Sixty episodes whose difficulty is beta-distributed, from all or nothing to all alike, five epochs each."""
    rng = np.random.default_rng(3)
    hits = rng.binomial(5, rng.beta(rate * spread, (1 - rate) * spread, size=(600, 60)))
    held, widths = 0, []
    for row in hits.tolist():
        n = effective_sample_size(row, [5] * 60)
        low, high = wilson(n * sum(row) / 300, n)
        held += low <= rate <= high
        widths.append((high - low) / (wilson(sum(row), 300)[1] - wilson(sum(row), 300)[0]))
    assert held / 600 >= 0.93
    assert np.mean(widths) < 1.15 or spread < 300 or rate < 0.4


def test_wilson_against_published_values():
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(8, 10) == pytest.approx((0.490162, 0.943318), abs=1e-6)
    assert wilson(0, 10)[0] == 0.0
    assert wilson(10, 10)[1] == 1.0


@given(st.integers(1, 10_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_an_interval_holds_its_rate(trial: tuple[int, int]):
    hits, n = trial
    low, high = wilson(hits, n)
    assert 0.0 <= low <= hits / n <= high <= 1.0


@given(st.lists(SCRIPTS, min_size=1, max_size=12), st.integers(1, 3))
def test_a_rate_of_two_masks_is_the_rate_of_the_counts(plots: list[EpisodeScript], epochs: int):
    outcomes = [
        score(EPISODES[plot.family], record_of(plot).model_copy(update={"episode_id": EPISODES[plot.family].id}))
        for plot in plots
    ] * epochs
    facts = outcome_columns(outcomes)
    found = rate_of(facts["B"], facts["W"], facts["episode_id"])
    meant = count(facts).rate("P_B_W1")
    assert (found.hits, found.n, found.effective_n) == (meant.hits, meant.n, pytest.approx(meant.effective_n))
