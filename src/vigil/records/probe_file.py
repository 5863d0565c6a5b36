"""`probes.jsonl`: the answers to the probes of a run, in a file next to the run's records.

A row belongs to one step of a record that counts. If a probe has several rows, the first row without an error counts. A
probe whose rows are all errors is asked again. `vigil.scoring.beliefs` compares the rows with the world.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from pydantic import Field, model_validator

from vigil.base.json_lines import AppendFile, Line, dump_line, parse_line, read_lines
from vigil.base.models import FrozenModel
from vigil.protocol.actions import InvalidAction, Reply
from vigil.records.costs import Tokens
from vigil.records.probe import Framing, ProbeAnswer, question_sha256
from vigil.records.record import EpisodeRecord

PROBES_FILE = "probes.jsonl"
PROBE_SCHEMA = 1
"""Schema version of the rows; it is raised by the same rules as the schema version of records."""
_ADVICE = "Restore the file from a copy, or remove it: the episodes' records do not need it."


class ProbeKey(NamedTuple):
    """What identifies a probe within a run: the attempt at an episode, the step, and the framing of the question."""

    episode_id: str
    epoch: int
    attempt: int
    step: int
    framing: Framing


class ProbeRecord(FrozenModel):
    """One probe. Exactly one of `answer`, `invalid` and `error` is set."""

    schema_version: int = PROBE_SCHEMA
    run_sha256: str
    """Hash of the probe's run (`RunHeader.sha256`)."""
    episode_id: str
    epoch: int = Field(ge=1)
    attempt: int = Field(ge=1)
    step: int = Field(ge=1)
    """Number of the step whose messages the probe repeats. The step's frame shows the world before the step's reply."""
    frame_sha256: str | None = None
    framing: Framing
    question_sha256: str
    """Hash of the question, its scale and its place in the request (`vigil.records.probe`)."""
    asked: datetime
    reply: Reply | None = None
    """Reply of the model; None if the server failed."""
    answer: ProbeAnswer | None = None
    invalid: InvalidAction | None = None
    """Why the reply is not an answer: it does not parse, refuses, or is an action."""
    error: str | None = None
    """Why the server failed, after all retries; the probe is then asked again."""

    @model_validator(mode="after")
    def _has_one_result(self) -> "ProbeRecord":
        results = (self.answer, self.invalid, self.error)
        if sum(result is not None for result in results) != 1 or (self.reply is None) != (self.error is not None):
            raise ValueError(
                "a probe must have either an answer or the reason why there is none, and must have a reply unless it "
                "is an error"
            )
        return self

    @property
    def key(self) -> ProbeKey:
        """Key that identifies the probe within its run."""
        return ProbeKey(self.episode_id, self.epoch, self.attempt, self.step, self.framing)


@dataclass(slots=True)
class ProbeTable:
    """The probes of a run, with one row for each probe: the row that counts."""

    rows: dict[ProbeKey, ProbeRecord] = field(default_factory=dict[ProbeKey, ProbeRecord])
    """Key of a probe -> its first row that is not an error; if all its rows are errors, its last row."""
    foreign: int = 0
    """Number of rows that do not count, because they belong to another run or to another version of the question."""
    tokens: Tokens = field(default_factory=Tokens)
    """Tokens of all replies to probes of this run."""

    def add(self, row: ProbeRecord, run_sha256: str) -> None:
        """Add a row of the file; count it as foreign if it belongs to another run or question."""
        if row.run_sha256 != run_sha256 or row.question_sha256 != question_sha256(row.framing):
            self.foreign += 1
            return
        if row.reply is not None:
            self.tokens += Tokens.of([row.reply.usage])
        if not self.is_done(row.key):
            self.rows[row.key] = row

    def is_done(self, key: ProbeKey) -> bool:
        """Return whether a probe has a row without error."""
        row = self.rows.get(key)
        return row is not None and row.error is None

    def of(self, record: EpisodeRecord) -> list[ProbeRecord]:
        """Return the record's probes that the server answered, sorted by step and framing."""
        mine = (record.episode_id, record.epoch, record.attempt)
        found = [row for key, row in self.rows.items() if key[:3] == mine and row.error is None]
        return sorted(found, key=lambda row: (row.step, row.framing))

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about the rows that do not count; empty if all rows count."""
        named = f"rows of {PROBES_FILE} are of another run or another question, and do not count."
        return (f"{self.foreign} {named}",) if self.foreign else ()

    @property
    def errors(self) -> int:
        """Number of probes for which all rows are errors."""
        return sum(row.error is not None for row in self.rows.values())


def read_probes(folder: Path, run_sha256: str) -> ProbeTable:
    """Return the probes of a run; an empty table if the run has no file of probes. Raises RecordError."""
    return _table(read_lines(folder / PROBES_FILE), folder / PROBES_FILE, run_sha256)


def _table(lines: Iterable[Line], path: Path, run_sha256: str) -> ProbeTable:
    table = ProbeTable()
    for line in lines:
        table.add(parse_line(line, ProbeRecord, repr(str(path)), _ADVICE), run_sha256)
    return table


class ProbeLog:
    """The writer of a run's `probes.jsonl`; nothing else writes to this file."""

    def __init__(self, folder: Path, run_sha256: str) -> None:
        """Open or create the file. A partial last line is moved to another file. Raises RecordError."""
        path = folder / PROBES_FILE
        self._file = AppendFile(path)
        self._run = run_sha256
        try:
            self.table = _table(self._file.lines.complete, path, run_sha256)
            self._file.repair_tail()
        except BaseException:
            self._file.close()
            raise

    def append(self, row: ProbeRecord) -> None:
        """Write one row; it is on disk on return. Raises RecordError."""
        self._file.append(dump_line(row))
        self.table.add(row, self._run)

    def close(self) -> None:
        """Release the file; remove it if it is empty."""
        if not self._file.path.stat().st_size:
            self._file.path.unlink()
        self._file.close()

    def __enter__(self) -> "ProbeLog":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
