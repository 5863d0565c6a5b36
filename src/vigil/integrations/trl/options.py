"""Options of the episodes that TRL trains on: the keywords of `Episodes`."""

from collections.abc import Collection
from typing import Any, ClassVar, Literal

from pydantic import ConfigDict, Field, ValidationError

from vigil.integrations.options import EpisodeOptions, check_names, invalid_option
from vigil.integrations.rewards import Shaping
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES

OWNER = "Episodes"
"""Name of the class in messages."""


class Options(Shaping, EpisodeOptions):
    """Options that select the episodes, and determine their observations, actions and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    PROFILES: ClassVar[Collection[str]] = frozenset(
        n for n, full in PROFILE_NAMES.items() if PROFILES[full].is_append_only
    )

    profile: str = Field(
        "image_history_all", description="profile: `image_history_all`, because in TRL a conversation can only grow"
    )
    actions: Literal["text", "tools"] = Field(
        "text",
        description="form of an action: `text` (the replies of `vigil run`) or `tools` (calls of the four skills, in "
        "the form of the model's own chat template)",
    )
    limit: int | None = Field(
        None, ge=1, description="number of rows: drawn evenly from a pack's families, or the first of a stream"
    )
    workers: int = Field(1, ge=0, description="number of background processes that make a stream's houses")
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())

    @classmethod
    def of(cls, given: dict[str, Any]) -> "Options":
        """Return the options with these names and values.

        Raises SettingError; its message suggests a similar name if a name is unknown.
        """
        check_names(given, cls.model_fields, OWNER)
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise invalid_option(error, OWNER) from None
