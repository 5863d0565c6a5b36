"""The forms of files that demonstrations are written as."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from vigil.authoring.demonstrations.lerobot import DATA_FILES, LeRobotRows
from vigil.authoring.demonstrations.play import Example
from vigil.authoring.demonstrations.rows import TRAIN_JSONL, TRAIN_PARQUET, ParquetRows, SftRows

Format = Literal["sft", "parquet", "lerobot"]


class Rows(Protocol):
    """Writes the files of one form."""

    def add(self, examples: Sequence[Example]) -> None:
        """Writes the examples of one episode."""
        ...

    def close(self) -> None:
        """Finishes the files."""
        ...


@dataclass(frozen=True, slots=True)
class Form:
    """What writes a form, and which of its files hold the rows."""

    rows: Callable[[Path], Rows]
    table: str
    has_corrections: bool = True


FORMS: dict[Format, Form] = {
    "sft": Form(SftRows, TRAIN_JSONL),
    "parquet": Form(ParquetRows, TRAIN_PARQUET),
    "lerobot": Form(LeRobotRows, DATA_FILES, has_corrections=False),
}
