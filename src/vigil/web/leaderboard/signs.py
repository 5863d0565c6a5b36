"""Signs of contamination or fraud: facts that readers should know. The site shows them; they never change a rank."""

import hashlib
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pandas as pd

from vigil.packs.pack import Pack
from vigil.protocol.actions import InteractPixel
from vigil.records.record import EpisodeRecord, RunHeader
from vigil.web.leaderboard.metadata import EntryMetadata

MIN_REPLIES = 4
"""Plays with fewer replies are not compared with other plays, because short plays are often alike."""
FASTEST_REPLY_S = 0.05
MOST_TOKENS_PER_S = 5000
_SLACK_S = 1.0


class PlayReader:
    """Reads from each play the facts from which signs follow, and counts impossible timings."""

    def __init__(self, header: RunHeader, pack: Pack) -> None:
        self._header = header
        self._solutions = {name: found.actions[:-1] for name, found in pack.solutions.items()}
        self.timing_faults: Counter[str] = Counter()

    def facts(self, record: EpisodeRecord) -> dict[str, Any]:
        """Return hashes of a play's replies, of the replies with their times, and of all its actions but the last.

        Also return whether these actions are those of the solution. The hash of the actions is empty if none of them
        is a click, because plays without clicks are often alike.
        """
        replies = hashlib.sha256()
        for step in record.steps:
            replies.update(f"{len(step.reply.text)}\n{step.reply.text}\n".encode())
        times = "\n".join([f"{record.started} {record.ended}", *(repr(step.reply.seconds) for step in record.steps)])
        acted = tuple(step.action for step in record.steps[:-1])
        self.timing_faults.update(self._timing(record))
        actions = "\n".join(action.model_dump_json() for action in acted if action is not None)
        has_click = any(isinstance(action, InteractPixel) for action in acted)
        return {
            "replies_sha256": replies.hexdigest(),
            "play_sha256": hashlib.sha256(f"{replies.hexdigest()}\n{times}".encode()).hexdigest(),
            "actions_sha256": hashlib.sha256(actions.encode()).hexdigest() if has_click else "",
            "is_solution": len(acted) >= MIN_REPLIES - 1 and acted == self._solutions.get(record.episode_id),
        }

    def _timing(self, record: EpisodeRecord) -> Iterator[str]:
        replies = [step.reply for step in record.steps]
        began, started, ended = _utc(self._header.started), _utc(record.started), _utc(record.ended)
        if ended < started or any(reply.seconds < 0 for reply in replies):
            yield "they end before they begin"
        elif sum(reply.seconds for reply in replies) > (ended - began).total_seconds() + _SLACK_S:
            yield "their replies took longer than from the beginning of the run to the end of the play"
        if started < began or (self._header.ended and ended > _utc(self._header.ended)):
            yield "they were played before the run began or after it ended"
        if self._header.spec.agent_kind != "model":
            return
        if any(reply.reply_source == "server" and reply.seconds < FASTEST_REPLY_S for reply in replies):
            yield f"a reply of a server took less than {FASTEST_REPLY_S:g} s"
        rates = [reply.usage.output_tokens / reply.seconds for reply in replies if reply.usage and reply.seconds > 0]
        if max(rates, default=0.0) > MOST_TOKENS_PER_S:
            yield f"a reply has more than {MOST_TOKENS_PER_S:,} tokens a second"


def _utc(when: datetime) -> datetime:
    """Return a time with its time zone; a time without a zone is taken as UTC."""
    return when if when.tzinfo is not None else when.replace(tzinfo=UTC)


def own_signs(
    header: RunHeader, metadata: EntryMetadata, plays: pd.DataFrame, timing_faults: dict[str, int]
) -> Iterator[str]:
    """Yield the signs that follow from one entry alone."""
    models, total = header.answering_models, len(plays)
    if len(models) > 1:
        yield f"The answers name {len(models)} models, not one: {', '.join(models)}."
    if metadata.model_release is not None and header.started.date() < metadata.model_release:
        yield f"The run began on {header.started.date()}, before the stated release on {metadata.model_release}."
    if metadata.submission_date < (header.ended or header.started).date():
        yield f"The stated day of submission, {metadata.submission_date}, is before the end of the run."
    solved = sum(plays["is_solution"])
    if solved:
        yield f"{solved} of {total} plays are, action by action, the solution that is published with the pack."
    for fault, count in sorted(timing_faults.items()):
        yield f"Impossible timing in {count} of {total} plays: {fault}."
