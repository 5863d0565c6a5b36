"""Tasks whose obvious action is refused. The agent can see the reason, but is not informed of it.

The reason is that a machine runs or is open, an obstacle stands in front of a door, or a shelf is full.
"""

from vigil.scoring.closure_kind import ClosureKind

FULL = "full_shelf"
"""Form of the tasks in which a shelf is full."""

KIND = ClosureKind(
    name="silent_refusal",
    position=5,
    tasks="vigil.authoring.closure.kinds.silent_refusal.tasks:silent_refusal",
    exempt={FULL: frozenset({"protocol", "hidden_at_start"})},
    faults="vigil.authoring.closure.kinds.silent_refusal.tasks:faults",
)
