"""Tasks whose last act hides the result: the agent puts an object into a container and then closes the container."""

from vigil.scoring.closure_kind import ClosureKind

KIND = ClosureKind(
    name="out_of_sight",
    position=7,
    tasks="vigil.authoring.closure.kinds.out_of_sight.tasks:out_of_sight",
    exempt={"": frozenset({"protocol", "hidden_at_start"})},
)
