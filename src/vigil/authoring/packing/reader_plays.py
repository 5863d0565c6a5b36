"""Plays of a pack by readers (people, or models that see its pictures), with results and the causes of failures.

They are stored in the pack's folder in `plays.json`. This file is not part of the pack's hash, because a pack is played
after it was frozen.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from vigil.authoring.cards import rate_words, table_lines
from vigil.authoring.packing.sidecar_files import SidecarFile
from vigil.base.versions import schema_validator
from vigil.packs.pack import Pack
from vigil.protocol.actions import Status
from vigil.scoring.levels import LEVELS
from vigil.scoring.rates import wilson

PLAYS = "plays.json"
PLAYS_SCHEMA = 1
Cause = Literal["agent", "picture", "wording", "world"]
"""Cause of a failure: the reader (agent), the picture, the wording of the instruction, or the simulated world."""
CAUSES: tuple[Cause, ...] = get_args(Cause)


class ReaderPlay(BaseModel):
    """One play of an episode by a reader."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    episode_id: str
    reader: str
    """Name of the reader, the same in all plays of this reader."""
    group: str
    """Level of difficulty of the episode; in a pack of closure stress, its kind."""
    steps: int = Field(ge=0)
    status: Status | None
    """Reported status; None if the reader did not report."""
    W: bool
    B: bool
    C: bool | None = None
    """Whether the closure is correct; None outside packs of closure stress."""
    label: str
    cause: Cause | None = None
    """Cause of the failure; None for a success."""
    reason: str = ""
    """Remark on the cause, by the person who determined it."""

    @property
    def is_right(self) -> bool:
        """Whether the play is a success: C in packs of closure stress, B in other packs."""
        return self.B if self.C is None else self.C

    @model_validator(mode="after")
    def _failures_have_causes(self) -> "ReaderPlay":
        if self.is_right == (self.cause is not None):
            raise ValueError("a play that failed needs a cause, and a play that succeeded must not have one")
        return self


class ReaderPlays(SidecarFile):
    """All plays of one pack by readers."""

    schema_version: Annotated[int, schema_validator(PLAYS_SCHEMA)] = PLAYS_SCHEMA
    drawn: str
    """Sentence that says how the episodes were drawn."""
    plays: tuple[ReaderPlay, ...] = Field(min_length=1)


def read_plays(pack: Pack) -> ReaderPlays | None:
    """Return the plays of exactly this pack; None if there are none. Raises PackMismatch if the file is invalid."""
    return ReaderPlays.read(pack, PLAYS, "Write it again, or remove it.")


def plays_table(found: ReaderPlays) -> list[str]:
    """Return the lines of a Markdown table: rates (%) and causes of failures, overall and by group."""
    groups: dict[str, list[ReaderPlay]] = defaultdict(list)
    for play in found.plays:
        groups[play.group].append(play)
    measures = ["W", "B"] if found.plays[0].C is None else ["C"]
    heads = ["", "plays", *(f"{measure} [95 %]" for measure in measures), *CAUSES]
    rows = [("all", found.plays), *((name, groups[name]) for name in sorted(groups, key=_order_key))]
    return table_lines(heads, ([name, *_cells(plays, measures)] for name, plays in rows))


def _order_key(group: str) -> tuple[int, str]:
    return (list(LEVELS).index(group) if group in LEVELS else 0), group


def _cells(plays: Sequence[ReaderPlay], measures: Iterable[str]) -> list[str]:
    causes = Counter(play.cause for play in plays)
    hits = (sum(bool(getattr(play, measure)) for play in plays) for measure in measures)
    shares = (rate_words(count / len(plays), wilson(count, len(plays))) for count in hits)
    return [str(len(plays)), *shares, *(str(causes[cause]) for cause in CAUSES)]
