"""Where houses come from: files of houses, or seeds for the project's own generator."""

import gzip
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vigil.errors import SettingError
from vigil.house import House
from vigil.housegen import generate, spec_for
from vigil.strict_json import read_json

MOST_LINES = 100_000
MIXED = (
    *("kitchen", "2", "3", "4", "2", "bedroom", "3", "2", "4", "5"),
    *("living-room", "2", "3", "4", "2", "bathroom", "3", "2", "4", "6"),
)
"""What `mixed` stands for: a fifth of one room, three tenths of two, a fifth of three and of four, a tenth of more."""
SECRET_SEEDS = range(100_000, 1_000_000)
"""Of houses that are drawn by a seed."""


@dataclass(frozen=True, slots=True)
class Seeded:
    """A house to be generated."""

    seed: int
    spec: str

    @property
    def name(self) -> str:
        """The house's name."""
        return f"{spec_for(self.spec).name}_{self.seed}"

    def house(self) -> House:
        """Returns the house. Raises SettingError where the seed yields none."""
        return generate(self.seed, spec_for(self.spec))


@dataclass(frozen=True, slots=True)
class Filed:
    """A house in a file: alone, or a line of many."""

    path: Path
    line: int | None = None

    @property
    def name(self) -> str:
        """The house's name."""
        return self.path.stem if self.line is None else f"{self.path.name.split('.')[0]}_{self.line}"

    def house(self) -> House:
        """Returns the house. Raises HouseError."""
        if self.line is None:
            return House.load(self.path)
        for number, text in enumerate(_lines(self.path), start=1):
            if number == self.line:
                return House(self.name, _document(self.path, number, text))
        raise SettingError(f"House file {str(self.path)!r} has no line {self.line}.")


Source = Seeded | Filed


def seeded(seeds: str, specs: Iterable[str]) -> list[Source]:
    """Returns houses to generate for seeds `A:B` (B excluded), each seed with each spec in turn.

    Raises SettingError.
    """
    first, _, last = seeds.partition(":")
    if not (first.isdigit() and last.isdigit()) or int(first) >= int(last):
        raise SettingError(f"Seeds {seeds!r}: expected FIRST:END with FIRST < END, e.g. 100:160.")
    return _in_turn(range(int(first), int(last)), specs)


def drawn(seed: int, count: int, specs: Iterable[str]) -> list[Source]:
    """Returns so many houses to generate, whose own seeds only who knows `seed` can tell; more begin with the same.

    Raises SettingError.
    """
    order = np.random.default_rng([len(SECRET_SEEDS), seed]).permutation(len(SECRET_SEEDS))
    return _in_turn([SECRET_SEEDS[int(index)] for index in order[:count]], specs)


def _in_turn(seeds: Iterable[int], specs: Iterable[str]) -> list[Source]:
    wanted = [each for spec in specs for each in (MIXED if spec == "mixed" else (spec,))]
    for spec in wanted:
        spec_for(spec)
    return [Seeded(seed, wanted[index % len(wanted)]) for index, seed in enumerate(seeds)]


def filed(paths: Iterable[Path], limit: int | None = None) -> list[Source]:
    """Returns the houses in files (JSON, or one a line in .jsonl and .jsonl.gz), at most `limit` of each file.

    Raises SettingError.
    """
    found: list[Source] = []
    for path in paths:
        if not path.is_file():
            raise SettingError(f"House file {str(path)!r} does not exist.")
        if path.suffix in (".jsonl", ".gz"):
            most = MOST_LINES if limit is None else limit
            found += [Filed(path, number) for number, _ in zip(range(1, most + 1), _lines(path), strict=False)]
        else:
            found.append(Filed(path))
    names = [source.name for source in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SettingError(f"Several houses have the name {twice[0]!r}; rename the files.")
    return found


def _lines(path: Path) -> Iterator[str]:
    with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as lines:
        yield from lines


def _document(path: Path, number: int, text: str) -> dict:
    try:
        return read_json(text)
    except ValueError as error:
        raise SettingError(f"Line {number} of {str(path)!r} is not JSON: {error}.") from None
