"""A run's `episodes.jsonl` as the pages read it: row by row, rows left out kept apart, grown files read on.

Unlike the runner's reader this one never gives up on a file: what cannot be read is named, the rest is shown.
"""

import os
from dataclasses import dataclass, field, replace
from pathlib import Path

from vigil.episode import Episode
from vigil.errors import RecordError
from vigil.record import EpisodeRecord, Key
from vigil.record_file import scan_lines
from vigil.row_check import REPEATED, LeftOut, RowCheck, told
from vigil.scoring import Outcome, settle
from vigil.summary import Settlement, Unscored


@dataclass(frozen=True, slots=True)
class Row:
    """Where a record that stands lies in its file, and the verdict on it."""

    line: int
    start: int
    size: int
    outcome: Outcome | None
    error: Unscored | None


@dataclass(slots=True)
class RecordTable:
    """All rows of one file that can be read. `refresh` takes in what was appended since."""

    path: Path
    episodes: dict[str, Episode]
    check: RowCheck
    epochs: int = 1
    rows: dict[Key, Row] = field(default_factory=dict)
    left_out: list[LeftOut] = field(default_factory=list)
    """Rows that cannot be read, are not this run's, contradict the protocol, or repeat others."""
    is_missing: bool = False
    """Whether there is no file yet."""
    torn: int | None = None
    """The number of a last line that is not finished: being written, or cut off by a crash."""
    _seen: int = 0
    _lines: int = 0
    _identity: tuple[int, int] = (0, 0)

    def refresh(self) -> None:
        """Reads what is new. Starts afresh when the file was replaced or cut."""
        try:
            stat = self.path.stat()
        except OSError:
            self._forget((0, 0))
            self.is_missing = True
            return
        self.is_missing = False
        identity = (stat.st_dev, stat.st_ino)
        if identity != self._identity or stat.st_size < self._seen:
            self._forget(identity)
        self.torn = None
        if stat.st_size > self._seen:
            with self.path.open("rb") as file:
                file.seek(self._seen)
                self._take(file.read())

    def record(self, key: Key) -> EpisodeRecord:
        """Returns the record that stands for `key`. Raises RecordError."""
        row = self.rows.get(key)
        if row is None:
            raise RecordError(f"No readable record of episode {key[0]!r} (epoch {key[1]}) is in this run.")
        with self.path.open("rb") as file:
            file.seek(row.start)
            return EpisodeRecord.model_validate_json(file.read(row.size))

    def settlement(self) -> Settlement:
        """Returns all verdicts, sorted by episode and epoch."""
        rows = [row for _, row in sorted(self.rows.items())]
        planned: dict = {}
        for episode in self.episodes.values():
            planned[episode.family] = planned.get(episode.family, 0) + self.epochs
        return Settlement(
            tuple(row.outcome for row in rows if row.outcome is not None),
            tuple(row.error for row in rows if row.error is not None),
            planned,
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the rows before any number."""
        torn = (
            f"Line {self.torn} of its records is not finished and is passed over: it is being written or was cut off.",
        )
        return (*self.check.notes, *told(self.left_out), *(torn if self.torn is not None else ()))

    def _forget(self, identity: tuple[int, int]) -> None:
        self.rows, self.left_out, self.torn = {}, [], None
        self._seen = self._lines = 0
        self._identity = identity

    def _take(self, data: bytes) -> None:
        lines = data.splitlines(keepends=True)
        is_torn = not data.endswith(b"\n")
        for line in lines[:-1] if is_torn else lines:
            self._lines += 1
            self._add(line)
            self._seen += len(line)
        self.torn = self._lines + 1 if is_torn else None

    def _add(self, line: bytes) -> None:
        for read in scan_lines(line):
            row = read.row
            if isinstance(row, EpisodeRecord):
                row = self._fault(row) or row
            if isinstance(row, EpisodeRecord):
                self._judge(row, len(line))
            else:
                self.left_out.append(replace(row, line=self._lines))

    def _fault(self, record: EpisodeRecord) -> LeftOut | None:
        fault = self.check.of(self._lines, record)
        earlier = self.rows.get(record.key)
        if fault is None and earlier is not None and earlier.error is None:
            detail = f"epoch {record.epoch} of {record.episode_id!r}"
            return LeftOut(self._lines, REPEATED, detail, record.episode_id)
        return fault

    def _judge(self, record: EpisodeRecord, size: int) -> None:
        episode = self.episodes[record.episode_id]
        outcome, unscored = None, None
        if record.end == "error":
            boundary, message = (record.error.boundary, record.error.message) if record.error else ("runner", "")
            unscored = Unscored(record.episode_id, record.epoch, episode.family, boundary, message, record.attempt)
        else:
            outcome = settle(episode, record)
        self.rows[record.key] = Row(self._lines, self._seen, size, outcome, unscored)


def is_inside(path: Path, folder: Path) -> bool:
    """Whether `path`, all links followed, lies in `folder` (all links followed)."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
