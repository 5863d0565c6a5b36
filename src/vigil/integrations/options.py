"""Options of the environments and data sets for Gymnasium, verifiers, TRL and verl."""

from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator

from vigil.assets.database import AssetDatabase
from vigil.authoring.streaming.address import is_stream
from vigil.authoring.streaming.difficulty import Difficulty, difficulties_named
from vigil.errors import SettingError, did_you_mean, first_error
from vigil.integrations.rewards import Shaping
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.actions import Coordinates, ReplyPolicy
from vigil.protocol.families import Family, parse_families
from vigil.protocol.observation import Quality
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES
from vigil.sim import BACKENDS, make_simulator
from vigil.sim.protocol import Simulator

_PROFILES = {
    name: full for name, full in PROFILE_NAMES.items() if PROFILES[full].is_papers or PROFILES[full].has_claims
}
"""Profiles whose observations fit into the observation spaces of the environments."""


class EpisodeOptions(BaseModel):
    """Options that select the episodes, and determine their observations and replies."""

    PROFILES: ClassVar[Collection[str]] = _PROFILES
    """Names of the profiles that users may choose."""
    OWNER: ClassVar[str]
    """Name, in messages, of the class or environment that takes the options."""
    pack: str | Path = Field("starter", description="name or folder of a pack, or a stream, e.g. `stream:7`")
    family: list[Family] = Field([], description="one family or more, e.g. `AI` or `AI,SI`; all if unset")
    difficulty: list[Difficulty] = Field(
        [], description="difficulty in a stream: one or more of `easy`, `medium` and `hard`; all if unset"
    )
    suite: Literal["chores"] | None = Field(
        None, description="suite of a stream's episodes: `chores`; if unset, the episodes are those of the families"
    )
    houses: tuple[int, int] | None = Field(
        None,
        description="houses of a stream to use, as (first, end): houses first to end - 1; all houses if unset",
    )
    profile: str = Field(
        "baseline",
        description="profile: `baseline`; `action_feedback`, which adds the two booleans of `feedback`; or "
        "`itemised_report`, with a claim about each chore",
    )
    coordinates: Coordinates = Field("pixel", description="coordinates of clicks: `pixel` or `normalized_1000`")
    reply_policy: ReplyPolicy = Field("strict", description="how the text of a reply is parsed: `strict` or `lenient`")
    backend: str = Field("mujoco", description="the simulator's backend")
    quality: Quality = Field("default", description="quality of frames: `default`, or `fast` with rougher edges")
    asset_database: str | Path | None = Field(
        None, description="file of AI2-THOR's asset database, for houses that use its assets"
    )

    @field_validator("family", "difficulty", mode="before")
    @classmethod
    def _names(cls, given: Any, info: ValidationInfo) -> Any:
        names = [given] if isinstance(given, str) else given
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise ValueError(f"{info.field_name} is {given!r}; give a name, or a list of names")
        try:
            return list(parse_families(names) if info.field_name == "family" else difficulties_named(names))
        except SettingError as error:
            raise ValueError(str(error)) from None

    @field_validator("houses", mode="before")
    @classmethod
    def _houses(cls, given: Any) -> Any:
        return tuple(given) if isinstance(given, list) else given

    @field_validator("difficulty", "houses", "suite")
    @classmethod
    def _of_streams(cls, given: Any, info: ValidationInfo) -> Any:
        if given and not is_stream(info.data.get("pack")):
            raise ValueError(f"{info.field_name} is for a stream (pack stream:7), not for a pack")
        return given

    @field_validator("profile", "backend")
    @classmethod
    def _known(cls, given: str, info: ValidationInfo) -> str:
        names: Collection[str] = cls.PROFILES if info.field_name == "profile" else BACKENDS
        if given not in names:
            hint = did_you_mean(given, names)
            raise ValueError(f"{info.field_name} {given!r} does not exist.{hint} Choose one of {', '.join(names)}")
        return given

    @property
    def assets(self) -> AssetDatabase:
        """Asset database with the sizes of objects. Raises SettingError if it is invalid."""
        return AssetDatabase.from_file(None if self.asset_database is None else Path(self.asset_database))

    def make_simulator(self) -> Simulator:
        """Return a simulator with these options. Raises SettingError or SimulatorError."""
        return make_simulator(self.backend, assets=self.assets, quality=self.quality)

    @classmethod
    def of(cls, given: dict[str, Any]) -> Self:
        """Return the options with these names and values.

        Raises SettingError; its message suggests a similar name if a name is unknown.
        """
        check_names(given, cls.model_fields, cls.OWNER)
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise invalid_option(error, cls.OWNER) from None

    @property
    def condition(self) -> Profile:
        """Profile under which episodes are played."""
        names = Profile.model_fields.keys() & type(self).model_fields.keys()
        return Profile(name=PROFILE_NAMES[self.profile], **{name: getattr(self, name) for name in names})


class GymnasiumOptions(Shaping, EpisodeOptions):
    """Options that select the episodes, and determine their observations, actions and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    OWNER: ClassVar[str] = "Vigil-v0"

    workers: int = Field(
        1, ge=0, description="number of background processes that make a stream's episodes; with 0, `reset` makes them"
    )
    actions: Literal["text", "structured"] = Field(
        "text", description="form of an action: `text` (a reply's text) or `structured` (a dict of numbers)"
    )
    frames: bool = Field(True, description="whether an observation has the frame; if not, only `render()` draws frames")
    evaluator: bool = Field(False, description="whether `info` has the outcome when an episode ends")


class RowOptions(EpisodeOptions):
    """Options of a data set whose rows name episodes."""

    limit: int | None = Field(
        None, ge=1, description="number of episodes: drawn evenly from a pack's families, or the first ones of a stream"
    )
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())


class TrlOptions(Shaping, RowOptions):
    """Options that select the episodes, and determine their observations, actions and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    OWNER: ClassVar[str] = "Episodes"
    PROFILES: ClassVar[Collection[str]] = frozenset(
        name for name, full in PROFILE_NAMES.items() if PROFILES[full].is_append_only
    )

    profile: str = Field(
        "image_history_all", description="profile: `image_history_all`, because in TRL a conversation can only grow"
    )
    actions: Literal["text", "tools"] = Field(
        "text",
        description="form of an action: `text` (the replies of `vigil run`) or `tools` (calls of the four skills, in "
        "the form of the model's own chat template)",
    )
    workers: int = Field(1, ge=0, description="number of background processes that make a stream's houses")


class VerlOptions(Shaping, RowOptions):
    """Options that select the episodes, and determine their observations, replies and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    OWNER: ClassVar[str] = "The agent loop"

    stream_workers: int = Field(1, ge=0, description="number of background processes that make a stream's houses")
    workers: int = Field(1, ge=1, description="number of simulator processes of each agent-loop worker")


def check_names(given: Iterable[str], known: Iterable[str], owner: str) -> None:
    """Raise SettingError for the first given option that `owner` does not have; the error suggests a similar name."""
    known = list(known)
    for name in given:
        if name not in known:
            hint = did_you_mean(name, known) or f" Its options: {', '.join(known)}."
            raise SettingError(f"{owner} has no option {name!r}.{hint}")


def invalid_option(error: ValidationError, owner: str) -> SettingError:
    """Return the error that names the first invalid option of `owner`, and says what is wrong with it."""
    fault = first_error(error).removeprefix("taskset.").replace("Value error, ", "", 1)
    return SettingError(f"{owner}: option {fault.rstrip('.')}.")
