"""Options of the episodes that TRL trains on: the keywords of `Episodes`."""

from collections.abc import Collection
from typing import ClassVar, Literal

from pydantic import ConfigDict, Field

from vigil.integrations.options import EpisodeOptions
from vigil.integrations.rewards import Shaping
from vigil.packs.private import REVEAL_HELP
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES


class TrlOptions(Shaping, EpisodeOptions):
    """Options that select the episodes, and determine their observations, actions and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    OWNER: ClassVar[str] = "Episodes"
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
        None, ge=1, description="number of rows: drawn evenly from a pack's families, or the first rows of a stream"
    )
    workers: int = Field(1, ge=0, description="number of background processes that make a stream's houses")
    reveal_private_pack: bool = Field(False, description=REVEAL_HELP.removesuffix(".").lower())
