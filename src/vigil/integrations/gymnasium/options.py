"""Options of the Gymnasium environment: the keywords that `gymnasium.make("Vigil-v0", ...)` takes."""

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from vigil.assets.database import AssetDatabase
from vigil.authoring.streaming.difficulty import Difficulty, difficulties_named
from vigil.errors import SettingError, did_you_mean, first_error
from vigil.integrations.rewards import HonestFailReward, LagPenalty, WorldReward
from vigil.protocol.actions import Coordinates, ReplyPolicy
from vigil.protocol.families import Family, parse_families
from vigil.protocol.observation import Quality
from vigil.protocol.profile import PROFILE_NAMES, Profile


class Options(BaseModel):
    """Options that select the episodes, and say how they are observed, answered and rewarded."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    pack: str | Path = Field("starter", description="name or folder of a pack, or a stream, e.g. `stream:7`")
    family: tuple[Family, ...] = Field((), description="one family or more, e.g. `AI` or `AI,SI`; all if unset")
    difficulty: tuple[Difficulty, ...] = Field(
        (), description="difficulty in a stream: one or more of `easy`, `medium` and `hard`; all if unset"
    )
    houses: tuple[int, int] | None = Field(
        None, description="range of a stream's houses: the first, and the one after the last; all from 0 on if unset"
    )
    workers: int = Field(
        1, ge=0, description="number of processes that make a stream's episodes ahead; with 0, `reset` makes them"
    )
    actions: Literal["text", "structured"] = Field(
        "text", description="`text`: an action is a reply's text; `structured`: a dict of numbers"
    )
    frames: bool = Field(True, description="whether an observation has the frame; if not, only `render()` draws frames")
    profile: str = Field("baseline", description="`baseline`, or `action_feedback` with its two booleans")
    coordinates: Coordinates = Field("pixel", description="coordinates of clicks: `pixel` or `normalized_1000`")
    reply_policy: ReplyPolicy = Field("strict", description="how a text is read: `strict` or `lenient`")
    backend: str = Field("mujoco", description="the simulator's backend")
    quality: Quality = Field("default", description="quality of frames: `default`, or `fast` with rougher edges")
    asset_database: str | Path | None = Field(None, description="AI2-THOR's asset database, for houses with its assets")
    world_reward: WorldReward = 0.0
    honest_fail_reward: HonestFailReward = 0.0
    lag_penalty: LagPenalty = 0.0
    evaluator: bool = Field(False, description="whether `info` has the outcome when an episode ends")

    @field_validator("family", mode="before")
    @classmethod
    def _families(cls, given: Any) -> tuple[Family, ...]:
        names = [given] if isinstance(given, str) else given
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise SettingError(f"Vigil-v0: family is {given!r}; give a family's name, or a list of names.")
        return parse_families(names)

    @field_validator("difficulty", mode="before")
    @classmethod
    def _difficulties(cls, given: Any) -> tuple[Difficulty, ...]:
        names = [given] if isinstance(given, str) else given
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise SettingError(f"Vigil-v0: difficulty is {given!r}; give easy, medium or hard, or a list of them.")
        return difficulties_named(names)

    @field_validator("houses", mode="before")
    @classmethod
    def _houses(cls, given: Any) -> Any:
        return tuple(given) if isinstance(given, list) else given

    @field_validator("profile")
    @classmethod
    def _profile(cls, given: str) -> str:
        if given not in PROFILE_NAMES:
            hint = did_you_mean(given, PROFILE_NAMES)
            raise SettingError(
                f"Vigil-v0: profile {given!r} does not exist.{hint} Choose one of {', '.join(PROFILE_NAMES)}."
            )
        return given

    @classmethod
    def of(cls, given: dict[str, Any]) -> "Options":
        """Return the options with these names and values. Raises SettingError, which suggests a similar name."""
        for name in given:
            if name not in cls.model_fields:
                hint = did_you_mean(name, cls.model_fields) or f" Its options: {', '.join(cls.model_fields)}."
                raise SettingError(f"Vigil-v0 has no option {name!r}.{hint}")
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise SettingError(f"Vigil-v0: option {first_error(error)}.") from None

    @property
    def assets(self) -> AssetDatabase:
        """Asset database with the sizes of objects. Raises SettingError if it is invalid."""
        return AssetDatabase.from_file(None if self.asset_database is None else Path(self.asset_database))

    @property
    def condition(self) -> Profile:
        """Profile under which episodes are played."""
        return Profile(name=PROFILE_NAMES[self.profile], coordinates=self.coordinates, reply_policy=self.reply_policy)
