"""Proposals about one drawer of several."""

from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
import pytest

from vigil.authoring.drafting.grammar import kinds_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.ai.drafts import acting
from vigil.authoring.families.cr.drafts import swing_blocked
from vigil.authoring.families.da.drafts import approaching
from vigil.authoring.families.pg.drafts import pointing
from vigil.authoring.families.si.drafts import seeking
from vigil.authoring.families.sv.drafts import verifying
from vigil.authoring.families.vs.drafts import searching
from vigil.authoring.review.validate import Validator
from vigil.housegen.base.spec import spec_for
from vigil.housegen.document import with_merged_drawers
from vigil.housegen.generate import generate
from vigil.protocol.episode import Episode
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.house import House
from vigil.protocol.world import Setup
from vigil.scene.supports import drawers_of
from vigil.sim.privileged import PrivilegedSimulator

Proposals = Callable[[HouseContext], Iterator[Episode]]

GRAMMAR: dict[str, Proposals] = {
    "PG": lambda context: pointing(context, "medium"),
    "SV": lambda context: verifying(context, "open"),
    "AI": lambda context: acting(context, "open"),
    "SI": lambda context: seeking(context, "close"),
    "SM reveal_pick": kinds_of("SM")["reveal_pick"],
    "SM put_into": kinds_of("SM")["put_into"],
    "SM open_pick_place": kinds_of("SM")["open_pick_place"],
}


@pytest.fixture(scope="module")
def house() -> House:
    return generate(0, spec_for("bedroom"))


@pytest.fixture(scope="module")
def context(simulator: PrivilegedSimulator, house: House) -> HouseContext:
    return HouseContext(simulator, house, np.random.default_rng(3))


def drawer_ids(context: HouseContext) -> set[str]:
    return {thing.id for thing in context.view.scene.things.values() if thing.is_drawer}


def test_of_each_pieces_drawers_one_is_proposed(context: HouseContext) -> None:
    scene = context.view.scene
    chests = {thing.parent for thing in scene.things.values() if thing.is_drawer}
    found = [thing for thing in context.things(lambda thing: True) if thing.is_drawer]
    assert len(drawers_of(scene, scene.things[next(iter(chests)) or ""])) > 1
    assert sorted(thing.parent or "" for thing in found) == sorted(chest or "" for chest in chests)
    assert len({tuple(thing.id for thing in context.things(lambda thing: thing.is_drawer)) for _ in range(9)}) > 1


@pytest.mark.parametrize("name", GRAMMAR)
def test_every_kind_has_a_valid_episode_about_a_drawer(name: str, simulator: PrivilegedSimulator, house: House) -> None:
    context = HouseContext(simulator, house, np.random.default_rng(3))
    drawers, validator = drawer_ids(context), Validator(simulator)
    context.allowed_ids = frozenset(
        thing.id for thing in context.view.scene.things.values() if thing.is_pickupable or thing.id in drawers
    )
    context.allowed_ids |= {thing.id for thing in context.view.scene.things.values() if thing.category == "SideTable"}
    drafts = (draft for draft in islice(GRAMMAR[name](context), 12) if drawers & set(draft.bindings.values()))
    for draft in islice(drafts, 3):
        assert " drawer " in draft.instruction
        assert " of the dresser" in draft.instruction
        verdict = validator.validate(draft, house)
        if verdict.is_valid:
            return
        context.begin(Setup())
    pytest.fail(f"{name}: no valid episode about a drawer of {sorted(drawers)}")


def test_a_drawer_that_the_house_does_not_name_is_proposed_and_holds(
    simulator: PrivilegedSimulator, house: House
) -> None:
    """As in ProcTHOR's own houses, which name no drawer."""
    whole = with_merged_drawers(house)
    context = HouseContext(simulator, whole, np.random.default_rng(3))
    context.allowed_ids = frozenset(drawer_ids(context))
    assert context.allowed_ids.isdisjoint(whole.ids)
    drafts = list(islice(verifying(context, "open"), 3))
    assert drafts
    assert any(Validator(simulator).validate(draft, whole).is_valid for draft in drafts)


@pytest.mark.parametrize("find", [approaching, lambda context: searching(context, by_turning=True)])
def test_nobody_walks_up_to_a_drawer_or_looks_for_one(context: HouseContext, find: Proposals) -> None:
    context.allowed_ids = frozenset(drawer_ids(context))
    assert list(find(context)) == []
    context.allowed_ids = None


def test_what_is_taken_out_is_not_put_on_the_same_furniture(simulator: PrivilegedSimulator, house: House) -> None:
    context = HouseContext(simulator, house, np.random.default_rng(3))
    furniture = {name: context.thing(name).parent for name in drawer_ids(context)}
    things = context.view.scene.things.values()
    loose = {thing.id for thing in things if thing.is_pickupable and not thing.is_openable}
    tables = ("Dresser", "SideTable", "Desk", "TVStand", "CoffeeTable", "Bed")
    named = loose | {thing.id for thing in things if thing.category in tables}
    context.allowed_ids = frozenset(named | set(furniture))
    drafts = list(islice(kinds_of("SM")["open_pick_place"](context), 12))
    context.allowed_ids = None
    about = [draft for draft in drafts if draft.bindings["container"] in furniture]
    assert about
    for draft in about:
        assert isinstance(draft.goal, ObjectAtReceptacle)
        assert draft.goal.receptacle_id != furniture[draft.bindings["container"]]


def test_the_furniture_itself_holds_nothing_inside(context: HouseContext) -> None:
    wholes = {context.thing(name).parent for name in drawer_ids(context)}
    for draft in islice(kinds_of("SM")["put_into"](context), 12):
        assert draft.bindings["receptacle"] not in wholes


def test_only_low_drawers_are_blocked_by_what_stands_before_them(context: HouseContext) -> None:
    asked = [draft.goal.object_id for draft in islice(swing_blocked(context), 12)]
    low = [name for name in asked if name in drawer_ids(context)]
    assert all(context.thing(name).position.y < 0.5 for name in low)
