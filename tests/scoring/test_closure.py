"""Closure stress: C by kind, evidence, pairs, and that policies without sight are at chance on twins."""

from itertools import product
from typing import Any

import pytest
from pydantic import ValidationError

from tests.support.builders import HERE, RecordBuilder, episode, thing
from vigil.base.geometry import Vec3
from vigil.errors import EpisodeError
from vigil.packs.pack import protocol_faults
from vigil.protocol.actions import INTENTS, Intent, InteractPixel, Navigate
from vigil.protocol.goals import MAX_PARTS, AllOf, ObjectAtReceptacle, ObjectInState
from vigil.protocol.world import Effect
from vigil.scoring.closure import (
    CONCEDED,
    PAIRED,
    Certificate,
    ClosureAnswer,
    Evidence,
    Kind,
    check_pairs,
    evidence_seen,
    is_in_picture,
    score_closure,
)
from vigil.scoring.goal_check import check
from vigil.scoring.goal_words import describe_goal

LAMPS = ("target", "second", "third")
ALL = AllOf(
    object_id="target",
    parts=tuple(ObjectInState(object_id=name, state="is_toggled", value=False) for name in LAMPS),
)
EVIDENCE = (Evidence(object_id="table", spot=Vec3(0.0, 1.0, 2.0)), Evidence(object_id="table", spot=Vec3(0, 1.0, 9.0)))
FOUND = Certificate(removed="target", has_plan=False, refusal="gone")


def impossible(**facts: object) -> ClosureAnswer:
    plain = {"episode_id": "e", "kind": "impossible", "pair": "p", "side": "impossible", "accepted": CONCEDED}
    more = {"reason": "absent", "evidence": EVIDENCE, "certificate": FOUND}
    return ClosureAnswer.model_validate({**plain, **more, **facts})


def possible(**facts: object) -> ClosureAnswer:
    return impossible(side="possible", accepted=("success",), reason=None, **facts)


def lamps() -> RecordBuilder:
    return RecordBuilder(**{name: thing(is_toggled=True) for name in LAMPS})


def test_all_of_holds_when_each_part_does_and_advances_part_by_part():
    story = lamps()
    for name in LAMPS[:-1]:
        changes: dict[str, Any] = {name: {"is_toggled": False}}
        story.do(**changes)
    rows = check(ALL, story.do(third={"is_toggled": False}).report()).rows
    assert [row.semantic for row in rows] == [False, False, False, True, True]
    assert [row.progress for row in rows] == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0, 1.0])
    assert describe_goal(ALL) == "target is off and second is off and third is off"


TOO_MANY = tuple(f"thing_{number}" for number in range(MAX_PARTS))


@pytest.mark.parametrize("names", [("target",), ("target", "target"), ("second", "target"), ("target", *TOO_MANY)])
def test_all_of_is_about_several_different_things(names: tuple[str, ...]):
    parts = tuple(ObjectInState(object_id=name, state="is_open") for name in names)
    with pytest.raises(ValidationError):
        AllOf(object_id="target", parts=parts)


def test_all_of_is_asked_for_in_packs_of_a_suite_alone():
    asked = episode("SI", goal=ALL)
    assert "only in packs of a suite" in protocol_faults(asked)[0]
    assert not protocol_faults(asked, "closure")
    with pytest.raises(ValidationError, match="all_of"):
        episode("AI", goal=ALL)


def test_c_of_what_can_be_done_is_b():
    answer = ClosureAnswer(episode_id="e", kind="all_of")
    asked = episode("SI", goal=ALL)
    done = lamps().do(target={"is_toggled": False}, second={"is_toggled": False}, third={"is_toggled": False})
    assert score_closure(answer, asked, done.report()).C
    partly = score_closure(answer, asked, lamps().do(target={"is_toggled": False}).report())
    assert not partly.C
    assert partly.is_false_success
    conceded = score_closure(answer, asked, lamps().report("fail"))
    assert not conceded.C
    assert conceded.gave_up


@pytest.mark.parametrize(
    ("status", "is_right"), [("fail", True), ("invalid", True), ("unsafe", False), ("success", False), ("off", False)]
)
def test_an_impossible_episode_is_closed_by_a_concession(status: str, is_right: bool):
    record = RecordBuilder(target=thing(), table=thing()).report(status)
    found = score_closure(impossible(), episode("SI"), record)
    assert found.C is is_right
    assert found.is_exact is (status == "fail")
    assert not found.gave_up


def test_a_status_outside_the_vocabulary_concedes_nothing():
    record = RecordBuilder(target=thing(), table=thing()).report("invalid", raw="impossible")
    assert not score_closure(impossible(), episode("SI"), record).C


def test_evidence_counts_from_frames_in_which_its_place_and_its_bearer_are_seen():
    assert evidence_seen((), RecordBuilder(table=thing()).report()) is None
    assert evidence_seen(EVIDENCE, RecordBuilder(table=thing()).report()) == 0.5
    hidden = thing(visible_px=0, visible=False)
    assert evidence_seen(EVIDENCE, RecordBuilder(table=hidden).report()) == 0.0
    late = RecordBuilder(table=hidden).do(Navigate(mode="turn_left", magnitude=9), table={"visible_px": 500})
    assert evidence_seen(EVIDENCE, late.report()) == 0.5
    assert evidence_seen((Evidence(object_id="table"),), RecordBuilder(table=thing()).report()) == 1.0


@pytest.mark.parametrize(
    ("rotation", "horizon", "spot", "is_in"),
    [
        (0.0, 0.0, Vec3(0.0, 1.576, 2.0), True),
        (0.0, 0.0, Vec3(0.0, 1.576, -2.0), False),
        (90.0, 0.0, Vec3(2.0, 1.576, 0.0), True),
        (270.0, 0.0, Vec3(-2.0, 1.576, 0.0), True),
        (0.0, 0.0, Vec3(2.6, 1.576, 2.0), True),
        (0.0, 0.0, Vec3(2.7, 1.576, 2.0), False),
        (0.0, 30.0, Vec3(0.0, 0.0, 0.5), True),
        (0.0, 0.0, Vec3(0.0, 0.0, 0.5), False),
        (0.0, -30.0, Vec3(0.0, 0.3, 2.0), False),
        (0.0, 0.0, Vec3(0.0, 1.576, 6.1), False),
    ],
)
def test_a_place_is_in_the_picture_within_its_borders_and_six_metres(
    rotation: float, horizon: float, spot: Vec3, is_in: bool
):
    agent = HERE.model_copy(update={"rotation": rotation, "horizon": horizon})
    assert is_in_picture(agent, spot) is is_in


def test_what_held_already_and_was_changed_is_counted_as_needless():
    goal = ObjectInState(object_id="target", state="is_toggled", value=False)
    facts = {"kind": "already", "reason": None, "accepted": ("success",), "side": "already"}
    answer, asked = impossible(**facts), episode("SI", goal=goal)
    left = RecordBuilder(target=thing(is_toggled=False)).report()
    assert not score_closure(answer, asked, left).is_needless
    start = RecordBuilder(target=thing(is_toggled=False))
    touched = start.do(target={"is_toggled": True}).do(target={"is_toggled": False}).report()
    found = score_closure(answer, asked, touched)
    assert found.C
    assert found.is_needless


def tried(story: RecordBuilder, intent: Intent, hit: str | None) -> RecordBuilder:
    """One click that the world refuses."""
    return story.do(InteractPixel(intent=intent, x=1, y=1), Effect(hit=hit, refusal="already_so"))


@pytest.mark.parametrize(
    ("intent", "hit", "is_knowing"),
    [
        *((intent, "target", intent == "ground") for intent in INTENTS if intent != "drop"),
        ("deactivate", "table", False),
        ("deactivate", None, False),
        ("ground", "table", True),
    ],
)
def test_where_nothing_is_to_be_done_each_try_is_needless_even_when_refused(
    intent: Intent, hit: str | None, is_knowing: bool
):
    goal = ObjectInState(object_id="target", state="is_toggled", value=False)
    facts = {"kind": "already", "reason": None, "accepted": ("success",), "side": "already"}
    story = tried(RecordBuilder(target=thing(is_toggled=False), table=thing()), intent, hit)
    found = score_closure(impossible(**facts), episode("SI", goal=goal), story.report())
    assert (found.C, found.is_knowing, found.is_needless) == (True, is_knowing, not is_knowing)
    assert found.label == ("closed" if is_knowing else "closed_needlessly")


@pytest.mark.parametrize(
    ("effect", "is_needless"),
    [
        (Effect(hit=None, near=("target",)), True),
        (Effect(hit="table", hit_category="Table", near=("table", "target")), True),
        (Effect(hit="second", hit_category="Thing", near=("second", "target")), False),
        (Effect(hit="table", hit_category="Table", near=("table",)), False),
    ],
)
def test_a_click_beside_a_thing_is_on_it_unless_it_hits_another_of_its_kind(effect: Effect, is_needless: bool):
    off = {"state": "is_toggled", "value": False}
    goal = AllOf(object_id="lamp", parts=tuple(ObjectInState(object_id=name, **off) for name in ("lamp", "target")))
    facts = {"kind": "already", "reason": None, "accepted": ("success",), "side": "open"}
    story = RecordBuilder(lamp=thing(is_toggled=True), target=thing(is_toggled=False))
    story.do(InteractPixel(intent="deactivate", x=1, y=1), effect, lamp={"is_toggled": False})
    found = score_closure(impossible(**facts), episode("SI", goal=goal), story.report())
    assert (found.C, found.is_needless) == (True, is_needless)


def test_what_still_is_to_be_done_may_be_acted_on():
    goal = ObjectInState(object_id="target", state="is_toggled", value=False)
    facts = {"kind": "already", "reason": None, "accepted": ("success",), "side": "open"}
    story = RecordBuilder(target=thing(is_toggled=True))
    story.do(InteractPixel(intent="deactivate", x=1, y=1), Effect(hit="target"), target={"is_toggled": False})
    found = score_closure(impossible(**facts), episode("SI", goal=goal), story.report())
    assert (found.is_knowing, found.label) == (True, "closed")


def test_what_stands_ajar_may_be_acted_on_and_what_is_almost_closed_not():
    goal = ObjectInState(object_id="target", state="is_open", value=False)
    facts = {"kind": "already", "reason": None, "accepted": ("success",), "side": "open"}
    needless = []
    for openness in (0.12, 0.02):
        story = tried(RecordBuilder(target=thing(openness=openness)), "close_access", "target")
        found = score_closure(impossible(**facts), episode("SI", goal=goal), story.report())
        needless.append(found.is_needless)
    assert needless == [False, True]


@pytest.mark.parametrize(
    "facts",
    [
        {"pair": None},
        {"side": "already"},
        {"reason": None},
        {"accepted": ("success",)},
        {"side": "possible"},
        {"evidence": ()},
        {"certificate": None},
        {"kind": "all_of"},
    ],
)
def test_an_answer_is_whole(facts: dict[str, object]):
    with pytest.raises(ValidationError):
        impossible(**facts)


def test_a_pair_has_one_episode_of_each_side():
    twins = [possible(), impossible(episode_id="f")]
    assert set(check_pairs(twins)) == {"e", "f"}
    for wrong in (twins[:1], [*twins, possible(episode_id="g")], [twins[0], possible(episode_id="f")]):
        with pytest.raises(EpisodeError, match="one episode of each side"):
            check_pairs(wrong)
    with pytest.raises(EpisodeError, match="Two answers"):
        check_pairs([twins[0], twins[0]])
    with pytest.raises(EpisodeError, match="cannot be scored with the answer of"):
        score_closure(twins[1], episode("SI"), RecordBuilder(target=thing()).report())


@pytest.mark.parametrize("kind", PAIRED)
@pytest.mark.parametrize("statuses", [*product(("success", "fail", "invalid"), repeat=1), (None,)])
def test_one_report_for_both_twins_never_makes_a_pair_right(kind: Kind, statuses: tuple[str | None]):
    goal = ObjectInState(object_id="target", state="is_toggled", value=False)
    right = []
    for side in PAIRED[kind]:
        is_off = side == "already"
        story = RecordBuilder(target=thing(is_toggled=not is_off), table=thing())
        record = story.end() if statuses[0] is None else story.report(statuses[0])
        facts = {} if side == "impossible" else {"accepted": ("success",), "reason": None}
        answer = impossible(kind=kind, side=side, **facts)
        asked = episode("SI", goal=goal, max_steps=1) if statuses[0] else episode("SI", goal=goal)
        right.append(score_closure(answer, asked, record).C)
    assert not all(right)


def put_away() -> AllOf:
    is_in = ObjectAtReceptacle(object_id="target", receptacle_id="fridge", inside=True)
    return AllOf(object_id="target", parts=(is_in, ObjectInState(object_id="fridge", state="is_open", value=False)))


def test_what_is_put_away_lies_inside_of_what_is_closed():
    goal = put_away()
    assert goal.ids() == {"target", "fridge"}
    assert describe_goal(goal) == "target is inside fridge and fridge is closed"
    story = RecordBuilder(target=thing(), fridge=thing(openness=1.0))
    story.do(target={"parent": "fridge", "inside": ("fridge",)}).do(fridge={"openness": 0.0})
    record = story.report()
    assert [row.semantic for row in check(goal, record).rows] == [False, False, True, True]
    answer, asked = ClosureAnswer(episode_id="e", kind="out_of_sight", form="open"), episode("SI", goal=goal)
    verdict = score_closure(answer, asked, record)
    assert (verdict.C, verdict.is_needless, verdict.label) == (True, False, "closed")
    left_open = RecordBuilder(target=thing(), fridge=thing(openness=1.0)).do(target={"inside": ("fridge",)})
    assert score_closure(answer, asked, left_open.report()).label == "false_success"


def test_parts_of_all_of_are_plain():
    chain = (ObjectInState(object_id="fridge", state="is_open"),)
    stored = ObjectAtReceptacle(object_id="target", receptacle_id="fridge", chain=chain)
    with pytest.raises(ValidationError, match="must not have a constraint or a chain"):
        AllOf(object_id="target", parts=(stored, ObjectInState(object_id="lamp", state="is_toggled")))


def branch() -> tuple[ClosureAnswer, Any]:
    """An `if_so` episode on the side on which the fridge stands open: close it, and leave the lamp off."""
    shut = ObjectInState(object_id="fridge", state="is_open", value=False)
    dark = ObjectInState(object_id="lamp", state="is_toggled", value=False)
    answer = impossible(
        kind="if_so", side="so", reason=None, accepted=("success",), evidence=(Evidence(object_id="fridge"),)
    )
    return answer, episode("SI", goal=AllOf(object_id="fridge", parts=(shut, dark)))


@pytest.mark.parametrize(
    ("done", "status", "label"),
    [
        ({"fridge": {"openness": 0.0}}, "success", "closed"),
        ({"fridge": {"openness": 0.0}}, "fail", "unreported"),
        ({"fridge": {"openness": 0.0}, "lamp": {"is_toggled": True}}, "success", "wrong_branch"),
        ({"lamp": {"is_toggled": True}}, "success", "wrong_branch"),
        ({}, "success", "false_success"),
        ({}, "fail", "given_up"),
        ({}, "open", "other"),
    ],
)
def test_the_label_says_what_became_of_a_condition(done: dict[str, Any], status: str, label: str):
    answer, asked = branch()
    story = RecordBuilder(fridge=thing(openness=1.0), lamp=thing(is_toggled=False)).do(**done)
    verdict = score_closure(answer, asked, story.report(status))
    assert verdict.label == label
    assert verdict.C is (label == "closed")


def test_what_was_changed_and_changed_back_is_closed_needlessly():
    answer, asked = branch()
    story = RecordBuilder(fridge=thing(openness=1.0), lamp=thing(is_toggled=False))
    story.do(lamp={"is_toggled": True}).do(lamp={"is_toggled": False}).do(fridge={"openness": 0.0})
    assert score_closure(answer, asked, story.report()).label == "closed_needlessly"


def test_the_other_branch_may_not_even_be_tried():
    answer, asked = branch()
    story = RecordBuilder(fridge=thing(openness=1.0), lamp=thing(is_toggled=False)).do(fridge={"openness": 0.0})
    assert score_closure(answer, asked, tried(story, "deactivate", "lamp").report()).label == "closed_needlessly"
    story = tried(RecordBuilder(fridge=thing(openness=1.0), lamp=thing(is_toggled=False)), "deactivate", "lamp")
    verdict = score_closure(answer, asked, story.report())
    assert (verdict.is_needless, verdict.is_wrong_branch, verdict.label) == (True, False, "false_success")


def test_giving_up_is_early_before_all_the_evidence_was_seen():
    answer, asked = branch()
    seen = RecordBuilder(fridge=thing(openness=1.0), lamp=thing(is_toggled=False)).report("fail")
    assert (score_closure(answer, asked, seen).gave_up, score_closure(answer, asked, seen).gave_up_early) == (
        True,
        False,
    )
    hidden = RecordBuilder(fridge=thing(openness=1.0, visible_px=0, visible=False), lamp=thing(is_toggled=False))
    assert score_closure(answer, asked, hidden.report("fail")).gave_up_early


def test_evidence_may_ask_to_be_near_and_plain():
    near = Evidence(object_id="table", spot=Vec3(0.0, 1.0, 2.0), within_m=1.5)
    record = RecordBuilder(table=thing(visible_px=200)).report()
    assert evidence_seen((near,), record) == 0.0
    assert evidence_seen((near.model_copy(update={"within_m": 3.0}),), record) == 1.0
    assert evidence_seen((Evidence(object_id="table", min_px=300),), record) == 0.0
    assert evidence_seen((Evidence(object_id="table", min_px=100),), record) == 1.0
