"""Plays of a pack by people or models that see its pictures, with the result of each and the cause of each failure.

They are stored in `plays.json` next to the pack, outside its hash: the file is written after the pack was frozen.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.authoring.packing.sidecar_files import SidecarFile, read_sidecar
from vigil.base.versions import schema_validator
from vigil.packs.pack import Pack
from vigil.protocol.actions import Status
from vigil.scoring.levels import LEVELS
from vigil.scoring.rates import wilson

PLAYS = "plays.json"
PLAYS_SCHEMA = 1
Cause = Literal["agent", "picture", "wording", "world"]
"""Cause of a failure."""
CAUSES: tuple[Cause, ...] = get_args(Cause)


class ReaderPlay(BaseModel):
    """One episode, as a reader played it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    episode_id: str
    reader: str
    """The player; the same name in other plays is the same player."""
    group: str
    """The episode's level of difficulty, or its kind in a pack of closure stress."""
    steps: int = Field(ge=0)
    status: Status | None
    """The reported status; None without a report."""
    W: bool
    B: bool
    C: bool | None = None
    """Correct closure; None outside packs of closure stress."""
    label: str
    cause: Cause | None = None
    """The cause of failure; None when the episode was closed correctly."""
    reason: str = ""
    """Remark by the person who looked for the cause."""

    @property
    def is_right(self) -> bool:
        """Return whether the play counts as a success: C where the pack asks for it, else B."""
        return self.B if self.C is None else self.C

    @model_validator(mode="after")
    def _failures_have_causes(self) -> "ReaderPlay":
        if self.is_right == (self.cause is not None):
            raise ValueError("a failure has a cause, and only a failure has one")
        return self


class ReaderPlays(SidecarFile):
    """Results of all plays of one pack."""

    schema_version: Annotated[int, schema_validator(PLAYS_SCHEMA)] = PLAYS_SCHEMA
    drawn: str
    """How the episodes were drawn, as a sentence."""
    plays: tuple[ReaderPlay, ...] = Field(min_length=1)


def read_plays(pack: Pack) -> ReaderPlays | None:
    """Return the plays of this very pack; None without plays. Raises PackMismatch for a broken file."""
    return read_sidecar(pack, PLAYS, ReaderPlays, "Write it anew, or remove it.")


def plays_table(found: ReaderPlays) -> list[str]:
    """Return a Markdown table: success rates overall and by group, in per cent, and the causes of failures."""
    groups: dict[str, list[ReaderPlay]] = defaultdict(list)
    for play in found.plays:
        groups[play.group].append(play)
    measures = ["W", "B"] if found.plays[0].C is None else ["C"]
    heads = ["", "plays", *(f"{measure} [95 %]" for measure in measures), *CAUSES]
    rows = [("all", found.plays), *((name, groups[name]) for name in sorted(groups, key=_place))]
    return [
        f"| {' | '.join(heads)} |",
        f"|{'---|' * len(heads)}",
        *(f"| {name} | {' | '.join(_cells(plays, measures))} |" for name, plays in rows),
    ]


def _place(group: str) -> tuple[int, str]:
    return (list(LEVELS).index(group) if group in LEVELS else 0), group


def _cells(plays: Sequence[ReaderPlay], measures: Iterable[str]) -> list[str]:
    causes = Counter(play.cause for play in plays)
    shares = (_share([bool(getattr(play, measure)) for play in plays]) for measure in measures)
    return [str(len(plays)), *shares, *(str(causes[cause]) for cause in CAUSES)]


def _share(found: Sequence[bool]) -> str:
    low, high = wilson(sum(found), len(found))
    return f"{100 * sum(found) / len(found):.1f} [{100 * low:.0f}, {100 * high:.0f}]"
