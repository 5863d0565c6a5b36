"""JSON-lines files: one JSON value per line, append-only. All such files are read and written by this module.

A line is complete if it ends with a newline. A last line without a newline is also complete if it is whole JSON,
because a killed process may have failed to write only the newline. Any other bytes after the last complete line are a
partial line: readers skip it, and the writer moves it to a side file. Lines are read one at a time. A line, a file or a
number of lines above the limits below raises an error.
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
"""Maximum length of a line. For comparison, a row with forty replies of maximum length has about 10 MiB."""
MAX_LINES = 1_000_000
MAX_FILE_BYTES = 4096 * MIB
MAX_SIDE_FILES = 10_000
"""Maximum number of side files (with partial lines) of one file."""
_Row = TypeVar("_Row", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Line:
    """One complete line of a file: a line that ends with a newline, or a last line that is whole JSON."""

    number: int
    """Line number, counted from 1."""
    start: int
    """Offset of the line in the file, in bytes."""
    data: bytes
    """Bytes of the line, including its newline if it has one."""

    @property
    def end(self) -> int:
        """Offset of the end of the line in the file, in bytes."""
        return self.start + len(self.data)


@dataclass(frozen=True, slots=True)
class Lines:
    """The content of a file: its complete lines, and the partial line after them, if any."""

    complete: tuple[Line, ...]
    partial_line: bytes
    """Bytes after the last complete line."""


class LineReader:
    """Reader of a file's lines, one at a time. After the last complete line, `partial_line` has the remaining bytes."""

    def __init__(self, file: BinaryIO, place: str, *, number: int = 0, start: int = 0) -> None:
        """`file` is positioned after its first `number` lines (`start` bytes). `place` names the file in messages."""
        self._file = file
        self._place = place
        self._number, self.end = number, start
        """Number of the last complete line that was read, and the offset (bytes) of its end."""
        self.partial_line = b""
        """Bytes after the last complete line."""
        self.lacks_newline = False
        """Whether the last complete line ends without a newline."""

    def __iter__(self) -> Iterator[Line]:
        """Yield each line whose end has been written. Raises RecordError if a limit is exceeded."""
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
                raise RecordError(
                    f"{self._place}: {fault}, the limit for a file of JSON lines. Is it a file of JSON lines?"
                )


def _start_of_unended_line(file: BinaryIO) -> int:
    """Return the offset (bytes) after the last newline of a file."""
    start = file.seek(0, os.SEEK_END)
    while start:
        before = max(0, start - MIB)
        file.seek(before)
        if (at := file.read(start - before).rfind(b"\n")) >= 0:
            return before + at + 1
        start = before
    return 0


def read_lines(path: Path, max_lines: int | None = None) -> tuple[Line, ...]:
    """Return the complete lines of a file, at most `max_lines`; () if the file does not exist. Raises RecordError."""
    if not os.path.lexists(path):
        return ()
    with open_file(path, repr(str(path)), RecordError) as file:
        return tuple(islice(LineReader(file, repr(str(path))), max_lines))


def parse_line(
    line: Line, kind: type[_Row] | TypeAdapter[_Row], file: str, advice: str, error: type[InputError] = RecordError
) -> _Row:
    """Return the row in a line.

    Raises `error` if the row is invalid. The message names the file, line and field, and ends with `advice`.
    """
    validate = kind.validate_json if isinstance(kind, TypeAdapter) else kind.model_validate_json
    try:
        return validate(line.data)
    except ValidationError as fault:
        raise error(f"{file} line {line.number}: {first_error(fault, 'the line')}. {advice}") from None


def dump_line(row: BaseModel, **options: Any) -> bytes:
    """Return a row as one line of JSON with its newline; `options` are those of `model_dump_json`."""
    return row.model_dump_json(**options).encode() + b"\n"


def append_line(path: Path, line: bytes) -> None:
    """Append a line to a file with several writers. On return, the line is on disk. Raises RecordError."""
    with AppendFile(path, waits=True, reads_all=False) as file:
        file.append(line)


def is_being_written(path: Path) -> bool | None:
    """Return whether a process has the file open for appending; None if this cannot be found out.

    The check holds the writer's lock for a moment, so repeat it only when the file has changed.
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
    """A JSON-lines file that is locked, so that only one process at a time writes to it.

    Only its methods `repair_tail`, `append` and `truncate` change the file.
    """

    def __init__(self, path: Path, *, waits: bool = False, makes_folder: bool = False, reads_all: bool = True) -> None:
        """Open or create the file. If another process writes to it, wait if `waits`, otherwise raise RecordError.

        Without `reads_all`, `lines` has at most the last line, so that appending takes the same time however long the
        file is.
        """
        self.path = path
        self._file, self.made_folder = _open_locked(path, waits, makes_folder)
        try:
            with open(self._file.fileno(), "rb", closefd=False) as file:
                start = 0 if reads_all else _start_of_unended_line(file)
                file.seek(start)
                self._reader = LineReader(file, repr(str(path)), start=start)
                self.lines = Lines(tuple(self._reader), self._reader.partial_line)
        except RecordError:
            self._file.close()
            raise
        """Content of the file when it was opened; emptied by `repair_tail`."""
        self.partial_line_file: Path | None = None
        """Side file to which the partial last line was moved; None if there was no partial line."""
        self._is_repaired = False

    def repair_tail(self) -> None:
        """Make the file end with a newline. Move a partial last line to a side file. Raises RecordError."""
        if self._is_repaired:
            return
        try:
            if self.lines.partial_line:
                side = unused_side_path(self.path)
                side.write_bytes(self.lines.partial_line)
                self._file.truncate(self._reader.end)
                self.partial_line_file = side
            elif self._reader.lacks_newline:
                self._write(b"\n")
        except OSError as error:
            raise RecordError(
                f"The partial last line of {str(self.path)!r} cannot be moved to another file: {error.strerror}. "
                "The line is still in the file; fix the cause and give the same command again."
            ) from None
        self._is_repaired, self.lines = True, Lines((), b"")

    def append(self, *lines: bytes) -> int:
        """Append lines, each with its newline, and return the offset (bytes) at which they begin.

        On return all lines are on disk; if RecordError is raised, none is.
        """
        self.repair_tail()
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._write(b"".join(lines))
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(before)
            raise write_error(self.path, error) from error
        return before

    def truncate(self, end: int) -> None:
        """Remove everything after the first `end` bytes of the file; `end` must be the end of a line."""
        self._file.truncate(end)
        self._reader.lacks_newline &= end >= self._reader.end
        complete = tuple(line for line in self.lines.complete if line.end <= end)
        self.lines = Lines(complete, b"")

    def close(self) -> None:
        """Close the file and release its lock."""
        self._file.close()

    def fileno(self) -> int:
        """Return the file descriptor of the open file."""
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
    """Return the error to raise if a file of a run cannot be written."""
    return RecordError(
        f"Cannot write to {str(path)!r}: {error.strerror}. What was written before is kept; fix this and give the "
        "same command again."
    )


def unused_side_path(path: Path) -> Path:
    """Return a path for the side file with a file's partial line; no file has this path yet. Raises RecordError."""
    for number in range(1, MAX_SIDE_FILES):
        side = path.with_name(f"{path.name}.partial-{number}")
        if not side.exists():
            return side
    raise RecordError(
        f"The folder has {MAX_SIDE_FILES - 1:,} files with partial lines of {str(path)!r}; delete these files."
    )


def _is_json(data: bytes) -> bool:
    try:
        read_json(data)
    except ValueError:
        return False
    return True


def _open_locked(path: Path, waits: bool, makes_folder: bool) -> tuple[BinaryIO, bool]:
    """Return the locked file, and whether this call made the file's folder.

    A process that ends without writing a record removes the folder that it made. If another process removes the folder
    while this process waits for the lock, the folder and the file are made again.
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
            continue  # the folder was removed after it was made
        except OSError as error:
            raise _open_error(path, error) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except (BlockingIOError, PermissionError):  # a network file system may report a held lock with either
            file.close()
            raise RecordError(f"{str(path)!r} is being written by another process. Wait for it, or end it.") from None
        except OSError as error:
            file.close()
            raise RecordError(
                f"{str(path)!r} cannot be locked: {error.strerror}. This file system does not support locks, which "
                "keep two processes from writing to one file. Choose a folder on another file system, such as a "
                "local disk."
            ) from None
        if _is_same_file(path, file):
            file.seek(0)
            return file, made_folder
        file.close()


def _open_error(path: Path, error: OSError) -> RecordError:
    return RecordError(f"{str(path)!r} cannot be written: {error.strerror}. Choose another place.")


def _make_folder(folder: Path) -> bool:
    """Make a folder if it does not exist, and return whether it was made. Raises RecordError."""
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
    """Return whether the file at `path` is still the file that was opened as `file`."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False
