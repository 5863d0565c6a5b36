"""Options of the environment: fields of verifiers' configs, `--env.taskset.*` on its command line."""

from pathlib import Path
from typing import Any

import verifiers.v1 as vf
from pydantic import Field, field_validator

from vigil.actions import Coordinates, ReplyPolicy
from vigil.episode import families_named
from vigil.errors import VigilError, did_you_mean
from vigil.integrations.rewards import HonestFailReward, LagPenalty, WorldReward
from vigil.observation import Quality
from vigil.pack import find
from vigil.profile import PROFILE_NAMES, ImageFormat, Profile, PromptVariant
from vigil.sim import BACKENDS

TASKSET_ID = "vigil-verifiers"
"""The module, `vigil_verifiers`, under which verifiers looks the environment up."""


class VigilTaskConfig(vf.TaskConfig):
    """What is rewarded beside B."""

    world_reward: WorldReward = 0.0
    honest_fail_reward: HonestFailReward = 0.0
    lag_penalty: LagPenalty = 0.0


class VigilTasksetConfig(vf.TasksetConfig):
    """What is played, and how it is seen and answered."""

    task: VigilTaskConfig = VigilTaskConfig()
    pack: str = Field("starter", description="a pack's name, or its folder")
    family: list[str] = Field([], description="a family or several, as `AI` or `AI,SI`; all without it")
    limit: int | None = Field(None, ge=1, description="only so many episodes, evenly drawn from the families")
    profile: str = Field("baseline", description="`baseline`, or `action_feedback` with its two booleans")
    prompt_variant: PromptVariant = Field("default", description="`default`, or `neutral_report`")
    coordinates: Coordinates = Field("pixel", description="`pixel` or `normalized_1000`: how the model points")
    reply_policy: ReplyPolicy = Field("strict", description="how a reply is read: `strict` or `lenient`")
    image_format: ImageFormat = Field("png", description="how frames are sent: `png` or `jpeg`")
    backend: str = Field("mujoco", description="the simulator's backend")
    quality: Quality = Field("default", description="of a frame: `default`, or `fast` without shadows")
    asset_database: Path | None = Field(None, description="AI2-THOR's file, for houses of its assets")
    workers: int | None = Field(None, ge=1, description="processes that simulate and draw; one for each CPU without it")

    @field_validator("pack")
    @classmethod
    def _pack(cls, given: str) -> str:
        try:
            find(given)
        except VigilError as error:
            raise ValueError(str(error)) from None
        return given

    @field_validator("family", mode="before")
    @classmethod
    def _families(cls, given: Any) -> Any:
        names = [given] if isinstance(given, str) else given
        try:
            return list(families_named(names))
        except VigilError as error:
            raise ValueError(str(error)) from None

    @field_validator("profile")
    @classmethod
    def _profile(cls, given: str) -> str:
        return _known("profile", given, PROFILE_NAMES)

    @field_validator("backend")
    @classmethod
    def _backend(cls, given: str) -> str:
        return _known("backend", given, BACKENDS)

    @property
    def condition(self) -> Profile:
        """The profile under which episodes are played."""
        return Profile(
            name=PROFILE_NAMES[self.profile],
            prompt_variant=self.prompt_variant,
            coordinates=self.coordinates,
            reply_policy=self.reply_policy,
            image_format=self.image_format,
        )


class VigilEnvConfig(vf.EnvConfig):
    """The environment with its one agent, the model."""

    agent: vf.AgentConfig = vf.AgentConfig(runtime=vf.SubprocessConfig())
    """Nothing runs in its sandbox: simulators are processes of the environment."""


def _known(what: str, given: str, names: Any) -> str:
    if given not in names:
        raise ValueError(f"there is no {what} {given!r}.{did_you_mean(given, names)} Choose one of {', '.join(names)}.")
    return given
