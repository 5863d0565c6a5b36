"""Proposals of pairs of chores about the same object.

Done in the wrong order, the later chore undoes the earlier (`order`); or doing one also does the other (`by_the_way`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from vigil.assets.catalog import CATALOG
from vigil.authoring.chores.placements import putting
from vigil.authoring.chores.proposed import ProposedChore, in_turn
from vigil.authoring.chores.states import act_on, close_drawers, sure_of
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.families.sm.plans import emptying, putting_in, receptacles_for
from vigil.protocol.goals import ObjectAtReceptacle
from vigil.protocol.world import ObjectSetup
from vigil.scene.supports import children
from vigil.scene.things import Thing

Pair = tuple[ProposedChore, ProposedChore]
Pairs = Iterator[Pair]
TRIED_RECEPTACLES = 2
"""Number of receptacles tried as the place to which a container is carried."""


def order_pairs(context: HouseContext) -> Pairs:
    """Yield pairs of chores that work in one order only: in the other order, the later chore undoes the earlier one."""
    yield from in_turn(_put_and_close(context), _put_and_carry(context), _take_and_close(context))


def _with(chore: ProposedChore, changes: Mapping[str, ObjectSetup]) -> ProposedChore:
    return replace(chore, changes={**chore.changes, **changes})


def _put_into(context: HouseContext) -> Iterator[tuple[Thing, ProposedChore]]:
    """Yield (container, chore) for containers that open; the chore is to put something into the container."""
    taken: set[str] = set()
    for plan in putting_in(context):
        container, goal = plan.roles["receptacle"], plan.facts[-1]
        assert isinstance(goal, ObjectAtReceptacle)
        if container.id in taken or not container.is_openable or children(context.view.scene, goal.object_id):
            continue
        chore = putting(context, goal.model_copy(update={"chain": ()}), plan.setup)
        if chore is not None:
            taken.add(container.id)
            yield container, chore


def _put_and_close(context: HouseContext) -> Pairs:
    """Yield pairs: put something into a container, and leave the container closed or running."""
    for container, chore in _put_into(context):
        runs = CATALOG[container.category].runs_only_when_closed
        if runs and context.rng.integers(2):
            state = {container.id: ObjectSetup(openness=0.0, is_toggled=False)}
            yield _with(chore, state), _with(act_on(context, container, "turn_on"), state)
            continue
        every = close_drawers(context, context.thing(container.parent or "")) if container.is_drawer else None
        if every is not None:
            yield _with(chore, every.changes), every
            continue
        off = False if container.is_toggleable else None
        state = {container.id: ObjectSetup(openness=float(context.rng.integers(2)), is_toggled=off)}
        sure = context.rng.integers(2)
        closing = sure_of(context, container, "close", is_met=True) if sure else act_on(context, container, "close")
        yield _with(chore, state), _with(closing, state)


def _take_and_close(context: HouseContext) -> Pairs:
    """Yield pairs: put an object from a closed container elsewhere, and leave the container closed."""
    taken: set[str] = set()
    for plan in emptying(context):
        container, goal = plan.roles["container"], plan.facts[-1]
        assert isinstance(goal, ObjectAtReceptacle)
        if container.id in taken or children(context.view.scene, goal.object_id):
            continue
        chore = putting(context, goal.model_copy(update={"chain": ()}), plan.setup)
        if chore is not None:
            taken.add(container.id)
            yield chore, _with(sure_of(context, container, "close", is_met=True), plan.setup.objects)


def _put_and_carry(context: HouseContext) -> Pairs:
    """Yield pairs: put something into a container that can be carried, and put this container somewhere else."""
    for plan in putting_in(context):
        container, goal = plan.roles["receptacle"], plan.facts[-1]
        assert isinstance(goal, ObjectAtReceptacle)
        if not container.is_pickupable or children(context.view.scene, container.id):
            continue
        for place in receptacles_for(context, container, {container.id, container.parent, goal.object_id})[
            :TRIED_RECEPTACLES
        ]:
            chore = putting(context, goal.model_copy(update={"chain": ()}), plan.setup)
            there = ObjectAtReceptacle(object_id=container.id, receptacle_id=place.id)
            carrying = putting(context, there, plan.setup)
            if chore is not None and carrying is not None:
                yield chore, carrying
                break


def by_the_way_pairs(context: HouseContext) -> Pairs:
    """Yield pairs: put something into a closed container, and leave the container open."""
    for container, chore in _put_into(context):
        if not CATALOG[container.category].runs_only_when_closed:
            state = {container.id: ObjectSetup(openness=0.0)}
            yield _with(chore, state), _with(act_on(context, container, "open"), state)
