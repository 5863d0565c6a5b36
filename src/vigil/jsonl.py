"""JSON-lines files: one JSON value a line, only ever appended to. Here is the one reader and the one writer of them.

A line counts when it has its newline, or is whole JSON without one: a process that was killed may have left out the
newline alone. Any other bytes after the last line are torn: readers pass over them, the writer puts them aside.
"""

import fcntl
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self, TypeVar, cast

from pydantic import BaseModel, TypeAdapter, ValidationError

from vigil.errors import InputError, RecordError, first_fault
from vigil.strict_json import read_json

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
    """What a file holds, or the part of it that was read."""

    whole: tuple[Line, ...]
    torn: bytes
    """What follows the last whole line."""

    @property
    def end(self) -> int:
        """Bytes of the file up to the end of the last whole line; 0 when there is none."""
        return self.whole[-1].end if self.whole else 0

    @property
    def is_open(self) -> bool:
        """Whether the last whole line lacks its newline."""
        return bool(self.whole) and not self.whole[-1].data.endswith((b"\n", b"\r"))


def split(data: bytes, *, number: int = 0, start: int = 0) -> Lines:
    """Returns the lines of a file, or of what follows its first `number` lines of `start` bytes."""
    lines: list[Line] = []
    for raw in data.splitlines(keepends=True):
        if not raw.endswith((b"\n", b"\r")) and not _is_json(raw):
            return Lines(tuple(lines), raw)
        number += 1
        lines.append(Line(number, start, raw))
        start += len(raw)
    return Lines(tuple(lines), b"")


def read_lines(path: Path) -> tuple[Line, ...]:
    """Returns the whole lines of a file, which is left alone; none when there is no file. Raises RecordError."""
    try:
        return split(path.read_bytes()).whole
    except FileNotFoundError:
        return ()
    except OSError as error:
        raise RecordError(f"{str(path)!r} cannot be read: {error.strerror}.") from None


def parse(
    line: Line, kind: type[_Row] | TypeAdapter[_Row], file: str, advice: str, error: type[InputError] = RecordError
) -> _Row:
    """Returns the row in a line. Raises `error`, which names file, line and field and ends with the `advice`."""
    validate = kind.validate_json if isinstance(kind, TypeAdapter) else kind.model_validate_json
    try:
        return validate(line.data)
    except ValidationError as fault:
        raise error(f"{file} line {line.number}: {first_fault(fault, 'the line')}. {advice}") from None


def dump_line(row: BaseModel, **options: Any) -> bytes:
    """Returns a row as one line of JSON with its newline; `options` are those of `model_dump_json`."""
    return row.model_dump_json(**options).encode() + b"\n"


def append_line(path: Path, line: bytes) -> None:
    """Adds one line to a file that several processes may write to, on disk when this returns. Raises RecordError."""
    with AppendFile(path, waits=True) as file:
        file.append(line)


def is_being_written(path: Path) -> bool | None:
    """Whether a process holds the file open for appending; None where that cannot be known.

    To find out that nobody does takes the writer's lock for an instant: ask again only when something has changed.
    """
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    return False


class AppendFile:
    """A file of JSON lines, locked: one process at a time writes to it. `mend`, `append` and `cut` alone change it."""

    def __init__(self, path: Path, *, waits: bool = False, makes_folder: bool = False) -> None:
        """Opens or creates the file. `waits` for another writer rather than to refuse. Raises RecordError."""
        self.path = path
        self._file, self.made_folder = _locked(path, waits, makes_folder)
        self.lines = split(self._file.read())
        """What the file held when it was opened; forgotten when it is mended."""
        self.torn: Path | None = None
        """Where the torn last line was put aside."""
        self._is_mended = False

    def mend(self) -> None:
        """Makes the file end with a newline; a torn last line goes to a side file. Raises RecordError."""
        if self._is_mended:
            return
        try:
            if self.lines.torn:
                side = free_name(self.path)
                side.write_bytes(self.lines.torn)
                self._file.truncate(self.lines.end)
                self.torn = side
            elif self.lines.is_open:
                self._write(b"\n")
        except OSError as error:
            raise RecordError(
                f"The torn last line of {str(self.path)!r} cannot be put aside: {error.strerror}. It is still there; "
                "mend this and give the same command again."
            ) from None
        self._is_mended, self.lines = True, Lines((), b"")

    def append(self, *lines: bytes) -> None:
        """Writes lines, each with its newline, on disk when this returns, or none of them. Raises RecordError."""
        self.mend()
        before = os.fstat(self._file.fileno()).st_size
        try:
            self._write(b"".join(lines))
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(before)
            raise unwritten(self.path, error) from error

    def cut(self, end: int) -> None:
        """Drops whatever follows the first `end` bytes of the file, which end a line, and does not put it aside."""
        self._file.truncate(end)
        whole = tuple(line for line in self.lines.whole if line.end <= end)
        self.lines = Lines(whole, b"")

    def close(self) -> None:
        """Releases the file to other writers."""
        self._file.close()

    def fileno(self) -> int:
        """Returns the number of the open file."""
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


def unwritten(path: Path, error: OSError) -> RecordError:
    """Returns what is said when a file of a run cannot be written."""
    return RecordError(
        f"Cannot write to {str(path)!r}: {error.strerror}. What was written before is kept; mend this and give the "
        "same command again."
    )


def free_name(path: Path) -> Path:
    """Returns a name beside a file for its torn last line, where nothing lies yet. Raises RecordError."""
    for number in range(1, MAX_SIDE_FILES):
        side = path.with_name(f"{path.name}.torn-{number}")
        if not side.exists():
            return side
    raise RecordError(f"{str(path)!r}: ten thousand torn lines lie beside it; clear them away.")


def _is_json(data: bytes) -> bool:
    try:
        read_json(data)
    except ValueError:
        return False
    return True


def _locked(path: Path, waits: bool, makes_folder: bool) -> tuple[BinaryIO, bool]:
    """Returns the file, locked, and whether its folder was made for it.

    A process that ends without a record removes the folder it made. Should that happen while this one waits for the
    lock, the folder and the file are made again.
    """
    while True:
        made_folder = makes_folder and _make_folder(path.parent)
        if path.is_fifo() or path.is_socket():
            raise RecordError(f"{str(path)!r} is a pipe, not a file: what is in it cannot be read again. Remove it.")
        try:
            file = cast(BinaryIO, path.open("ab+", buffering=0))
        except FileNotFoundError as error:
            if not makes_folder:
                raise _unopened(path, error) from None
            continue  # taken away since it was made
        except OSError as error:
            raise _unopened(path, error) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except OSError:
            file.close()
            raise RecordError(f"{str(path)!r} is being written by another process. Wait for it, or end it.") from None
        if _is_at(path, file):
            file.seek(0)
            return file, made_folder
        file.close()


def _unopened(path: Path, error: OSError) -> RecordError:
    return RecordError(f"{str(path)!r} cannot be written: {error.strerror}. Choose another place.")


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
