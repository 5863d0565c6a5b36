"""The kinds of the suite, each with what proposes its tasks in a house."""

from collections.abc import Callable

from vigil.authoring.closure.alike import look_alike
from vigil.authoring.closure.all_of import all_of
from vigil.authoring.closure.already import already, if_so
from vigil.authoring.closure.impossible import impossible
from vigil.authoring.closure.out_of_sight import out_of_sight
from vigil.authoring.closure.refusals import silent_refusal
from vigil.authoring.closure.tasks import Tasks
from vigil.authoring.drafting.house_context import HouseContext
from vigil.closure import Kind

PROPOSALS: dict[Kind, Callable[[HouseContext], Tasks]] = {
    "all_of": all_of,
    "impossible": impossible,
    "already": already,
    "if_so": if_so,
    "silent_refusal": silent_refusal,
    "look_alike": look_alike,
    "out_of_sight": out_of_sight,
}
"""Kind -> what proposes it."""
