"""Options of the verifiers environment. In Python they are fields of its configs; on the command line of `verifiers`
they are `--env.taskset.*`."""

from pathlib import Path

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports] - an extra
from pydantic import Field, field_validator

from vigil.authoring.streaming.address import is_stream, seed_in
from vigil.errors import VigilError
from vigil.integrations.options import EpisodeOptions
from vigil.integrations.rewards import Shaping
from vigil.packs.pack import find_pack
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.profile import ImageFormat, PromptVariant, SystemRole

TASKSET_ID = "vigil-verifiers"
"""Id by which the library `verifiers` finds the environment, in the module `vigil_verifiers`."""


class VigilTaskConfig(vf.TaskConfig, Shaping):
    """Options that shape the reward in addition to B."""


class VigilTasksetConfig(vf.TasksetConfig, EpisodeOptions):
    """Options that select the episodes, and determine their observations and replies."""

    task: VigilTaskConfig = VigilTaskConfig()
    limit: int | None = Field(
        None, ge=1, description="number of episodes: drawn evenly from a pack's families, or the first ones of a stream"
    )
    stream_workers: int = Field(1, ge=0, description="number of background processes that make a stream's episodes")
    prompt_variant: PromptVariant = Field(
        "default", description="wording of the system prompt: `default` or `neutral_report`"
    )
    image_format: ImageFormat = Field("png", description="how frames are sent: `png` or `jpeg`")
    system_role: SystemRole = Field(
        "system", description="role of the system prompt: `system`, or `user` for models without that role"
    )
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())
    workers: int | None = Field(None, ge=1, description="number of simulator processes; one for each CPU if unset")

    @field_validator("pack")
    @classmethod
    def _pack(cls, given: str | Path) -> str | Path:
        try:
            if is_stream(given):
                seed_in(str(given))
            else:
                find_pack(given)
        except VigilError as error:
            raise ValueError(str(error)) from None
        return given


class VigilEnvConfig(vf.EnvConfig):
    """Configuration of the environment and of its only agent, the model."""

    agent: vf.AgentConfig = vf.AgentConfig(runtime=vf.SubprocessConfig())
    """Configuration of the agent. Nothing runs in its sandbox; the simulators are processes of the environment."""
