"""Levels: how difficult an episode is, measured on its house and its recorded solution.

The difficulty index is a sum over ten figures. Three bounds for each family divide the index into four levels. Figures,
index and level are facts about an episode, not verdicts: no score depends on them.
`vigil.authoring.packing.episode_measures` measures the figures.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field

from vigil.base.json_lines import dump_line, parse_line, read_lines
from vigil.base.models import FrozenModel
from vigil.base.versions import schema_validator
from vigil.errors import SettingError, check_known
from vigil.packs.files import MANIFEST, PackFiles
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family

LEVELS_SCHEMA = 2
LEVELS_FILE = "levels.jsonl"
"""File in a pack's folder with one `EpisodeLevel` per line, sorted by id."""
Level = Literal["easy", "medium", "hard", "extreme"]
LEVELS: tuple[Level, ...] = get_args(Level)

FREE_PX, MIN_PX = 4000, 10
"""Bounds on a target's size (pixels). A target of at least FREE_PX adds no difficulty. A target below MIN_PX is as
difficult as a target of MIN_PX."""


class LevelMeasures(FrozenModel):
    """The figures of one episode from which its index of difficulty is computed."""

    path_m: float = Field(ge=0)
    """Distance (m) walked in the recorded solution."""
    turns: int = Field(ge=0)
    """Number of turns of the body in the solution."""
    doors: int = Field(ge=0)
    """Number of times that the solution passes from one room into another."""
    rooms: int = Field(ge=1)
    """Number of rooms in which the target may be: 1 if it is in view at the start, otherwise all rooms of the house."""
    look_alikes: int = Field(ge=0)
    """Number of other objects that the target's name, without adjectives, may also mean. Only objects that are shown in
    a frame of the solution count."""
    target_px: int = Field(ge=0)
    """Number of pixels of the target in the solution's first frame that shows it; 0 if no frame shows it."""
    containers: int = Field(ge=0)
    """Number of closed containers around the target at the reset. If the instruction does not name the target's
    container, all closed containers in which a person would look for the target count."""
    occlusion: float = Field(ge=0, le=1)
    """Share of the target hidden by other objects in the solution's first frame that shows it; 1 if no frame does."""
    slack: float = Field(ge=0, le=1)
    """Share of the step budget that the solution leaves unused."""
    reference_words: int = Field(ge=0)
    """Number of words, without the article, in the longest phrase by which the instruction names the target."""


@dataclass(frozen=True, slots=True)
class LevelCost:
    """The contribution of one figure to the index of difficulty, as a formula for readers and as a function."""

    formula: str
    """Formula of the contribution, as text for readers."""
    of: Callable[[LevelMeasures], float]


COSTS: dict[str, LevelCost] = {
    "path_m": LevelCost("log2(1 + path_m)", lambda m: math.log2(1.0 + m.path_m)),
    "turns": LevelCost("turns / 4", lambda m: m.turns / 4),
    "doors": LevelCost("doors / 2", lambda m: m.doors / 2),
    "rooms": LevelCost("log2(rooms) / 2", lambda m: math.log2(m.rooms) / 2),
    "look_alikes": LevelCost("log2(1 + look_alikes)", lambda m: math.log2(1.0 + m.look_alikes)),
    "target_px": LevelCost(
        f"log2({FREE_PX} / target_px) / 2, not below 0; under {MIN_PX} pixels as {MIN_PX}",
        lambda m: max(0.0, math.log2(FREE_PX / max(m.target_px, MIN_PX)) / 2),
    ),
    "containers": LevelCost("1.5 x containers", lambda m: 1.5 * m.containers),
    "occlusion": LevelCost("2 x occlusion", lambda m: 2.0 * m.occlusion),
    "slack": LevelCost("3 x (1 - slack)", lambda m: 3.0 * (1.0 - m.slack)),
    "reference_words": LevelCost("(reference_words - 1) / 4", lambda m: max(m.reference_words - 1, 0) / 4),
}
"""Name of a figure -> its contribution to the index. Doubling the path length adds about one point to the index."""


class EpisodeLevel(FrozenModel):
    """The level, index and figures of one episode: a line of `levels.jsonl`."""

    schema_version: Annotated[int, schema_validator(LEVELS_SCHEMA)] = LEVELS_SCHEMA
    episode_id: str
    level: Level
    index: float
    measures: LevelMeasures


def index_of(measures: LevelMeasures) -> float:
    """Return the index of difficulty: the sum of the costs of all figures."""
    return round(sum(cost.of(measures) for cost in COSTS.values()), 3)


def level_of(family: Family, index: float) -> Level:
    """Return the level of a difficulty index within a family, by `FamilySpec.level_bounds`.

    The package's bounds are near the quartiles of a sample of drafted episodes. Half of the episodes start at the first
    place that shows the target well, the other half at the hardest of twelve places. The bounds are higher in VS and
    SM, because models failed most in these two families.
    """
    given = [spec.level_bounds for spec in FAMILIES.values() if spec.level_bounds is not None]
    bounds = FAMILIES[family].level_bounds or tuple(statistics.fmean(each) for each in zip(*given, strict=True))
    return LEVELS[sum(index > bound for bound in bounds)]


def grade_episode(episode: Episode, measures: LevelMeasures) -> EpisodeLevel:
    """Return the level, index and figures of an episode whose figures are `measures`."""
    index = index_of(measures)
    return EpisodeLevel(episode_id=episode.id, level=level_of(episode.family, index), index=index, measures=measures)


def parse_levels(names: Iterable[str]) -> tuple[Level, ...]:
    """Return the levels that `names` lists, the easiest first. A name may be `all`, or list several: "hard,extreme".

    Raises SettingError for a name that is not a level.
    """
    wanted = {word.strip().lower() for name in names for word in name.split(",")}
    if wanted == {"all"}:
        return LEVELS
    for word in sorted(wanted):
        check_known("Level", word, LEVELS, "Choose one of:", ", or all.")
    return tuple(level for level in LEVELS if level in wanted)


def dump_levels(levels: Iterable[EpisodeLevel]) -> bytes:
    """Return the content of `levels.jsonl`, sorted by id."""
    return b"".join(dump_line(level) for level in sorted(levels, key=lambda each: each.episode_id))


def read_levels(path: Path) -> dict[str, EpisodeLevel]:
    """Return the levels in a file by episode id. Raises SettingError, with the number of the invalid line."""
    if not path.exists():
        raise SettingError(f"Levels file {str(path)!r} does not exist. `vigil pack levels PACK --out FILE` writes one.")
    advice = "Write it again with `vigil pack levels`."
    rows = [
        parse_line(line, EpisodeLevel, f"Levels file {str(path)!r}", advice, SettingError) for line in read_lines(path)
    ]
    return {row.episode_id: row for row in rows}


def read_pack_levels(folder: Path) -> Mapping[str, EpisodeLevel]:
    """Return the levels in a pack's `levels.jsonl` by episode id; empty when the pack does not have this file.

    If the manifest lists the file, its hash is checked. Raises PackMismatch, EpisodeError or SettingError.
    """
    path = folder / LEVELS_FILE
    if not path.exists():
        return {}
    files = PackFiles.of(folder) if (folder / MANIFEST).exists() else None
    if files is None or LEVELS_FILE not in files.manifest.files:
        return read_levels(path)
    return {row.episode_id: row for row in files.rows(LEVELS_FILE, EpisodeLevel)}
