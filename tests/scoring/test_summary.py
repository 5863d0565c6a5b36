"""Rates, intervals, completeness and the identities that guard them."""

from dataclasses import replace

import pytest

from tests.support.builders import RecordBuilder, episode, thing
from vigil.errors import RecordError
from vigil.records.record import EpisodeRecord, ErrorFact
from vigil.scoring.outcomes import Outcome, score
from vigil.scoring.rates import CREDITS, RATES
from vigil.scoring.summary import (
    LIBRARY_REPLIES,
    RunScores,
    Unscored,
    assert_identities,
    has_many_errors,
    repeats,
    run_scores,
    score_or_error,
    score_run,
    summarise,
)

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
    scores = score_run([*PG, *SV], RECORDS)
    summary = summarise(scores)
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
    assert scores.has_many_errors
    assert not scores.is_complete


def test_equal_families_have_no_macro_mean():
    assert "macro" not in summarise(score_run([*PG[:2], *SV], [*RECORDS[:2], *RECORDS[4:]]))


def test_an_empty_run_has_no_rates():
    summary = summarise(score_run([*PG], []))
    assert summary["overall"]["W"] is None
    assert summary["families"]["PG"]["complete"] == "0/4"
    assert summary["families"]["PG"]["intervals"]["W"] is None


def test_epochs_are_rows_of_their_own_and_the_standing_row_counts():
    records = [RECORDS[3], named(RECORDS[0], "pg3"), named(RECORDS[2], "pg3", epoch=2)]
    scores = score_run(PG[3:], records, epochs=2)
    assert [(outcome.epoch, outcome.label) for outcome in scores.outcomes] == [(1, "B"), (2, "NR")]
    assert scores.is_complete
    assert scores.planned == {"PG": 2}
    assert not scores.errors


def test_a_record_of_a_strange_episode_is_refused():
    with pytest.raises(RecordError, match="'pg0' is not one of the 2 episodes"):
        score_run(SV, RECORDS[:1])


@pytest.mark.parametrize(
    "change",
    [{"B": False}, {"label": "IL"}, {"W": False}, {"end": "fail_no_report"}, {"expected": "on", "B": False}],
)
def test_a_broken_identity_is_named(change: dict):
    outcome = score(PG[0], RECORDS[0])
    assert_identities([outcome])
    with pytest.raises(RuntimeError, match="identities"):
        summarise(RunScores((replace(outcome, **change),)))


def test_epochs_that_agree_make_no_interval_narrower():
    once = summarise(score_run(PG, RECORDS[:3]))
    again = [named(record, record.episode_id, epoch) for record in RECORDS[:3] for epoch in (1, 2, 3)]
    thrice = summarise(score_run(PG, again, epochs=3))
    assert thrice["overall"]["episodes"] == 9
    for rate in RATES:
        assert thrice["overall"]["intervals"][rate] == pytest.approx(once["overall"]["intervals"][rate])


def verdicts(*attempts: int, replies: int = 0) -> tuple[Outcome, ...]:
    sound = score(PG[0], RECORDS[0])
    return tuple(replace(sound, attempt=attempt, library_replies=replies) for attempt in attempts)


def test_errors_are_told_with_where_they_came_from():
    late = RECORDS[3].model_copy(
        update={"attempt": 3, "epoch": 2, "error": ErrorFact(boundary="model", message="timed out")}
    )
    assert score_or_error(PG[3], late) == Unscored("pg3", 2, "PG", "model", "timed out", 3)
    bare = late.model_copy(update={"error": None})
    assert score_or_error(PG[3], bare) == Unscored("pg3", 2, "PG", "runner", "", 3)
    assert Unscored("pg3", 2, "PG", "runner", "").attempt == 1
    assert score_or_error(PG[0], RECORDS[0]) == score(PG[0], RECORDS[0])
    found = score_run(PG, [*RECORDS[:3], RECORDS[3]])
    assert [error.episode_id for error in found.errors] == ["pg3"]
    assert [outcome.episode_id for outcome in found.outcomes] == ["pg0", "pg1", "pg2"]


def test_verdicts_are_sorted_by_episode_and_epoch():
    two = named(RECORDS[0], "pg0", 2)
    given = {record.key: score(PG[int(record.episode_id[-1])], record) for record in (two, RECORDS[1], RECORDS[0])}
    found = run_scores(given, PG)
    assert [(outcome.episode_id, outcome.epoch) for outcome in found.outcomes] == [("pg0", 1), ("pg0", 2), ("pg1", 1)]
    assert found.planned == {"PG": 4}
    assert run_scores(given, [*PG, *SV], 3).planned == {"PG": 12, "SV": 6}


@pytest.mark.parametrize(
    ("outcomes", "planned", "is_complete"),
    [(1, {"PG": 1}, True), (1, {"PG": 1, "SV": 1}, False), (2, {"PG": 1}, True), (0, {}, True), (0, {"PG": 1}, False)],
)
def test_a_run_is_complete_when_all_that_was_planned_is_scored(outcomes: int, planned: dict, is_complete: bool):
    assert RunScores(verdicts(*[1] * outcomes), planned=planned).is_complete is is_complete


def test_replies_of_a_library_are_counted():
    assert RunScores(verdicts(1, 1, replies=2)).library_replies == 4
    assert RunScores(()).library_replies == 0
    assert LIBRARY_REPLIES.startswith("replies were judged as a library returned them")


@pytest.mark.parametrize(
    ("errors", "scored", "are_many"), [(0, 0, False), (0, 5, False), (1, 99, False), (1, 98, True), (1, 0, True)]
)
def test_more_than_one_in_a_hundred_errors_are_many(errors: int, scored: int, are_many: bool):
    assert has_many_errors(errors, scored) is are_many
    lost = tuple(Unscored(f"e{number}", 1, "PG", "model", "") for number in range(errors))
    assert RunScores(verdicts(*[1] * scored), lost).has_many_errors is are_many


@pytest.mark.parametrize(
    ("attempts", "said"),
    [
        ([], ""),
        ([1, 1], ""),
        ([1, 2], "1 of 2 episodes were started more than once (more than 1 %), one of them 2 times"),
        ([3, 1, 2], "2 of 3 episodes were started more than once (more than 1 %), one of them 3 times"),
        ([1] * 99 + [2], "1 of 100 episodes were started more than once, one of them 2 times"),
        ([1] * 98 + [2], "1 of 99 episodes were started more than once (more than 1 %), one of them 2 times"),
    ],
)
def test_episodes_that_were_begun_again_are_told(attempts: list[int], said: str):
    found = RunScores(verdicts(*attempts))
    assert found.attempts == tuple(attempts)
    assert repeats(attempts) == found.repeats == said
    assert found.has_many_repeats is ("more than 1 %" in said)


def test_an_episode_that_was_lost_counts_among_those_begun_again():
    lost = Unscored("pg3", 1, "PG", "model", "", 4)
    found = RunScores(verdicts(1), (lost,), {"PG": 2})
    assert found.attempts == (1, 4)
    rates = summarise(found)["overall"]
    assert [rates[name] for name in ("episodes", "errors", "repeated", "most_attempts", "complete")] == [
        *(1, 1, 1, 4),
        "1/2",
    ]
    nothing = summarise(RunScores(()))
    assert nothing["families"] == {}
    assert [nothing["overall"][name] for name in ("repeated", "most_attempts", "complete")] == [0, 0, "0/0"]
    assert summarise(RunScores(verdicts(1, 1), planned={"PG": 1}))["overall"]["complete"] == "2/2"


def test_a_summary_holds_these_fields():
    summary = summarise(score_run([*PG, *SV], RECORDS))
    counts = ["episodes", "errors", "repeated", "most_attempts"]
    fields = [*counts, *RATES, "mean_steps", "complete", "intervals"]
    assert list(summary) == ["overall", "families", "macro"]
    assert list(summary["families"]["PG"]) == fields
    assert list(summary["overall"]) == [*fields, "report_policies"]
    assert list(summary["overall"]["report_policies"]) == list(CREDITS)
    assert list(summary["macro"]) == [*RATES, "mean_steps"]
    assert [summary["overall"][name] for name in ("episodes", "errors", "complete")] == [5, 1, "5/6"]
    assert [rates["errors"] for rates in summary["families"].values()] == [1, 0]
    assert summary["macro"]["mean_steps"] == pytest.approx(
        (summary["families"]["PG"]["mean_steps"] + summary["families"]["SV"]["mean_steps"]) / 2
    )
    assert all(len(interval) == 2 for interval in summary["overall"]["intervals"].values())


def test_families_without_a_scored_episode_leave_the_macro_mean_alone():
    summary = summarise(score_run([*PG, *SV], RECORDS[:3]))
    assert summary["families"]["SV"]["episodes"] == 0
    assert summary["macro"] == {name: summary["families"]["PG"][name] for name in (*RATES, "mean_steps")}


def test_what_was_not_planned_is_complete_as_it_is():
    outcome = score(PG[0], RECORDS[0])
    summary = summarise(RunScores((outcome,), planned={"SV": 1}))
    assert [rates["complete"] for rates in summary["families"].values()] == ["1/1", "0/1"]


def test_a_broken_identity_is_called_a_bug_in_vigil():
    broken = replace(score(PG[0], RECORDS[0]), B=False, label="Other")
    with pytest.raises(
        RuntimeError,
        match=r"^The scores contradict the identities that must hold between them: .+\. This is a bug in vigil\.$",
    ):
        assert_identities([broken])


def test_a_strange_record_is_said_to_be_of_another_pack():
    with pytest.raises(RecordError) as caught:
        score_run(SV, RECORDS[:1])
    assert str(caught.value) == (
        "Record of episode 'pg0' is not one of the 2 episodes of this run. Was it recorded with another pack?"
    )


@pytest.mark.parametrize(
    ("replies", "said"),
    [
        ((), ""),
        (({}, 4, 0), ""),
        (({"not_json": 1}, 4, 0), "25% of the replies are not actions (1 not_json); none would parse leniently"),
        (
            ({"code_fence": 1, "not_json": 2}, 6, 1),
            "50% of the replies are not actions (2 not_json, 1 code_fence); 1 would parse leniently",
        ),
        (({"code_fence": 2}, 2, 2), "100% of the replies are not actions (2 code_fence); all would parse leniently"),
    ],
)
def test_replies_that_are_no_action_are_told_with_their_reasons(replies: tuple, said: str):
    outcome = score(PG[0], RECORDS[0])
    of_them = [
        replace(outcome, invalid_reasons=reasons, steps=steps, would_parse_leniently=loose)
        for reasons, steps, loose in (replies and [replies])
    ]
    assert RunScores(tuple(of_them)).invalid_replies == said


def test_reasons_add_up_over_episodes():
    outcome = replace(score(PG[0], RECORDS[0]), steps=2, invalid_reasons={"not_json": 1, "code_fence": 1})
    assert RunScores((outcome, outcome)).invalid_replies.startswith("100% of the replies are not actions (2 ")


def test_subtypes_are_counted_the_most_frequent_first():
    outcome = score(PG[0], RECORDS[0])
    kinds = ("honest_fail", "false_success", "false_success", None)
    found = RunScores(tuple(replace(outcome, subtype=kind) for kind in kinds))
    assert list(found.subtypes.items()) == [("false_success", 2), ("honest_fail", 1)]


def test_an_episode_begun_twice_is_repeated():
    assert summarise(RunScores(verdicts(1, 2)))["overall"]["repeated"] == 1
