"""What describes a family of episodes: its row of facts, and what authoring and tests need to make its episodes."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Tier = Literal["diagnostic", "compositional"]
TargetSize = Literal["large", "medium", "small"]
Skill = Literal["navigate", "look", "interact_pixel", "interact_pixel(ground)", "report"]
DEFAULT_HORIZON_DEG = 30.0


@dataclass(frozen=True, slots=True)
class DraftKind:
    """One kind of a family's episodes, with what drafts it."""

    drafts: str | Callable[..., Any]
    """Function from a `HouseContext` to drafts, or its name "package.module:function", loaded when it is needed."""
    arguments: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Further arguments of the function; a `DraftKind` among them stands for its function."""
    in_starter: int = 0
    """Number of episodes of the kind in the starter pack."""
    fallback: str | None = None
    """Kind that takes the kind's place in the starter pack where no house yields it."""


@dataclass(frozen=True, slots=True)
class StreamGrading:
    """How a stream grades a family's episodes: a measured fact with two bounds."""

    by: Literal["actions", "distance_m"]
    """Actions of the recorded solution with its report, or metres from the start to the target."""
    easy: float
    """Highest value that is easy."""
    medium: float
    """Highest value that is medium; what is above is hard."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilySpec:
    """A family: what the protocol, authoring, analysis and tests know of it.

    The fields without a default are the contract of `protocol.md` section 4. A family without `kinds` can be scored
    and reported, and not drafted.
    """

    code: str
    """Two capital letters."""
    name: str
    tier: Tier
    visible_at_start: bool
    """Whether the target is in view at the start."""
    max_steps: int
    max_invalid: int
    skills: tuple[Skill, ...]
    """Expected skills; a recorded solution uses no others."""
    goal_kinds: tuple[str, ...]
    extra_goal_kinds: tuple[str, ...] = ()
    """Kinds of goals that it may use in addition to the paper's: several places or states at once."""
    suite_goal_kinds: tuple[str, ...] = ()
    """Kinds of goals that it may use only in the packs of a suite (`vigil.packs.pack.protocol_faults`)."""
    summary: str = ""
    """What it asks for, in a few words."""
    position: int = 100
    """Place in tables; the paper's families have 1 to 8, and families of one place follow by their codes."""
    kinds: Mapping[str, DraftKind] = field(default_factory=dict[str, DraftKind])
    """Kind -> what drafts it. A pack holds equally many of each stratum, and streams and packs ask for each kind."""
    briefing: str = ""
    """What a language model that proposes tasks is asked for."""
    start_distance_m: tuple[float, float] = (0.0, math.inf)
    """Least and largest distance from the start to the target."""
    rules: tuple[str, ...] = ()
    """Names of the rules for drafts that bind this family and not all (`vigil.authoring.review`)."""
    end_words: str | None = None
    """Regular expression of the words by which an instruction says when it is done; None where the act says it."""
    stratum: Literal["template", "target_size", "distance", "label", "turning"] = "template"
    """Fact over whose values a pack is balanced."""
    grading: StreamGrading | None = None
    """Difficulty in streams; None where the target's size grades the episodes."""
    level_bounds: tuple[float, float, float] | None = None
    """Highest index of difficulty that is easy, medium and hard (`vigil.scoring.levels`); None: the others' mean."""
    sample_goal: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """A simple goal in JSON terms about `target`, `table` and `obstacle`, with which tests make an episode."""

    @property
    def allowed_goal_kinds(self) -> tuple[str, ...]:
        """Kinds of goals that the family may use in any pack."""
        return (*self.goal_kinds, *self.extra_goal_kinds)

    @property
    def start_horizon(self) -> float | None:
        """The camera pitch to start with; None when the author is free to choose (`look` is expected)."""
        return None if "look" in self.skills else DEFAULT_HORIZON_DEG
