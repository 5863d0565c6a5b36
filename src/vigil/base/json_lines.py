"""JSON-lines files: one JSON value a line, only ever appended to. Here is the one reader and the one writer of them.

A line counts when it has its newline, or is whole JSON without one: a process that was killed may have left out the
newline alone. Any other bytes after the last line are torn: readers pass over them, the writer puts them aside.
Lines are read one at a time, and what no file of the project's has (endless lines, lines without end) is refused.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, Self, TypeVar, cast

from pydantic import BaseModel, TypeAdapter, ValidationError

from vigil.base.files import MIB, open_file
from vigil.base.json_files import read_json
from vigil.errors import InputError, RecordError, first_error

MAX_LINE_BYTES = 64 * MIB
"""A row of forty replies of the longest kind has some 10 MiB."""
MAX_LINES = 1_000_000
MAX_FILE_BYTES = 4096 * MIB
MAX_SIDE_FILES = 10_000
"""Of torn lines, beside one file."""
_Row = TypeVar("_Row", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Line:
    """One whole line of a file."""

    number: int
    """From 1."""
    start: int
    """Bytes of the file before it."""
    data: bytes
    """With its newline, if it has one."""

    @property
    def end(self) -> int:
        """Bytes of the file up to its end."""
        return self.start + len(self.data)


@dataclass(frozen=True, slots=True)
class Lines:
    """What a file holds."""

    complete: tuple[Line, ...]
    partial_line: bytes
    """What follows the last whole line."""

    @property
    def end(self) -> int:
        """Bytes of the file up to the end of the last whole line; 0 when there is none."""
        return self.complete[-1].end if self.complete else 0

    @property
    def lacks_newline(self) -> bool:
        """Whether the last whole line lacks its newline."""
        return bool(self.complete) and not self.complete[-1].data.endswith((b"\n", b"\r"))


class LineReader:
    """Reads a file's lines one at a time; after the last, it knows what follows."""

    def __init__(self, file: BinaryIO, place: str, *, number: int = 0, start: int = 0) -> None:
        """`file` stands behind its first `number` lines of `start` bytes; `place` names it in messages."""
        self._file = file
        self._place = place
        self._number, self.end = number, start
        """Bytes of the file up to the end of the last whole line that was read."""
        self.partial_line = b""
        """What follows the last whole line."""
        self.lacks_newline = False
        """Whether the last whole line lacks its newline."""

    def __iter__(self) -> Iterator[Line]:
        """Yield the whole lines. Raises RecordError at a limit."""
        while read := self._file.readline(MAX_LINE_BYTES + 1):
            for raw in read.splitlines(keepends=True):
                self._check(raw)
                lacks_newline = not raw.endswith((b"\n", b"\r"))
                if lacks_newline and not _is_json(raw):
                    self.partial_line = raw
                    return
                self.lacks_newline = lacks_newline
                self._number += 1
                yield Line(self._number, self.end, raw)
                self.end += len(raw)

    def _check(self, raw: bytes) -> None:
        limits = {
            f"line {self._number + 1} has more than {MAX_LINE_BYTES:,} bytes": len(raw) > MAX_LINE_BYTES,
            f"there are more than {MAX_LINES:,} lines in it": self._number >= MAX_LINES,
            f"it has more than {MAX_FILE_BYTES:,} bytes": self.end + len(raw) > MAX_FILE_BYTES,
        }
        for fault, is_so in limits.items():
            if is_so:
                raise RecordError(f"{self._place}: {fault}, the limit for a file of JSON lines. Is it one?")


def _read_all(file: BinaryIO, place: str) -> Lines:
    reader = LineReader(file, place)
    return Lines(tuple(reader), reader.partial_line)


def read_lines(path: Path, max_lines: int | None = None) -> tuple[Line, ...]:
    """Return the whole lines of a file, or the first `max_lines`; none when there is no file. Raises RecordError."""
    if not os.path.lexists(path):
        return ()
    with open_file(path, repr(str(path)), RecordError) as file:
        return tuple(islice(LineReader(file, repr(str(path))), max_lines))


def parse_line(
    line: Line, kind: type[_Row] | TypeAdapter[_Row], file: str, advice: str, error: type[InputError] = RecordError
) -> _Row:
    """Return the row in a line. Raises `error`, which names file, line and field and ends with the `advice`."""
    validate = kind.validate_json if isinstance(kind, TypeAdapter) else kind.model_validate_json
    try:
        return validate(line.data)
    except ValidationError as fault:
        raise error(f"{file} line {line.number}: {first_error(fault, 'the line')}. {advice}") from None


def dump_line(row: BaseModel, **options: Any) -> bytes:
    """Return a row as one line of JSON with its newline; `options` are those of `model_dump_json`."""
    return row.model_dump_json(**options).encode() + b"\n"


def append_line(path: Path, line: bytes) -> None:
    """Add one line to a file that several processes may write to, on disk when this returns. Raises RecordError."""
    with AppendFile(path, waits=True) as file:
        file.append(line)


def is_being_written(path: Path) -> bool | None:
    """Whether a process holds the file open for appending; None where that cannot be known.

    To find out that nobody does takes the writer's lock for an instant: ask again only when something has changed.
    """
    try:
        with open_file(path, repr(str(path)), RecordError) as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (OSError, RecordError):  # no such file, or a file system without locks
        return None
    return False


class AppendFile:
    """A locked file of JSON lines: one process at a time writes to it.

    Only `repair_tail`, `append` and `truncate` change it.
    """

    def __init__(self, path: Path, *, waits: bool = False, makes_folder: bool = False) -> None:
        """Open or create the file. `waits` for another writer instead of raising. Raises RecordError."""
        self.path = path
        self._file, self.made_folder = _open_locked(path, waits, makes_folder)
        try:
            with open(self._file.fileno(), "rb", closefd=False) as file:
                self.lines = _read_all(file, repr(str(path)))
        except RecordError:
            self._file.close()
            raise
        """What the file held when it was opened; forgotten when it is mended."""
        self.partial_line_file: Path | None = None
        """Where the torn last line was put aside."""
        self._is_repaired = False

    def repair_tail(self) -> None:
        """Make the file end with a newline; a torn last line goes to a side file. Raises RecordError."""
        if self._is_repaired:
            return
        try:
            if self.lines.partial_line:
                side = unused_side_path(self.path)
                side.write_bytes(self.lines.partial_line)
                self._file.truncate(self.lines.end)
                self.partial_line_file = side
            elif self.lines.lacks_newline:
                self._write(b"\n")
        except OSError as error:
            raise RecordError(
                f"The torn last line of {str(self.path)!r} cannot be put aside: {error.strerror}. It is still there; "
                "mend this and give the same command again."
            ) from None
        self._is_repaired, self.lines = True, Lines((), b"")

    def append(self, *lines: bytes) -> None:
        """Write lines, each with its newline, on disk when this returns, or none of them. Raises RecordError."""
        self.repair_tail()
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._write(b"".join(lines))
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(before)
            raise write_error(self.path, error) from error

    def truncate(self, end: int) -> None:
        """Drop whatever follows the first `end` bytes of the file, which end a line; the rest is not saved elsewhere."""
        self._file.truncate(end)
        complete = tuple(line for line in self.lines.complete if line.end <= end)
        self.lines = Lines(complete, b"")

    def close(self) -> None:
        """Release the file to other writers."""
        self._file.close()

    def fileno(self) -> int:
        """Return the number of the open file."""
        return self._file.fileno()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        os.fsync(self._file.fileno())


def write_error(path: Path, error: OSError) -> RecordError:
    """Return what is said when a file of a run cannot be written."""
    return RecordError(
        f"Cannot write to {str(path)!r}: {error.strerror}. What was written before is kept; mend this and give the "
        "same command again."
    )


def unused_side_path(path: Path) -> Path:
    """Return a name beside a file for its torn last line, where nothing lies yet. Raises RecordError."""
    for number in range(1, MAX_SIDE_FILES):
        side = path.with_name(f"{path.name}.partial-{number}")
        if not side.exists():
            return side
    raise RecordError(f"{str(path)!r}: ten thousand torn lines lie beside it; clear them away.")


def _is_json(data: bytes) -> bool:
    try:
        read_json(data)
    except ValueError:
        return False
    return True


def _open_locked(path: Path, waits: bool, makes_folder: bool) -> tuple[BinaryIO, bool]:
    """Return the file, locked, and whether its folder was made for it.

    A process that ends without a record removes the folder it made. Should that happen while this one waits for the
    lock, the folder and the file are made again.
    """
    while True:
        made_folder = makes_folder and _make_folder(path.parent)
        if path.exists() and not path.is_file():
            open_file(path, repr(str(path)), RecordError).close()
        try:
            file = cast(BinaryIO, path.open("ab+", buffering=0))
        except FileNotFoundError as error:
            if not makes_folder:
                raise _open_error(path, error) from None
            continue  # taken away since it was made
        except OSError as error:
            raise _open_error(path, error) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except (BlockingIOError, PermissionError):  # how a file system over the network may say the same
            file.close()
            raise RecordError(f"{str(path)!r} is being written by another process. Wait for it, or end it.") from None
        except OSError as error:
            file.close()
            raise RecordError(
                f"{str(path)!r} cannot be locked: {error.strerror}. This file system has no locks, which keep two "
                "processes from writing to one file. Choose a folder on another one, such as a local disk."
            ) from None
        if _is_same_file(path, file):
            file.seek(0)
            return file, made_folder
        file.close()


def _open_error(path: Path, error: OSError) -> RecordError:
    return RecordError(f"{str(path)!r} cannot be written: {error.strerror}. Choose another place.")


def _make_folder(folder: Path) -> bool:
    """Make a folder unless it is there, and return whether it was made. Raises RecordError."""
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


def _is_same_file(path: Path, file: BinaryIO) -> bool:
    """Whether an open file is the one that the path leads to."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False
