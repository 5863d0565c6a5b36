"""Sequential Manipulation: act on several objects in order."""

from vigil.protocol.family import DraftKind, FamilySpec, StreamGrading


def _kind(plans: str, in_starter: int = 0) -> DraftKind:
    """Return the kind of episodes whose plans the function named `plans` yields."""
    arguments = {"plans": DraftKind(f"vigil.authoring.families.sm.plans:{plans}")}
    return DraftKind("vigil.authoring.families.sm.drafts:drafts_of", arguments, in_starter)


FAMILY = FamilySpec(
    code="SM",
    name="Sequential Manipulation",
    tier="compositional",
    visible_at_start=True,
    max_steps=30,
    max_invalid=10,
    skills=("navigate", "interact_pixel", "report"),
    goal_kinds=("object_held", "object_at_receptacle"),
    extra_goal_kinds=("all_of",),
    summary="several interactions in the order that the scene forces",
    position=7,
    kinds={
        "reveal_pick": _kind("revealing", in_starter=3),
        "put_into": _kind("putting_in", in_starter=3),
        "rearrange": _kind("rearranging", in_starter=2),
        "open_pick_place": _kind("emptying", in_starter=2),
        "two_to_one": _kind("two_to_one"),
        "put_and_close": _kind("put_and_close"),
        "take_and_close": _kind("take_and_close"),
        "swap": _kind("swapping"),
        "out_of_into": _kind("from_one_into_another"),
        "three_acts": _kind("three_acts"),
    },
    briefing="Ask for a sequence. Kinds: reveal_pick (open container, take target), put_into (take target, put into "
    "receptacle, opened first where it is closed), rearrange (take target from source to receptacle), open_pick_place "
    "(open container, take target, put at receptacle), two_to_one (put target and second at one receptacle), "
    "put_and_close (open receptacle, put target inside, close it), take_and_close (open container, take target, put it "
    "at receptacle, close container), swap (target from source to receptacle, second from receptacle to source), "
    "out_of_into (target from container into receptacle, both closed), three_acts (open, close, start or stop first "
    "and next, and put target at receptacle). Roles: target and those that the kind names.",
    rules=("chain_of_objects", "not_shut_away"),
    grading=StreamGrading("actions", easy=8, medium=11),
    level_bounds=(8.0, 10.5, 12.5),
    sample_goal={
        "kind": "object_at_receptacle",
        "object_id": "target",
        "receptacle_id": "table",
        "chain": [{"kind": "object_held", "object_id": "target"}],
    },
)
