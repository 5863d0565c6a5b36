"""The forms of files that demonstrations are written as."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from vigil.authoring.demonstrations.chat_rows import TRAIN_JSONL, TRAIN_PARQUET, ParquetRowWriter, SftWriter
from vigil.authoring.demonstrations.lerobot import DATA_FILES, LeRobotWriter
from vigil.authoring.demonstrations.play import Example

Format = Literal["sft", "parquet", "lerobot"]


class RowWriter(Protocol):
    """Writes the files of one form."""

    def add(self, examples: Sequence[Example]) -> None:
        """Writes the examples of one episode."""
        ...

    def close(self) -> None:
        """Finishes the files."""
        ...


@dataclass(frozen=True, slots=True)
class OutputFormat:
    """What writes a form, and which of its files hold the rows."""

    rows: Callable[[Path], RowWriter]
    table: str
    has_corrections: bool = True


FORMATS: dict[Format, OutputFormat] = {
    "sft": OutputFormat(SftWriter, TRAIN_JSONL),
    "parquet": OutputFormat(ParquetRowWriter, TRAIN_PARQUET),
    "lerobot": OutputFormat(LeRobotWriter, DATA_FILES, has_corrections=False),
}
