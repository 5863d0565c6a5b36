"""Twins with one impossible side: there the target is absent, blocked or broken, or the receptacle is full."""

from vigil.scoring.closure_kind import ClosureKind

KIND = ClosureKind(
    name="impossible",
    position=2,
    tasks="vigil.authoring.closure.kinds.impossible.tasks:impossible",
    sides=("possible", "impossible"),
    unnamed_roles=frozenset({"place", "blocker", "occupant"}),
    exempt={"put": frozenset({"protocol", "hidden_at_start"})},
)
