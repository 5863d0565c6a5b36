"""JSON-lines files: what counts as a line, who may write, and what a kill or a full disk costs."""

import errno
import fcntl
import io
import os
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, Field, TypeAdapter

from vigil.base import json_lines as jsonl
from vigil.base.json_lines import (
    AppendFile,
    Line,
    LineReader,
    append_line,
    dump_line,
    is_being_written,
    parse_line,
    read_lines,
)
from vigil.errors import RecordError, SettingError


class Row(BaseModel):
    kind: Literal["row"] = "row"
    n: int


class Other(BaseModel):
    kind: Literal["other"]


def lines(*numbers: int) -> bytes:
    return b"".join(dump_line(Row(n=number)) for number in numbers)


def read_bytes(data: bytes, **begun: int) -> tuple[LineReader, list[Line]]:
    reader = LineReader(io.BytesIO(data), "it", **begun)
    return reader, list(reader)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "rows.jsonl"


@given(cut=st.integers(min_value=0))
def test_a_file_cut_at_any_byte_has_all_lines_but_the_one_it_was_cut_in(cut: int):
    whole = lines(1, 22, 333)
    cut %= len(whole) + 1
    found, read = read_bytes(whole[:cut])
    ends = [len(lines(1)), len(lines(1, 22)), len(whole)]
    assert [line.number for line in read] == [n for n, end in enumerate(ends, 1) if cut >= end - 1]
    assert b"".join(line.data for line in read) + found.partial_line == whole[:cut]
    assert found.end + len(found.partial_line) == cut
    assert found.lacks_newline == (cut in {end - 1 for end in ends})


def test_lines_read_on_have_the_places_of_the_whole_file():
    data = lines(1, 22, 333)
    first, *rest = read_bytes(data)[1]
    assert read_bytes(data[first.end :], number=1, start=first.end)[1] == rest
    assert [data[line.start : line.end] for line in (first, *rest)] == data.splitlines(keepends=True)


def test_an_empty_line_is_a_line():
    assert [line.data for line in read_bytes(b"{}\n\n{}\n")[1]] == [b"{}\n", b"\n", b"{}\n"]


def test_no_file_has_no_lines_and_a_folder_is_refused(path: Path):
    assert read_lines(path) == ()
    path.mkdir()
    with pytest.raises(RecordError, match=r"rows\.jsonl' is a folder, not a file"):
        read_lines(path)


def test_what_is_wrong_is_said_by_file_line_and_field(path: Path):
    path.write_bytes(lines(1) + b'{"n": "many"}\n')
    one, two = read_lines(path)
    assert parse_line(one, Row, "rows", "Mend it.") == Row(n=1)
    with pytest.raises(RecordError, match=r"^rows line 2: n: Input should be a valid integer.*\. Mend it\.$"):
        parse_line(two, Row, "rows", "Mend it.")
    either = TypeAdapter(Annotated[Row | Other, Field(discriminator="kind")])
    with pytest.raises(SettingError, match=r"^rows line 2: the line: Unable to extract tag"):
        parse_line(two, either, "rows", "Mend it.", SettingError)


@pytest.mark.parametrize(("cut", "torn"), [(0, b""), (1, b""), (2, dump_line(Row(n=2))[:-2])])
def test_a_line_is_added_after_whatever_a_kill_left(path: Path, cut: int, torn: bytes):
    path.write_bytes(lines(1, 2)[: len(lines(1, 2)) - cut])
    append_line(path, lines(3))
    assert path.read_bytes() == (lines(1, 3) if torn else lines(1, 2, 3))
    assert [side.read_bytes() for side in path.parent.glob("*.partial-*")] == ([torn] if torn else [])


def test_nothing_is_changed_before_something_is_written(path: Path):
    path.write_bytes(b"notes of mine")
    with AppendFile(path) as file:
        assert file.lines.partial_line == b"notes of mine"
    assert path.read_bytes() == b"notes of mine"
    assert list(path.parent.iterdir()) == [path]


def test_one_writer_refuses_another_or_waits_for_it(path: Path, monkeypatch: pytest.MonkeyPatch):
    first = AppendFile(path)
    with pytest.raises(RecordError, match="is being written by another process"):
        AppendFile(path)
    really = fcntl.flock
    asked: list[int] = []

    def lock(file: object, how: int) -> None:
        asked.append(how)
        first.close()  # as the other process does, sooner or later
        really(file, how)  # type: ignore[arg-type]

    monkeypatch.setattr(jsonl.fcntl, "flock", lock)
    append_line(path, lines(1))
    assert asked == [fcntl.LOCK_EX]
    assert path.read_bytes() == lines(1)


def test_a_full_disk_leaves_no_half_line(path: Path, monkeypatch: pytest.MonkeyPatch):
    with AppendFile(path) as file:
        file.append(lines(1))
        really = file._write

        def fill(data: bytes) -> None:
            really(data[:5])
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(file, "_write", fill)
        with pytest.raises(RecordError, match=r"Cannot write to .*No space left on device.*same command again"):
            file.append(lines(2))
        monkeypatch.setattr(file, "_write", really)
        file.append(lines(3))
    assert path.read_bytes() == lines(1, 3)


def test_what_is_cut_is_not_put_aside(path: Path):
    path.write_bytes(lines(1, 2) + b'{"torn')
    with AppendFile(path) as file:
        file.truncate(len(lines(1)))
        assert [line.number for line in file.lines.complete] == [1]
        file.append(lines(3))
    assert path.read_bytes() == lines(1, 3)
    assert list(path.parent.iterdir()) == [path]


def test_a_folder_is_made_only_when_that_is_wanted(tmp_path: Path):
    with pytest.raises(RecordError, match=r"cannot be written: No such file or directory\. Choose another place"):
        AppendFile(tmp_path / "new" / "rows.jsonl")
    AppendFile(tmp_path / "new" / "rows.jsonl", makes_folder=True).close()
    assert (tmp_path / "new" / "rows.jsonl").is_file()


def test_who_reads_can_tell_whether_somebody_writes(path: Path):
    assert is_being_written(path) is None
    with AppendFile(path) as file:
        assert is_being_written(path) is True
        file.append(lines(1))  # to have asked is no hindrance
        assert is_being_written(path) is True
    assert is_being_written(path) is False
    with AppendFile(path) as file:
        file.append(lines(2))


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        ({"MAX_LINE_BYTES": 12}, "line 3 has more than 12 bytes"),
        ({"MAX_LINES": 2}, "there are more than 2 lines in it"),
        ({"MAX_FILE_BYTES": 30}, "it has more than 30 bytes"),
    ],
)
def test_endless_files_are_refused(path: Path, monkeypatch: pytest.MonkeyPatch, limit: dict[str, int], said: str):
    for name, value in limit.items():
        monkeypatch.setattr(jsonl, name, value)
    path.write_bytes(b'{"n": 1}\n{"n": 2}\n{"n": 333}   \n')
    for read in (read_lines, AppendFile):
        with pytest.raises(RecordError, match=rf"rows\.jsonl': {said}, the limit for a file of JSON lines"):
            read(path)


def test_a_line_without_end_is_refused_before_it_is_read_whole():
    class Zeros(io.RawIOBase):
        """Has no end, as /dev/zero."""

        def readline(self, size: int | None = -1, /) -> bytes:
            return bytes(size or 0)

    with pytest.raises(RecordError, match=r"line 1 has more than 67,108,864 bytes"):
        list(LineReader(Zeros(), "it"))  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", ["/dev/zero", "pipe"])
def test_a_device_or_a_pipe_is_no_file_of_lines(tmp_path: Path, kind: str):
    os.mkfifo(tmp_path / "pipe")
    place = tmp_path / kind
    for read in (read_lines, AppendFile):
        with pytest.raises(RecordError, match=r"is a (device|pipe), not a file"):
            read(place)
    assert is_being_written(place) is None


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_named(path: Path, monkeypatch: pytest.MonkeyPatch, number: int):
    def lock(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(jsonl.fcntl, "flock", lock)
    with pytest.raises(
        RecordError, match=rf"cannot be locked: {os.strerror(number)}\. This file system does not support locks"
    ):
        AppendFile(path)
    assert is_being_written(path) is None


def test_a_lock_that_a_network_refuses_is_another_writers(path: Path, monkeypatch: pytest.MonkeyPatch):
    def lock(*_: object) -> None:
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(jsonl.fcntl, "flock", lock)
    with pytest.raises(RecordError, match="is being written by another process"):
        AppendFile(path)


def test_appending_does_not_read_the_lines_that_have_ended(tmp_path: Path, monkeypatch) -> None:
    path, read = tmp_path / "rows.jsonl", []
    path.write_bytes(b'{"number": 1}\n' * 1000)
    usual = jsonl.LineReader.__iter__
    monkeypatch.setattr(jsonl.LineReader, "__iter__", lambda self: (read.append(x) or x for x in usual(self)))
    append_line(path, b'{"number": 2}\n')
    assert not read
    assert path.read_bytes() == b'{"number": 1}\n' * 1000 + b'{"number": 2}\n'


@pytest.mark.parametrize("size", [10, 3 * 2**20])
def test_appending_moves_a_partial_line_of_any_length(tmp_path: Path, size: int) -> None:
    path, partial = tmp_path / "rows.jsonl", b'{"number": "' + size * b"x"
    path.write_bytes(b'{"number": 1}\n' + partial)
    append_line(path, b'{"number": 2}\n')
    assert path.read_bytes() == b'{"number": 1}\n{"number": 2}\n'
    (side,) = (each for each in tmp_path.iterdir() if each != path)
    assert side.read_bytes() == partial
