"""Step budgets of lists: how many steps the solver may need, and how many an agent gets. Source: decision 77."""

import zlib
from collections.abc import Iterable

from vigil.packs.pack import CHORES_BUDGETS
from vigil.protocol.goals import Chore, ObjectAtReceptacle

FACTORS = (2.3, 2.7)
"""Minimum and maximum of what a budget has for each step of the solver. The suite's limits on budgets override them."""
MIN_FACTOR = 2.0
"""Minimum of what a budget has for each step of the solver, also where the suite's limits override `FACTORS`."""
STEPS_PER_ROOM = 5
"""Steps that a budget has for each room of the home, because the solver knows where things are, and agents search."""
STEP_OF_BUDGETS = 5
MARGIN_OF_ESTIMATES = 8
"""Steps by which the estimate of a list's steps must be below the maximum, because many lists take more than it."""
STEPS, STEPS_PER_M, STEPS_PER_PUT = 18.0, 1.55, 18.5
"""Estimate of the solver's steps: for any list, for each metre of its walk, and for each object that it puts somewhere.
It was fitted to the 200 lists of an earlier pack; the standard deviation of its errors is 17 steps."""


def max_solver_steps(rooms: int) -> int:
    """Return the maximum number of steps that the solver may need for a list in a home with this number of rooms."""
    return int((CHORES_BUDGETS[1] - STEPS_PER_ROOM * rooms) / MIN_FACTOR)


def budget_for(steps: int, rooms: int, instruction: str) -> int:
    """Return the step budget of a list that the solver closes in `steps` steps, in a home with this number of rooms.

    It is a multiple of the steps, and more for each room; a hash of the instruction selects the factor from `FACTORS`.
    """
    share = zlib.crc32(instruction.encode()) / 2**32
    wanted = steps * (FACTORS[0] + share * (FACTORS[1] - FACTORS[0])) + STEPS_PER_ROOM * rooms
    rounded = -int(-wanted // STEP_OF_BUDGETS) * STEP_OF_BUDGETS
    return min(max(rounded, CHORES_BUDGETS[0]), CHORES_BUDGETS[1])


def is_within_budget(steps: int, rooms: int, budget: int) -> bool:
    """Return whether a budget leaves an agent enough steps; `steps` are those of the solver, `rooms` the home's."""
    return MIN_FACTOR * steps + STEPS_PER_ROOM * rooms <= budget


def puts_of(chores: Iterable[Chore]) -> int:
    """Return the number of objects that chores ask to put somewhere."""
    return sum(isinstance(part, ObjectAtReceptacle) for chore in chores for part in chore.parts)


def likely_steps(walk_m: float, puts: int) -> float:
    """Return an estimate of the solver's steps for a list, from the length of its walk and its number of puts."""
    return STEPS + STEPS_PER_M * walk_m + STEPS_PER_PUT * puts
