"""Step budgets of lists: multiples of the solver's steps, and more for each room; they do not tell these steps."""

import pytest

from vigil.authoring.chores.budgets import (
    FACTORS,
    MIN_FACTOR,
    STEP_OF_BUDGETS,
    STEPS_PER_ROOM,
    budget_for,
    is_within_budget,
    max_solver_steps,
)
from vigil.packs.pack import CHORES_BUDGETS

ROOMS = range(3, 11)


@pytest.mark.parametrize("rooms", ROOMS)
def test_a_budget_is_a_multiple_of_the_steps_and_has_steps_for_each_room(rooms: int) -> None:
    least, most = CHORES_BUDGETS
    for steps in range(1, max_solver_steps(rooms) + 1):
        found = {budget_for(steps, rooms, f"list {number}") for number in range(50)}
        assert all(least <= budget <= most and budget % STEP_OF_BUDGETS == 0 for budget in found)
        assert all(is_within_budget(steps, rooms, budget) for budget in found)
        inner = {budget - STEPS_PER_ROOM * rooms for budget in found if least < budget < most}
        assert all(FACTORS[0] <= budget / steps < FACTORS[1] + STEP_OF_BUDGETS / steps for budget in inner)


def test_a_home_with_more_rooms_gets_a_longer_budget() -> None:
    budgets = [budget_for(40, rooms, "list") for rooms in ROOMS]
    assert budgets == sorted(set(budgets))


def test_the_same_steps_give_several_budgets_and_a_budget_stands_for_several_steps() -> None:
    assert len({budget_for(60, 5, f"list {number}") for number in range(50)}) >= 4
    assert len({steps for steps in range(40, 90) for n in range(50) if budget_for(steps, 5, f"list {n}") == 180}) >= 5


@pytest.mark.parametrize("rooms", ROOMS)
def test_one_more_step_would_leave_too_few_replies(rooms: int) -> None:
    most = CHORES_BUDGETS[1]
    assert is_within_budget(max_solver_steps(rooms), rooms, most)
    assert not is_within_budget(max_solver_steps(rooms) + 1, rooms, most)
    assert FACTORS[0] > MIN_FACTOR
