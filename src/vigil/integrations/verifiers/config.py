"""Options of the environment: fields of verifiers' configs, `--env.taskset.*` on its command line."""

from pathlib import Path
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports]
from pydantic import Field, ValidationInfo, field_validator, model_validator

from vigil.authoring.streaming.address import is_stream, seed_in
from vigil.authoring.streaming.difficulty import difficulties_named
from vigil.errors import VigilError, did_you_mean
from vigil.integrations.rewards import HonestFailReward, LagPenalty, WorldReward
from vigil.packs.pack import find_pack
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.actions import Coordinates, ReplyPolicy
from vigil.protocol.families import parse_families
from vigil.protocol.observation import Quality
from vigil.protocol.profile import PROFILE_NAMES, ImageFormat, Profile, PromptVariant, SystemRole
from vigil.sim import BACKENDS

TASKSET_ID = "vigil-verifiers"
"""Id by which verifiers finds the environment, in the module `vigil_verifiers`."""


class VigilTaskConfig(vf.TaskConfig):
    """Options that shape the reward in addition to B."""

    world_reward: WorldReward = 0.0
    honest_fail_reward: HonestFailReward = 0.0
    lag_penalty: LagPenalty = 0.0


class VigilTasksetConfig(vf.TasksetConfig):
    """Options that select the episodes, and say how they are observed and answered."""

    task: VigilTaskConfig = VigilTaskConfig()
    pack: str = Field("starter", description="name or folder of a pack, or a stream, e.g. `stream:7`")
    family: list[str] = Field([], description="one family or more, e.g. `AI` or `AI,SI`; all if unset")
    limit: int | None = Field(
        None, ge=1, description="number of episodes: drawn evenly from a pack's families, or the first of a stream"
    )
    difficulty: list[str] = Field(
        [], description="difficulty in a stream: one or more of `easy`, `medium` and `hard`; all if unset"
    )
    houses: tuple[int, int] | None = Field(
        None, description="range of a stream's houses: the first, and the one after the last; all from 0 on if unset"
    )
    stream_workers: int = Field(1, ge=0, description="number of processes that make a stream's episodes ahead")
    profile: str = Field("baseline", description="`baseline`, or `action_feedback` with its two booleans")
    prompt_variant: PromptVariant = Field("default", description="`default`, or `neutral_report`")
    coordinates: Coordinates = Field("pixel", description="coordinates of clicks: `pixel` or `normalized_1000`")
    reply_policy: ReplyPolicy = Field("strict", description="how a reply is read: `strict` or `lenient`")
    image_format: ImageFormat = Field("png", description="how frames are sent: `png` or `jpeg`")
    system_role: SystemRole = Field("system", description="`system`, or `user` for models without that role")
    backend: str = Field("mujoco", description="the simulator's backend")
    quality: Quality = Field("default", description="quality of frames: `default`, or `fast` with rougher edges")
    asset_database: Path | None = Field(None, description="AI2-THOR's asset database, for houses with its assets")
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())
    workers: int | None = Field(None, ge=1, description="number of simulator processes; one for each CPU if unset")

    @field_validator("pack")
    @classmethod
    def _pack(cls, given: str) -> str:
        try:
            if is_stream(given):
                seed_in(given)
            else:
                find_pack(given)
        except VigilError as error:
            raise ValueError(str(error)) from None
        return given

    @field_validator("family", "difficulty", mode="before")
    @classmethod
    def _names(cls, given: Any, info: ValidationInfo) -> Any:
        names = [given] if isinstance(given, str) else given
        try:
            return list(parse_families(names) if info.field_name == "family" else difficulties_named(names))
        except VigilError as error:
            raise ValueError(str(error)) from None

    @model_validator(mode="after")
    def _fit_the_source(self) -> "VigilTasksetConfig":
        if not is_stream(self.pack) and (self.difficulty or self.houses):
            raise ValueError("difficulty and houses are for a stream (pack stream:7), not for a pack")
        if self.houses is not None and not 0 <= self.houses[0] < self.houses[1]:
            raise ValueError(f"houses {self.houses[0]} to {self.houses[1]} of a stream: expected 0 <= FIRST < END")
        return self

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
        """Profile under which episodes are played."""
        return Profile(
            name=PROFILE_NAMES[self.profile],
            prompt_variant=self.prompt_variant,
            coordinates=self.coordinates,
            reply_policy=self.reply_policy,
            image_format=self.image_format,
            system_role=self.system_role,
        )


class VigilEnvConfig(vf.EnvConfig):
    """Configuration of the environment with its one agent, the model."""

    agent: vf.AgentConfig = vf.AgentConfig(runtime=vf.SubprocessConfig())
    """Configuration of the agent. Nothing runs in its sandbox: simulators are processes of the environment."""


def _known(what: str, given: str, names: Any) -> str:
    if given not in names:
        raise ValueError(
            f"{what} {given!r} does not exist.{did_you_mean(given, names)} Choose one of {', '.join(names)}."
        )
    return given
