"""Approach and Interact: act on an object that is in view but out of reach."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

FAMILY = FamilySpec(
    code="AI",
    name="Approach and Interact",
    tier="compositional",
    visible_at_start=True,
    max_steps=25,
    max_invalid=8,
    skills=("navigate", "interact_pixel", "report"),
    goal_kinds=("object_state", "object_held"),
    summary="DA + interaction",
    position=5,
    kinds={
        **{
            act: DraftKind("vigil.authoring.families.ai.drafts:acting", {"act": act}, in_starter=2)
            for act in ("open", "close", "turn_on", "turn_off", "pick")
        },
        "look_alike": DraftKind(
            "vigil.authoring.drafting.look_alike_targets:drafts_among_look_alikes",
            {"asking": DraftKind("vigil.authoring.families.ai.drafts:asking")},
        ),
    },
    briefing="Ask to do one thing with a target in view but out of reach. Kinds: open, close, turn_on, turn_off, pick, "
    "look_alike (any of these, with something else in view that the target's bare name could mean). Role: target.",
    start_distance_m=(1.8, 5.0),
    rules=("out_of_reach_at_start",),
    grading=StreamGrading("actions", easy=5, medium=7),
    level_bounds=(4.2, 5.8, 7.6),
    sample_goal={"kind": "object_state", "object_id": "target", "state": "is_toggled"},
)
