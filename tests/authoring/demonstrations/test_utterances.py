"""What a demonstration says: of what is seen, and no more."""

import pytest

from vigil.authoring.demonstrations.utterances import SubjectInView, report_text, thought_text
from vigil.authoring.language.referring import Phrase
from vigil.protocol.actions import Action, InteractPixel, Look, Navigate, Report
from vigil.protocol.goals import (
    AgentNearTarget,
    Goal,
    ObjectAtReceptacle,
    ObjectHeld,
    ObjectInState,
    ReportStatus,
    TargetGrounded,
)

MUG = Phrase("mug", colour="red", support="desk", room="bedroom", is_inside=False)
TURN = Navigate(mode="turn_left", magnitude=30)


@pytest.mark.parametrize(
    ("subject", "thought"),
    [
        (
            SubjectInView(MUG, is_seen=True, x=100),
            "I see the red mug on the desk in the bedroom on the left; I turn left.",
        ),
        (SubjectInView(Phrase("mug"), is_seen=True, x=320), "I see the mug ahead; I turn left."),
        (SubjectInView(Phrase("mug"), is_seen=True, x=600), "I see the mug on the right; I turn left."),
        (SubjectInView(Phrase("mug"), is_seen=True), "I see the mug; I turn left."),
        (SubjectInView(Phrase("mug"), is_out_of_view=True), "I do not see the mug; I turn left."),
        (SubjectInView(Phrase("mug")), "I turn left."),
    ],
)
def test_a_thing_is_seen_or_not_or_nothing_is_said_of_it(subject: SubjectInView, thought: str) -> None:
    assert thought_text(TURN, subject, "") == thought


@pytest.mark.parametrize(
    ("action", "thought"),
    [
        (Navigate(mode="forward", magnitude=2), "I do not see the mug; I walk forward."),
        (Look(direction="down", magnitude=15), "I do not see the mug; I look down."),
        (InteractPixel(intent="pick", x=1, y=2), "I pick up the mug."),
        (InteractPixel(intent="place", x=1, y=2), "I put what I hold at the mug."),
        (InteractPixel(intent="drop"), "I put down what I hold."),
        (Report(status="success", summary=""), "Said."),
    ],
)
def test_an_action_is_told(action: Action, thought: str) -> None:
    assert thought_text(action, SubjectInView(Phrase("mug"), is_out_of_view=True), "Said.") == thought


@pytest.mark.parametrize(
    ("goal", "said"),
    [
        (TargetGrounded(object_id="a"), "I pointed at the red mug."),
        (AgentNearTarget(object_id="a"), "I am near the red mug."),
        (ReportStatus(object_id="a", state="is_open"), "The red mug is open."),
        (ObjectInState(object_id="a", state="is_visible"), "I see the red mug."),
        (ObjectInState(object_id="a", state="is_open", value=False), "I closed the red mug."),
        (ObjectInState(object_id="a", state="is_toggled"), "I turned on the red mug."),
        (ObjectHeld(object_id="a"), "I picked up the red mug."),
        (ObjectAtReceptacle(object_id="a", receptacle_id="b"), "I put the red mug on the box."),
        (ObjectAtReceptacle(object_id="a", receptacle_id="b", inside=True), "I put the red mug in the box."),
    ],
)
def test_a_report_tells_what_was_done_or_is_seen(goal: Goal, said: str) -> None:
    assert report_text(goal, {"a": MUG, "b": Phrase("box")}, "open") == said
