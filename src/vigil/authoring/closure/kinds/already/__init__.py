"""Twins that ask to make sure of a state (of one thing, a room or the home). On one side the state already holds."""

from vigil.scoring.closure_kind import ClosureKind

EVERYTHING_FORMS = ("off_room", "off_home", "closed_room", "closed_home")
"""Forms whose instruction is about everything in a room or in the home."""
_EVERYTHING = frozenset({"protocol", "clear_openness", "target_named", "unambiguous"})

KIND = ClosureKind(
    name="already",
    position=3,
    tasks="vigil.authoring.closure.kinds.already.tasks:already",
    sides=("open", "already"),
    may_hold_at_reset=True,
    forms_of_many=frozenset(EVERYTHING_FORMS),
    exempt={"": frozenset({"clear_openness"}), **dict.fromkeys(EVERYTHING_FORMS, _EVERYTHING)},
    faults="vigil.authoring.closure.kinds.already.tasks:faults",
)
