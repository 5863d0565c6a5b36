"""Tasks about several things: those of one name in a room, or those in a room or the home that are on or open."""

from vigil.scoring.closure_kind import ClosureKind

KIND = ClosureKind(
    name="all_of",
    position=1,
    tasks="vigil.authoring.closure.kinds.all_of.tasks:all_of",
    exempt={"": frozenset({"protocol", "hidden_at_start", "clear_openness", "target_named", "unambiguous"})},
    faults="vigil.authoring.closure.kinds.all_of.tasks:faults",
)
