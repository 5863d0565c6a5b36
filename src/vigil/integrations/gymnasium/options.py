"""Options of the Gymnasium environment: the keywords that `gymnasium.make("Vigil-v0", ...)` takes."""

from typing import Any, Literal

from pydantic import ConfigDict, Field, ValidationError

from vigil.integrations.options import EpisodeOptions, check_names, invalid_option
from vigil.integrations.rewards import Shaping

OWNER = "Vigil-v0"
"""Name of the environment in messages."""


class Options(Shaping, EpisodeOptions):
    """Options that select the episodes, and determine their observations, actions and rewards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    workers: int = Field(
        1, ge=0, description="number of background processes that make a stream's episodes; with 0, `reset` makes them"
    )
    actions: Literal["text", "structured"] = Field(
        "text", description="form of an action: `text` (a reply's text) or `structured` (a dict of numbers)"
    )
    frames: bool = Field(True, description="whether an observation has the frame; if not, only `render()` draws frames")
    evaluator: bool = Field(False, description="whether `info` has the outcome when an episode ends")

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
