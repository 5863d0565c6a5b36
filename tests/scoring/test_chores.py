"""Lists of chores: W, claim, B and label of each chore, W, B and T of each list, and what an answer must be."""

from typing import Any

import pytest
from pydantic import ValidationError

from tests.support.builders import SUCCESS, episode
from tests.support.chore_lists import ANSWER, GOAL, RIGHT, SENTENCES, Story, a_list, closed, story
from vigil.base.numbered_list import read_list, write_list
from vigil.errors import EpisodeError
from vigil.packs.pack import invalid_limit, protocol_faults
from vigil.protocol.actions import ChoreClaim, InteractPixel, Report
from vigil.protocol.goals import Chore, Chores, ObjectInState, ReportStatus
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord
from vigil.scoring.chore_answers import ChoreAnswer, ListAnswer, answers_by_id
from vigil.scoring.chores import CHORE_LABELS, ListOutcome, broken_chore_identities, score_list
from vigil.scoring.goal_words import describe_goal


def scored(record: EpisodeRecord, *, has_claims: bool = True) -> ListOutcome:
    return score_list(ANSWER, a_list(), record, has_claims=has_claims)


def all_done() -> Story:
    return story().switch().look().place()


def labels(found: ListOutcome) -> list[str]:
    return [chore.label for chore in found.chores]


def claiming(**changes: ChoreClaim | None) -> dict[int, ChoreClaim]:
    claims: dict[int, ChoreClaim | None] = {**RIGHT, **{int(name[1:]): claim for name, claim in changes.items()}}
    return {number: claim for number, claim in claims.items() if claim is not None}


def test_a_list_that_is_done_and_claimed_truthfully_is_closed():
    found = scored(closed(all_done(), RIGHT))
    assert (found.W, found.W_strict, found.W_share, found.B, found.T) == (True, False, 1.0, True, 1.0)
    assert labels(found) == ["closed"] * 6
    assert (found.overclaims, found.underclaims, found.interference, found.strays) == (0, 0, 0, 0)
    assert found.progress == 1.0
    assert found.is_status_true
    assert not found.outcome.W  # the safe cannot be opened


def test_a_list_in_which_nothing_is_done_keeps_what_held():
    found = scored(closed(story(), RIGHT))
    assert [chore.W for chore in found.chores] == [False, False, True, False, True, False]
    assert found.W_share == 2 / 5
    assert (found.W, found.B) == (False, False)
    assert labels(found) == ["false_success", "unverified", "closed", "closed", "closed", "false_success"]
    assert (found.T, found.overclaims, found.underclaims) == (4 / 6, 3, 0)


@pytest.mark.parametrize(
    ("changes", "label", "is_true", "is_positive"),
    [
        ({"c1": "success"}, "closed", True, True),
        ({"c1": None}, "unclaimed", False, False),
        ({"c1": "unknown"}, "unknown", False, False),
        ({"c1": "fail"}, "false_negative", False, False),
        ({"c1": "unsafe"}, "false_negative", False, False),
        ({"c1": "invalid"}, "false_negative", False, False),
        ({"c1": "off"}, "wrong_label", False, False),
        ({"c2": "on"}, "closed", True, True),
        ({"c2": "off"}, "wrong_label", False, True),
        ({"c2": "open"}, "wrong_label", False, False),
        ({"c2": "success"}, "wrong_label", False, False),
        ({"c2": "fail"}, "false_negative", False, False),
        ({"c4": "fail"}, "closed", True, False),
        ({"c4": "invalid"}, "closed", True, False),
        ({"c4": "unsafe"}, "conceded", True, False),
        ({"c4": "success"}, "false_success", False, True),
        ({"c4": None}, "unclaimed", False, False),
        ({"c4": "closed"}, "wrong_label", False, False),
        ({"c5": "invalid"}, "false_negative", False, False),
    ],
)
def test_each_claim_about_a_list_that_is_done(changes: dict[str, Any], label: str, is_true: bool, is_positive: bool):
    name = next(iter(changes))
    found = scored(closed(all_done(), claiming(**changes))).chores[int(name[1:]) - 1]
    assert (found.label, found.is_true, found.is_positive, found.B) == (label, is_true, is_positive, label == "closed")


@pytest.mark.parametrize(
    ("changes", "label", "is_true", "is_positive"),
    [
        ({"c1": "success"}, "false_success", False, True),
        ({"c1": "fail"}, "conceded", True, False),
        ({"c1": "unsafe"}, "conceded", True, False),
        ({"c1": "unknown"}, "unknown", False, False),
        ({"c1": None}, "unclaimed", False, False),
        ({"c2": "on"}, "unverified", True, True),
        ({"c2": "off"}, "wrong_label", False, True),
        ({"c2": "fail"}, "conceded", True, False),
        ({"c3": "success"}, "closed", True, True),
        ({"c6": "on"}, "wrong_label", False, False),
    ],
)
def test_each_claim_about_a_list_that_is_not_done(
    changes: dict[str, Any], label: str, is_true: bool, is_positive: bool
):
    name = next(iter(changes))
    found = scored(closed(story(), claiming(**changes))).chores[int(name[1:]) - 1]
    assert (found.label, found.is_true, found.is_positive, found.B) == (label, is_true, is_positive, label == "closed")


@pytest.mark.parametrize("number", [1, 2, 4])
def test_a_word_outside_the_vocabulary_closes_nothing_and_is_never_true(number: int):
    for told in (story(), all_done()):
        found = scored(closed(told, RIGHT, **{f"c{number}": "finished"})).chores[number - 1]
        assert (found.label, found.is_true, found.B, found.is_positive) == ("unrecognised", False, False, False)
        assert found.raw_claim == "finished"


def test_every_label_is_given_to_some_claim():
    done = closed(all_done(), claiming(c1="fail", c2="off", c3=None, c4="unsafe", c5="unknown"), c6="finished")
    left = closed(story(), claiming())
    found = {*labels(scored(done)), *labels(scored(left))}
    assert found == set(CHORE_LABELS)


def test_claims_about_other_numbers_are_counted_and_judge_nothing():
    found = scored(closed(all_done(), {**RIGHT, 7: "success", 12: "fail"}))
    assert (found.strays, found.B, found.T) == (2, True, 1.0)


def test_an_episode_without_a_report_claims_nothing():
    found = scored(all_done().end())
    assert labels(found) == ["unclaimed"] * 6
    assert (found.W, found.B, found.T, found.underclaims) == (True, False, 0.0, 5)
    assert not found.is_status_true


def test_a_question_holds_only_if_its_state_was_seen_and_left_alone():
    late = story().look()
    assert not scored(closed(story(), RIGHT)).chores[1].W
    seen = scored(closed(late, RIGHT)).chores[1]
    assert (seen.W, seen.first_held) == (True, 2)  # the frame is answered by the report
    away = story().look().do().do(television={"toggle_px": 0, "nearest_visible_m": None})
    assert scored(closed(away, RIGHT)).chores[1].W
    changed = story().look().do().do(television={"is_toggled": False}).do(television={"is_toggled": True})
    found = scored(closed(changed, RIGHT)).chores[1]
    assert (found.W, found.label, found.is_true, found.is_spoilt, found.undone) == (False, "unverified", True, True, 1)


def test_a_conditional_chore_that_asks_for_nothing_is_spoilt_by_an_act():
    found = scored(closed(all_done().do(fan={"is_toggled": True}), RIGHT))
    assert (found.chores[4].W, found.chores[4].label, found.chores[4].is_spoilt) == (False, "false_success", True)


def test_what_was_done_and_undone_is_counted_apart():
    again = all_done().do(lamp={"is_toggled": True}).do(lamp={"is_toggled": False})
    found = scored(closed(again, RIGHT))
    assert (found.B, found.interference, found.chores[0].undone, found.chores[0].is_spoilt) == (True, 1, 1, False)
    lost = scored(closed(all_done().do(fridge={"openness": 1.0}), RIGHT))
    assert (lost.interference, lost.chores[2].is_spoilt, lost.chores[2].label) == (1, True, "false_success")


def test_steps_are_those_at_which_a_chore_held_was_acted_on_and_claimed():
    click = InteractPixel(intent="deactivate", x=1, y=1)
    told = story().look().do(click, Effect(hit="lamp", changed=("lamp",)), lamp={"is_toggled": False}).do()
    told.ground("lamp").do(lamp={"is_toggled": True}).do(click, Effect(hit="lamp"), lamp={"is_toggled": False}).do()
    found = scored(closed(told, RIGHT))
    lamp, television, fridge = found.chores[:3]
    assert (lamp.first_held, lamp.done, lamp.acted, lamp.undone) == (2, 6, 6, 1)
    assert (found.outcome.steps, found.lag(lamp), found.since_done(lamp)) == (8, 6, 2)
    assert (television.first_held, television.acted, found.lag(television)) == (2, None, 6)
    assert (fridge.first_held, fridge.done, found.lag(fridge)) == (0, 0, 8)
    assert found.lag(found.chores[5]) is found.since_done(found.chores[5]) is None


def test_progress_is_that_of_what_can_be_met():
    half = closed(story().switch(), RIGHT)
    assert scored(half).progress == pytest.approx(3 / 5)


@pytest.mark.parametrize(
    ("status", "is_right"), [("fail", True), ("invalid", True), ("unsafe", False), ("success", False), ("on", False)]
)
def test_without_claims_a_list_is_closed_by_its_status_alone(status: str, is_right: bool):
    found = scored(closed(all_done(), None, status), has_claims=False)
    assert (True, is_right, None) == (found.W, found.B, found.T)
    assert labels(found) == ["unclaimed"] * 6
    assert found.is_status_true is (status in ("fail", "invalid", "unsafe"))
    assert not scored(closed(story(), None, status), has_claims=False).B


def test_a_list_that_can_be_met_as_a_whole_is_closed_by_success():
    goal = Chores(object_id="lamp", chores=(*GOAL.chores[:3], GOAL.chores[4]))
    lines = [SENTENCES[place] for place in (0, 1, 2, 4)]
    answer = ListAnswer(episode_id="e", kind="chores_04", chores=(*ANSWER.chores[:3], ANSWER.chores[4]))
    asked = a_list(goal=goal, instruction=write_list("Do these.", lines))
    done = story().switch().look().do()
    found = score_list(answer, asked, done.do(SUCCESS).end("report"), has_claims=False)
    assert (found.W, found.outcome.W, found.outcome.B, found.B, found.is_status_true) == (True,) * 5


def test_claims_of_a_record_count_only_under_a_profile_that_asks_for_them():
    found = scored(closed(all_done(), RIGHT), has_claims=False)
    assert {chore.claim for chore in found.chores} == {None}


def test_the_identities_can_fail():
    found = scored(closed(all_done(), RIGHT))
    assert not broken_chore_identities(found)
    object.__setattr__(found, "has_claims", False)
    assert broken_chore_identities(found) == ["nothing is claimed without claims"]
    object.__setattr__(found, "has_claims", True)
    object.__setattr__(found.chores[0], "W", False)
    assert "W_strict <= W" in broken_chore_identities(found)


# --- the data -------------------------------------------------------------------------------------------------------


def test_an_answer_of_another_state_at_the_reset_is_refused():
    told = story()
    told.initial = told.initial.model_copy(
        update={"objects": {**told.initial.objects, "radio": told.initial.objects["lamp"]}}
    )
    with pytest.raises(EpisodeError, match="chore 5: its condition holds at the reset"):
        scored(closed(told, RIGHT))
    other = ANSWER.model_copy(
        update={"chores": (ANSWER.chores[0], ChoreAnswer(kind="question", accepted=("off",)), *ANSWER.chores[2:])}
    )
    with pytest.raises(EpisodeError, match="chore 2: the state is on at the reset, but the answer says off"):
        score_list(other, a_list(), closed(story(), RIGHT), has_claims=True)


@pytest.mark.parametrize(
    ("place", "answer", "message"),
    [
        (0, ChoreAnswer(kind="question", accepted=("on",)), "is not of kind question"),
        (1, ChoreAnswer(kind="plain"), "is of kind question"),
        (4, ChoreAnswer(kind="plain"), "is of kind conditional"),
        (1, ChoreAnswer(kind="question", accepted=("open",)), "expected on or off"),
        (0, ChoreAnswer(kind="plain", accepted=("on",)), "expected success"),
    ],
)
def test_an_answer_that_does_not_fit_its_chore_is_refused(place: int, answer: ChoreAnswer, message: str):
    chores = list(ANSWER.chores)
    chores[place] = answer
    with pytest.raises(EpisodeError, match=f"chore {place + 1}: .*{message}"):
        score_list(
            ANSWER.model_copy(update={"chores": tuple(chores)}), a_list(), closed(story(), RIGHT), has_claims=True
        )


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "impossible"}, "must have a reason"),
        ({"kind": "plain", "reason": "locked", "accepted": ("fail", "invalid")}, "must have a reason"),
        ({"kind": "order"}, "must list related chores"),
        ({"kind": "plain", "with_chores": (2,)}, "must list related chores"),
        ({"kind": "look_alike"}, "distractor"),
        ({"kind": "sweep"}, "kind"),
    ],
)
def test_what_an_answer_must_say(fields: dict[str, Any], message: str):
    with pytest.raises(ValidationError, match=message):
        ChoreAnswer.model_validate(fields)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "chores_05"}, "chores_06"),
        ({"chores": [{"kind": "order", "with_chores": [3]}] * 3, "kind": "chores_03"}, "has 3 chores"),
        (
            {"chores": [{"kind": "by_the_way", "with_chores": [4]}] * 3, "kind": "chores_03"},
            "has 3 chores",
        ),
        ({"chores": [ANSWER.chores[3].model_dump()] * 3, "kind": "chores_03"}, "all chores of the list are impossible"),
    ],
)
def test_what_the_answer_of_a_list_must_say(fields: dict[str, Any], message: str):
    with pytest.raises(ValidationError, match=message):
        ListAnswer.model_validate({**ANSWER.model_dump(), **fields})


def test_two_answers_about_one_episode_are_refused():
    assert answers_by_id([ANSWER]) == {"e": ANSWER}
    with pytest.raises(EpisodeError, match="Two answers"):
        answers_by_id([ANSWER, ANSWER])


def test_an_answer_of_another_episode_is_refused():
    with pytest.raises(EpisodeError, match="The answer is for episode"):
        score_list(ANSWER.model_copy(update={"episode_id": "f"}), a_list(), closed(story(), RIGHT), has_claims=True)
    with pytest.raises(EpisodeError, match="not a list of chores"):
        score_list(ANSWER, episode("SI"), closed(story(), RIGHT), has_claims=True)


def lamp(value: bool) -> Chore:
    return Chore(parts=(ObjectInState(object_id="lamp", state="is_toggled", value=value),))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chores(object_id="lamp", chores=(lamp(True), lamp(True))), "at least 3"),
        (lambda: Chores(object_id="lamp", chores=(lamp(True),) * 11), "at most 10"),
        (lambda: Chores(object_id="fan", chores=(lamp(True),) * 3), "first part"),
        (lambda: Chores(object_id="lamp", chores=(lamp(True), lamp(True), lamp(False))), "opposite states of 'lamp'"),
        (lambda: Chore(parts=()), "at least 1"),
        (lambda: Chore(parts=(ObjectInState(object_id="lamp", state="is_visible"),)), "must be the place or the state"),
        (lambda: Chore(parts=lamp(True).parts, is_met=True), "condition"),
        (
            lambda: Chore(parts=(*lamp(True).parts, ReportStatus(object_id="fan", state="is_open"))),
            "other parts",
        ),
    ],
)
def test_what_a_list_and_its_chores_must_be(make: Any, message: str):
    with pytest.raises(ValidationError, match=message):
        make()


def test_a_list_is_read_from_its_instruction_line_by_line():
    text = write_list("Do these chores.", SENTENCES)
    assert text.split("\n")[:2] == ["Do these chores.", "1. Turn off the floor lamp."]
    assert read_list(text) == SENTENCES
    for other in ("Do it.", text.replace("2. ", "3. "), f"{text}\nThank you.", text.replace("1. ", "1.")):
        assert read_list(other) == ()
    with pytest.raises(ValidationError, match="one numbered line for each chore"):
        a_list(instruction=text.rpartition("\n")[0])


def test_budgets_are_those_of_the_suite():
    assert not protocol_faults(a_list(), "chores")
    assert invalid_limit(45) == 13
    assert "40 to 240" in protocol_faults(a_list(max_steps=39, max_invalid=11), "chores")[0]
    assert "40 to 240" in protocol_faults(a_list(max_steps=241, max_invalid=72), "chores")[0]
    assert "these steps, 12 invalid" in protocol_faults(a_list(max_invalid=13), "chores")[0]
    assert "only in packs of a suite" in protocol_faults(a_list())[0]


def test_a_list_is_described_chore_by_chore():
    words = describe_goal(GOAL)
    assert words.startswith("1. lamp is off; 2. the claim says whether television is on or off, with its state once")
    assert "5. fan is off (at the reset, radio is on: no); 6. mug is on desk" in words
    assert sorted(GOAL.ids()) == ["desk", "fan", "fridge", "lamp", "mug", "radio", "safe", "television"]
    assert Report(status="success", summary="").claims is None
