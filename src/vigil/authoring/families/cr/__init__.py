"""Constraint Resolving: resolve a constraint, then act on an object. The instruction may leave the constraint out."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

_EXPLICIT = {
    "obstacle": DraftKind("vigil.authoring.families.cr.drafts:obstacle_blocked", in_starter=2),
    "leaf": DraftKind("vigil.authoring.families.cr.leaves:leaf_in_the_way", in_starter=2, fallback="obstacle"),
    "swing": DraftKind("vigil.authoring.families.cr.drafts:swing_blocked", in_starter=2),
    "interlock": DraftKind("vigil.authoring.families.cr.drafts:interlocked", in_starter=2),
    "hand": DraftKind("vigil.authoring.families.cr.drafts:hand_full", in_starter=2),
}
_IMPLICIT = {
    f"{kind}_implicit": DraftKind("vigil.authoring.families.cr.drafts:without_constraint", {"drafts": explicit})
    for kind, explicit in _EXPLICIT.items()
}

FAMILY = FamilySpec(
    code="CR",
    name="Constraint Resolving",
    tier="compositional",
    visible_at_start=True,
    max_steps=40,
    max_invalid=12,
    skills=("navigate", "interact_pixel", "report"),
    goal_kinds=("object_state", "object_held"),
    summary="DA + interaction, after removing what prevents it",
    position=8,
    kinds={**_EXPLICIT, **_IMPLICIT},
    briefing="Ask for something that is prevented until an obstacle is dealt with; say both, the obstacle first. "
    "Kinds: obstacle (something stands in the way; pick it up), leaf (an open door bars the way; close it), swing "
    "(something keeps the target from opening; pick it up), interlock (a machine must be closed before it starts, or "
    "stopped before it opens; target alone), hand (put down what is in the hand, the obstacle, then pick up the "
    "target); each also with _implicit (say the order alone, and nothing of what prevents it). Roles: target, "
    "obstacle.",
    rules=("constraint_implicit", "constraint_visible", "constraint_holds", "hand_is_freed"),
    grading=StreamGrading("actions", easy=5, medium=8),
    level_bounds=(3.6, 5.8, 8.0),
    sample_goal={
        "kind": "object_held",
        "object_id": "target",
        "constraint": {"kind": "object_moved", "object_id": "obstacle", "latched": True, "distance_m": 0.5},
    },
)
