"""Options of the Gymnasium environment: the keywords that `gymnasium.make("Vigil-v0", ...)` takes."""

from typing import ClassVar, Literal

from pydantic import ConfigDict, Field

from vigil.integrations.options import EpisodeOptions
from vigil.integrations.rewards import Shaping


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
