"""Record files: reads the rows of an `episodes.jsonl`. This module also has the only code that writes such a file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from pydantic import ValidationError

from vigil.base.files import open_file
from vigil.base.json_files import is_object, read_json
from vigil.base.json_lines import AppendFile, Line, LineReader, dump_line
from vigil.base.versions import schema_mismatch
from vigil.errors import RecordError, first_error
from vigil.records.costs import RunTokens
from vigil.records.record import SCHEMA_VERSION, EpisodeRecord, Key, RowResolver
from vigil.records.row_check import REPEATED, UNREADABLE, LeftOutRow, RowCheck


class RowFilter:
    """Selects the rows that count, one for each episode and epoch, while rows are read (see `RowResolver`). It also
    collects the rows that are left out, each with the reason."""

    def __init__(self, check: RowCheck | None) -> None:
        """`check` decides which rows belong to the run. If it is None, all rows belong to the run."""
        self._check = check
        self._resolver = RowResolver()
        self.tokens = RunTokens()
        self.left_out: list[LeftOutRow] = []

    def accept(self, number: int, found: EpisodeRecord | LeftOutRow) -> EpisodeRecord | None:
        """Read the row of line `number`, from `parse_row`. Return its record if it now counts for its episode and
        epoch; None if it is left out."""
        if isinstance(found, EpisodeRecord):
            found = self._fault(number, found) or found
        if isinstance(found, LeftOutRow):
            self.left_out.append(found)
            return None
        self.tokens.add(found.key, found.tokens)
        return found

    def _fault(self, number: int, record: EpisodeRecord) -> LeftOutRow | None:
        fault = None if self._check is None else self._check.rejection(number, record)
        if fault is None and not self._resolver.accept(record):
            return LeftOutRow(number, REPEATED, f"epoch {record.epoch} of {record.episode_id!r}", record.episode_id)
        return fault


def read_records(path: Path) -> list[EpisodeRecord]:
    """Return all complete rows of an `episodes.jsonl`, of any runs, in file order. The file is not changed.

    A partial last line is skipped. Raises RecordError on any other unreadable line.
    """
    records: list[EpisodeRecord] = []
    if not path.exists():
        raise missing_file_error(path)
    with open_file(path, repr(str(path)), RecordError) as file:
        for found in map(parse_row, LineReader(file, repr(str(path)))):
            if isinstance(found, LeftOutRow):
                raise RecordError(f"{str(path)!r} line {found.line} {found}.")
            records.append(found)
    return records


def missing_file_error(path: Path) -> RecordError:
    """Return the error for a missing record file."""
    return RecordError(f"Record file {str(path)!r} does not exist. Give the folder of a run.")


@dataclass(frozen=True, slots=True)
class StoredRow:
    """Where the row of a play is in its file."""

    start: int
    """Offset (bytes)."""
    size: int
    """Length (bytes)."""
    is_error: bool


class StoredRecords(Sequence[EpisodeRecord]):
    """The row that counts for each play of a file, sorted by episode and epoch. A record is read when it is needed."""

    def __init__(self, path: Path, rows: Mapping[Key, StoredRow]) -> None:
        self._path, self._rows = path, [rows[key] for key in sorted(rows)]
        self.errors = sum(row.is_error for row in self._rows)
        """Number of plays that ended as `error`."""

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, index: int) -> EpisodeRecord: ...

    @overload
    def __getitem__(self, index: slice) -> list[EpisodeRecord]: ...

    def __getitem__(self, index: int | slice) -> EpisodeRecord | list[EpisodeRecord]:
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        row = self._rows[index]
        with open_file(self._path, repr(str(self._path)), RecordError) as file:
            file.seek(row.start)
            return EpisodeRecord.model_validate_json(file.read(row.size))


class RecordLog:
    """Writer of an `episodes.jsonl`. Nothing else writes to the file.

    `rows` says where the row is that counts for each key. `tokens` has the tokens of all rows, including superseded
    ones. `count` is the number of lines in the file. `left_out` has the rows that are not scored; it is known after
    `check`. `made_folder` says whether the folder did not exist before.
    """

    def __init__(self, path: Path) -> None:
        """Open the file, or create it and its folder. Move a partial last line to another file. Raises RecordError."""
        self._file = AppendFile(path, makes_folder=True)
        self.made_folder = self._file.made_folder
        self._read = tuple((line, parse_row(line)) for line in self._file.lines.complete)
        self.count = len(self._read)
        self._read_rows(None)
        try:
            self._file.repair_tail()
        except RecordError:
            self._file.close()
            raise

    def check(self, check: RowCheck) -> None:
        """Leave out the rows that do not belong to the run. Call this method once, before the first `append`."""
        self._read_rows(check)
        self._read = ()

    @property
    def partial_line_file(self) -> Path | None:
        """Side file to which a partial last line was moved; None if there was no partial line."""
        return self._file.partial_line_file

    def append(self, record: EpisodeRecord) -> None:
        """Append one row. Raises RecordError if its key already has a row without an error."""
        if self.is_done(record.key):
            raise RecordError(f"Episode {record.episode_id!r} (epoch {record.epoch}) already has a row that counts.")
        line = dump_line(record)
        self.rows[record.key] = StoredRow(self._file.append(line), len(line), record.end == "error")
        self.tokens.add(record.key, record.tokens)
        self.count += 1

    def is_done(self, key: Key) -> bool:
        """Return whether `key` has a row without an error."""
        row = self.rows.get(key)
        return row is not None and not row.is_error

    def records(self) -> StoredRecords:
        """Return the rows that count so far."""
        return StoredRecords(self._file.path, self.rows)

    def close(self) -> None:
        """Close the file and release its lock."""
        self._file.close()

    def _read_rows(self, check: RowCheck | None) -> None:
        rows = RowFilter(check)
        self.rows = {
            record.key: StoredRow(line.start, len(line.data), record.end == "error")
            for line, found in self._read
            if (record := rows.accept(line.number, found)) is not None
        }
        self.tokens = rows.tokens
        self.left_out = tuple(rows.left_out)


def parse_row(line: Line) -> EpisodeRecord | LeftOutRow:
    """Return the record in a line, or the reason why the line is not a record."""
    try:
        record = EpisodeRecord.model_validate_json(line.data)
    except ValidationError as error:
        return _unreadable(line, error)
    return _other_schema(line.number, record.schema_version, record.episode_id) or record


def _unreadable(line: Line, error: ValidationError) -> LeftOutRow:
    try:
        fields = read_json(line.data)
    except ValueError as fault:
        return LeftOutRow(line.number, UNREADABLE, f"not JSON: {fault}")
    known: dict[str, Any] = fields if is_object(fields) else {}
    episode_id = str(known.get("episode_id", ""))[:200]
    is_unknown = error.errors()[0]["type"] == "extra_forbidden"
    newer = "; a newer vigil may have written it" if is_unknown else ""
    wrong = LeftOutRow(line.number, UNREADABLE, f"{first_error(error, 'the line')}{newer}", episode_id)
    return _other_schema(line.number, known.get("schema_version", SCHEMA_VERSION), episode_id) or wrong


def _other_schema(number: int, found: object, episode_id: str) -> LeftOutRow | None:
    fault = schema_mismatch(found, SCHEMA_VERSION)
    return None if fault is None else LeftOutRow(number, UNREADABLE, f"it {fault}", episode_id)
