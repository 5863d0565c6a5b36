"""VIGIL under a name that the commands of `verifiers` can look up: `vf-eval vigil-verifiers`.

They import an environment as a module of its own at the top, so that `vigil.integrations.verifiers` cannot be named.
"""

from vigil.integrations.verifiers import VigilHarness, VigilTaskset, VigilVerifiersEnv, load_environment

__all__ = ["VigilHarness", "VigilTaskset", "VigilVerifiersEnv", "load_environment"]
