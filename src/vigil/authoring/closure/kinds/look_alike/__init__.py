"""Tasks about one of several things of a category, identified by colour, place, state, size or what lies on it."""

from vigil.scoring.closure_kind import ClosureKind

FORMS_READ_BACK = ("state", "bearing", "size")
"""Forms whose phrases `vigil.authoring.closure.kinds.look_alike.phrases` reads back, to check what they mean."""

KIND = ClosureKind(
    name="look_alike",
    position=6,
    tasks="vigil.authoring.closure.kinds.look_alike.tasks:look_alike",
    unnamed_roles=frozenset({"distractor"}),
    exempt=dict.fromkeys(FORMS_READ_BACK, frozenset({"target_named", "unambiguous"})),
    faults="vigil.authoring.closure.kinds.look_alike.tasks:faults",
)
