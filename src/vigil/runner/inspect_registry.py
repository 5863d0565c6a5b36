"""Names that Inspect finds through the package's entry point, so that `inspect eval vigil/vigil --model ...` works."""

from vigil.runner.inspect_task import vigil, vigil_score

__all__ = ["vigil", "vigil_score"]
