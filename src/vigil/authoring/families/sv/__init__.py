"""State Verification: report the state of an object that is in view."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

FAMILY = FamilySpec(
    code="SV",
    name="State Verification",
    tier="diagnostic",
    visible_at_start=True,
    max_steps=5,
    max_invalid=2,
    skills=("look", "report"),
    goal_kinds=("report_status",),
    summary="tell the state it is in",
    position=4,
    kinds={
        "on": DraftKind("vigil.authoring.families.sv.drafts:verifying", {"label": "on"}, in_starter=3),
        "off": DraftKind("vigil.authoring.families.sv.drafts:verifying", {"label": "off"}, in_starter=3),
        "open": DraftKind("vigil.authoring.families.sv.drafts:verifying", {"label": "open"}, in_starter=2),
        "closed": DraftKind("vigil.authoring.families.sv.drafts:verifying", {"label": "closed"}, in_starter=2),
    },
    briefing="Ask in which state one thing in view is; name both possible answers, never the answer. Kinds are the "
    "true answer: on, off, open, closed. Role: target.",
    start_distance_m=(0.5, 3.5),
    stratum="label",
    grading=StreamGrading("distance_m", easy=1.1, medium=2.0),
    level_bounds=(1.6, 2.8, 4.3),
    sample_goal={"kind": "report_status", "object_id": "target", "state": "is_toggled"},
)
