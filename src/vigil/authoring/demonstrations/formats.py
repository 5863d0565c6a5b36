"""The formats of files for demonstrations."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from vigil.authoring.demonstrations.chat_rows import TRAIN_JSONL, TRAIN_PARQUET, ParquetRowWriter, SftWriter
from vigil.authoring.demonstrations.lerobot import DATA_FILES, LeRobotWriter
from vigil.authoring.demonstrations.play import Example

Format = Literal["sft", "parquet", "lerobot"]


class RowWriter(Protocol):
    """A writer of the files of one format."""

    def add(self, examples: Sequence[Example]) -> None:
        """Write the examples of one episode."""
        ...

    def close(self) -> None:
        """Finish the files."""
        ...


@dataclass(frozen=True, slots=True)
class OutputFormat:
    """A format of files for demonstrations."""

    rows: Callable[[Path], RowWriter]
    """Function that makes a writer for a folder."""
    table: str
    """Path or pattern of the files with the rows."""
    has_corrections: bool = True
    """Whether the rows include corrections."""


FORMATS: dict[Format, OutputFormat] = {
    "sft": OutputFormat(SftWriter, TRAIN_JSONL),
    "parquet": OutputFormat(ParquetRowWriter, TRAIN_PARQUET),
    "lerobot": OutputFormat(LeRobotWriter, DATA_FILES, has_corrections=False),
}
