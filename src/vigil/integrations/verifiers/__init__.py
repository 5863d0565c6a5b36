"""VIGIL's episodes as a `verifiers` environment, for training models behind an OpenAI-compatible server.

    from vigil.integrations.verifiers import load_environment

    env = load_environment(pack="starter", family="PG", limit=2)

`vf-eval vigil-verifiers` runs the same environment (docs/verifiers.md). Needs the extra `verifiers`.
"""

try:
    import verifiers.v1  # noqa: F401  # pyright: ignore[reportMissingImports] - an extra
except ModuleNotFoundError:
    raise ModuleNotFoundError(
        "verifiers is not installed, or older than 0.4. Install it in a separate environment, because it needs an "
        "older version of openai than the rest of VIGIL: pip install 'vigil-bench[verifiers]'",
        name="verifiers",
    ) from None

from vigil.integrations.verifiers.env import VigilHarness, VigilVerifiersEnv, load_environment
from vigil.integrations.verifiers.taskset import VigilTaskset

__all__ = ["VigilHarness", "VigilTaskset", "VigilVerifiersEnv", "load_environment"]
