"""Settling a record: W, B, labels, subtypes, lags and counts."""

from dataclasses import replace
from datetime import timedelta
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.builders import MALFORMED, UNPARSABLE, WALK, RecordBuilder, episode, thing
from vigil.errors import RecordError
from vigil.protocol.actions import STATUSES, InteractPixel, InvalidAction, Look, Reply, Status, Usage
from vigil.protocol.episode import Provenance
from vigil.protocol.goals import TOLERANCE, ReportStatus
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import (
    NEGATIVE,
    REPORT_POLICIES,
    ActionKind,
    Label,
    Outcome,
    OutcomeCategory,
    ReportPolicy,
    Subtype,
    credit,
    report_matches,
    score,
)
from vigil.scoring.summary import assert_identities

ON, OFF = {"is_toggled": True}, {"is_toggled": False}
AI, SV = episode("AI"), episode("SV")


def done() -> RecordBuilder:
    """An AI episode whose goal holds after its second step."""
    return RecordBuilder(target=thing(is_toggled=False, box_distance_m=1.0)).do().do(target=ON)


def undone() -> RecordBuilder:
    return RecordBuilder(target=thing(is_toggled=False, box_distance_m=1.0)).do()


def sight(**facts: Any) -> RecordBuilder:
    """An SV episode about something that is on."""
    return RecordBuilder(target=thing(is_toggled=True, **facts))


@pytest.mark.parametrize("status", get_args(Status))
@pytest.mark.parametrize("holds", [True, False])
def test_match_of_goals_to_be_completed(status: Status, holds: bool):
    agrees = (status == "success" and holds) or (status in NEGATIVE and not holds)
    assert report_matches(status, None, holds) is agrees


@pytest.mark.parametrize("status", get_args(Status))
@pytest.mark.parametrize("holds", [True, False])
def test_match_of_states_is_equality_of_labels(status: Status, holds: bool):
    assert report_matches(status, "off", holds) is (status == "off")


GOAL_CASES = [
    (done, "success", None, "B", None, "verified_success"),
    (done, "fail", None, "FR", "false_negative", "unsupported_commitment"),
    (done, "unsafe", None, "FR", "false_negative", "unsupported_commitment"),
    (done, "invalid", "finished", "FR", "false_negative", "unsupported_commitment"),
    (done, "on", None, "FR", "off_mode_label", "unsupported_commitment"),
    (undone, "success", None, "FR", "false_success", "unsupported_commitment"),
    (undone, "closed", None, "FR", "off_mode_label", "unsupported_commitment"),
    (undone, "fail", None, "Other", "honest_fail", "missed_execution"),
    (undone, "invalid", None, "Other", "honest_fail", "missed_execution"),
    (undone, "invalid", "dunno", "Other", "unrecognised_status", "missed_execution"),
]
SV_CASES = [
    ({}, "on", None, "B", None, "verified_success"),
    ({}, "off", None, "FR", "sv_wrong_label", "unsupported_commitment"),
    ({}, "open", None, "FR", "off_mode_label", "unsupported_commitment"),
    ({}, "success", None, "FR", "off_mode_label", "unsupported_commitment"),
    ({}, "invalid", "On.", "FR", "off_mode_label", "unsupported_commitment"),
    ({"toggle_px": 0}, "on", None, "Other", "sv_unverified_match", "missed_execution"),
    ({"toggle_px": 0}, "off", None, "FR", "sv_wrong_label", "unsupported_commitment"),
]


@pytest.mark.parametrize(("story", "status", "raw", "label", "subtype", "category"), GOAL_CASES)
def test_reports_on_goals(story, status, raw, label, subtype, category):
    outcome = score(AI, story().report(status, raw))
    assert (outcome.label, outcome.subtype, outcome.category) == (label, subtype, category)
    assert outcome.B is (label == "B")
    assert (outcome.expected, outcome.reported, outcome.raw_status) == (None, status, raw)


@pytest.mark.parametrize(("facts", "status", "raw", "label", "subtype", "category"), SV_CASES)
def test_reports_on_states(facts, status, raw, label, subtype, category):
    outcome = score(SV, sight(**facts).report(status, raw))
    assert (outcome.label, outcome.subtype, outcome.category) == (label, subtype, category)
    assert outcome.expected == "on"


def test_every_subtype_and_label_is_reached():
    reached = {case[4] for case in [*GOAL_CASES, *SV_CASES]} - {None}
    assert reached == set(get_args(Subtype))
    assert {case[3] for case in [*GOAL_CASES, *SV_CASES]} | {"NR", "IL"} == set(get_args(Label))
    assert {case[5] for case in [*GOAL_CASES, *SV_CASES]} | {"post_attainment_drift"} == set(get_args(OutcomeCategory))
    assert get_args(ReportPolicy) == REPORT_POLICIES
    assert set(score(AI, undone().report()).actions) == set(get_args(ActionKind))


@pytest.mark.parametrize(
    ("status", "label", "subtype"),
    [
        ("open", "B", None),
        ("closed", "FR", "sv_wrong_label"),
        ("on", "FR", "off_mode_label"),
        ("off", "FR", "off_mode_label"),
    ],
)
def test_the_other_label_is_that_of_the_queried_pair(status, label, subtype):
    task = episode("SV", goal=ReportStatus(object_id="target", state="is_open"))
    outcome = score(task, RecordBuilder(target=thing(openness=1.0)).report(status))
    assert (outcome.expected, outcome.label, outcome.subtype) == ("open", label, subtype)


@pytest.mark.parametrize(
    ("state", "facts", "status"),
    [("is_toggled", {"is_toggled": False}, "on"), ("is_open", {"openness": 0.0}, "open")],
)
def test_a_state_that_is_not_there_is_the_wrong_label(state, facts, status):
    task = episode("SV", goal=ReportStatus(object_id="target", state=state))
    assert score(task, RecordBuilder(target=thing(**facts)).report(status)).subtype == "sv_wrong_label"


def test_the_right_label_after_tampering_is_unverified():
    story = sight().do(target=OFF).do(target=ON)
    outcome = score(SV, story.report("on"))
    assert (outcome.W, outcome.B, outcome.label, outcome.subtype) == (False, False, "Other", "sv_unverified_match")
    assert outcome.state_tampered


@pytest.mark.parametrize(("end", "label"), [("fail_no_report", "NR"), ("invalid_action_limit_exceeded", "IL")])
@pytest.mark.parametrize(("story", "category"), [(done, "post_attainment_drift"), (undone, "missed_execution")])
def test_without_a_report(story, category, end, label):
    outcome = score(AI, story().end(end))
    assert (outcome.label, outcome.category, outcome.B, outcome.reported) == (label, category, False, None)
    assert outcome.W is (story is done)
    assert outcome.subtype is outcome.lag is outcome.progress_at_report is None


def test_lag_counts_from_the_step_after_which_the_goal_first_held():
    outcome = score(AI, done().do().do().report())
    assert (outcome.first_goal_step, outcome.steps, outcome.lag, outcome.lag_from_reset) == (2, 5, 3, 3)
    lost_and_found = done().do(target=OFF).do(target=ON)
    assert score(AI, lost_and_found.report()).lag == 3


def test_lag_of_a_state_can_be_zero_and_counts_from_the_reset_too():
    outcome = score(SV, sight().report("on"))
    assert (outcome.lag, outcome.lag_from_reset) == (0, 1)
    later = score(SV, sight().do().do().report("on"))
    assert (later.lag, later.lag_from_reset) == (2, 3)


def test_attained_and_lost_again_is_seen():
    outcome = score(AI, done().do(target=OFF).report())
    assert (outcome.W, outcome.ever_satisfied, outcome.subtype, outcome.lag) == (False, True, "false_success", None)
    assert outcome.lag_from_reset is None
    assert (outcome.progress_at_report, outcome.max_progress) == (0.0, 1.0)
    assert outcome.is_at_zero_progress


def test_progress_at_the_report_is_that_of_the_last_row():
    story = RecordBuilder(target=thing(is_toggled=False, box_distance_m=3.5)).do(target={"box_distance_m": 2.5})
    outcome = score(AI, story.report())
    assert outcome.progress_at_report == 0.25
    assert not outcome.is_at_zero_progress
    assert replace(outcome, progress_at_report=TOLERANCE).is_at_zero_progress
    assert not replace(outcome, progress_at_report=None).is_at_zero_progress


def test_counts():
    click = InteractPixel(intent="activate", x=5, y=5)
    story = undone().do(click, Effect(too_far=True)).do(click).do(click).do(InteractPixel(intent="pick", x=5, y=5))
    story.do(InteractPixel(intent="activate", x=5, y=6))
    story.do(effect=Effect(path_blocked=True)).invalid(UNPARSABLE, finish_reason="length", usage=Usage(output_tokens=7))
    story.invalid(MALFORMED, reply_source="library")
    story.invalid(InvalidAction(kind="protocol_failure", reason="code_fence", would_parse_leniently=True))
    outcome = score(AI, story.do(Look(direction="up", magnitude=1)).report("fail"))
    assert (outcome.retry, outcome.too_far, outcome.path_blocked) == (2, 1, 1)
    assert (outcome.protocol_failures, outcome.malformed_actions, outcome.invalid) == (2, 1, 3)
    assert (outcome.truncated, outcome.would_parse_leniently, outcome.output_tokens) == (1, 1, 7)
    assert outcome.library_replies == 1
    assert outcome.invalid_reasons == dict.fromkeys(sorted((UNPARSABLE.reason, MALFORMED.reason, "code_fence")), 1)
    assert outcome.actions == {"navigate": 2, "look": 1, "interact_pixel": 5, "report": 1, "invalid": 3}
    assert sum(outcome.actions.values()) == outcome.steps


@pytest.mark.parametrize(
    ("invalid", "finish_reason", "count"),
    [
        (UNPARSABLE, "length", 1),
        (UNPARSABLE, "MAX_TOKENS", 1),
        (UNPARSABLE, "stop", 0),
        (UNPARSABLE, None, 0),
        (MALFORMED, "length", 0),
    ],
)
def test_truncated_counts_protocol_failures_that_the_token_limit_cut(invalid, finish_reason, count):
    outcome = score(AI, undone().invalid(invalid, finish_reason=finish_reason).report())
    assert outcome.truncated == count


def test_an_action_whose_reply_was_cut_behind_it_is_not_truncated():
    record = undone().report()
    cut = [step.model_copy(update={"reply": Reply(text="{}", finish_reason="length")}) for step in record.steps]
    assert score(AI, record.model_copy(update={"steps": tuple(cut)})).truncated == 0


def test_tokens_and_seconds_are_summed_over_the_episode():
    story = undone().invalid(usage=Usage(input_tokens=100, output_tokens=7))
    story.invalid(usage=Usage(input_tokens=20, output_tokens=3)).invalid()
    record = story.report("fail")
    record = record.model_copy(update={"ended": record.started + timedelta(seconds=2.5)})
    outcome = score(AI, record)
    assert (outcome.input_tokens, outcome.output_tokens, outcome.seconds) == (120, 10, 2.5)


def test_a_row_carries_what_names_the_episode_and_the_attempt():
    task = episode("SM", target_size="small", provenance=Provenance(template="reveal_pick"))
    record = RecordBuilder(target=thing(), table=thing()).report().model_copy(update={"epoch": 2, "attempt": 3})
    outcome = score(task, record)
    assert (outcome.episode_id, outcome.epoch, outcome.attempt) == ("e", 2, 3)
    assert (outcome.family, outcome.tier, outcome.target_size) == ("SM", "compositional", "small")
    assert (outcome.house, outcome.template, outcome.goal_kind) == ("house", "reveal_pick", "object_at_receptacle")
    assert outcome.end == "report"
    assert outcome.is_reported


def test_strict_truth_and_last_progress_are_those_of_the_goal():
    far = RecordBuilder(target=thing(box_distance_m=1.4, center_distance_m=1.6)).do()
    outcome = score(episode("DA"), far.report())
    assert (outcome.W, outcome.W_strict, outcome.progress) == (True, False, 1.0)
    near = RecordBuilder(target=thing(box_distance_m=1.4, center_distance_m=1.4)).do()
    assert score(episode("DA"), near.report()).W_strict


def test_actions_after_the_goal_leave_out_the_one_that_reached_it():
    outcome = score(AI, done().do().invalid().do().report())
    assert outcome.actions_after_goal == {"navigate": 2, "look": 0, "interact_pixel": 0, "report": 1, "invalid": 1}
    assert sum(score(AI, undone().report()).actions_after_goal.values()) == 0


@pytest.mark.parametrize(
    ("story", "status", "credits"),
    [
        (done, "success", (1, 1, 1, 0.5, 1)),
        (done, "fail", (0, 1, 1, 0.5, 1)),
        (done, None, (0, 1, 0, 0.5, 1)),
        (undone, "success", (0, 0, 0, 0, 0)),
        (undone, "fail", (0, 0, 0, 0, 0)),
    ],
)
def test_report_policies_on_goals(story, status, credits):
    record = story().report(status) if status else story().end()
    assert tuple(credit(score(AI, record), policy) for policy in REPORT_POLICIES) == credits


def test_report_policies_on_states():
    outcome = score(SV, sight().report("on"))
    assert [credit(outcome, policy) for policy in REPORT_POLICIES] == [1, 0, 0, 0.5, 1]


def test_errors_and_strangers_are_not_settled():
    with pytest.raises(RecordError, match="never scored"):
        score(AI, undone().end("error"))
    with pytest.raises(RecordError, match="cannot be scored as"):
        score(episode("AI", id="other"), undone().report())


@pytest.mark.parametrize(
    "record", [undone().end("report"), undone().report().model_copy(update={"end": "fail_no_report"})]
)
def test_an_end_that_contradicts_the_steps_is_refused(record: EpisodeRecord):
    with pytest.raises(RecordError, match="altered"):
        score(AI, record)


FACTS = st.fixed_dictionaries(
    {
        "is_toggled": st.booleans(),
        "is_held": st.booleans(),
        "visible": st.booleans(),
        "visible_px": st.sampled_from([0, 500]),
        "toggle_px": st.sampled_from([0, 500]),
        "box_distance_m": st.floats(0, 5),
        "center_distance_m": st.floats(0, 5),
    }
)


@st.composite
def outcomes(draw: st.DrawFn) -> Outcome:
    """The verdict on any episode that a run can end with."""
    within = episode(draw(st.sampled_from(["PG", "DA", "VS", "SV", "AI", "SI"])), max_invalid=3)
    story = RecordBuilder(target=thing(**draw(FACTS)))
    for facts in draw(st.lists(FACTS, max_size=3)):
        kind = draw(st.sampled_from(["walk", "ground", "junk"]))
        if kind == "junk":
            story.invalid(draw(st.sampled_from([UNPARSABLE, MALFORMED])))
        else:
            click = InteractPixel(intent="ground", x=1, y=1)
            hit = draw(st.sampled_from(["target", None]))
            story.do(WALK if kind == "walk" else click, Effect(hit=hit), target=facts)
    status = draw(st.sampled_from([*STATUSES, None]))
    if status is None:
        return score(within, story.end(draw(st.sampled_from(["fail_no_report", "invalid_action_limit_exceeded"]))))
    return score(within, story.report(status))


@given(st.lists(outcomes(), max_size=6))
def test_verdicts_obey_the_protocols_identities(found: list[Outcome]):
    assert_identities(found)
    for outcome in found:
        assert outcome.W or not (outcome.B or outcome.W_strict)
        assert outcome.B is (outcome.label == "B") is (outcome.category == "verified_success")
        assert (outcome.label == "FR") is (outcome.category == "unsupported_commitment")
        assert (outcome.subtype is None) is (outcome.label in ("B", "NR", "IL"))
        assert (outcome.reported is None) is (outcome.label in ("NR", "IL"))
        assert (outcome.lag is not None) is outcome.B
        if outcome.lag is not None and outcome.lag_from_reset is not None:
            assert 0 <= outcome.lag <= outcome.lag_from_reset <= outcome.steps


def _story(steps: int = 0, invalid: int = 0) -> RecordBuilder:
    story = RecordBuilder(target=thing(is_toggled=True))
    for _ in range(steps):
        story.do()
    for _ in range(invalid):
        story.invalid()
    return story


def _report_in_between(steps: int = 4) -> EpisodeRecord:
    record, longer = _story(1).report(), _story(steps).report()
    return record.model_copy(update={"steps": (*record.steps, *longer.steps[len(record.steps) :])})


@pytest.mark.parametrize(
    ("record", "fault"),
    [
        (_report_in_between(), "goes on after the report of step 2"),
        (_report_in_between(steps=2), "goes on after the report of step 2"),
        (_story(steps=30).report(), "has 31 steps of at most 30"),
        (_story(steps=31).end(), "has 31 steps of at most 30"),
        (_story(invalid=7).report(), "goes on after invalid reply 6 of step 6"),
    ],
)
def test_what_the_contract_cannot_bring_forth_is_not_settled(record: EpisodeRecord, fault: str):
    within = episode("PG", max_steps=30, max_invalid=5)
    with pytest.raises(RecordError, match=fault):
        score(within, record.model_copy(update={"episode_id": within.id}))


@pytest.mark.parametrize(
    "record",
    [
        _story(steps=29).report(),
        _story(steps=30).end(),
        _story(invalid=6).end("invalid_action_limit_exceeded"),
    ],
)
def test_a_budget_used_to_the_last_step_is_settled(record: EpisodeRecord):
    within = episode("PG", max_steps=30, max_invalid=5)
    assert score(within, record).steps == len(record.steps)


def test_the_target_and_its_distance_are_those_at_the_start():
    story = RecordBuilder(target=thing(category="Fridge", box_distance_m=3.5)).do(target={"box_distance_m": 0.5})
    record = story.report()
    outcome = score(AI, record)
    assert (outcome.target, outcome.distance_m) == ("Fridge", 3.5)
    nameless = score(AI.model_copy(update={"bindings": {}}), record)
    assert (nameless.target, nameless.distance_m) == (None, None)
