"""Record files: the lines of an `episodes.jsonl`, and the one writer of it."""

import fcntl
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

from pydantic import ValidationError

from vigil.errors import RecordError, first_fault
from vigil.record import SCHEMA_VERSION, EpisodeRecord, Key, dump_line, standing
from vigil.row_check import REPEATED, UNREADABLE, LeftOut, RowCheck, told
from vigil.strict_json import read_json


@dataclass(frozen=True, slots=True)
class Line:
    """One whole line of a file: a record, or why there is none."""

    number: int
    """From 1."""
    end: int
    """Bytes of the file up to its end."""
    row: EpisodeRecord | LeftOut


@dataclass(frozen=True, slots=True)
class Rows:
    """What a run's file holds, checked."""

    standing: dict[Key, EpisodeRecord]
    """The row that counts for each key, sorted by key."""
    left_out: tuple[LeftOut, ...]
    is_torn: bool
    """Whether its last line is cut off."""
    notes: tuple[str, ...]
    """What a reader must know of the rows before any number."""


def scan_lines(data: bytes) -> Iterator[Line]:
    """Yields each line of a file, one at a time; a torn last line is passed over."""
    end = 0
    for number, line in enumerate(data.splitlines(keepends=True), start=1):
        row = _row(number, line)
        if row is None:
            return
        end += len(line)
        yield Line(number, end, row)


def checked(lines: Iterable[Line], check: RowCheck | None) -> Iterator[Line]:
    """Yields the lines; those that `check`, if there is one, does not let pass or that repeat others are left out."""
    stands: set[Key] = set()
    for line in lines:
        row = line.row
        if isinstance(row, EpisodeRecord):
            fault = None if check is None else check.of(line.number, row)
            if fault is None and row.key in stands:
                fault = LeftOut(line.number, REPEATED, f"epoch {row.epoch} of {row.episode_id!r}", row.episode_id)
            if fault is not None:
                line = Line(line.number, line.end, fault)
            elif row.end != "error":
                stands.add(row.key)
        yield line


def read_rows(path: Path, check: RowCheck) -> Rows:
    """Returns what stands in a run's `episodes.jsonl`, which is left alone. Raises RecordError when there is none."""
    data = read_file(path)
    records: list[EpisodeRecord] = []
    left_out: list[LeftOut] = []
    end = 0
    for line in checked(scan_lines(data), check):
        end = line.end
        if isinstance(line.row, LeftOut):
            left_out.append(line.row)
        else:
            records.append(line.row)
    is_torn = bool(data[end:].strip())
    torn = ("The last line of its records is torn and was passed over; the same command plays it again.",)
    notes = (*check.notes, *told(left_out), *(torn if is_torn else ()))
    return Rows(standing(records), tuple(left_out), is_torn, notes)


def read_records(path: Path) -> list[EpisodeRecord]:
    """Returns all complete rows of an `episodes.jsonl` in file order, of whichever run; the file is left alone.

    A torn last line is passed over. Raises RecordError on any other unreadable line.
    """
    records: list[EpisodeRecord] = []
    for line in scan_lines(read_file(path)):
        if isinstance(line.row, LeftOut):
            raise RecordError(f"{str(path)!r} line {line.number} {line.row}.")
        records.append(line.row)
    return records


def read_file(path: Path) -> bytes:
    """Returns the bytes of a run's `episodes.jsonl`. Raises RecordError when there is none."""
    if not path.is_file():
        raise RecordError(f"Record file {str(path)!r} does not exist. Give the folder of a run.")
    return path.read_bytes()


class RecordLog:
    """The one writer of an `episodes.jsonl`: append-only, flushed to disk row by row.

    `rows` are those that stand, by key; `count` is the number of all lines in the file; `left_out` are those that do
    not count (once `check` was told which run this is); `made_folder` says that the folder was not there before.
    """

    def __init__(self, path: Path) -> None:
        """Opens or creates the file and its folder, cutting a torn last line to a side file. Raises RecordError."""
        self.path = path
        self._file, self.made_folder = _locked(path)
        try:
            self.torn = self._repair()
        except OSError as error:
            self._file.close()
            raise RecordError(
                f"The torn last line of {str(path)!r} cannot be put aside: {error.strerror}. It is still there; mend "
                "this and give the same command again."
            ) from None
        except RecordError:
            self._file.close()
            raise

    def check(self, check: RowCheck) -> None:
        """Leaves out the rows that are not the run's."""
        self._take(check)

    def append(self, record: EpisodeRecord) -> None:
        """Writes one row. Raises RecordError when a row without error already stands for its key."""
        earlier = self.rows.get(record.key)
        if earlier is not None and earlier.end != "error":
            raise RecordError(f"Episode {record.episode_id!r} (epoch {record.epoch}) already has a row that stands.")
        self._write(dump_line(record))
        self.rows[record.key] = record
        self.count += 1

    def is_done(self, key: Key) -> bool:
        """Whether a row without error stands for `key`."""
        row = self.rows.get(key)
        return row is not None and row.end != "error"

    def close(self) -> None:
        """Releases the file."""
        self._file.close()

    def _take(self, check: RowCheck | None) -> None:
        found = list(checked(self._lines, check))
        self.rows = standing(line.row for line in found if isinstance(line.row, EpisodeRecord))
        self.left_out = tuple(line.row for line in found if isinstance(line.row, LeftOut))

    def _repair(self) -> Path | None:
        self._file.seek(0)
        data = self._file.read()
        self._lines = tuple(scan_lines(data))
        self.count = len(self._lines)
        self._take(None)
        good = self._lines[-1].end if self._lines else 0
        torn = data[good:]
        if not torn:
            if data and not data.endswith(b"\n"):
                self._write(b"\n")
            return None
        side = free_name(self.path)
        side.write_bytes(torn)
        self._file.truncate(good)
        return side

    def _write(self, line: bytes) -> None:
        self._file.write(line)
        self._file.flush()
        os.fsync(self._file.fileno())


def _row(number: int, line: bytes) -> EpisodeRecord | LeftOut | None:
    """Returns the record in a line, or why there is none; None for a torn line, which has no end."""
    try:
        record = EpisodeRecord.model_validate_json(line)
    except ValidationError as error:
        return _unreadable(number, line, error)
    return _other_schema(number, record.schema_version, record.episode_id) or record


def _unreadable(number: int, line: bytes, error: ValidationError) -> LeftOut | None:
    try:
        fields = read_json(line)
    except ValueError as fault:
        is_torn = not line.endswith((b"\n", b"\r"))
        return None if is_torn else LeftOut(number, UNREADABLE, f"not JSON: {fault}")
    known = fields if isinstance(fields, dict) else {}
    episode_id = str(known.get("episode_id", ""))[:200]
    wrong = LeftOut(number, UNREADABLE, first_fault(error, "the line"), episode_id)
    return _other_schema(number, known.get("schema_version", SCHEMA_VERSION), episode_id) or wrong


def _other_schema(number: int, found: object, episode_id: str) -> LeftOut | None:
    if found == SCHEMA_VERSION:
        return None
    detail = f"record schema {found!r}, expected {SCHEMA_VERSION}: read it with the vigil that wrote it"
    return LeftOut(number, UNREADABLE, detail[:200], episode_id)


def _locked(path: Path) -> tuple[BinaryIO, bool]:
    """Returns the file, locked, and whether its folder was made for it.

    A process that ends without having recorded anything takes its new folder away: a lock that was got on a file that
    is no longer there is worth nothing, and all is begun again.
    """
    while True:
        made_folder = _make_folder(path.parent)
        try:
            file = cast(BinaryIO, path.open("ab+"))
        except FileNotFoundError:
            continue  # taken away since it was made
        except OSError as error:
            raise RecordError(f"{str(path)!r} cannot be written: {error.strerror}. Choose another folder.") from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            raise RecordError(f"{str(path)!r} is being written by another process. Wait for it, or end it.") from None
        if _is_at(path, file):
            return file, made_folder
        file.close()


def _make_folder(folder: Path) -> bool:
    """Makes a folder unless it is there, and returns whether it was made. Raises RecordError."""
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        if folder.is_dir():
            return False
        raise RecordError(f"{str(folder)!r} is a file, not a folder. Choose another place with --log-dir.") from None
    except OSError as error:
        raise RecordError(
            f"Folder {str(folder)!r} cannot be made: {error.strerror}. Choose another place with --log-dir."
        ) from None
    return True


def _is_at(path: Path, file: BinaryIO) -> bool:
    """Whether an open file is the one that the path leads to."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def free_name(path: Path) -> Path:
    """Returns a name beside a file for its torn last line, where nothing lies yet. Raises RecordError."""
    for number in range(1, 10_000):
        side = path.with_name(f"{path.name}.torn-{number}")
        if not side.exists():
            return side
    raise RecordError(f"{str(path)!r}: ten thousand torn lines lie beside it; clear them away.")
