"""House generator: `generate(seed, spec)` writes ProcTHOR house documents, the same bytes for the same arguments."""

from vigil.housegen.check import Fault, check_house
from vigil.housegen.generate import GENERATOR_VERSION, generate
from vigil.housegen.spec import SPECS, HouseSpec, spec_for

__all__ = ["GENERATOR_VERSION", "SPECS", "Fault", "HouseSpec", "check_house", "generate", "spec_for"]
