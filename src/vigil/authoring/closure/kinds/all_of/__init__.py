"""Tasks about several things: all things of one name in a room, or all that are on or open in a room or the home."""

from vigil.scoring.closure_kind import ClosureKind

KIND = ClosureKind(
    name="all_of",
    position=1,
    tasks="vigil.authoring.closure.kinds.all_of.tasks:all_of",
    exempt={"": frozenset({"protocol", "hidden_at_start", "clear_openness", "target_named", "unambiguous"})},
    faults="vigil.authoring.closure.kinds.all_of.tasks:faults",
)
