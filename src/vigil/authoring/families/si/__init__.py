"""Search and Interact: find an object that is out of view and act on it."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

ACTS = ("open", "close", "turn_on", "turn_off", "pick")

FAMILY = FamilySpec(
    code="SI",
    name="Search and Interact",
    tier="compositional",
    visible_at_start=False,
    max_steps=35,
    max_invalid=10,
    skills=("navigate", "look", "interact_pixel", "report"),
    goal_kinds=("object_state", "object_held"),
    suite_goal_kinds=("all_of", "chores", "object_at_receptacle"),
    summary="VS + DA + interaction",
    position=6,
    kinds={
        **{act: DraftKind("vigil.authoring.families.si.drafts:seeking", {"act": act}, in_starter=2) for act in ACTS},
        **{
            f"{act}_afar": DraftKind("vigil.authoring.families.si.drafts:seeking", {"act": act, "by_turning": False})
            for act in ACTS
        },
        "pick_inside": DraftKind("vigil.authoring.families.si.drafts:picking_from_inside"),
        "look_alike": DraftKind(
            "vigil.authoring.drafting.look_alike_targets:drafts_among_look_alikes",
            {"asking": DraftKind("vigil.authoring.families.si.drafts:asking")},
        ),
    },
    briefing="Ask to find a target that is out of view and do one thing with it. Kinds: open, close, turn_on, "
    "turn_off, pick, each also with _afar (not visible by turning); look_alike (its bare name could mean something "
    "else too); pick_inside (it lies in a closed container, of which the instruction says nothing). Roles: target, and "
    "for pick_inside container.",
    start_distance_m=(1.8, 12.0),
    rules=("found_by_opening",),
    grading=StreamGrading("actions", easy=5, medium=9),
    level_bounds=(8.2, 11.7, 14.3),
    sample_goal={"kind": "object_held", "object_id": "target"},
)
