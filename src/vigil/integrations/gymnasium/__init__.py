"""VIGIL's episodes as a Gymnasium environment, for training: importing this module registers `Vigil-v0`.

    import gymnasium
    import vigil.integrations.gymnasium

    env = gymnasium.make("Vigil-v0", pack="starter", family="PG")

`GymnasiumOptions` lists the options of `make`; docs/gymnasium.md explains them. Needs the extra `gymnasium`.
"""

try:
    import gymnasium
except ModuleNotFoundError:
    raise ModuleNotFoundError(
        "Gymnasium is not installed. Give: pip install 'vigil-bench[gymnasium]'", name="gymnasium"
    ) from None

from vigil.integrations.gymnasium.env import VigilEnv
from vigil.integrations.gymnasium.vector import SharedProcessVectorEnv, make_vector
from vigil.integrations.options import GymnasiumOptions

__all__ = ["ENV_ID", "GymnasiumOptions", "SharedProcessVectorEnv", "VigilEnv", "make_vector"]

ENV_ID = "Vigil-v0"

gymnasium.register(
    ENV_ID,
    entry_point=f"{__name__}:{VigilEnv.__name__}",
    vector_entry_point=f"{__name__}:{make_vector.__name__}",
)
