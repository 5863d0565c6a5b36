"""Tasks about one of several things of a category, distinguished by colour, place, state, what lies on it, or size."""

from vigil.scoring.closure_kind import ClosureKind

FORMS_READ_BACK = ("state", "bearing", "size")
"""Forms whose phrases have their own reader (`vigil.authoring.closure.kinds.look_alike.phrases`)."""

KIND = ClosureKind(
    name="look_alike",
    position=6,
    tasks="vigil.authoring.closure.kinds.look_alike.tasks:look_alike",
    unnamed_roles=frozenset({"distractor"}),
    exempt=dict.fromkeys(FORMS_READ_BACK, frozenset({"target_named", "unambiguous"})),
    faults="vigil.authoring.closure.kinds.look_alike.tasks:faults",
)
