"""`attempts.jsonl`: the attempts at episodes, each written to disk before the agent sees its first frame.

A row in `episodes.jsonl` is written when an episode is over. An episode that is killed before its end does not have a
row, and the same command starts it again; this file counts both attempts. Each row has the number of its attempt.
"""

import json
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, Field

from vigil.base.json_lines import append_line, parse_line, read_lines
from vigil.records.record import Key, RunSpec

ATTEMPTS_FILE = "attempts.jsonl"


class Attempt(BaseModel):
    """One attempt at an episode: a line of the file."""

    episode_id: str
    epoch: int = Field(ge=1)
    attempt: int = Field(ge=1)
    spec_sha256: str
    """Hash of the run's settings (`RunSpec.sha256`)."""
    started: datetime

    @property
    def key(self) -> Key:
        """Episode and epoch of the attempt."""
        return self.episode_id, self.epoch


def read_attempts(path: Path, spec: RunSpec) -> list[Attempt]:
    """Return the attempts of the run `spec`; empty if there is no file. Attempts of other runs in the file are left
    out.

    Raises RecordError when the file cannot be read.
    """
    advice = "Restore the file from a copy, or choose another folder."
    attempts = [parse_line(line, Attempt, repr(str(path)), advice) for line in read_lines(path)]
    return [attempt for attempt in attempts if attempt.spec_sha256 == spec.sha256]


class AttemptLog:
    """Attempts of one run. Attempts of an earlier run with other settings in the same folder do not count."""

    def __init__(self, path: Path, spec: RunSpec) -> None:
        """Read the file, if it exists. Raises RecordError when it cannot be read.

        An incomplete last line does not count. A line is written before the agent sees its first frame, so the attempt
        of an incomplete line had not begun.
        """
        self._path = path
        self._spec = spec.sha256
        self._count = Counter(attempt.key for attempt in read_attempts(path, spec))

    def count(self, key: Key) -> int:
        """Return the number of attempts at an episode."""
        return self._count[key]

    def begin(self, key: Key) -> None:
        """Record on disk that an episode begins. Raises RecordError when the line cannot be written."""
        fields = {
            "episode_id": key[0],
            "epoch": key[1],
            "attempt": self._count[key] + 1,
            "spec_sha256": self._spec,
            "started": datetime.now(UTC).isoformat(),
        }
        append_line(self._path, json.dumps(fields).encode() + b"\n")
        self._count[key] += 1
