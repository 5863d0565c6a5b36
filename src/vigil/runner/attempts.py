"""`attempts.jsonl`: which episodes were begun, noted on disk before their first frame is shown.

A row in `episodes.jsonl` is written when an episode is over. One that was killed in between leaves none, and is begun
anew by the same command; here it is counted all the same. The number goes into the row as `attempt`.
"""

import hashlib
import json
import os
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

from vigil.errors import RecordError
from vigil.record import Key, RunSpec

ATTEMPTS_FILE = "attempts.jsonl"


class AttemptLog:
    """The attempts of one run. A run of other settings, which the folder may have held before, has its own count."""

    def __init__(self, path: Path, spec: RunSpec) -> None:
        """Reads the file, if there is one. Raises RecordError when it cannot be read."""
        self._path = path
        self._spec = hashlib.sha256(spec.model_copy(update={"base_url": None}).model_dump_json().encode()).hexdigest()
        self._count: Counter[Key] = Counter()
        for number, line in enumerate(self._whole_lines(), start=1):
            try:
                fields = json.loads(line)
                key, run = (str(fields["episode_id"]), int(fields["epoch"])), fields["spec_sha256"]
            except (ValueError, KeyError, TypeError, RecursionError) as error:
                raise RecordError(
                    f"{str(path)!r} line {number} is not readable ({error}). Restore the file from a copy, or choose "
                    "another folder."
                ) from None
            self._count[key] += run == self._spec

    def count(self, key: Key) -> int:
        """Returns how often an episode was begun."""
        return self._count[key]

    def begin(self, key: Key) -> None:
        """Notes that an episode begins, on disk when this returns. Raises RecordError when it cannot be written."""
        fields = {
            "episode_id": key[0],
            "epoch": key[1],
            "attempt": self._count[key] + 1,
            "spec_sha256": self._spec,
            "started": datetime.now(UTC).isoformat(),
        }
        try:
            with self._path.open("ab") as file:
                file.write(json.dumps(fields).encode() + b"\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise RecordError(
                f"Cannot write to {str(self._path)!r}: {error.strerror}. What was written before is kept; mend this "
                "and give the same command again."
            ) from error
        self._count[key] += 1

    def _whole_lines(self) -> list[bytes]:
        """Returns the lines; a torn last one, whose episode showed nothing yet, is cut off."""
        if not self._path.is_file():
            return []
        try:
            data = self._path.read_bytes()
            whole = data[: data.rfind(b"\n") + 1]
            if len(whole) < len(data):
                os.truncate(self._path, len(whole))
        except OSError as error:
            raise RecordError(f"{str(self._path)!r} cannot be read: {error.strerror}.") from None
        return whole.splitlines()
