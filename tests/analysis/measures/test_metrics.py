"""Metrics: identities on any rows, and the analyses that no published table pins."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.episode_strategies import EPISODES, SCRIPTS
from tests.support.published_runs import PUBLISHED, EpisodeScript, record_of
from vigil.analysis.measures.metrics import (
    LABELS,
    RunMetrics,
    after_goal_intervals,
    after_goal_shares,
    by_family,
    closure_curve,
    clustered_intervals,
    is_excluded,
    macro,
    macro_interval,
    mean_with_interval,
    measure,
    regimes,
)
from vigil.analysis.measures.rows import outcome_table
from vigil.scoring.outcomes import score


def rows_of(plots: list[EpisodeScript]) -> Any:
    outcomes = []
    for number, plot in enumerate(plots):
        episode = EPISODES[plot.family].model_copy(update={"id": f"e{number:03}"})
        outcomes.append(score(episode, record_of(plot).model_copy(update={"episode_id": episode.id})))
    return outcome_table(outcomes)


@given(st.lists(SCRIPTS, max_size=30))
def test_parts_make_the_whole_on_any_rows(plots: list[EpisodeScript]):
    rows = rows_of(plots)
    found = measure(rows)
    assert sum(found.counts[name] for name in LABELS) == len(plots)
    assert found.counts["B"] <= found.counts["W"]
    assert sum(part.n for part in by_family(rows).values()) == len(plots)
    for name, interval in clustered_intervals(rows).items():
        assert interval is None or interval[0] <= (found.share(name) or 0.0) + 1e-12 <= interval[1] + 2e-12


def test_plays_that_only_repeat_make_no_rate_surer():
    rows = rows_of(
        [
            EpisodeScript("PG", True, "success"),
            EpisodeScript("PG", False, "success"),
            EpisodeScript("PG", True, "NR"),
            EpisodeScript("AI", False, "fail"),
        ]
    )
    once, thrice = measure(rows), measure(pd.concat([rows] * 3))
    assert (thrice.n, thrice.episodes) == (12, 4)
    for name in ("W", "P_B_W1", "P_FR_W0", "IL"):
        assert thrice.rate(name).n == 3 * once.rate(name).n
        assert thrice.rate(name).interval == pytest.approx(once.rate(name).interval)


@given(st.lists(SCRIPTS, min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_the_order_of_episodes_does_not_matter(plots: list[EpisodeScript], random: Any):
    rows = rows_of(plots)
    order = list(range(len(plots)))
    random.shuffle(order)
    assert measure(rows) == measure(rows.iloc[order])


def test_closure_curve_counts_only_matching_reports():
    plots = [
        EpisodeScript("AI", True, "success"),
        EpisodeScript("AI", True, "success", wait=2),
        EpisodeScript("AI", True, "fail"),
        EpisodeScript("AI", True, "NR"),
    ]
    assert closure_curve(rows_of(plots), 4) == [0.0, 0.25, 0.25, 0.5, 0.5]
    assert closure_curve(rows_of([EpisodeScript("AI", False, "NR")])) is None


def test_shares_after_attainment_pooled_and_by_episode():
    rows = rows_of(
        [
            EpisodeScript("AI", True, "success"),
            EpisodeScript("AI", True, "success", wait=3),
            EpisodeScript("AI", False, "NR", wait=3),
        ]
    )
    shares = after_goal_shares(rows)
    assert shares["navigate"] == pytest.approx((3 / 5, 3 / 8))
    assert shares["report"] == pytest.approx((2 / 5, 5 / 8))
    assert sum(pair[0] for pair in shares.values() if pair) == pytest.approx(1.0)
    assert set(after_goal_shares(rows_of([EpisodeScript("AI", False, "NR")])).values()) == {None}


def in_houses(rows: Any, houses: int) -> Any:
    return rows.assign(house=[f"house_{number % houses}" for number in range(len(rows))])


def test_shares_and_means_lie_in_their_intervals():
    courses = [EpisodeScript("AI", True, "success" if wait % 2 else "NR", wait=wait) for wait in range(12)]
    rows = in_houses(rows_of(courses), 6)
    shares, intervals = after_goal_shares(rows), after_goal_intervals(rows)
    for kind in ("navigate", "report"):
        for share, interval in zip(shares[kind] or (), intervals[kind], strict=True):
            assert interval is not None
            assert interval[0] < share < interval[1]
    found = mean_with_interval(rows, "steps")
    assert found is not None
    assert found[0] == rows["steps"].mean()
    assert found[1] is not None
    assert found[1] < found[0] < (found[2] or 0.0)


def test_a_mean_is_over_what_is_known_and_has_no_interval_in_four_houses():
    rows = in_houses(rows_of([EpisodeScript("AI", True, "success", wait=1), EpisodeScript("AI", False, "NR")]), 4)
    assert mean_with_interval(rows, "lag") == (2.0, None, None)
    assert mean_with_interval(rows[~rows["B"]], "lag") is None


def test_a_mean_of_families_is_surer_than_each_and_as_sure_as_an_only_one():
    courses = [EpisodeScript(family, number < 4, "NR") for family in ("AI", "CR") for number in range(10)]
    rows = rows_of(courses)
    low, high = macro_interval(rows, "W") or (0.0, 0.0)
    alone = by_family(rows)["AI"].rate("W").interval
    only = macro_interval(rows[rows["family"] == "AI"], "W")
    assert alone is not None
    assert only == pytest.approx(alone)
    assert alone[0] < low < 0.4 < high < alone[1]
    assert macro_interval(rows[:0], "W") is None


def test_false_success_at_zero_and_at_some_progress():
    rows = rows_of(
        [
            EpisodeScript("AI", False, "success"),
            EpisodeScript("AI", False, "success", advanced=True),
            EpisodeScript("AI", False, "fail"),
        ]
    )
    found = measure(rows)
    assert (found.counts["FS"], found.counts["FS_zero"], found.counts["FS_high"]) == (2, 1, 0)


def test_lag_counts_from_attainment_and_sv_may_be_zero():
    found = measure(rows_of([EpisodeScript("SV", True, "on"), EpisodeScript("AI", True, "success", wait=1)])).means
    assert found["lag"] == pytest.approx(1.0)
    assert found["lag_without_sv"] == pytest.approx(2.0)


def test_macro_weighs_families_alike():
    rows = rows_of([EpisodeScript("AI", True, "success")] + [EpisodeScript("PG", False, "NR")] * 3)
    assert measure(rows).share("B") == pytest.approx(0.25)
    assert macro(by_family(rows), "B") == pytest.approx(0.5)


def test_rates_over_nothing_are_none():
    found = measure(rows_of([]))
    assert found.share("W") is None
    assert found.means["steps"] is None
    assert not is_excluded(found)


def measures(n: int, **counts: int) -> RunMetrics:
    return RunMetrics(n, {"W": 0, "W0": 0, "B": 0, "IL": 0, "FR_W0": 0, "NoRep_W1": 0, **counts})


def test_exclusion_takes_zero_b_or_mostly_invalid():
    assert is_excluded(measures(1000, W=200))
    assert is_excluded(measures(1000, W=200, B=100, IL=501))
    assert not is_excluded(measures(1000, W=200, B=1, IL=500))


def test_regimes_are_clear_only_when_their_interval_is():
    assert regimes(measures(1000, W=300, W0=700, B=270)) == {"state-coupled": "clear"}
    assert regimes(measures(1000, W=300, W0=700, B=150, FR_W0=650)) == {"FR-heavy": "clear"}
    assert regimes(measures(1000, W=300, W0=700, B=150, NoRep_W1=125)) == {"NR-heavy": "borderline"}
    assert regimes(measures(1000, W=300, W0=700, B=150, FR_W0=600, NoRep_W1=200, IL=600)) == {
        "low-compliance": "clear",
        "FR-heavy": "clear",
        "NR-heavy": "clear",
    }
    assert regimes(measures(1000, W=300, W0=700, B=200)) == {"mixed": ""}


def test_counterfactual_policies_follow_from_w_alone():
    rows = rows_of([EpisodeScript(family, True, "NR") for family in sorted(PUBLISHED)])
    found = measure(rows)
    assert (found.counts["Always"], found.counts["W"], found.counts["Always_reported"]) == (7, 8, 0)
    assert np.isclose(found.counts["W_sv"], 1)
