"""Record files: the rows of an `episodes.jsonl`, and the one writer of it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from vigil.base.files import open_file
from vigil.base.json_files import read_json
from vigil.base.json_lines import AppendFile, Line, LineReader, dump_line
from vigil.base.versions import other_schema
from vigil.errors import RecordError, first_fault
from vigil.records.costs import RunTokens
from vigil.records.record import SCHEMA_VERSION, EpisodeRecord, Key, Standing, standing
from vigil.records.row_check import REPEATED, UNREADABLE, LeftOut, RowCheck


@dataclass(frozen=True, slots=True)
class Row:
    """One whole line of a file: a record, or why there is none."""

    line: Line
    found: EpisodeRecord | LeftOut


def rows_of(lines: Iterable[Line]) -> Iterator[Row]:
    """Yields what stands in each line, one at a time."""
    for line in lines:
        yield Row(line, _read(line))


class RowFilter:
    """Tells, as rows come in, which of them stand; those that are left out are kept with the reason."""

    def __init__(self, check: RowCheck | None) -> None:
        """`check` tells the run's rows from others; without one all are."""
        self._check = check
        self._standing = Standing()
        self.tokens = RunTokens()
        self.left_out: list[LeftOut] = []

    def takes(self, row: Row) -> EpisodeRecord | None:
        """Takes in a row. Returns its record if it stands from now on, in the place of any of its key before it."""
        found = row.found
        if isinstance(found, EpisodeRecord):
            found = self._fault(row.line.number, found) or found
        if isinstance(found, LeftOut):
            self.left_out.append(found)
            return None
        self.tokens.add(found.key, found.tokens)
        return found

    def _fault(self, number: int, record: EpisodeRecord) -> LeftOut | None:
        fault = None if self._check is None else self._check.of(number, record)
        if fault is None and not self._standing.takes(record):
            return LeftOut(number, REPEATED, f"epoch {record.epoch} of {record.episode_id!r}", record.episode_id)
        return fault


def read_records(path: Path) -> list[EpisodeRecord]:
    """Returns all complete rows of an `episodes.jsonl` in file order, of whichever run; the file is left alone.

    A torn last line is passed over. Raises RecordError on any other unreadable line.
    """
    records: list[EpisodeRecord] = []
    if not path.exists():
        raise missing(path)
    with open_file(path, repr(str(path)), RecordError) as file:
        for row in rows_of(LineReader(file, repr(str(path)))):
            if isinstance(row.found, LeftOut):
                raise RecordError(f"{str(path)!r} line {row.line.number} {row.found}.")
            records.append(row.found)
    return records


def missing(path: Path) -> RecordError:
    """Returns what is said when there is no record file."""
    return RecordError(f"Record file {str(path)!r} does not exist. Give the folder of a run.")


class RecordLog:
    """The one writer of an `episodes.jsonl`.

    `rows` are those that stand, by key, `tokens` what they and those before them took; `count` is the number of all
    lines in the file; `left_out` are those that do not count (once `check` was told which run this is);
    `made_folder` says that the folder was not there before.
    """

    def __init__(self, path: Path) -> None:
        """Opens or creates the file and its folder, cutting a torn last line to a side file. Raises RecordError."""
        self._file = AppendFile(path, makes_folder=True)
        self.made_folder = self._file.made_folder
        self._read = tuple(rows_of(self._file.lines.whole))
        self.count = len(self._read)
        self._take(None)
        try:
            self._file.mend()
        except RecordError:
            self._file.close()
            raise

    def check(self, check: RowCheck) -> None:
        """Leaves out the rows that are not the run's. Once, before anything is appended."""
        self._take(check)
        self._read = ()

    @property
    def torn(self) -> Path | None:
        """Where a torn last line was put aside."""
        return self._file.torn

    def append(self, record: EpisodeRecord) -> None:
        """Writes one row. Raises RecordError when a row without error already stands for its key."""
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
        """Releases the file."""
        self._file.close()

    def _take(self, check: RowCheck | None) -> None:
        rows = RowFilter(check)
        records = (record for row in self._read if (record := rows.takes(row)) is not None)
        self.rows = standing(records)
        self.tokens = rows.tokens
        self.left_out = tuple(rows.left_out)


def _read(line: Line) -> EpisodeRecord | LeftOut:
    """Returns the record in a line, or why there is none."""
    try:
        record = EpisodeRecord.model_validate_json(line.data)
    except ValidationError as error:
        return _unreadable(line, error)
    return _other_schema(line.number, record.schema_version, record.episode_id) or record


def _unreadable(line: Line, error: ValidationError) -> LeftOut:
    try:
        fields = read_json(line.data)
    except ValueError as fault:
        return LeftOut(line.number, UNREADABLE, f"not JSON: {fault}")
    known = fields if isinstance(fields, dict) else {}
    episode_id = str(known.get("episode_id", ""))[:200]
    is_unknown = error.errors()[0]["type"] == "extra_forbidden"
    newer = "; a newer vigil may have written it" if is_unknown else ""
    wrong = LeftOut(line.number, UNREADABLE, f"{first_fault(error, 'the line')}{newer}", episode_id)
    return _other_schema(line.number, known.get("schema_version", SCHEMA_VERSION), episode_id) or wrong


def _other_schema(number: int, found: object, episode_id: str) -> LeftOut | None:
    fault = other_schema(found, SCHEMA_VERSION)
    return None if fault is None else LeftOut(number, UNREADABLE, f"it {fault}", episode_id)
