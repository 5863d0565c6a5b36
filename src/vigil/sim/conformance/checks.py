"""The list of checks that every simulator backend must pass, in the reference house.

Each check takes a `Harness` (`vigil.sim.conformance.harness`). It raises AssertionError, which says what was expected
and what was found. Checks use a backend only through `vigil.sim.protocol` and `vigil.sim.privileged`. A check's
docstring says what it requires.
"""

import inspect
from collections.abc import Callable
from types import ModuleType

from vigil.sim.conformance import handling, moving, privileged, seeing
from vigil.sim.conformance.harness import Harness

ConformanceCheck = Callable[[Harness], None]


def _checks_in(module: ModuleType) -> list[ConformanceCheck]:
    """Return the public functions that a module defines, in the order of their definitions."""
    found = vars(module).values()
    mine = (each for each in found if inspect.isfunction(each) and each.__module__ == module.__name__)
    return [each for each in mine if not each.__name__.startswith("_")]


CHECKS = tuple(check for module in (moving, handling, seeing, privileged) for check in _checks_in(module))
