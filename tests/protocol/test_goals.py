"""Goals, row by row: truth, strictness, latching, tampering and progress."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from tests.support.builders import GOALS, RecordBuilder, thing
from vigil.base.geometry import Vec3
from vigil.errors import RecordError
from vigil.protocol.actions import InteractPixel
from vigil.protocol.goals import (
    NEAR_M,
    OBSERVABLE_M,
    OBSERVABLE_PX,
    TOLERANCE,
    AgentNearTarget,
    Constraint,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
    is_observable,
    is_state_observable,
    state_label,
)
from vigil.protocol.world import Effect
from vigil.scoring.goal_check import UNFINISHED_AT_MOST, GoalCheck, GoalRow, check, label_at_reset
from vigil.scoring.goal_words import describe_goal

TARGET = TargetGrounded(object_id="target")
HIDDEN: dict[str, Any] = {"visible": False, "visible_px": 0, "open_px": 0, "toggle_px": 0, "nearest_visible_m": None}
SEEN: dict[str, Any] = {"visible": True, "visible_px": 500, "open_px": 300, "toggle_px": 300, "nearest_visible_m": 2.0}


def verdict(goal, record) -> tuple[bool, bool]:
    found = check(goal, record)
    return found.semantic, found.strict


def progress(goal, record) -> list[float | None]:
    return [row.progress if row.progress is None else round(row.progress, 6) for row in check(goal, record).rows]


@pytest.mark.parametrize(
    ("px", "metres", "is_seen"),
    [(40, 6.0, True), (39, 1.0, False), (40, 6.001, False), (500, None, False), (0, None, False)],
)
def test_observable_is_forty_pixels_within_six_metres(px: int, metres: float | None, is_seen: bool):
    assert is_observable(thing(visible_px=px, open_px=0, toggle_px=0, nearest_visible_m=metres)) is is_seen
    shown = thing(visible_px=0, open_px=px, toggle_px=0, nearest_visible_m=metres)
    assert is_state_observable(shown, "is_open") is is_seen
    assert not is_state_observable(shown, "is_toggled")


class TestTargetGrounded:
    @pytest.mark.parametrize(
        ("hit", "category", "near", "expected"),
        [
            ("target", "Thing", ("target",), (True, True)),
            ("shelf", "Shelf", ("shelf", "target"), (True, False)),
            (None, "Thing", ("target",), (True, False)),
            ("twin", "Thing", ("target", "twin"), (False, False)),
            ("shelf", "Shelf", ("shelf",), (False, False)),
            (None, "Thing", (), (False, False)),
        ],
    )
    def test_the_pixel_is_the_targets_or_within_three(self, hit, category, near, expected):
        record = RecordBuilder(target=thing()).ground(hit, category, near).report()
        assert verdict(TARGET, record) == expected

    def test_the_last_ground_click_is_the_answer(self):
        story = RecordBuilder(target=thing()).ground("target").ground("shelf", "Shelf")
        found = check(TARGET, story.report())
        assert (found.semantic, found.ever_satisfied, found.first_satisfied_step) == (False, True, 1)
        assert [row.progress for row in found.rows] == [0.0, 1.0, 0.0, 0.0]

    def test_a_click_with_another_intent_is_no_answer(self):
        pick = InteractPixel(intent="pick", x=1, y=1)
        pointed = RecordBuilder(target=thing()).ground("target").do(pick, Effect(hit="shelf", hit_category="Shelf"))
        assert verdict(TARGET, pointed.report()) == (True, True)
        touched = RecordBuilder(target=thing()).do(pick, Effect(hit="target", hit_category="Thing"))
        assert verdict(TARGET, touched.report()) == (False, False)

    def test_no_click_is_no_answer(self):
        assert verdict(TARGET, RecordBuilder(target=thing()).do().invalid().report()) == (False, False)


class TestAgentNearTarget:
    GOAL = AgentNearTarget(object_id="target")

    @pytest.mark.parametrize(
        ("box_m", "center_m", "expected"),
        [(1.49, 1.49, (True, True)), (1.49, 1.5, (True, False)), (1.5, 1.4, (False, False))],
    )
    def test_less_than_a_metre_and_a_half_to_the_box(self, box_m, center_m, expected):
        record = (
            RecordBuilder(target=thing()).do(target={"box_distance_m": box_m, "center_distance_m": center_m}).report()
        )
        assert verdict(self.GOAL, record) == expected

    @pytest.mark.parametrize(("box_m", "holds"), [(0.79, True), (0.8, False), (1.0, False)])
    def test_an_episode_may_ask_for_another_distance(self, box_m, holds):
        goal = AgentNearTarget(object_id="target", threshold_m=0.8)
        facts = {"box_distance_m": box_m, "center_distance_m": box_m}
        assert verdict(goal, RecordBuilder(target=thing()).do(target=facts).end()) == (holds, holds)

    def test_progress_is_measured_to_the_distance_asked_for(self):
        goal = AgentNearTarget(object_id="target", threshold_m=0.5)
        assert progress(
            goal, RecordBuilder(target=thing(box_distance_m=2.5)).do(target={"box_distance_m": 1.5}).end()
        ) == [
            0.0,
            0.5,
        ]

    def test_it_is_not_latched_and_progress_follows_the_distance(self):
        story = RecordBuilder(target=thing(box_distance_m=3.5)).do(target={"box_distance_m": 2.5})
        story = story.do(target={"box_distance_m": 1.2}).do(target={"box_distance_m": 4.0})
        found = check(self.GOAL, story.end())
        assert [row.semantic for row in found.rows] == [False, False, True, False]
        assert [row.progress for row in found.rows] == [0.0, 0.5, 1.0, 0.0]
        assert (found.progress, found.max_progress, found.ever_satisfied) == (0.0, 1.0, True)

    def test_progress_short_of_the_goal_stays_below_one(self):
        record = RecordBuilder(target=thing(box_distance_m=3.5)).do(target={"box_distance_m": 1.5}).end()
        assert check(self.GOAL, record).progress == 0.99


class TestSeen:
    GOAL = ObjectInState(object_id="target", state="is_visible")

    def test_it_is_latched(self):
        record = RecordBuilder(target=thing(**HIDDEN)).do(target=SEEN).do(target=HIDDEN).report()
        assert [row.semantic for row in check(self.GOAL, record).rows] == [False, True, True, True]
        assert verdict(self.GOAL, record) == (True, True)

    def test_strict_asks_for_the_simulators_own_verdict_at_the_same_moment(self):
        few = SEEN | {"visible": False}
        story = RecordBuilder(target=thing(**HIDDEN)).do(target=few)
        assert verdict(self.GOAL, story.end()) == (True, False)
        assert verdict(self.GOAL, story.do(target=HIDDEN | {"visible": True}).end()) == (True, False)
        assert verdict(self.GOAL, story.do(target=SEEN).end()) == (True, True)

    def test_not_to_see_is_no_goal(self):
        with pytest.raises(ValidationError, match="not that an object is not seen"):
            ObjectInState(object_id="target", state="is_visible", value=False)


class TestState:
    @pytest.mark.parametrize(
        ("value", "openness", "expected"),
        [
            (True, 1.0, (True, True)),
            (True, 0.99, (True, True)),
            (True, 0.51, (True, False)),
            (True, 0.5, (False, False)),
            (True, None, (False, False)),
            (False, 0.0, (True, True)),
            (False, 0.01, (True, True)),
            (False, 0.09, (True, False)),
            (False, 0.1, (False, False)),
            (False, None, (False, False)),
        ],
    )
    def test_open_and_closed(self, value, openness, expected):
        goal = ObjectInState(object_id="target", state="is_open", value=value)
        assert verdict(goal, RecordBuilder(target=thing(openness=openness)).report()) == expected

    @pytest.mark.parametrize(
        ("value", "is_toggled", "expected"),
        [(True, True, True), (True, False, False), (False, False, True), (False, True, False), (False, None, False)],
    )
    def test_toggled_as_is(self, value, is_toggled, expected):
        goal = ObjectInState(object_id="target", state="is_toggled", value=value)
        assert verdict(goal, RecordBuilder(target=thing(is_toggled=is_toggled)).report()) == (expected, expected)

    def test_it_is_not_latched(self):
        goal = ObjectInState(object_id="target", state="is_toggled")
        record = (
            RecordBuilder(target=thing(is_toggled=False))
            .do(target={"is_toggled": True})
            .do(target={"is_toggled": False})
        )
        found = check(goal, record.end())
        assert (found.semantic, found.ever_satisfied, found.first_satisfied_step) == (False, True, 1)

    def test_progress_of_an_interaction_is_distance_and_state(self):
        goal = ObjectInState(object_id="target", state="is_toggled")
        story = RecordBuilder(target=thing(is_toggled=False, box_distance_m=2.5)).do(target={"box_distance_m": 2.0})
        story = story.do(target={"box_distance_m": 1.0}).do(target={"is_toggled": True})
        assert progress(goal, story.end()) == [0.0, 0.25, 0.5, 1.0]

    def test_progress_of_a_search_adds_having_seen(self):
        goal = ObjectHeld(object_id="target")
        story = RecordBuilder(target=thing(**HIDDEN, box_distance_m=2.5)).do(target=SEEN).do(target=HIDDEN)
        story = story.do(target={"box_distance_m": 1.0}).do(target={"is_held": True})
        assert progress(goal, story.end()) == [0.0, 0.333333, 0.333333, 0.666667, 1.0]

    def test_what_is_met_at_reset_is_dropped(self):
        goal = ObjectInState(object_id="target", state="is_open", value=False)
        story = RecordBuilder(target=thing(openness=0.9, box_distance_m=1.0)).do(target={"openness": 0.5})
        assert progress(goal, story.end()) == [0.0, 0.5]

    def test_a_goal_met_in_every_part_at_reset_has_no_progress_once_it_is_lost(self):
        goal = ObjectInState(object_id="target", state="is_open", value=False)
        story = RecordBuilder(target=thing(openness=0.0, box_distance_m=1.0)).do(target={"openness": 0.5})
        assert progress(goal, story.end()) == [1.0, 0.0]


class TestHeldAndPlaced:
    GOAL = ObjectAtReceptacle(object_id="target", receptacle_id="table", chain=(ObjectHeld(object_id="target"),))

    def test_held(self):
        story = RecordBuilder(target=thing()).do(target={"is_held": True})
        assert verdict(ObjectHeld(object_id="target"), story.report()) == (True, True)

    @pytest.mark.parametrize(
        ("where", "expected"),
        [
            ({"parent": "table", "support_chain": ("table",)}, (True, True)),
            ({"parent": "bowl", "support_chain": ("bowl", "table")}, (True, False)),
            ({"parent": None, "over": ("table",)}, (True, False)),
            ({"parent": "shelf", "support_chain": ("shelf",)}, (False, False)),
            ({"parent": None}, (False, False)),
            ({"parent": "table", "support_chain": ("table",), "is_held": True}, (False, False)),
            ({"parent": "table", "support_chain": ("table",), "not_on": ("table",)}, (False, False)),
            ({"parent": "drawer", "support_chain": ("drawer", "table"), "not_on": ("drawer", "table")}, (False, False)),
            ({"parent": "drawer", "support_chain": ("drawer", "table"), "not_on": ("drawer",)}, (True, False)),
            ({"parent": "table", "over": ("table",), "not_on": ("table",)}, (False, False)),
        ],
    )
    def test_at_a_receptacle(self, where, expected):
        record = RecordBuilder(target=thing(), table=thing()).do(target=where).report()
        assert verdict(self.GOAL, record) == expected

    @pytest.mark.parametrize(
        ("where", "expected"),
        [
            ({"parent": "table", "support_chain": ("table",)}, (False, False)),
            ({"parent": "table", "support_chain": ("table",), "inside": ("table",)}, (True, True)),
            ({"parent": "bowl", "support_chain": ("bowl", "table"), "inside": ("bowl",)}, (False, False)),
            ({"parent": "bowl", "support_chain": ("bowl", "table"), "inside": ("bowl", "table")}, (True, False)),
            ({"parent": None, "over": ("table",)}, (False, False)),
            ({"parent": None, "over": ("table",), "over_inside": ("table",)}, (True, False)),
            ({"parent": "table", "inside": ("table",), "is_held": True}, (False, False)),
        ],
    )
    def test_inside_a_receptacle(self, where, expected):
        goal = self.GOAL.model_copy(update={"inside": True})
        story = (
            RecordBuilder(target=thing(), table=thing())
            .do(target={"is_held": True})
            .do(target={"is_held": False} | where)
        )
        record = story.report()
        assert verdict(goal, record) == expected
        assert (progress(goal, record)[-1] == 1.0) == expected[0]

    def test_inside_is_always_written(self):
        assert self.GOAL.model_dump(mode="json")["inside"] is False

    def test_progress_counts_each_link_latched_and_the_end(self):
        story = RecordBuilder(target=thing(), table=thing()).do(target={"is_held": True}).do(target={"is_held": False})
        assert progress(self.GOAL, story.end()) == [0.0, 0.5, 0.5]
        on = {"parent": "table", "support_chain": ("table",)}
        assert progress(self.GOAL, story.do(target=on).end()) == [0.0, 0.5, 0.5, 1.0]

    def test_a_chain_that_was_skipped_does_not_matter_for_the_goal(self):
        on = {"parent": "table", "support_chain": ("table",)}
        assert verdict(self.GOAL, RecordBuilder(target=thing(), table=thing()).do(target=on).end()) == (True, True)


class TestReportStatus:
    GOAL = ReportStatus(object_id="target", state="is_toggled")

    def test_the_closing_frame_is_the_one_that_the_last_reply_answered(self):
        seen_then_not = RecordBuilder(target=thing(is_toggled=True)).do(target=HIDDEN)
        assert verdict(self.GOAL, seen_then_not.end()) == (True, True)
        assert verdict(self.GOAL, seen_then_not.report("on")) == (False, False)
        found_again = RecordBuilder(target=thing(is_toggled=True, **HIDDEN)).do(target=SEEN)
        assert verdict(self.GOAL, found_again.end()) == (False, False)
        assert verdict(self.GOAL, found_again.report("on")) == (True, True)

    def test_it_is_the_state_that_must_be_seen(self):
        back = RecordBuilder(target=thing(is_toggled=True, toggle_px=39))
        assert verdict(self.GOAL, back.report("on")) == (False, False)
        small = RecordBuilder(target=thing(is_toggled=True, visible=False))
        assert verdict(self.GOAL, small.report("on")) == (True, False)

    @pytest.mark.parametrize("changes", [[True], [True, False]])
    def test_a_state_that_was_ever_changed_is_tampered_with(self, changes):
        story = RecordBuilder(target=thing(is_toggled=False))
        for value in changes:
            story.do(target={"is_toggled": value})
        found = check(self.GOAL, story.report("off"))
        assert (found.semantic, found.strict, found.is_tampered) == (False, False, True)
        assert label_at_reset(self.GOAL, story.end()) == "off"

    def test_another_state_of_the_object_may_change(self):
        story = RecordBuilder(target=thing(is_toggled=False, openness=0.0)).do(target={"openness": 1.0})
        assert verdict(self.GOAL, story.report("off")) == (True, True)
        opened = check(ReportStatus(object_id="target", state="is_open"), story.end())
        assert opened.is_tampered

    def test_there_is_no_progress(self):
        found = check(self.GOAL, RecordBuilder(target=thing(is_toggled=False)).do().report("off"))
        assert [row.progress for row in found.rows] == [None, None, None]
        assert found.max_progress is None

    @pytest.mark.parametrize(
        ("state", "facts", "label"),
        [
            ("is_toggled", {"is_toggled": True}, "on"),
            ("is_toggled", {"is_toggled": False}, "off"),
            ("is_open", {"openness": 0.8}, "open"),
            ("is_open", {"openness": 0.02}, "closed"),
        ],
    )
    def test_labels(self, state, facts, label):
        assert (
            label_at_reset(ReportStatus(object_id="target", state=state), RecordBuilder(target=thing(**facts)).end())
            == label
        )


class TestProgressOfParts:
    @pytest.mark.parametrize(
        ("value", "openness", "expected"),
        [(True, (0.0, 0.2, 0.9), [0.0, 0.4, 1.0]), (False, (1.0, 0.55, 0.0), [0.0, 0.5, 1.0])],
    )
    def test_opening_and_closing_are_measured_to_their_own_thresholds(self, value, openness, expected):
        goal = ObjectInState(object_id="target", state="is_open", value=value)
        story = RecordBuilder(target=thing(openness=openness[0], box_distance_m=1.0))
        for each in openness[1:]:
            story.do(target={"openness": each})
        assert progress(goal, story.end()) == expected

    @pytest.mark.parametrize(
        ("kind", "openness"), [("object_open", (0.0, 0.2, 0.1)), ("object_closed", (1.0, 0.64, 0.82))]
    )
    @pytest.mark.parametrize("latched", [True, False])
    def test_a_constraint_of_a_leaf_adds_how_far_it_has_come(self, kind, openness, latched):
        constraint = Constraint(object_id="obstacle", kind=kind, latched=latched)
        goal = ObjectHeld(object_id="target", constraint=constraint)
        story = RecordBuilder(target=thing(box_distance_m=1.0), obstacle=thing(openness=openness[0]))
        for each in openness[1:]:
            story.do(obstacle={"openness": each})
        share = [0.0, 0.4, 0.4 if latched else 0.2]
        assert progress(goal, story.end()) == [part / 2 for part in share]


class TestConstraint:
    @staticmethod
    def goal(**facts: Any) -> ObjectHeld:
        return ObjectHeld(object_id="target", constraint=Constraint(object_id="obstacle", **facts))

    def test_a_state_must_be_so_at_closure(self):
        goal = self.goal(kind="object_closed", latched=False)
        story = RecordBuilder(target=thing(), obstacle=thing(openness=1.0)).do(target={"is_held": True})
        assert verdict(goal, story.end()) == (False, False)
        story.do(obstacle={"openness": 0.05})
        assert verdict(goal, story.end()) == (True, True)
        assert verdict(goal, story.do(obstacle={"openness": 0.9}).end()) == (False, False)

    def test_an_event_is_latched(self):
        goal = self.goal(kind="object_moved", latched=True, distance_m=0.5)
        away, back = {"position": Vec3(0.0, 1.0, 3.5)}, {"position": Vec3(0.0, 1.0, 3.0)}
        story = RecordBuilder(target=thing(), obstacle=thing()).do(obstacle=away).do(obstacle=back)
        assert verdict(goal, story.do(target={"is_held": True}).end()) == (True, True)

    def test_moving_up_is_not_away_and_taking_up_is(self):
        goal = self.goal(kind="object_moved", latched=True, distance_m=0.5)
        lifted = RecordBuilder(target=thing(is_held=True), obstacle=thing()).do(
            obstacle={"position": Vec3(0.0, 9.0, 3.0)}
        )
        assert verdict(goal, lifted.end()) == (False, False)
        assert verdict(goal, lifted.do(obstacle={"is_held": True}).end()) == (True, True)

    @pytest.mark.parametrize(
        ("kind", "before", "after"),
        [
            ("object_open", {"openness": 0.0}, {"openness": 0.6}),
            ("object_closed", {"openness": 1.0}, {"openness": 0.0}),
            ("object_on", {"is_toggled": False}, {"is_toggled": True}),
            ("object_off", {"is_toggled": True}, {"is_toggled": False}),
            ("object_released", {"is_held": True}, {"is_held": False}),
        ],
    )
    @pytest.mark.parametrize("latched", [True, False])
    def test_each_kind_counts_for_goal_and_progress(self, kind, before, after, latched):
        goal = self.goal(kind=kind, latched=latched)
        story = RecordBuilder(target=thing(box_distance_m=1.0), obstacle=thing(**before)).do(obstacle=after)
        story.do(target={"is_held": True}).do(obstacle=before)
        found = check(goal, story.end())
        assert [row.semantic for row in found.rows] == [False, False, True, latched]
        assert [row.progress for row in found.rows] == [0.0, 0.5, 1.0, 1.0 if latched else 0.5]

    @pytest.mark.parametrize(
        ("openness", "is_open", "is_closed"),
        [(0.0, False, True), (0.09, False, True), (0.1, False, False), (0.5, False, False), (0.51, True, False)],
    )
    def test_open_is_more_than_a_half_and_closed_less_than_a_tenth(self, openness, is_open, is_closed):
        story = RecordBuilder(target=thing(is_held=True), obstacle=thing(openness=openness))
        held = [verdict(self.goal(kind=kind, latched=False), story.end()) for kind in ("object_open", "object_closed")]
        assert held == [(is_open, is_open), (is_closed, is_closed)]

    @pytest.mark.parametrize("kind", ["object_open", "object_closed", "object_on", "object_off"])
    def test_a_thing_without_the_state_meets_nothing(self, kind):
        story = RecordBuilder(target=thing(is_held=True), obstacle=thing(openness=None, is_toggled=None))
        assert verdict(self.goal(kind=kind, latched=False), story.end()) == (False, False)

    @pytest.mark.parametrize(("moved_m", "holds"), [(0.5, True), (0.499, False)])
    def test_moved_is_the_asked_distance_or_more(self, moved_m, holds):
        goal = self.goal(kind="object_moved", latched=False, distance_m=0.5)
        story = RecordBuilder(target=thing(is_held=True), obstacle=thing())
        story.do(obstacle={"position": Vec3(0.0, 1.0, 3.0 + moved_m)})
        assert verdict(goal, story.end()) == (holds, holds)

    @pytest.mark.parametrize(("moved_m", "holds"), [(0.5 - TOLERANCE, True), (0.5 - 1.001 * TOLERANCE, False)])
    def test_moved_by_exactly_the_distance_less_the_tolerance_is_moved(self, moved_m, holds):
        goal = self.goal(kind="object_moved", latched=False, distance_m=0.5)
        story = RecordBuilder(target=thing(is_held=True), obstacle=thing(position=Vec3(0.0, 1.0, 0.0)))
        story.do(obstacle={"position": Vec3(0.0, 1.0, moved_m)})
        assert verdict(goal, story.end()) == (holds, holds)

    def test_progress_of_moving_follows_the_distance(self):
        goal = self.goal(kind="object_moved", latched=True, distance_m=0.5)
        story = RecordBuilder(target=thing(box_distance_m=1.0), obstacle=thing())
        story.do(obstacle={"position": Vec3(0.0, 1.0, 3.25)}).do(obstacle={"position": Vec3(0.0, 1.0, 3.0)})
        assert progress(goal, story.end()) == [0.0, 0.25, 0.25]

    def test_only_moving_has_a_distance(self):
        with pytest.raises(ValidationError, match="distance_m"):
            Constraint(kind="object_moved", object_id="x", latched=True)
        with pytest.raises(ValidationError, match="distance_m"):
            Constraint(kind="object_on", object_id="x", latched=True, distance_m=1.0)


def test_ids_of_a_goal_are_all_that_it_names():
    assert GOALS["SM"].ids() == {"target", "table"}
    assert GOALS["CR"].ids() == {"target", "obstacle"}


@pytest.mark.parametrize(
    ("family", "kind"),
    [
        ("PG", "target_grounded"),
        ("DA", "agent_near_target"),
        ("VS", "object_state"),
        ("SV", "report_status"),
        ("AI", "object_state"),
        ("SI", "object_held"),
        ("SM", "object_at_receptacle"),
        ("CR", "object_held"),
    ],
)
def test_a_goal_comes_back_from_its_kind_and_fields(family, kind):
    written = GOALS[family].model_dump_json()
    assert json.loads(written)["kind"] == kind
    assert TypeAdapter(Goal).validate_json(written) == GOALS[family]


@pytest.mark.parametrize("metres", [0.0, -1.0, float("nan"), float("inf")])
def test_a_distance_that_is_none_is_refused(metres):
    with pytest.raises(ValidationError, match="threshold_m"):
        AgentNearTarget(object_id="target", threshold_m=metres)
    with pytest.raises(ValidationError, match="distance_m"):
        Constraint(kind="object_moved", object_id="x", latched=True, distance_m=metres)


@pytest.mark.parametrize("kind", [GOALS["PG"], GOALS["CR"].constraint])
def test_goals_and_constraints_take_no_unknown_field_and_never_change(kind):
    with pytest.raises(ValidationError, match="Extra inputs"):
        type(kind).model_validate(kind.model_dump() | {"hint": "look left"})
    with pytest.raises(ValidationError, match="frozen"):
        kind.object_id = "other"


def test_the_margins_of_goals_are_the_protocols():
    assert (NEAR_M, OBSERVABLE_M, OBSERVABLE_PX, UNFINISHED_AT_MOST, TOLERANCE) == (1.5, 6.0, 40, 0.99, 1e-6)


@pytest.mark.parametrize(
    ("first", "later", "is_tampered"),
    [
        (0.4, 0.4 + 1e-7, False),
        (0.4, 0.4 - 1e-7, False),
        (0.0, TOLERANCE, False),
        (0.4, 0.4 + 1e-5, True),
        (0.4, 0.4 - 1e-5, True),
        (None, None, False),
        (None, 0.4, True),
    ],
)
def test_a_drift_within_the_tolerance_is_no_tampering(first, later, is_tampered):
    goal = ReportStatus(object_id="target", state="is_open")
    story = RecordBuilder(target=thing(openness=first)).do(target={"openness": later})
    assert check(goal, story.report("closed")).is_tampered is is_tampered


@pytest.mark.parametrize(("openness", "label"), [(0.5, "closed"), (0.51, "open"), (None, "closed")])
def test_the_label_of_an_opening_is_open_above_a_half(openness, label):
    goal = ReportStatus(object_id="target", state="is_open")
    assert label_at_reset(goal, RecordBuilder(target=thing(openness=openness)).end()) == label


def test_a_record_without_the_goals_objects_is_refused():
    with pytest.raises(RecordError, match="object 'table' is missing from the world after step 0"):
        check(GOALS["SM"], RecordBuilder(target=thing()).end())
    lost = RecordBuilder(target=thing()).do().end()
    gone = lost.steps[0].model_copy(update={"world": lost.steps[0].world.model_copy(update={"objects": {}})})
    with pytest.raises(RecordError, match="object 'target' is missing from the world after step 1"):
        check(GOALS["PG"], lost.model_copy(update={"steps": (gone,)}))
    with pytest.raises(RecordError, match="object 'target' is missing"):
        label_at_reset(ReportStatus(object_id="target", state="is_open"), RecordBuilder(table=thing()).end())


STATES = st.fixed_dictionaries(
    {
        "openness": st.sampled_from([None, 0.0, 0.05, 0.3, 0.6, 1.0]),
        "is_toggled": st.sampled_from([None, True, False]),
        "is_held": st.booleans(),
        "visible": st.booleans(),
        "visible_px": st.sampled_from([0, 39, 40, 500]),
        "toggle_px": st.sampled_from([0, 39, 40, 500]),
        "nearest_visible_m": st.sampled_from([None, 1.0, 7.0]),
        "box_distance_m": st.floats(0, 9),
        "center_distance_m": st.floats(0, 9),
        "parent": st.sampled_from([None, "table", "bowl"]),
        "support_chain": st.sampled_from([(), ("table",), ("bowl", "table")]),
        "position": st.builds(Vec3, st.floats(0, 2), st.floats(0, 2), st.floats(0, 2)),
    }
)
MORE_GOALS = [
    *GOALS.values(),
    *(ObjectInState(object_id="target", state="is_open", value=value) for value in (True, False)),
    ReportStatus(object_id="target", state="is_open"),
]


@given(goal=st.sampled_from(MORE_GOALS), states=st.lists(st.tuples(STATES, STATES), min_size=1, max_size=5))
def test_strict_implies_semantic_and_progress_is_one_exactly_where_the_goal_holds(goal, states):
    story = RecordBuilder(target=thing(**states[0][0]), obstacle=thing(**states[0][1]), table=thing())
    for target, obstacle in states[1:]:
        story.do(target=target, obstacle=obstacle)
    found = check(goal, story.end())
    assert len(found.rows) == len(states)
    for row in found.rows:
        assert row.semantic or not row.strict
        if row.progress is not None:
            assert 0.0 <= row.progress <= 1.0
            assert (row.progress == 1.0) is row.semantic
    first = found.rows[0]
    assert first.semantic or not first.progress
    assert found.ever_satisfied is (found.first_row is not None)


@pytest.mark.parametrize(
    ("held", "first_row", "first_step"),
    [
        ((False, False), None, None),
        ((True, False), 0, None),
        ((True, True), 0, 1),
        ((False, False, True, False), 2, 2),
        ((True, False, True), 0, 2),
    ],
)
def test_when_a_goal_held_first(held: tuple[bool, ...], first_row: int | None, first_step: int | None):
    found = GoalCheck(tuple(GoalRow(each, False, None) for each in held), is_tampered=False)
    assert (found.first_row, found.first_satisfied_step) == (first_row, first_step)
    assert found.ever_satisfied is any(held)
    assert found.semantic is held[-1]
    assert found.max_progress is None


def test_a_queried_leaf_is_seen_by_what_shows_it_open():
    goal = ReportStatus(object_id="target", state="is_open")
    assert verdict(goal, RecordBuilder(target=thing(openness=1.0, toggle_px=0)).report("open")) == (True, True)
    assert verdict(goal, RecordBuilder(target=thing(openness=1.0, open_px=0)).report("open")) == (False, False)


def test_only_a_queried_state_is_tampered_with():
    story = RecordBuilder(target=thing(is_toggled=False)).do(target={"is_toggled": True})
    assert not check(ObjectInState(object_id="target", state="is_toggled"), story.end()).is_tampered


def test_a_thing_to_be_found_is_found_or_not():
    goal = ObjectInState(object_id="target", state="is_visible")
    story = RecordBuilder(target=thing(**HIDDEN, box_distance_m=2.5)).do(target={"box_distance_m": 1.6})
    assert progress(goal, story.do(target=SEEN).end()) == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("state", "before", "after", "label"),
    [
        ("is_toggled", {"is_toggled": False}, {"is_toggled": True}, "off"),
        ("is_open", {"openness": 0.0}, {"openness": 1.0}, "closed"),
    ],
)
def test_a_state_counts_until_it_is_changed(state, before, after, label):
    goal = ReportStatus(object_id="target", state=state)
    story = RecordBuilder(target=thing(**before)).do(target=after)
    assert [row.semantic for row in check(goal, story.report(label)).rows] == [True, False, False]
    assert not check(goal, RecordBuilder(target=thing(**before)).end("error")).is_tampered


@pytest.mark.parametrize(
    "fields",
    [
        {"object_id": "x"},
        {"kind": "object_at_receptacle", "object_id": "x", "receptacle_id": "r", "chain": [{"object_id": "x"}]},
    ],
)
def test_a_goal_without_its_kind_is_none(fields: dict):
    with pytest.raises(ValidationError, match="Unable to extract tag"):
        TypeAdapter(Goal).validate_python(fields)


@pytest.mark.parametrize(
    ("query", "is_toggled", "openness", "label"),
    [
        ("is_toggled", True, None, "on"),
        ("is_toggled", False, 1.0, "off"),
        ("is_open", True, 0.51, "open"),
        ("is_open", True, 0.5, "closed"),
        ("is_open", None, None, "closed"),
    ],
)
def test_a_state_has_one_of_two_labels(query, is_toggled, openness, label):
    assert state_label(query, is_toggled=is_toggled, openness=openness) == label


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (TargetGrounded(object_id="Mug|1"), "the last ground click is on Mug|1"),
        (AgentNearTarget(object_id="Bed|1", threshold_m=1.25), "the agent stands less than 1.25 m from Bed|1"),
        (ObjectInState(object_id="Bed|1", state="is_visible"), "Bed|1 has been seen"),
        (ObjectInState(object_id="Safe|1", state="is_open"), "Safe|1 is open"),
        (ObjectInState(object_id="Safe|1", state="is_open", value=False), "Safe|1 is closed"),
        (ObjectInState(object_id="Lamp|1", state="is_toggled"), "Lamp|1 is on"),
        (ObjectInState(object_id="Lamp|1", state="is_toggled", value=False), "Lamp|1 is off"),
        (ObjectHeld(object_id="Mug|1"), "Mug|1 is in the hand"),
        (ObjectAtReceptacle(object_id="Mug|1", receptacle_id="Bed|1"), "Mug|1 is on Bed|1"),
        (ObjectAtReceptacle(object_id="Mug|1", receptacle_id="Safe|1", inside=True), "Mug|1 is inside Safe|1"),
        (
            ReportStatus(object_id="Safe|1", state="is_open"),
            "the report says whether Safe|1 is open or closed, with its state in view and untouched",
        ),
        (
            ReportStatus(object_id="Lamp|1", state="is_toggled"),
            "the report says whether Lamp|1 is on or off, with its state in view and untouched",
        ),
        (
            ObjectAtReceptacle(
                object_id="Mug|1",
                receptacle_id="Bed|1",
                chain=(ObjectInState(object_id="Safe|1", state="is_open"), ObjectHeld(object_id="Mug|1")),
            ),
            "Mug|1 is on Bed|1; for progress alone: Safe|1 is open, Mug|1 is in the hand",
        ),
    ],
)
def test_a_goal_is_said_in_words(goal, words):
    assert describe_goal(goal) == words


@pytest.mark.parametrize(
    ("constraint", "words"),
    [
        (Constraint(kind="object_open", object_id="Safe|1", latched=False), "Safe|1 is open (at the end)"),
        (Constraint(kind="object_closed", object_id="Safe|1", latched=True), "Safe|1 is closed (at some moment)"),
        (Constraint(kind="object_on", object_id="Lamp|1", latched=True), "Lamp|1 is on (at some moment)"),
        (Constraint(kind="object_off", object_id="Lamp|1", latched=False), "Lamp|1 is off (at the end)"),
        (
            Constraint(kind="object_released", object_id="Cup|1", latched=True),
            "Cup|1 is no longer in the hand (at some moment)",
        ),
        (
            Constraint(kind="object_moved", object_id="Box|1", latched=True, distance_m=0.5),
            "Box|1 has been moved by 0.5 m or more (at some moment)",
        ),
    ],
)
def test_a_constraint_is_said_in_words(constraint, words):
    assert describe_goal(ObjectHeld(object_id="Mug|1", constraint=constraint)) == f"Mug|1 is in the hand; and {words}"
