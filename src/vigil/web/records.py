"""A run's `episodes.jsonl` as the pages read it: row by row, broken rows kept apart, grown files read on.

Unlike the runner's reader this one never gives up on a file: what cannot be read is named, the rest is shown.
"""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from vigil.episode import Episode
from vigil.errors import RecordError
from vigil.record import SCHEMA_VERSION, EpisodeRecord, Key
from vigil.scoring import Outcome, settle
from vigil.summary import Settlement, Unscored


@dataclass(frozen=True, slots=True)
class BrokenRow:
    """A line that is no record, or a record that contradicts itself or its pack."""

    line: int
    reason: str
    episode_id: str = ""


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
    epochs: int = 1
    rows: dict[Key, Row] = field(default_factory=dict)
    broken: list[BrokenRow] = field(default_factory=list)
    is_missing: bool = False
    """Whether there is no file yet."""
    torn: BrokenRow | None = None
    """A last line that is not finished: being written, or cut off by a crash."""
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

    def _forget(self, identity: tuple[int, int]) -> None:
        self.rows, self.broken, self.torn = {}, [], None
        self._seen = self._lines = 0
        self._identity = identity

    def _take(self, data: bytes) -> None:
        for line in data.splitlines(keepends=True):
            if not line.endswith(b"\n"):
                self.torn = BrokenRow(self._lines + 1, "The line is not finished: it is being written, or was cut off.")
                return
            self._lines += 1
            self._add(line)
            self._seen += len(line)

    def _add(self, line: bytes) -> None:
        try:
            record = EpisodeRecord.model_validate_json(line)
        except ValidationError as error:
            fault = error.errors(include_url=False, include_input=False)[0]
            place = ".".join(str(part) for part in fault["loc"])
            self.broken.append(BrokenRow(self._lines, f"{place}: {fault['msg']}".strip(": "), _id_in(line)))
            return
        if record.schema_version != SCHEMA_VERSION:
            reason = f"record schema {record.schema_version}, this version of vigil reads {SCHEMA_VERSION}"
            self.broken.append(BrokenRow(self._lines, reason, record.episode_id))
            return
        self._judge(record, len(line))

    def _judge(self, record: EpisodeRecord, size: int) -> None:
        earlier = self.rows.get(record.key)
        if earlier is not None and earlier.error is None:
            return
        episode = self.episodes.get(record.episode_id)
        if episode is None:
            self.broken.append(BrokenRow(self._lines, "not one of the episodes of this run", record.episode_id))
            return
        outcome, unscored = None, None
        if record.end == "error":
            boundary, message = (record.error.boundary, record.error.message) if record.error else ("runner", "")
            unscored = Unscored(record.episode_id, record.epoch, episode.family, boundary, message)
        else:
            try:
                outcome = settle(episode, record)
            except RecordError as error:
                self.broken.append(BrokenRow(self._lines, str(error), record.episode_id))
                return
        self.rows[record.key] = Row(self._lines, self._seen, size, outcome, unscored)


def is_inside(path: Path, folder: Path) -> bool:
    """Whether `path`, all links followed, lies in `folder` (all links followed)."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def _id_in(line: bytes) -> str:
    try:
        found = json.loads(line)
    except ValueError:
        return ""
    return str(found.get("episode_id", ""))[:200] if isinstance(found, dict) else ""
