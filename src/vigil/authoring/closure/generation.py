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
"""Family that a drafts file names when it records that a house is finished. The episodes themselves are of SI or CR."""


def closure_proposer(seed: int) -> Proposer:
    """Return the function that proposes tasks of each kind in a house; `seed` determines the random choices."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Tasks]]:
        for kind in KINDS:
            seed_context(context, seed, f"closure {kind}")
            yield kind, PROPOSALS[kind](context)

    return proposals


def closure_checker(simulator: PrivilegedSimulator) -> Checker:
    """Return the function that certifies proposed tasks of the suite on a simulator."""
    return Certifier(simulator).certify


CLOSURE_GRAMMAR = Grammar("closure grammar", closure_proposer, closure_checker, shares_limits=False)
