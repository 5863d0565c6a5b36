"""The grammar of the suite: it proposes tasks of each kind in a house, and certifies each of them."""

from collections.abc import Callable, Iterator

from vigil.authoring.closure.all_of import all_of
from vigil.authoring.closure.already_done import already, if_so
from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.distractors import look_alike
from vigil.authoring.closure.impossible import impossible
from vigil.authoring.closure.out_of_sight import out_of_sight
from vigil.authoring.closure.silent_refusals import silent_refusal
from vigil.authoring.closure.tasks import Tasks
from vigil.authoring.drafting.generation import Checker, Grammar, Proposer, seed_context
from vigil.authoring.drafting.house_context import HouseContext
from vigil.protocol.families import Family
from vigil.scoring.closure import KINDS, Kind
from vigil.sim.privileged import PrivilegedSimulator

PROPOSALS: dict[Kind, Callable[[HouseContext], Tasks]] = {
    "all_of": all_of,
    "impossible": impossible,
    "already": already,
    "if_so": if_so,
    "silent_refusal": silent_refusal,
    "look_alike": look_alike,
    "out_of_sight": out_of_sight,
}
"""Kind -> the function that proposes its tasks in a house."""
FAMILY: Family = "SI"
"""Family under which a house is marked as done; episodes are of SI, and of CR where a constraint must be resolved."""


def closure_proposer(seed: int) -> Proposer:
    """Return the proposer of the suite's kinds."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Tasks]]:
        for kind in KINDS:
            seed_context(context, seed, f"closure {kind}")
            yield kind, PROPOSALS[kind](context)

    return proposals


def closure_checker(simulator: PrivilegedSimulator) -> Checker:
    """Return the checker that certifies tasks of the suite."""
    return Certifier(simulator).certify


CLOSURE_GRAMMAR = Grammar("closure grammar", closure_proposer, closure_checker, shares_limits=False)
