"""Drafts file: proposed episodes, both the valid episodes and the rejected proposals with the rule that each breaks.

    {"line": "header", ...}      the author of the proposals and the settings
    {"line": "house", ...}       which house of which dataset or file, and its hash
    {"line": "draft", ...}       a valid episode with its solution and the facts that packs are balanced over
    {"line": "closure", ...}     a task of the closure-stress suite: its episodes, solutions and answers
    {"line": "chores", ...}      a list of chores: its episode, solution and answer
    {"line": "rejected", ...}    a proposal that broke a rule, with the reason
    {"line": "done", ...}        a family in a house is finished, with counts

Houses are stored next to the file, in the folder `<stem>.houses`. One process at a time appends to the file. Lines
after the last `done` line are unfinished work; they are removed when the file is continued.
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
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.families import Family
from vigil.protocol.house import House, canonical_json
from vigil.scoring.chore_answers import ListAnswer
from vigil.scoring.closure import ClosureAnswer, Kind

DRAFTS_SCHEMA = 2
DRAFTS_VERSION = 9
"""Version of the drafts and their wording. It is raised when the same house and seed give other drafts than before;
`tests/authoring/streaming` checks examples. Drafts files, recipes and streams of another version are refused."""
UNVERSIONED_DRAFTS = 1
"""Version of drafts that do not state a version."""
DIGITS = 6
"""Number of hash digits in a draft's id."""

HOUSE_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
MAX_LINES = 100_000
"""Maximum number of houses in one file."""
Split = Literal["train", "val", "test"]
"""Splits of the dataset ProcTHOR-10K."""


class _Line(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Header(_Line):
    """Author of the proposals, and the settings. A file can only be continued with an equal header."""

    line: Literal["header"] = "header"
    schema_version: Annotated[int, schema_validator(DRAFTS_SCHEMA)] = DRAFTS_SCHEMA
    author: str
    seed: int
    simulator: str
    per_house: int
    tried: int
    starts: int = Field(default=1, ge=1)
    """Number of start poses drawn for each draft; the hardest is used. The field is written if the number exceeds 1."""
    forms: Forms = "public"
    """Sentence forms from which instructions are drawn: one of two halves (such as `public`), or all."""
    templates: tuple[str, ...] = Field(default=(), exclude_if=lambda names: not names)
    """Kinds of episodes to draft. A family that has none of these kinds gets all its kinds. Written if not empty."""
    drafts: int = Field(default=UNVERSIONED_DRAFTS, ge=1)
    """Version of the drafts and their wording."""
    is_seed_secret: bool = False
    """Whether names of houses and episodes must not reveal the seed. The field is written if True."""
    asset_database_sha256: str | None = None
    """Hash of AI2-THOR's asset database, from which objects get their sizes; written if the database is used."""


class HouseOrigin(_Line):
    """Source of a house that the project did not generate. A pack identifies the house by its source."""

    line: Literal["house"] = "house"
    name: str = Field(pattern=HOUSE_PATTERN)
    """Name of the house in packs."""
    dataset: str = Field(pattern=r"^[^/\x00]{1,255}$")
    """Name of the dataset, or of the file with the house."""
    split: Split | None = None
    index: int | None = Field(default=None, ge=0, lt=MAX_LINES)
    """Position in the file or in the split, counted from 0; None if the file has only one house."""
    revision: str | None = Field(default=None, pattern=r"^[0-9a-f]{40}$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    """SHA-256 of the house's canonical JSON."""


class DraftFacts(_Line):
    """Facts over which a pack is balanced, in addition to the facts in the episode itself."""

    category: str
    """Category of the target."""
    rooms: int
    area_m2: float
    distance_m: float
    """Distance (m) from the start to the target's box in the floor plane."""
    is_seen_by_turning: bool
    """Whether the target is visible from the start position at some heading and pitch."""
    label: Literal["on", "off", "open", "closed"] | None = None
    """State of the target that a report must have; None in all families except state verification."""


class Draft(_Line):
    """A valid episode that nobody has reviewed yet."""

    line: Literal["draft"] = "draft"
    kind: str
    """Kind of the episode within its family, as in the grammar's table."""
    episode: Episode
    actions: tuple[Action, ...]
    facts: DraftFacts

    @property
    def solution(self) -> Solution:
        """The recorded solution."""
        return Solution(episode_id=self.episode.id, actions=self.actions)

    @property
    def group(self) -> str:
        """The episode's family. Packs take a certain number of drafts of each group."""
        return self.episode.family

    @property
    def drafts(self) -> tuple["Draft", ...]:
        """The draft itself, as a tuple: a task of a family has only one side."""
        return (self,)

    @property
    def answers(self) -> tuple[ClosureAnswer, ...]:
        """An empty tuple: only tasks of a suite have answers."""
        return ()


class ClosureDraft(_Line):
    """A certified task of the closure-stress suite: one episode, or two twins."""

    line: Literal["closure"] = "closure"
    kind: Kind
    drafts: tuple[Draft, ...] = Field(min_length=1, max_length=2)
    answers: tuple[ClosureAnswer, ...] = Field(min_length=1, max_length=2)
    """Answers to the sides, in the same order as `drafts`."""

    @property
    def group(self) -> str:
        """The task's kind. Packs take a certain number of tasks of each group."""
        return self.kind


class ListDraft(_Line):
    """A certified list of chores."""

    line: Literal["chores"] = "chores"
    kind: str
    """Kind of the list; it depends only on the number of chores."""
    drafts: tuple[Draft, ...] = Field(min_length=1, max_length=1)
    answers: tuple[ListAnswer, ...] = Field(min_length=1, max_length=1)

    @property
    def group(self) -> str:
        """The kind of the list. Packs take a certain number of lists of each group."""
        return self.kind


class Rejection(_Line):
    """A proposal that broke a rule and so must not be in a pack."""

    line: Literal["rejected"] = "rejected"
    family: Family
    kind: str
    house: str
    rule: str
    message: str
    instruction: str = ""


class FamilyDone(_Line):
    """Line that says that the work on a family in a house is finished."""

    line: Literal["done"] = "done"
    family: Family
    house: str
    kept: int
    rejected: dict[str, int]
    """Rule -> number of proposals that broke it."""
    seconds: float


TaskDraft = Draft | ClosureDraft | ListDraft
DraftLine = HouseOrigin | TaskDraft | Rejection | FamilyDone
_LINE: TypeAdapter[Header | DraftLine] = TypeAdapter(Annotated[Header | DraftLine, Field(discriminator="line")])


@dataclass(frozen=True, slots=True)
class DraftsContent:
    """Content of a drafts file."""

    header: Header
    tasks: tuple[TaskDraft, ...] = ()
    rejections: tuple[Rejection, ...] = ()
    done: tuple[FamilyDone, ...] = ()
    origins: tuple[HouseOrigin, ...] = ()

    @property
    def drafts(self) -> tuple[Draft, ...]:
        """All sides of all tasks."""
        return tuple(draft for task in self.tasks for draft in task.drafts)

    @property
    def reasons(self) -> dict[str, dict[str, int]]:
        """Family -> rule -> number of proposals that broke the rule, both sorted by name."""
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
        """Open the file for writing, locked against other writers. Begin the file, or remove unfinished work from it.

        Raises SettingError if the file's folder does not exist, or if the file is invalid or was begun with other
        settings. Raises RecordError if the file cannot be written.
        """
        if not self.path.parent.is_dir():
            raise SettingError(f"Folder {str(self.path.parent)!r} does not exist. Create it first.")
        with AppendFile(self.path) as file:
            content = self._continue(file, header)
            self.houses.mkdir(exist_ok=True)
            yield DraftsWriter(file, self.houses, content)

    def read(self) -> DraftsContent:
        """Return the content up to the last finished family. Raises SettingError if the file is missing or invalid."""
        return self._proposed(_finished(self._lines()))

    def check_assets(self, given: str | None) -> None:
        """Raise SettingError unless the drafts were made with the asset database of this hash (None: no database)."""
        header = self._proposed(self._lines(most=1)).header
        fault = asset_mismatch(f"Drafts file {str(self.path)!r}", header.asset_database_sha256, given)
        if fault is not None:
            raise SettingError(fault)

    def house(self, name: str) -> House:
        """Return the house `name` that is stored next to the file. Raises HouseError if it is missing or invalid."""
        path = self.houses / f"{name}.json"
        if not path.exists():
            raise HouseError(f"House {name!r} of drafts file {str(self.path)!r} is missing: {str(path)!r}.")
        return House.load(path)

    def has_house(self, name: str) -> bool:
        """Return whether a house called `name` is stored next to the file."""
        return (self.houses / f"{name}.json").is_file()

    def _lines(self, most: int | None = None) -> Sequence[JsonLine]:
        if not self.path.exists():
            raise SettingError(f"Drafts file {str(self.path)!r} does not exist. `vigil pack propose` writes one.")
        return read_lines(self.path, most)

    def _continue(self, file: AppendFile, header: Header) -> DraftsContent:
        """Remove unfinished work, or write the header if the file is empty. Return the finished content."""
        first = _bytes_of(header)
        if first.startswith(b"".join(line.data for line in file.lines.complete) + file.lines.partial_line):
            file.truncate(0)  # empty, or an interrupted first line
            file.append(first)
            return DraftsContent(header)
        finished = _finished(file.lines.complete)
        found = self._proposed(finished)
        if found.header != header:
            raise SettingError(
                f"Drafts file {str(self.path)!r} was begun with other settings "
                f"({_differences(found.header, header)}). Use the same settings, or another file."
            )
        file.truncate(finished[-1].end)
        return found

    def _proposed(self, lines: Sequence[JsonLine]) -> DraftsContent:
        rows = [
            parse_line(line, _LINE, str(self.path), "Restore the file, or propose again.", SettingError)
            for line in lines
        ]
        if not rows or not isinstance(rows[0], Header):
            raise SettingError(
                f"Drafts file {str(self.path)!r} does not begin with a header. Make the file again with `vigil "
                "pack propose`."
            )
        return DraftsContent(
            rows[0],
            tuple(row for row in rows if isinstance(row, TaskDraft)),
            tuple(row for row in rows if isinstance(row, Rejection)),
            tuple(row for row in rows if isinstance(row, FamilyDone)),
            tuple(row for row in rows if isinstance(row, HouseOrigin)),
        )


def house_in(files: Sequence[DraftsFile], name: str) -> House:
    """Return the house called `name` from the first drafts file that has it. Raises HouseError if no file has it."""
    return next((file for file in files if file.has_house(name)), files[0]).house(name)


@dataclass(frozen=True, slots=True)
class DraftsWriter:
    """A drafts file that is open for writing."""

    file: AppendFile
    houses: Path
    begun: DraftsContent
    """Finished content of the file at the time when it was opened."""

    @property
    def done(self) -> frozenset[tuple[str, Family]]:
        """Pairs of house and family that were already finished when the file was opened."""
        return frozenset((each.house, each.family) for each in self.begun.done)

    def add(self, house: House | None, lines: Iterable[DraftLine]) -> None:
        """Append the lines about a house, and store the house (None if it cannot be made). Raises RecordError."""
        if house is not None:
            house.save(self.houses / f"{house.name}.json")
        self.file.append(*map(_bytes_of, lines))


def draft_id(episode: Episode, category: str, house: House, secret: int | None = None) -> str:
    """Return an id: the paper's form of id, then the family and a hash, so that equal drafts have equal ids.

    If a `secret` seed is given, the id reveals nothing to readers who do not know the seed.
    """
    dumped = canonical_json(episode.model_dump(mode="json", exclude={"id", "provenance"}))
    if secret is not None:
        return secret_name(secret, "private", dumped)
    digest = hashlib.sha256(dumped).hexdigest()
    return f"{id_stem(episode, category, house)}_{episode.family.lower()}_{digest[:DIGITS]}"


def id_stem(episode: Episode, category: str, house: House) -> str:
    """Return the beginning of ids: the house's generator, the target's category, and the house's seed.

    If the seed is unknown, the number at the end of the house's name is used instead; without a number, 0.
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
    """Return the lines up to the last `done` line; if there is none, only the first line."""
    last = max((index for index, line in enumerate(lines) if b'"line":"done"' in line.data), default=0)
    return lines[: last + 1]


def _differences(old: Header, new: Header) -> str:
    before, now = old.model_dump(), new.model_dump()
    return ", ".join(
        f"{key} {before.get(key)!r}, now {now.get(key)!r}" for key in before | now if before.get(key) != now.get(key)
    )
