"""Composition of lists: the same seed gives the same lists, and chores of a list do not contradict one another."""

from itertools import islice

import numpy as np
import pytest

from vigil.authoring.chores import compose, sentences
from vigil.authoring.chores.budgets import MARGIN_OF_ESTIMATES, likely_steps, max_solver_steps, puts_of
from vigil.authoring.chores.compose import MAX_PUTS, HomePool, ListTask, compositions, pool_of
from vigil.authoring.drafting.drafts import Rejection
from vigil.authoring.drafting.generation import seed_context
from vigil.authoring.drafting.house_context import HouseContext
from vigil.authoring.drafting.sources import GeneratedHouse
from vigil.authoring.language.sentences import FORMS, Sentences
from vigil.authoring.solving.chore_order import length_of
from vigil.authoring.solving.chores import plan_chores
from vigil.protocol.goals import Chores
from vigil.sim.privileged import PrivilegedSimulator


@pytest.fixture(scope="module")
def context(simulator: PrivilegedSimulator) -> HouseContext:
    return HouseContext(simulator, GeneratedHouse(8001, "3").house(), np.random.default_rng(0))


def lists_of(context: HouseContext, seed: int, *counts: int) -> list[ListTask]:
    seed_context(context, seed, "chores")
    pool: HomePool = pool_of(context)
    tasks = [task for count in counts for task in islice(compositions(context, pool, count), 2)]
    return [task for task in tasks if isinstance(task, ListTask)]


def test_the_same_seed_gives_the_same_lists(context: HouseContext) -> None:
    first, again, other = (lists_of(context, seed, 6) for seed in (1, 1, 2))
    assert first
    assert [task.episode for task in first] == [task.episode for task in again]
    assert [task.instruction for task in first] != [task.instruction for task in other]


def test_a_list_can_be_done_in_an_order_that_its_text_does_not_give(context: HouseContext) -> None:
    tasks = lists_of(context, 3, 10, 7, 3)
    assert {len(task.chores) for task in tasks} == {3, 7, 10}
    for task in tasks:
        goal = task.episode.goal
        assert isinstance(goal, Chores)
        assert len(set(goal.chores)) == len(goal.chores)
        context.simulator.reset(task.episode.start, task.episode.setup)
        conceded = {place for place, chore in enumerate(task.chores) if chore.reason is not None}
        plan = plan_chores(task.episode, context.view, conceded)
        assert plan.entanglement == task.entanglement
        before = plan.entanglement.before
        assert all(plan.order.index(a) < plan.order.index(b) for a, b in before)
        assert not before or any(a > b for a, b in before)
        puts = puts_of(chore.chore for chore in task.chores if chore.reason is None)
        assert puts <= MAX_PUTS.get(len(task.chores), 2)
        most = max_solver_steps(len(context.view.scene.rooms)) - MARGIN_OF_ESTIMATES
        assert likely_steps(plan.walk_m, puts) <= most
        assert length_of(plan.lengths, range(len(goal.chores))) > plan.walk_m


def test_every_chore_of_a_list_has_its_own_things(context: HouseContext) -> None:
    """Only chores that are entangled, or have a state to remember, and furniture to put things on, share a thing."""
    for task in lists_of(context, 4, 8):
        for place, chore in enumerate(task.chores):
            for other in task.chores[:place]:
                if {chore.kind, other.kind} & {"order", "by_the_way", "plain"} or chore.changes == other.changes:
                    continue
                assert chore.ids & other.ids <= chore.receptacle_ids & other.receptacle_ids


def test_only_lists_that_are_made_use_up_chores(context: HouseContext, monkeypatch: pytest.MonkeyPatch) -> None:
    seed_context(context, 5, "chores")
    pool: HomePool = pool_of(context)
    monkeypatch.setattr(compose, "MARGIN_OF_ESTIMATES", 1000.0)
    (failed,) = islice(compositions(context, pool, 5), 1)
    assert isinstance(failed, Rejection)
    assert failed.message == "the walk is too long"
    assert not pool.uses
    monkeypatch.undo()
    made = next(task for task in compositions(context, pool, 5) if isinstance(task, ListTask))
    assert sum(pool.uses.values()) <= len(made.chores)
    assert pool.uses


@pytest.mark.parametrize("name", [name for name, value in vars(sentences).items() if isinstance(value, Sentences)])
def test_both_halves_of_the_sentence_forms_are_used_and_differ(name: str) -> None:
    forms: Sentences = getattr(sentences, name)
    assert forms.public
    assert forms.held_out
    assert not set(forms.public) & set(forms.held_out)
    assert set(forms.of(FORMS[-1])) == {*forms.public, *forms.held_out}
