"""The grammar of the suite: it proposes tasks of each kind in a house, and certifies each proposed task."""

from collections.abc import Callable
from functools import partial

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.tasks import Tasks
from vigil.authoring.drafting.generation import Checker, Grammar, proposer_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.base.exported import loaded
from vigil.protocol.families import Family
from vigil.scoring.closure import CLOSURE_KINDS, KINDS, Kind
from vigil.sim.privileged import PrivilegedSimulator

FAMILY: Family = "SI"
"""Family that a drafts file names when it records that a house is finished. The episodes themselves are of SI or CR."""


def closure_kinds(_: Family) -> dict[Kind, Callable[[HouseContext], Tasks]]:
    """Return kind -> the function that proposes its tasks in a house."""
    return {name: loaded(CLOSURE_KINDS[name].tasks) for name in KINDS}


def closure_checker(simulator: PrivilegedSimulator) -> Checker:
    """Return the function that certifies proposed tasks of the suite on a simulator."""
    return Certifier(simulator).certify


CLOSURE_GRAMMAR = Grammar(
    "closure grammar", partial(proposer_of, closure_kinds, suite="closure"), closure_checker, shares_limits=False
)
