"""VIGIL under a name that the commands of `verifiers` can look up: `vf-eval vigil-verifiers`.

These commands import an environment as a top-level module, so they cannot find `vigil.integrations.verifiers`.
"""

from vigil.integrations.verifiers import VigilHarness, VigilTaskset, VigilVerifiersEnv, load_environment

__all__ = ["VigilHarness", "VigilTaskset", "VigilVerifiersEnv", "load_environment"]
