"""Step budgets of lists: how many steps the solver may need, and how many an agent gets. Source: decision 73."""

import zlib
from collections.abc import Iterable

from vigil.packs.pack import CHORES_BUDGETS
from vigil.protocol.goals import Chore, ObjectAtReceptacle

FACTORS = (2.8, 3.3)
"""Minimum and maximum of the step budget as a multiple of the solver's steps. The suite's limits on budgets override
them."""
MIN_FACTOR = 2.6
"""Minimum of the step budget as a multiple of the solver's steps, also where the suite's limits override `FACTORS`."""
STEP_OF_BUDGETS = 5
MAX_SOLVER_STEPS = int(CHORES_BUDGETS[1] / MIN_FACTOR)
"""Maximum number of steps that the solver may need for a list. A list that needs more is not made."""
MAX_LIKELY_STEPS = MAX_SOLVER_STEPS - 8
"""Maximum estimate of the solver's steps (`likely_steps`). A list with a higher estimate is dropped unsolved. The
limit is below `MAX_SOLVER_STEPS`, because many lists take more than the estimate."""
STEPS, STEPS_PER_M, STEPS_PER_PUT = 18.0, 1.55, 18.5
"""Estimate of the solver's steps: for any list, for each metre of its walk, and for each object that it puts somewhere.
It was fitted to the 200 lists of an earlier pack; the standard deviation of its errors is 17 steps."""


def budget_for(steps: int, instruction: str) -> int:
    """Return the step budget of a list that the solver closes in `steps` steps.

    It is a multiple of them; a hash of the instruction selects the factor from `FACTORS`.
    """
    share = zlib.crc32(instruction.encode()) / 2**32
    wanted = steps * (FACTORS[0] + share * (FACTORS[1] - FACTORS[0]))
    rounded = -int(-wanted // STEP_OF_BUDGETS) * STEP_OF_BUDGETS
    return min(max(rounded, CHORES_BUDGETS[0]), CHORES_BUDGETS[1])


def is_within_budget(steps: int, budget: int) -> bool:
    """Return whether a budget leaves an agent enough steps, if the solver needs `steps`."""
    return MIN_FACTOR * steps <= budget


def puts_of(chores: Iterable[Chore]) -> int:
    """Return the number of objects that chores ask to put somewhere."""
    return sum(isinstance(part, ObjectAtReceptacle) for chore in chores for part in chore.parts)


def likely_steps(walk_m: float, puts: int) -> float:
    """Return an estimate of the solver's steps for a list, from the length of its walk and its number of puts."""
    return STEPS + STEPS_PER_M * walk_m + STEPS_PER_PUT * puts
