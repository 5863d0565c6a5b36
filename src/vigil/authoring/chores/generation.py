"""Generation of lists of chores: composes lists of each length in a home, and certifies each list."""

from collections.abc import Iterator

from vigil.authoring.chores.certify import ListCertifier
from vigil.authoring.chores.compose import ListTask, compositions, pool_of
from vigil.authoring.drafting.drafts import DraftFacts, Rejection
from vigil.authoring.drafting.generation import Checker, Grammar, Proposer, SolvedSide, seed_context
from vigil.authoring.drafting.house_context import HouseContext
from vigil.protocol.families import Family
from vigil.protocol.goals import MAX_CHORES, MIN_CHORES
from vigil.scene.outlines import room_floor
from vigil.scoring.chore_answers import list_kind
from vigil.sim.privileged import PrivilegedSimulator

LENGTHS = range(MIN_CHORES, MAX_CHORES + 1)
CATEGORY = "Chores"
"""Word that ids and facts have in place of a category, because they must not name an object of the list."""


def chores_proposer(seed: int) -> Proposer:
    """Return the proposer of lists. It treats lists of each length as a separate kind of task."""

    def proposals(context: HouseContext, family: Family) -> Iterator[tuple[str, Iterator[ListTask | Rejection]]]:
        seed_context(context, seed, "chores")
        pool = pool_of(context)
        for count in reversed(LENGTHS):
            seed_context(context, seed, f"chores {count}")
            yield list_kind(count), compositions(context, pool, count)

    return proposals


def chores_checker(simulator: PrivilegedSimulator) -> Checker:
    """Return the checker that certifies lists."""
    return ListCertifier(simulator).certify


def list_facts(context: HouseContext, side: SolvedSide) -> DraftFacts:
    """Return the facts about a list that are used to balance packs."""
    rooms = context.simulator.scene().rooms
    area_m2 = round(sum(room_floor(room).area for room in rooms), 1)
    return DraftFacts(category=CATEGORY, rooms=len(rooms), area_m2=area_m2, distance_m=0.0, is_seen_by_turning=False)


CHORES_GRAMMAR = Grammar("chores grammar", chores_proposer, chores_checker, shares_limits=False, facts_of=list_facts)
