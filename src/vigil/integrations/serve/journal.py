"""`sessions.jsonl` of a server's run: each session that begins, and each reply before it is carried out.

A killed server continues its sessions from this file. The file stores hashes of the tokens, not the tokens.
"""

import hashlib
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from vigil.base.json_lines import dump_line
from vigil.protocol.actions import Reply
from vigil.records.record import Key
from vigil.web.live_play import open_journal

SESSIONS_FILE = "sessions.jsonl"


def hashed(token: str) -> str:
    """Return the hash of a token, under which the server stores the session."""
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()


class _Line(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    session: str
    """Hash of the session's token."""
    begins: tuple[str, int, int] | None = None
    """Episode, epoch and attempt of a session that begins; None if the line is a reply."""
    started: datetime | None = None
    """When the session began; None if the line is a reply."""
    reply: Reply | None = None


@dataclass(slots=True)
class Begun:
    """A session from the journal, with its replies."""

    session: str
    key: Key
    attempt: int
    started: datetime | None
    replies: list[Reply] = field(default_factory=list)


class Journal:
    """The journal's file, open for writing."""

    def __init__(self, path: Path) -> None:
        """Open or create the file. Raises RecordError if it is damaged or another server writes to it."""
        self._file, lines = open_journal(path, _Line)
        self.begun: dict[str, Begun] = {}
        """Hash of a token -> its session, for the sessions that were in the file when it was opened."""
        for line in lines:
            if line.begins is not None:
                episode_id, epoch, attempt = line.begins
                self.begun[line.session] = Begun(line.session, (episode_id, epoch), attempt, line.started)
            elif line.reply is not None and line.session in self.begun:
                self.begun[line.session].replies.append(line.reply)

    def begin(self, session: str, key: Key, attempt: int) -> None:
        """Write the beginning of a session. Raises RecordError."""
        line = _Line(session=session, begins=(*key, attempt), started=datetime.now(UTC))
        self._file.append(dump_line(line, exclude_none=True))

    def add(self, session: str, reply: Reply) -> None:
        """Write a reply. Raises RecordError."""
        self._file.append(dump_line(_Line(session=session, reply=reply), exclude_none=True))

    def close(self) -> None:
        """Release the file."""
        self._file.close()
