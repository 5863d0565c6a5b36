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
        """Complete and close the files."""
        ...


@dataclass(frozen=True, slots=True)
class OutputFormat:
    """A format of files for demonstrations."""

    rows: Callable[[Path], RowWriter]
    """Function that takes a folder and returns a writer of files in this folder."""
    table: str
    """Path of the file with the rows, or a pattern if there are several files."""
    has_corrections: bool = True
    """Whether the rows include corrections (requests with a false report in addition to the correct answer)."""


FORMATS: dict[Format, OutputFormat] = {
    "sft": OutputFormat(SftWriter, TRAIN_JSONL),
    "parquet": OutputFormat(ParquetRowWriter, TRAIN_PARQUET),
    "lerobot": OutputFormat(LeRobotWriter, DATA_FILES, has_corrections=False),
}
