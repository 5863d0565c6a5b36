"""Twins that ask for one act if a state holds, and for another act if not. The state holds on only one side."""

from vigil.scoring.closure_kind import ClosureKind

KIND = ClosureKind(
    name="if_so",
    position=4,
    tasks="vigil.authoring.closure.kinds.if_so.tasks:if_so",
    sides=("so", "otherwise"),
    may_hold_at_reset=True,
    has_branches=True,
    exempt={"": frozenset({"protocol", "hidden_at_start", "clear_openness"})},
)
