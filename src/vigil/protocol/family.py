"""Description of a family of episodes: its facts, and the functions and settings that make its episodes."""

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
    """One kind of a family's episodes, and the function that drafts episodes of this kind."""

    drafts: str | Callable[..., Any]
    """Function that takes a `HouseContext` and returns drafts, or the function's name as "package.module:function"."""
    arguments: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Further arguments of the function. A value that is a `DraftKind` is replaced by the function of that kind."""
    in_starter: int = 0
    """Number of episodes of the kind in the starter pack."""
    fallback: str | None = None
    """Kind that replaces this kind in the starter pack if no house yields an episode of this kind."""


@dataclass(frozen=True, slots=True)
class StreamGrading:
    """Rule by which a stream grades a family's episodes as easy, medium or hard: a measured fact and two bounds."""

    by: Literal["actions", "distance_m"]
    """The measured fact: number of actions in the recorded solution, or distance (m) from the start to the target."""
    easy: float
    """Highest value of the measured fact (`by`) in an easy episode."""
    medium: float
    """Highest value of the measured fact (`by`) in a medium episode; an episode with a higher value is hard."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilySpec:
    """The facts about a family that the protocol, authoring, analysis and tests use.

    Section 4 of `protocol.md` fixes the fields that do not have a default. If a family does not have `kinds`, its
    episodes can be scored and reported, but not drafted.
    """

    code: str
    """Code of the family: two capital letters."""
    name: str
    tier: Tier
    visible_at_start: bool
    """Whether the target is in view at the start."""
    max_steps: int
    max_invalid: int
    skills: tuple[Skill, ...]
    """Skills that the family requires; a recorded solution uses no other skills."""
    goal_kinds: tuple[str, ...]
    extra_goal_kinds: tuple[str, ...] = ()
    """Kinds of goals that the family may use although the paper does not have them, e.g. several states at once."""
    suite_goal_kinds: tuple[str, ...] = ()
    """Kinds of goals that the family may use only in packs of a suite (see `packs.pack.protocol_faults`)."""
    summary: str = ""
    """What the family's tasks ask for, in a few words."""
    position: int = 100
    """Position of the family in tables: 1 to 8 for the paper's families. Equal positions are sorted by code."""
    kinds: Mapping[str, DraftKind] = field(default_factory=dict[str, DraftKind])
    """Name of a kind of episodes -> how the kind is drafted. Packs and streams draft every kind."""
    briefing: str = ""
    """Text that asks a language model to propose tasks of this family."""
    start_distance_m: tuple[float, float] = (0.0, math.inf)
    """Least and greatest distance (m) from the start to the target."""
    rules: tuple[str, ...] = ()
    """Names of rules for drafts (`vigil.authoring.review`) that apply to this family but not to every family."""
    end_words: str | None = None
    """Regular expression for words that say when the task is done; each instruction must match it. None without such a
    rule."""
    stratum: Literal["template", "target_size", "distance", "label", "turning"] = "template"
    """Fact about episodes over which a pack is balanced: each value of the fact has about equally many episodes."""
    grading: StreamGrading | None = None
    """Rule for the difficulty of episodes in streams; None if the target's size decides the difficulty."""
    level_bounds: tuple[float, float, float] | None = None
    """Highest difficulty indices (`vigil.scoring.levels`) of an easy, a medium and a hard episode. If None, the mean of
    the other families' bounds is used."""
    sample_goal: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """A simple goal as JSON from which tests make an episode; its objects are `target`, `table` and `obstacle`."""

    @property
    def allowed_goal_kinds(self) -> tuple[str, ...]:
        """Kinds of goals that the family may use in any pack."""
        return (*self.goal_kinds, *self.extra_goal_kinds)

    @property
    def start_horizon(self) -> float | None:
        """Camera pitch (deg) at the start. None in families with the skill `look`: there, authors choose the pitch."""
        return None if "look" in self.skills else DEFAULT_HORIZON_DEG
