"""The request for a pack: what the pack must contain, and how its drafts are made. It comes from the command line."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vigil.authoring.language.sentences import Forms
from vigil.authoring.packing.suites import SuiteName, suite_of_kind
from vigil.protocol.families import FAMILIES, Family, wanted_kinds
from vigil.scoring.levels import Level

MAX_PER_HOUSE = 3
PER_FAMILY = 125


@dataclass(frozen=True, slots=True)
class PackRequest:
    """Settings of a pack that is to be made."""

    name: str
    per_family: int = PER_FAMILY
    seed: int = 0
    """Seed that draws houses and drafts. It also decides between candidates that are equally good."""
    max_per_house: int = MAX_PER_HOUSE
    """Maximum number of episodes of one family, or of tasks of one kind, in one house."""
    version: str = "1"
    description: str = ""
    aliases: tuple[str, ...] = ()
    families: tuple[Family, ...] = tuple(FAMILIES)
    tasks: Mapping[str, int] = field(default_factory=dict)
    """Kind of task in the suite -> number of such tasks; empty for a pack of families. Twins are one task."""
    is_seed_secret: bool = False
    """Whether the pack reveals only the hash of its seed."""
    backend: str = "mujoco"
    asset_database_sha256: str | None = None
    """Hash of AI2-THOR's asset database from which things get their sizes; None if they have typical sizes."""
    levels: tuple[Level, ...] = ()
    """Levels of difficulty over which each family is divided evenly; empty if levels do not matter."""
    is_robust: bool = False
    """Whether episodes must also satisfy the robustness rules. The check of candidates must then include the rules."""
    forms: Forms = "public"
    """Sentence forms of new drafts: one of two halves (such as `public`), or all."""
    drafted_in: int | None = None
    """Number of houses, drawn by the seed, in which drafts are made first; None for all available houses."""
    one_family_per_house: bool = False
    """Whether each house gets only one family, in rotation."""
    starts: int = 1
    """Number of start poses drawn for each draft; the hardest is used."""
    templates: tuple[str, ...] = ()
    """Kinds of episodes to draft. A family that has none of these kinds gets all its kinds."""

    @property
    def suite(self) -> SuiteName | None:
        """The suite of the pack; None for a pack of families."""
        return next(map(suite_of_kind, self.tasks), None)

    def admits(self, family: Family, kind: str) -> bool:
        """Return whether episodes of this kind may be in the pack."""
        return not self.templates or kind in wanted_kinds(family, self.templates)

    @property
    def quotas(self) -> dict[str, int]:
        """Family -> number of its episodes; in a suite, kind -> number of its tasks."""
        return {**self.tasks} if self.tasks else dict.fromkeys(self.families, self.per_family)

    @property
    def level_quotas(self) -> dict[Level, int]:
        """Level -> number of episodes of each family. If there is a remainder, the first levels get one more."""
        each, left = divmod(self.per_family, max(len(self.levels), 1))
        return {level: each + (place < left) for place, level in enumerate(self.levels)}
