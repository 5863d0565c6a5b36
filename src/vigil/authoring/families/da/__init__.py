"""Distance Approach: walk up to an object that is in view."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

FAMILY = FamilySpec(
    code="DA",
    name="Distance Approach",
    tier="diagnostic",
    visible_at_start=True,
    max_steps=12,
    max_invalid=4,
    skills=("navigate", "report"),
    goal_kinds=("agent_near_target",),
    summary="walk up to it",
    position=2,
    kinds={
        "approach": DraftKind("vigil.authoring.families.da.drafts:approaching", in_starter=10),
        "look_alike": DraftKind(
            "vigil.authoring.drafting.look_alike_targets:drafts_among_look_alikes",
            {"asking": DraftKind("vigil.authoring.families.da.drafts:asking")},
        ),
    },
    briefing="Ask to walk up to one thing in view. Say the standard: 'to within about one and a half metres of ..., "
    "near enough to touch it'. Kinds: approach, look_alike (something else that its bare name could mean is in view). "
    "Role: target.",
    start_distance_m=(2.2, 6.0),
    rules=("out_of_reach_at_start", "near_sees_target", "standard_in_words", "stop_can_be_checked"),
    end_words=r"\b(touch|reach)\b",
    stratum="distance",
    grading=StreamGrading("actions", easy=4, medium=6),
    level_bounds=(5.6, 7.0, 8.4),
    sample_goal={"kind": "agent_near_target", "object_id": "target"},
)
