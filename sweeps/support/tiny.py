"""The tiny pack of the tests, for sweeps: one small room, episodes of several families, quick on the `fake` backend."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

from tiny_pack import tiny_pack

__all__ = ["tiny_pack"]
