"""Step budgets of lists: multiples of the solver's steps that do not tell how many these are."""

from vigil.authoring.chores.budgets import (
    FACTORS,
    MAX_SOLVER_STEPS,
    MIN_FACTOR,
    STEP_OF_BUDGETS,
    budget_for,
    is_within_budget,
)
from vigil.packs.pack import CHORES_BUDGETS


def test_a_budget_is_a_multiple_of_the_steps_within_the_limits() -> None:
    least, most = CHORES_BUDGETS
    for steps in range(1, MAX_SOLVER_STEPS + 1):
        found = {budget_for(steps, f"list {number}") for number in range(50)}
        assert all(least <= budget <= most and budget % STEP_OF_BUDGETS == 0 for budget in found)
        assert all(is_within_budget(steps, budget) for budget in found)
        inner = {budget for budget in found if least < budget < most}
        assert all(FACTORS[0] <= budget / steps < FACTORS[1] + STEP_OF_BUDGETS / steps for budget in inner)


def test_the_same_steps_give_several_budgets_and_a_budget_stands_for_several_steps() -> None:
    assert len({budget_for(60, f"list {number}") for number in range(50)}) >= 5
    assert len({steps for steps in range(40, 80) for n in range(50) if budget_for(steps, f"list {n}") == 180}) >= 5


def test_one_more_step_would_leave_too_few_replies() -> None:
    most = CHORES_BUDGETS[1]
    assert is_within_budget(MAX_SOLVER_STEPS, most)
    assert not is_within_budget(MAX_SOLVER_STEPS + 1, most)
    assert FACTORS[0] > MIN_FACTOR
