"""The grammar of the suite: it proposes tasks of each kind in a house, and certifies each proposed task."""

from collections.abc import Callable, Iterator

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.tasks import Tasks
from vigil.authoring.drafting.generation import Checker, Grammar, Proposer, seed_context
from vigil.authoring.drafting.house_context import HouseContext
from vigil.base.exported import loaded
from vigil.protocol.families import Family
from vigil.scoring.closure import CLOSURE_KINDS, KINDS, Kind
from vigil.sim.privileged import PrivilegedSimulator

PROPOSALS: dict[Kind, Callable[[HouseContext], Tasks]] = {
    name: loaded(kind.tasks) for name, kind in CLOSURE_KINDS.items()
}
"""Kind -> the function that proposes its tasks in a house."""
FAMILY: Family = "SI"
"""Family that drafts files record when a house is finished. The suite's episodes are of SI, or of CR if constrained."""


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
