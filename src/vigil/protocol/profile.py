"""Profile: the published condition under which an agent is evaluated.

Source: `protocol.md` sections 2.1, 2.3 and 2.4; the paper's section on reproducibility.
"""

import re
import tomllib
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from pydantic import Field, field_validator, model_validator

from vigil.base.models import FrozenModel
from vigil.protocol.actions import Coordinates, ReplyPolicy
from vigil.protocol.profiles.rows import EVERYTHING, PROFILE_NAMES, PROFILES, ProfileRow
from vigil.protocol.prompt_file import check_template, variant_of

PromptVariant = Literal["default", "neutral_report"]
"""Prompt variants of the paper; any other prompt comes from a file and is named after its hash."""
ImageFormat = Literal["png", "jpeg"]
SystemRole = Literal["system", "user"]
"""Where the system prompt is sent: in a separate `system` message, or at the beginning of the first `user` message."""

BASELINE, ACTION_FEEDBACK = PROFILE_NAMES["baseline"], PROFILE_NAMES["action_feedback"]
ITEMISED_REPORT = PROFILE_NAMES["itemised_report"]

HISTORY_TURNS = 20
HISTORY_REPLY_CHARS = 4000
JPEG_QUALITY = 90


class Profile(FrozenModel):
    """The condition under which an agent is evaluated. It is part of a run's identity."""

    name: str = BASELINE
    """Full name of the profile, as in its row of `vigil.protocol.profiles.rows`."""
    prompt_variant: str = "default"
    """Name of the prompt variant: a variant of the paper, or a name made from the hash of `prompt_template`."""
    prompt_template: str | None = None
    """Text of a prompt file; None for the paper's variants."""
    coordinates: Coordinates = "pixel"
    reply_policy: ReplyPolicy = "strict"
    image_format: ImageFormat = "png"
    system_role: SystemRole = "system"
    history_turns: int = Field(default=HISTORY_TURNS, ge=0)
    history_reply_chars: int = Field(default=HISTORY_REPLY_CHARS, ge=1)

    @model_validator(mode="after")
    def _variant_matches_template(self) -> "Profile":
        if self.prompt_template is None:
            if self.prompt_variant not in get_args(PromptVariant):
                raise ValueError(f"prompt_variant {self.prompt_variant!r} is not one of {get_args(PromptVariant)}")
            return self
        check_template(self.prompt_template)
        if self.prompt_variant != variant_of(self.prompt_template):
            raise ValueError(f"prompt_variant {self.prompt_variant!r} is not the name that prompt_template has")
        return self

    @field_validator("name")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in PROFILES:
            raise ValueError(f"{name!r} is not the name of a profile")
        return name

    @property
    def row(self) -> ProfileRow:
        """The profile's row in the table of profiles: how the profile differs from the baseline."""
        return PROFILES[self.name]

    @property
    def has_feedback(self) -> bool:
        """Whether the agent gets `too_far` and `path_blocked` after each action."""
        return self.row.has_feedback

    @property
    def past_turns(self) -> int:
        """Greatest number of past turns in a model's conversation."""
        return EVERYTHING if self.row.is_append_only else self.history_turns

    @property
    def has_claims(self) -> bool:
        """Whether a report has a claim about each chore of a list."""
        return self.row.has_claims

    @property
    def has_custom_prompt(self) -> bool:
        """Whether the prompt comes from a file instead of the paper."""
        return self.prompt_template is not None


class ModelCoordinates(NamedTuple):
    """The coordinate mode of the models whose name matches a pattern, and the source of this fact."""

    pattern: str
    coordinates: Coordinates
    source: str


COORDINATES_BY_MODEL: tuple[ModelCoordinates, ...] = tuple(
    ModelCoordinates(**row)
    for row in tomllib.loads(Path(__file__).with_name("coordinates.toml").read_text(encoding="utf-8"))["model"]
)
"""The paper's table of coordinate modes by model. The first pattern that is found in the model's name (in lower case)
decides. If none is found, the mode is `pixel`."""


def coordinates_for(model: str) -> Coordinates:
    """Return the coordinate mode that `model` was trained with; `pixel` if the table does not list the model."""
    return known_coordinates(model) or "pixel"


def known_coordinates(model: str) -> Coordinates | None:
    """Return the coordinate mode of `model` in `COORDINATES_BY_MODEL`; None if no pattern matches the model."""
    name = model.casefold()
    return next((one.coordinates for one in COORDINATES_BY_MODEL if re.search(one.pattern, name)), None)
