"""Sources of houses: files of houses, ProcTHOR-10K, or seeds for the project's own generator."""

import gzip
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, islice
from pathlib import Path
from typing import TypeVar

import numpy as np
from pydantic import ValidationError

from vigil.authoring.drafting.drafts import MAX_LINES, HouseOrigin
from vigil.authoring.drafting.procthor import DATASET, REVISION, SPLITS, is_dataset, named, split_file
from vigil.base.files import MIB, open_file
from vigil.base.json_files import read_json
from vigil.errors import HouseError, SettingError, did_you_mean, first_error
from vigil.housegen.base.spec import spec_for
from vigil.housegen.document import with_seed_removed
from vigil.housegen.generate import generate
from vigil.packs.private import is_secret, secret_name, secret_subseed
from vigil.protocol.house import MAX_HOUSE_BYTES, House

MAX_LINES_BYTES = 16 * 1024 * MIB
"""Maximum size (bytes) of a file of houses, after decompression."""
MIXED = (
    *("kitchen", "2", "3", "4", "2", "bedroom", "3", "2", "4", "5"),
    *("living-room", "2", "3", "4", "2", "bathroom", "3", "2", "4", "6"),
)
"""Specs (kinds of houses) that `mixed` stands for: 20 % one room, 30 % two, 20 % three, 20 % four, 10 % more."""
DRAWN_SEEDS = range(100_000, 1_000_000)
"""Seeds of houses; a public seed draws some of them. They are so few that anyone can try all of them."""
_T = TypeVar("_T")
OnDownload = Callable[[str], None]
"""Function that is called with a line that announces a download."""


@dataclass(frozen=True, slots=True)
class GeneratedHouse:
    """A house to be made by the project's generator."""

    seed: int
    spec: str
    given_name: str = ""
    """Name of the house if its seed must stay secret; otherwise empty."""

    @property
    def name(self) -> str:
        """Name of the house in packs."""
        return self.given_name or f"{spec_for(self.spec).name}_{self.seed}"

    def house(self) -> House:
        """Return the house. Raises SettingError if the generator cannot make a house from the seed."""
        house = generate(self.seed, spec_for(self.spec))
        return with_seed_removed(house, self.given_name) if self.given_name else house

    def origin(self, house: House) -> None:
        """Return None: the house itself states its generator, and its seed unless the seed is secret."""


@dataclass(frozen=True, slots=True)
class HouseInFile:
    """A house in a file. It is the only house in the file, or one line of the file."""

    path: Path
    line: int | None = None
    """Number of the line, counted from 1; None if the file has only one house."""
    given_name: str = ""
    """Name of the house; empty if the name follows from the file's name."""
    dataset: str = ""
    """Name of the dataset; empty if the file's name stands for it."""
    split: str | None = None
    revision: str | None = None

    @property
    def name(self) -> str:
        """Name of the house in packs."""
        return self.given_name or (
            self.path.stem if self.line is None else f"{self.path.name.split('.')[0]}_{self.line}"
        )

    def house(self) -> House:
        """Return the house. Raises HouseError if it cannot be read."""
        if self.line is None:
            return House(self.name, House.load(self.path).data)
        for text in islice(lines_of(self.path), self.line - 1, self.line):
            return self.parse_line(text)
        raise HouseError(f"House {self.name!r}: {str(self.path)!r} has no line {self.line}.")

    def parse_line(self, text: bytes) -> House:
        """Return the house in `text`, which is the house's line of the file. Raises HouseError if it is not JSON."""
        try:
            return House(self.name, read_json(text))
        except ValueError as error:
            place = f"line {self.line} of {str(self.path)!r}"
            raise HouseError(f"House {self.name!r}: {place} is not JSON: {error}.") from None

    def origin(self, house: House) -> HouseOrigin:
        """Return the house's source as packs record it. Raises HouseError if the name is not allowed in packs."""
        fields = {
            "name": self.name,
            "dataset": self.dataset or self.path.name,
            "split": self.split,
            "index": None if self.line is None else self.line - 1,
            "revision": self.revision,
            "sha256": house.sha256,
        }
        try:
            return HouseOrigin.model_validate(fields)
        except ValidationError as error:
            raise HouseError(
                f"House {self.name!r} of {str(self.path)!r}: {first_error(error)}. Rename the house."
            ) from None


HouseSource = GeneratedHouse | HouseInFile


def houses_from_seeds(seeds: str, specs: Iterable[str], secret: int | None = None) -> list[HouseSource]:
    """Return houses to generate for the seeds `A:B` (B excluded). The houses get the specs in turn.

    With a `secret` seed, A to B are numbers of houses, which cannot be generated without the secret seed. Raises
    SettingError if the range or a spec is invalid.
    """
    found = re.fullmatch(r"(\d{1,18}):(\d{1,18})", seeds, re.ASCII)
    first, last = (int(found[1]), int(found[2])) if found else (0, 0)
    if first >= last:
        raise SettingError(f"Seeds {seeds!r}: expected FIRST:END with FIRST < END, e.g. 100:160.")
    if last - first > MAX_LINES:
        raise SettingError(
            f"Seeds {seeds!r} are for more than {MAX_LINES:,} houses. Use several commands, each with a part of "
            "the seeds and another output file."
        )
    return _houses_by_turns(range(first, last), specs, secret)


def houses_drawn_from(seed: int, count: int, specs: Iterable[str]) -> list[HouseSource]:
    """Return `count` houses to generate, drawn at random by `seed`. A larger count begins with the same houses.

    If `seed` is secret, the houses cannot be generated without it. Raises SettingError if a spec is invalid.
    """
    if is_secret(seed):
        return _houses_by_turns(range(count), specs, seed)
    return _houses_by_turns(draw_sample(DRAWN_SEEDS, seed, count), specs)


def draw_sample(choice: Sequence[_T], seed: int, count: int | None) -> list[_T]:
    """Return `count` of the items, drawn at random by `seed`; if `count` is None, all items in their order.

    A larger count begins with the same items.
    """
    if count is None:
        return list(choice)
    order = np.random.default_rng([len(choice), seed]).permutation(len(choice))
    return [choice[int(index)] for index in order[:count]]


def secret_house(secret: int, number: int, spec: str) -> GeneratedHouse:
    """Return a house that cannot be generated without the secret seed. Its name does not reveal the seed."""
    which = f"{number} {spec}".encode()
    return GeneratedHouse(secret_subseed(secret, "house", which), spec, secret_name(secret, "house", which))


def _houses_by_turns(seeds: Iterable[int], specs: Iterable[str], secret: int | None = None) -> list[HouseSource]:
    wanted = [each for spec in specs for each in (MIXED if spec == "mixed" else (spec,))]
    for spec in wanted:
        spec_for(spec)
    in_turn = [(seed, wanted[index % len(wanted)]) for index, seed in enumerate(seeds)]
    return [
        GeneratedHouse(seed, spec) if secret is None else secret_house(secret, seed, spec) for seed, spec in in_turn
    ]


def houses_from(
    places: Iterable[str], limit: int | None = None, report: OnDownload = lambda line: None
) -> list[HouseInFile]:
    """Return the houses at these places, at most `limit` at each place.

    A place is a file (JSON, or one house per line in .jsonl and .jsonl.gz), or a text that refers to houses of
    ProcTHOR-10K. `report` gets a line that announces a download. Raises SettingError if a place is invalid or two
    houses have the same name.
    """
    found: list[HouseInFile] = []
    for place in places:
        found += islice(dataset_houses(*named(place), report) if is_dataset(place) else _of_file(place), limit)
    twice = next((name for name, count in Counter(source.name for source in found).items() if count > 1), None)
    if twice is not None:
        raise SettingError(f"Several houses have the name {twice!r}; rename the files, or name each house once.")
    return found


def house_at(place: str, report: OnDownload) -> House:
    """Return the one house at a place: a JSON file, or a text that refers to a house of ProcTHOR-10K.

    Raises HouseError if the house cannot be read, SettingError if the place is invalid or refers to several houses.
    """
    if not is_dataset(place):
        return House.load(Path(place))
    count = len(named(place).indices)
    if count > 1:
        raise SettingError(f"{place!r} names {count} houses; name one, e.g. {DATASET}:{named(place).split}:0.")
    (source,) = houses_from([place], report=report)
    return source.house()


def read_all(sources: Iterable[HouseInFile]) -> Iterator[tuple[HouseInFile, House | HouseError]]:
    """Yield each house, or the error from reading it. A file with several houses is read once, line by line."""
    for path, group in groupby(sources, key=lambda source: source.path):
        left = {source.line: source for source in group}
        if None in left:
            yield left[None], _tried(left[None].house)
            continue
        fault = "there are fewer lines in it"
        try:
            for number, text in enumerate(lines_of(path), start=1):
                source = left.pop(number, None)
                if source is not None:
                    yield source, _tried(partial(source.parse_line, text))
                if not left:
                    break
        except HouseError as error:
            fault = str(error)
        for source in left.values():
            yield source, HouseError(f"House {source.name!r}, line {source.line} of {str(path)!r}: {fault}.")


def _tried(make: Callable[[], House]) -> House | HouseError:
    try:
        return make()
    except HouseError as error:
        return error


def lines_of(path: Path) -> Iterator[bytes]:
    """Yield the lines of a file, compressed or not. Raises HouseError if the file is unreadable or over the limits."""
    what = f"House file {str(path)!r}"
    total = 0
    with open_file(path, what, HouseError) as file:
        lines = gzip.GzipFile(fileobj=file) if path.suffix == ".gz" else file
        for number in range(1, MAX_LINES + 2):
            try:
                line = lines.readline(MAX_HOUSE_BYTES + 1)
            except (OSError, EOFError, zlib.error) as error:
                raise HouseError(f"{what} cannot be read: {error}.") from None
            if not line:
                return
            total += len(line)
            limits = {
                f"line {number} is over {MAX_HOUSE_BYTES // MIB} MiB": len(line) > MAX_HOUSE_BYTES,
                f"it has more than {MAX_LINES:,} lines": number > MAX_LINES,
                f"it is over {MAX_LINES_BYTES // MIB // 1024} GiB": total > MAX_LINES_BYTES,
            }
            for fault in (fault for fault, is_so in limits.items() if is_so):
                raise HouseError(
                    f"{what}: {fault}, the limit for a file with one house per line. Does the file have one house "
                    "per line?"
                )
            yield line


def dataset_houses(
    split: str, indices: Sequence[int], report: OnDownload, revision: str = REVISION
) -> list[HouseInFile]:
    """Return houses of a split of ProcTHOR-10K, without reading them.

    Raises SettingError if an index is too large or the dataset cannot be downloaded.
    """
    path = split_file(split, report, revision)
    for index in indices:
        if index >= SPLITS[split]:
            raise SettingError(f"{DATASET}: split {split!r} has houses 0 to {SPLITS[split] - 1}, not {index}.")
    return [HouseInFile(path, index + 1, f"{DATASET}_{split}_{index}", DATASET, split, revision) for index in indices]


def _of_file(place: str) -> Iterator[HouseInFile]:
    path = Path(place)
    if not path.is_file():
        hint = did_you_mean(place.partition(":")[0], [DATASET])
        raise SettingError(f"House file {place!r} does not exist.{hint}")
    if path.suffix not in (".jsonl", ".gz"):
        yield HouseInFile(path)
        return
    for number, _ in enumerate(lines_of(path), start=1):
        yield HouseInFile(path, number)
