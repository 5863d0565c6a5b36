"""Drafts: a file of proposed episodes that hold, and of those that do not, each with the rule that it breaks.

    {"line": "header", ...}      who proposes, and with which settings
    {"line": "house", ...}       which house of which dataset or file, and its hash
    {"line": "draft", ...}       a valid episode with its solution and the facts that packs are balanced over
    {"line": "closure", ...}     a task of the closure-stress suite: its episodes, solutions and answers
    {"line": "rejected", ...}    what was proposed in vain, and why
    {"line": "done", ...}        a family in a house is finished, with counts

Houses lie beside the file, in the folder `<stem>.houses`. The file is only appended to, by one process at a time;
what follows the last `done` line was interrupted and is cut off when the file is continued.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from vigil.authoring.language.sentences import Forms
from vigil.base.json_lines import AppendFile, parse_line, read_lines
from vigil.base.json_lines import Line as JsonLine
from vigil.base.versions import schema_validator
from vigil.errors import HouseError, SettingError
from vigil.housegen.document import generator_name
from vigil.packs.pack import asset_mismatch
from vigil.packs.private import secret_name
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode, Family
from vigil.protocol.house import House, canonical_json
from vigil.scoring.closure import ClosureAnswer, Kind

DRAFTS_SCHEMA = 1
DRAFTS_VERSION = 4
"""Of what is drafted in a house, and in which words. Raised when a house and a seed yield other drafts than before:
`tests/authoring/streaming` pins some. Drafts files, recipes and streams of another version are refused."""
UNVERSIONED_DRAFTS = 1
"""The version of drafts that name none."""
DIGITS = 6
"""Of a draft's own hash in its id."""


HOUSE_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
MAX_LINES = 100_000
"""Houses in one file."""
Split = Literal["train", "val", "test"]
"""Of ProcTHOR-10K."""


class _Line(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Header(_Line):
    """Who proposes, and with which settings; two parts of one file agree on it."""

    line: Literal["header"] = "header"
    schema_version: Annotated[int, schema_validator(DRAFTS_SCHEMA)] = DRAFTS_SCHEMA
    author: str
    seed: int
    simulator: str
    per_house: int
    tried: int
    starts: int = Field(default=1, ge=1)
    """Drawn for each draft, of which the hardest is kept; written where there are several."""
    forms: Forms = "public"
    """Which half of the sentence forms is spoken."""
    drafts: int = Field(default=UNVERSIONED_DRAFTS, ge=1)
    """The version of what is drafted, and in which words."""
    is_seed_secret: bool = False
    """Whether houses and episodes have names that tell nothing of the seed; written where they have."""
    asset_database_sha256: str | None = None
    """Of AI2-THOR's asset database, by which things have their sizes; written where there is one."""


class HouseOrigin(_Line):
    """Where a house is from that the project did not generate; a pack pins it by this."""

    line: Literal["house"] = "house"
    name: str = Field(pattern=HOUSE_PATTERN)
    """Its name in packs."""
    dataset: str = Field(pattern=r"^[^/\x00]{1,255}$")
    """Of a dataset, or the name of a file."""
    split: Split | None = None
    index: int | None = Field(default=None, ge=0, lt=MAX_LINES)
    """Line of the file, or place in the split, from 0; None for the only house of a file."""
    revision: str | None = Field(default=None, pattern=r"^[0-9a-f]{40}$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    """Of its canonical JSON."""


class DraftFacts(_Line):
    """What a pack is balanced over, besides what the episode itself says."""

    category: str
    """Of the target."""
    rooms: int
    area_m2: float
    distance_m: float
    """From the start to the target's box, in the floor plane."""
    is_seen_by_turning: bool
    """Whether the target can be seen from the start position, looking anywhere."""
    label: Literal["on", "off", "open", "closed"] | None = None
    """State verification only."""


class Draft(_Line):
    """A valid episode that nobody has reviewed yet."""

    line: Literal["draft"] = "draft"
    kind: str
    """Of the grammar's table."""
    episode: Episode
    actions: tuple[Action, ...]
    facts: DraftFacts


class ClosureDraft(_Line):
    """A certified task of the closure-stress suite: one episode, or two twins."""

    line: Literal["closure"] = "closure"
    kind: Kind
    drafts: tuple[Draft, ...] = Field(min_length=1, max_length=2)
    answers: tuple[ClosureAnswer, ...] = Field(min_length=1, max_length=2)
    """Of each draft, in the same order."""


class Rejection(_Line):
    """Something proposed that no pack may hold."""

    line: Literal["rejected"] = "rejected"
    family: Family
    kind: str
    house: str
    rule: str
    message: str
    instruction: str = ""


class FamilyDone(_Line):
    """A family in a house is finished."""

    line: Literal["done"] = "done"
    family: Family
    house: str
    kept: int
    rejected: dict[str, int]
    """Rule -> how many proposals broke it."""
    seconds: float


DraftLine = HouseOrigin | Draft | ClosureDraft | Rejection | FamilyDone
_LINE: TypeAdapter[Header | DraftLine] = TypeAdapter(Annotated[Header | DraftLine, Field(discriminator="line")])


@dataclass(frozen=True, slots=True)
class DraftsContent:
    """All that a drafts file says."""

    header: Header
    drafts: tuple[Draft, ...]
    rejections: tuple[Rejection, ...]
    done: tuple[FamilyDone, ...]
    origins: tuple[HouseOrigin, ...] = ()
    closures: tuple[ClosureDraft, ...] = ()

    @property
    def reasons(self) -> dict[str, dict[str, int]]:
        """Family -> rule -> proposals that broke it."""
        found: dict[str, Counter[str]] = {}
        for rejection in self.rejections:
            found.setdefault(rejection.family, Counter())[rejection.rule] += 1
        return {family: dict(sorted(rules.items())) for family, rules in sorted(found.items())}


class DraftsFile:
    """A drafts file with its folder of houses."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.houses = path.with_name(f"{path.stem}.houses")

    @contextmanager
    def writing(self, header: Header) -> Iterator["DraftsWriter"]:
        """Begins or continues the file, which nobody else can write to meanwhile.

        Raises SettingError when it was begun with other settings, RecordError when it cannot be written.
        """
        if not self.path.parent.is_dir():
            raise SettingError(f"Folder {str(self.path.parent)!r} does not exist. Make it first.")
        with AppendFile(self.path) as file:
            done = self._continue(file, header)
            self.houses.mkdir(exist_ok=True)
            yield DraftsWriter(file, self.houses, frozenset((each.house, each.family) for each in done))

    def read(self) -> DraftsContent:
        """Return what the file says. Raises SettingError naming the line that is wrong."""
        return self._proposed(_finished(self._lines()))

    def check_assets(self, given: str | None) -> None:
        """Raise SettingError when the drafts were made with another asset database than the one of hash `given`."""
        header = self._proposed(self._lines(most=1)).header
        fault = asset_mismatch(f"Drafts file {str(self.path)!r}", header.asset_database_sha256, given)
        if fault is not None:
            raise SettingError(fault)

    def house(self, name: str) -> House:
        """Return a house that lies beside the file. Raises HouseError."""
        path = self.houses / f"{name}.json"
        if not path.exists():
            raise HouseError(f"House {name!r} of drafts file {str(self.path)!r} is missing: {str(path)!r}.")
        return House.load(path)

    def _lines(self, most: int | None = None) -> Sequence[JsonLine]:
        if not self.path.exists():
            raise SettingError(f"Drafts file {str(self.path)!r} does not exist. `vigil pack propose` writes one.")
        return read_lines(self.path, most)

    def _continue(self, file: AppendFile, header: Header) -> tuple[FamilyDone, ...]:
        """Return what is done in the file, which then ends with it."""
        first = _bytes_of(header)
        if first.startswith(b"".join(line.data for line in file.lines.complete) + file.lines.partial_line):
            file.truncate(0)  # nothing, or what a kill left of the first line
            file.append(first)
            return ()
        finished = _finished(file.lines.complete)
        found = self._proposed(finished)
        if found.header != header:
            raise SettingError(
                f"Drafts file {str(self.path)!r} was begun with other settings ({_differences(found.header, header)}). "
                "Use the same ones, or another file."
            )
        file.truncate(finished[-1].end)
        return found.done

    def _proposed(self, lines: Sequence[JsonLine]) -> DraftsContent:
        rows = [
            parse_line(line, _LINE, str(self.path), "Restore the file, or propose anew.", SettingError)
            for line in lines
        ]
        if not rows or not isinstance(rows[0], Header):
            raise SettingError(f"Drafts file {str(self.path)!r} does not begin with a header. Propose anew.")
        return DraftsContent(
            rows[0],
            tuple(row for row in rows if isinstance(row, Draft)),
            tuple(row for row in rows if isinstance(row, Rejection)),
            tuple(row for row in rows if isinstance(row, FamilyDone)),
            tuple(row for row in rows if isinstance(row, HouseOrigin)),
            tuple(row for row in rows if isinstance(row, ClosureDraft)),
        )


@dataclass(frozen=True, slots=True)
class DraftsWriter:
    """A drafts file that is open for writing."""

    file: AppendFile
    houses: Path
    done: frozenset[tuple[str, Family]]
    """Which families were done in which houses when the file was opened."""

    def add(self, house: House | None, lines: Iterable[DraftLine]) -> None:
        """Appends what was proposed in a house; None where there is no house. Raises RecordError."""
        if house is not None:
            house.save(self.houses / f"{house.name}.json")
        self.file.append(*map(_bytes_of, lines))


def draft_id(episode: Episode, category: str, house: House, secret: int | None = None) -> str:
    """Return an id of the paper's form with a suffix of its family and its own hash: the same draft, the same id.

    With a `secret` seed the id tells nothing to who has not that seed.
    """
    dumped = canonical_json(episode.model_dump(mode="json", exclude={"id", "provenance"}))
    if secret is not None:
        return secret_name(secret, "private", dumped)
    digest = hashlib.sha256(dumped).hexdigest()
    return f"{id_stem(episode, category, house)}_{episode.family.lower()}_{digest[:DIGITS]}"


def id_stem(episode: Episode, category: str, house: House) -> str:
    """Return how ids begin: who made the house, what the episode is about, and the house's seed or number.

    Generated houses have a seed; others are numbered by what their name ends in, 0 where that is no number.
    """
    seed = episode.provenance.seed
    number = re.search(r"\d{0,9}$", house.name, re.ASCII)
    which = f"seed{seed:03d}" if seed is not None else f"house{int((number and number[0]) or 0):03d}"
    return f"{generator_name(house)}_{category.lower()}_{which}"


def _bytes_of(line: Header | DraftLine) -> bytes:
    usual = {"starts": 1, "is_seed_secret": False, "asset_database_sha256": None} if isinstance(line, Header) else {}
    exclude = {name for name, value in usual.items() if getattr(line, name) == value}
    return canonical_json(line.model_dump(mode="json", exclude=exclude)) + b"\n"


def _finished(lines: Sequence[JsonLine]) -> Sequence[JsonLine]:
    """Return the lines of finished work: all up to the last `done`, and the header."""
    last = max((index for index, line in enumerate(lines) if b'"line":"done"' in line.data), default=0)
    return lines[: last + 1]


def _differences(old: Header, new: Header) -> str:
    before, now = old.model_dump(), new.model_dump()
    return ", ".join(f"{key} {before[key]!r}, now {now[key]!r}" for key in before if before[key] != now[key])
