"""Record files: the rows of an `episodes.jsonl`, and the one writer of it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from vigil.base.files import open_file
from vigil.base.json_files import read_json
from vigil.base.json_lines import AppendFile, Line, LineReader, dump_line
from vigil.base.versions import schema_mismatch
from vigil.errors import RecordError, first_error
from vigil.records.costs import RunTokens
from vigil.records.record import SCHEMA_VERSION, EpisodeRecord, Key, RowResolver, effective_records
from vigil.records.row_check import REPEATED, UNREADABLE, LeftOutRow, RowCheck


@dataclass(frozen=True, slots=True)
class FileRow:
    """One whole line of a file: a record, or why there is none."""

    line: Line
    found: EpisodeRecord | LeftOutRow


def parse_rows(lines: Iterable[Line]) -> Iterator[FileRow]:
    """Yield what stands in each line, one at a time."""
    for line in lines:
        yield FileRow(line, _read(line))


class RowFilter:
    """Tells, as rows come in, which of them stand; those that are left out are kept with the reason."""

    def __init__(self, check: RowCheck | None) -> None:
        """`check` tells the run's rows from others; without one all are."""
        self._check = check
        self._resolver = RowResolver()
        self.tokens = RunTokens()
        self.left_out: list[LeftOutRow] = []

    def accept(self, row: FileRow) -> EpisodeRecord | None:
        """Take in a row. Returns its record if it stands from now on, in the place of any of its key before it."""
        found = row.found
        if isinstance(found, EpisodeRecord):
            found = self._fault(row.line.number, found) or found
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
    """Return all complete rows of an `episodes.jsonl` in file order, of whichever run; the file is left alone.

    A torn last line is passed over. Raises RecordError on any other unreadable line.
    """
    records: list[EpisodeRecord] = []
    if not path.exists():
        raise missing_file_error(path)
    with open_file(path, repr(str(path)), RecordError) as file:
        for row in parse_rows(LineReader(file, repr(str(path)))):
            if isinstance(row.found, LeftOutRow):
                raise RecordError(f"{str(path)!r} line {row.line.number} {row.found}.")
            records.append(row.found)
    return records


def missing_file_error(path: Path) -> RecordError:
    """Return what is said when there is no record file."""
    return RecordError(f"Record file {str(path)!r} does not exist. Give the folder of a run.")


class RecordLog:
    """The one writer of an `episodes.jsonl`.

    `rows` are those that stand, by key, `tokens` what they and those before them took; `count` is the number of all
    lines in the file; `left_out` are those that do not count (once `check` was told which run this is);
    `made_folder` says that the folder was not there before.
    """

    def __init__(self, path: Path) -> None:
        """Open or creates the file and its folder, cutting a torn last line to a side file. Raises RecordError."""
        self._file = AppendFile(path, makes_folder=True)
        self.made_folder = self._file.made_folder
        self._read = tuple(parse_rows(self._file.lines.complete))
        self.count = len(self._read)
        self._read_rows(None)
        try:
            self._file.repair_tail()
        except RecordError:
            self._file.close()
            raise

    def check(self, check: RowCheck) -> None:
        """Leave out the rows that are not the run's. Once, before anything is appended."""
        self._read_rows(check)
        self._read = ()

    @property
    def partial_line_file(self) -> Path | None:
        """Where a torn last line was put aside."""
        return self._file.partial_line_file

    def append(self, record: EpisodeRecord) -> None:
        """Write one row. Raises RecordError when a row without error already stands for its key."""
        if self.is_done(record.key):
            raise RecordError(f"Episode {record.episode_id!r} (epoch {record.epoch}) already has a row that stands.")
        self._file.append(dump_line(record))
        self.rows[record.key] = record
        self.tokens.add(record.key, record.tokens)
        self.count += 1

    def is_done(self, key: Key) -> bool:
        """Whether a row without error stands for `key`."""
        row = self.rows.get(key)
        return row is not None and row.end != "error"

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def _read_rows(self, check: RowCheck | None) -> None:
        rows = RowFilter(check)
        records = (record for row in self._read if (record := rows.accept(row)) is not None)
        self.rows = effective_records(records)
        self.tokens = rows.tokens
        self.left_out = tuple(rows.left_out)


def _read(line: Line) -> EpisodeRecord | LeftOutRow:
    """Return the record in a line, or why there is none."""
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
    known = fields if isinstance(fields, dict) else {}
    episode_id = str(known.get("episode_id", ""))[:200]
    is_unknown = error.errors()[0]["type"] == "extra_forbidden"
    newer = "; a newer vigil may have written it" if is_unknown else ""
    wrong = LeftOutRow(line.number, UNREADABLE, f"{first_error(error, 'the line')}{newer}", episode_id)
    return _other_schema(line.number, known.get("schema_version", SCHEMA_VERSION), episode_id) or wrong


def _other_schema(number: int, found: object, episode_id: str) -> LeftOutRow | None:
    fault = schema_mismatch(found, SCHEMA_VERSION)
    return None if fault is None else LeftOutRow(number, UNREADABLE, f"it {fault}", episode_id)
