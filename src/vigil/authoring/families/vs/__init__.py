"""View Search: bring an object into view that is out of view at the start."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading

FAMILY = FamilySpec(
    code="VS",
    name="View Search",
    tier="diagnostic",
    visible_at_start=False,
    max_steps=20,
    max_invalid=6,
    skills=("navigate", "look", "report"),
    goal_kinds=("object_state",),
    summary="bring it into view",
    position=3,
    kinds={
        "walk": DraftKind("vigil.authoring.families.vs.drafts:searching", {"by_turning": False}, in_starter=7),
        "turn": DraftKind("vigil.authoring.families.vs.drafts:searching", {"by_turning": True}, in_starter=3),
        "look_alike": DraftKind(
            "vigil.authoring.drafting.look_alike_targets:drafts_among_look_alikes",
            {"asking": DraftKind("vigil.authoring.families.vs.drafts:asking")},
        ),
    },
    briefing="Ask to look for one thing that is out of view at the start. Kinds: walk (another room or place), turn "
    "(turning on the spot shows it), look_alike (its bare name could mean something else too). Say when it is done: "
    "once the thing is in the picture. Role: target.",
    start_distance_m=(1.8, 12.0),
    rules=("stop_can_be_checked",),
    end_words=r"\b(see|seen|seeing|in (?:the |your )?(?:picture|view)|into (?:the picture|view))\b",
    stratum="turning",
    grading=StreamGrading("actions", easy=2, medium=5),
    level_bounds=(5.3, 8.0, 12.1),
    sample_goal={"kind": "object_state", "object_id": "target", "state": "is_visible"},
)
