"""House generator: `generate(seed, spec)` returns a house in ProcTHOR's format.

The same arguments give the same bytes.
"""

from vigil.housegen.base.spec import SPECS, HouseSpec, spec_for
from vigil.housegen.checking.check import Fault, check_house
from vigil.housegen.generate import GENERATOR_VERSION, generate

__all__ = ["GENERATOR_VERSION", "SPECS", "Fault", "HouseSpec", "check_house", "generate", "spec_for"]
