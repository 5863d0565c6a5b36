"""Rates, intervals, completeness and the identities that guard them."""

from dataclasses import replace

import pytest
from stories import RecordBuilder, episode, thing

from vigil.errors import RecordError
from vigil.rates import RATES
from vigil.record import EpisodeRecord
from vigil.scoring import settle
from vigil.summary import Settlement, assert_identities, settle_run, summarise

PG = [episode("PG", id=f"pg{index}") for index in range(4)]
SV = [episode("SV", id=f"sv{index}") for index in range(2)]


def named(record: EpisodeRecord, episode_id: str, epoch: int = 1) -> EpisodeRecord:
    return record.model_copy(update={"episode_id": episode_id, "epoch": epoch})


def grounded() -> RecordBuilder:
    return RecordBuilder(target=thing(is_toggled=True)).ground("target")


RECORDS = [
    named(grounded().report(), "pg0"),
    named(grounded().report("fail"), "pg1"),
    named(grounded().end(), "pg2"),
    named(grounded().end("error"), "pg3"),
    named(grounded().report("on"), "sv0"),
    named(RecordBuilder(target=thing(is_toggled=True)).report("off"), "sv1"),
]


def test_rates_per_family_overall_and_macro():
    settlement = settle_run([*PG, *SV], RECORDS)
    summary = summarise(settlement)
    pg, sv, overall = summary["families"]["PG"], summary["families"]["SV"], summary["overall"]
    assert list(summary["families"]) == ["PG", "SV"]
    assert [pg[key] for key in ("episodes", "errors", "complete")] == [3, 1, "3/4"]
    assert {rate: round(pg[rate] * 3) for rate in RATES} == {
        "W": 3, "W_strict": 3, "B": 1, "Delta": 2, "FR": 1, "NR": 1, "IL": 0, "Other": 0, "NoRep": 1, "Stop": 2
    }  # fmt: skip
    assert [sv[key] for key in ("W", "B", "FR", "mean_steps")] == [1.0, 0.5, 0.5, 1.5]
    assert overall["B"] == pytest.approx(2 / 5)
    assert summary["macro"]["B"] == pytest.approx((1 / 3 + 1 / 2) / 2)
    assert overall["report_policies"]["always_success"] == pytest.approx(3 / 5)
    assert settlement.has_many_errors
    assert not settlement.is_complete


def test_equal_families_have_no_macro_mean():
    assert "macro" not in summarise(settle_run([*PG[:2], *SV], [*RECORDS[:2], *RECORDS[4:]]))


def test_an_empty_run_has_no_rates():
    summary = summarise(settle_run([*PG], []))
    assert summary["overall"]["W"] is None
    assert summary["families"]["PG"]["complete"] == "0/4"
    assert summary["families"]["PG"]["intervals"]["W"] == [0.0, 1.0]


def test_epochs_are_rows_of_their_own_and_the_standing_row_counts():
    records = [RECORDS[3], named(RECORDS[0], "pg3"), named(RECORDS[2], "pg3", epoch=2)]
    settlement = settle_run(PG[3:], records, epochs=2)
    assert [(outcome.epoch, outcome.label) for outcome in settlement.outcomes] == [(1, "B"), (2, "NR")]
    assert settlement.is_complete
    assert settlement.planned == {"PG": 2}
    assert not settlement.errors


def test_a_record_of_a_strange_episode_is_refused():
    with pytest.raises(RecordError, match="'pg0': not one of the 2 episodes"):
        settle_run(SV, RECORDS[:1])


@pytest.mark.parametrize(
    "change",
    [{"B": False}, {"label": "IL"}, {"W": False}, {"end": "fail_no_report"}, {"expected": "on", "B": False}],
)
def test_a_broken_identity_is_named(change: dict):
    outcome = settle(PG[0], RECORDS[0])
    assert_identities([outcome])
    with pytest.raises(RuntimeError, match="identities"):
        summarise(Settlement((replace(outcome, **change),)))


def test_epochs_that_agree_make_no_interval_narrower():
    once = summarise(settle_run(PG, RECORDS[:3]))
    again = [named(record, record.episode_id, epoch) for record in RECORDS[:3] for epoch in (1, 2, 3)]
    thrice = summarise(settle_run(PG, again, epochs=3))
    assert thrice["overall"]["episodes"] == 9
    for rate in RATES:
        assert thrice["overall"]["intervals"][rate] == pytest.approx(once["overall"]["intervals"][rate])
