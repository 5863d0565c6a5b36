"""Pixel Grounding: point at a named object that is in view."""

from vigil.protocol.family import DraftKind, FamilySpec

FAMILY = FamilySpec(
    code="PG",
    name="Pixel Grounding",
    tier="diagnostic",
    visible_at_start=True,
    max_steps=5,
    max_invalid=3,
    skills=("interact_pixel(ground)", "report"),
    goal_kinds=("target_grounded",),
    summary="point at the named object",
    position=1,
    kinds={
        "large": DraftKind("vigil.authoring.families.pg.drafts:pointing", {"size": "large"}, in_starter=3),
        "medium": DraftKind("vigil.authoring.families.pg.drafts:pointing", {"size": "medium"}, in_starter=4),
        "small": DraftKind("vigil.authoring.families.pg.drafts:pointing", {"size": "small"}, in_starter=3),
        "look_alike": DraftKind(
            "vigil.authoring.drafting.look_alike_targets:drafts_among_look_alikes",
            {"asking": DraftKind("vigil.authoring.families.pg.drafts:asking")},
        ),
    },
    briefing="Ask to point at one thing in view, within reach. Kinds are the size of the target, and look_alike "
    "(something else that its bare name could mean is in view). Role: target.",
    start_distance_m=(0.3, 1.35),
    rules=("graded", "in_reach_at_start"),
    stratum="target_size",
    level_bounds=(2.6, 3.4, 4.3),
    sample_goal={"kind": "target_grounded", "object_id": "target"},
)
