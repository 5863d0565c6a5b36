"""What chores do to one another, and the shortest order that does them all."""

from typing import Literal

import numpy as np
import pytest

from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.solving.chore_order import ChoreModel, entanglement, length_of, shortest_order, walk_lengths
from vigil.protocol.goals import Chore, ChorePart, ObjectAtReceptacle, ObjectInState, ReportStatus
from vigil.protocol.world import ObjectSetup, Setup
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def context(simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, GeneratedHouse(901, "kitchen").house(), np.random.default_rng(1))


def first_of(context: HouseContext, category: str) -> str:
    return next(thing.id for thing in context.view.scene.things.values() if thing.category == category)


def chore(*parts: ChorePart) -> Chore:
    return Chore(parts=parts)


def put(context: HouseContext, thing: str, receptacle: str, *, inside: bool = True) -> Chore:
    ids = first_of(context, thing), first_of(context, receptacle)
    return chore(ObjectAtReceptacle(object_id=ids[0], receptacle_id=ids[1], inside=inside))


def state(context: HouseContext, category: str, name: Literal["is_open", "is_toggled"], *, value: bool) -> Chore:
    return chore(ObjectInState(object_id=first_of(context, category), state=name, value=value))


def relations(context: HouseContext, chores: list[Chore], **start: ObjectSetup) -> object:
    context.begin(Setup(objects={first_of(context, category): change for category, change in start.items()}))
    found = entanglement(ChoreModel(context.view.scene), chores, range(len(chores)))
    context.begin(Setup())
    return None if found is None else (found.before, found.by_the_way)


def test_something_is_put_into_what_must_be_closed_before_it_is_closed(context: HouseContext) -> None:
    chores = [state(context, "Fridge", "is_open", value=False), put(context, "Apple", "Fridge")]
    assert relations(context, chores) == ({(1, 0)}, set())


def test_what_is_opened_for_another_chore_is_done_by_the_way(context: HouseContext) -> None:
    chores = [state(context, "Fridge", "is_open", value=True), put(context, "Apple", "Fridge")]
    assert relations(context, chores, Fridge=ObjectSetup(openness=0.0)) == (set(), {(0, 1)})


def test_a_machine_is_started_after_something_is_put_into_it(context: HouseContext) -> None:
    chores = [state(context, "Microwave", "is_toggled", value=True), put(context, "Potato", "Microwave")]
    closed = ObjectSetup(openness=0.0, is_toggled=False)
    assert relations(context, chores, Microwave=closed) == ({(1, 0)}, set())


def test_a_bowl_is_carried_before_something_is_put_into_it(context: HouseContext) -> None:
    chores = [put(context, "Apple", "Bowl"), put(context, "Bowl", "Cart", inside=False)]
    assert relations(context, chores) == ({(1, 0)}, set())


def test_a_state_that_is_asked_about_cannot_be_changed_for_another_chore(context: HouseContext) -> None:
    fridge = first_of(context, "Fridge")
    chores = [chore(ReportStatus(object_id=fridge, state="is_open")), put(context, "Apple", "Fridge")]
    assert relations(context, chores, Fridge=ObjectSetup(openness=0.0)) is None
    assert relations(context, chores, Fridge=ObjectSetup(openness=1.0)) == (set(), set())


def test_chores_about_different_things_go_in_any_order(context: HouseContext) -> None:
    chores = [state(context, "Fridge", "is_open", value=True), put(context, "Apple", "Cart", inside=False)]
    assert relations(context, chores) == (set(), set())


def test_the_shortest_order_keeps_what_must_come_first() -> None:
    """Stops on a line: the start at 0, chores at 1, 2 and 3."""
    at = np.array([1.0, 2.0, 3.0])
    lengths = np.abs(np.append(at, 0.0)[:, None] - at[None, :])
    assert shortest_order(lengths, frozenset()) == ([0, 1, 2], 3.0)
    assert shortest_order(lengths, frozenset({(2, 0)})) == ([1, 2, 0], 5.0)
    assert shortest_order(lengths, frozenset({(2, 1), (1, 0)})) == ([2, 1, 0], 5.0)
    assert length_of(lengths, [1, 0, 2]) == 5.0


def test_walks_are_measured_from_where_a_chore_ends(context: HouseContext) -> None:
    fridge, cart = first_of(context, "Fridge"), first_of(context, "Cart")
    lengths = walk_lengths(context.view, [(fridge, cart), (cart, cart)])
    assert lengths.shape == (3, 2)
    assert lengths[0, 1] == lengths[1, 1] == 0.0
    assert np.isfinite(lengths).all()
