"""Stored reasoning: a file next to the records with the reasoning that the provider sent separately from replies.

The file is written if the user requests it, for people and for training. A record has only the reasoning's length.
Reasoning is never part of a history, a request or a score: `vigil.protocol.actions.Reply` excludes it from
serialization.
"""

from pathlib import Path

from pydantic import Field

from vigil.base.json_lines import append_line, dump_line, parse_line, read_lines
from vigil.base.models import FrozenModel
from vigil.records.record import EpisodeRecord

REASONING_FILE = "reasoning.jsonl"
MAX_CHARS = 1024 * 1024
"""Maximum number of characters stored of a reply's reasoning. Of longer reasoning, only the end is stored."""


class EpisodeReasoning(FrozenModel):
    """One line of the file: the reasoning of the replies of one attempt at an episode."""

    episode_id: str
    epoch: int = Field(ge=1)
    attempt: int = Field(ge=1)
    steps: dict[int, str]
    """Step index -> reasoning of the reply at this step; steps without reasoning are left out."""


def store_reasoning(folder: Path, record: EpisodeRecord) -> EpisodeRecord:
    """Write the reasoning of a record's replies, if any, to a file in `folder`. Return the record without the
    reasoning.

    When the function returns, the reasoning is on disk. Raises RecordError if the file cannot be written.
    """
    tails = {step.index: step.reply.reasoning[-MAX_CHARS:] for step in record.steps if step.reply.reasoning}
    steps = {index: tail.encode("utf-8", "replace").decode() for index, tail in tails.items()}
    if not steps:
        return record
    found = EpisodeReasoning(episode_id=record.episode_id, epoch=record.epoch, attempt=record.attempt, steps=steps)
    append_line(folder / REASONING_FILE, dump_line(found))
    bare = [step.model_copy(update={"reply": step.reply.model_copy(update={"reasoning": ""})}) for step in record.steps]
    return record.model_copy(update={"steps": tuple(bare)})


def reasoning_by_step(folder: Path, record: EpisodeRecord) -> dict[int, str]:
    """Return step index -> stored reasoning for a record's replies; empty if none was stored. Raises RecordError."""
    mine = (record.episode_id, record.epoch, record.attempt)
    found = read_reasoning(folder, record.episode_id)
    stored = [one.steps for one in found if (one.episode_id, one.epoch, one.attempt) == mine]
    return stored[-1] if stored else {}


def read_reasoning(folder: Path, episode_id: str = "") -> list[EpisodeReasoning]:
    """Return the stored reasoning of a run, or of one episode of it; empty if there is none. Raises RecordError."""
    file, name = folder / REASONING_FILE, episode_id.encode()
    advice = "Restore the file from a copy, or remove it."
    return [
        parse_line(line, EpisodeReasoning, repr(str(file)), advice) for line in read_lines(file) if name in line.data
    ]
