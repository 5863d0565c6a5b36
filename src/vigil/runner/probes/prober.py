"""Asks the probes of a finished episode, and records each answer.

The episode's row is written before its first probe is sent. A failed probe therefore cannot affect the episode.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Literal

from vigil.agents.conversation import Message
from vigil.agents.frame_encoding import EncodedFrame
from vigil.errors import ModelAPIError
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import split_reasoning
from vigil.records.probe import FRAMINGS, Framing, question_sha256, read_probe_answer
from vigil.records.probe_file import ProbeKey, ProbeLog, ProbeRecord, ProbeTable
from vigil.records.record import EpisodeRecord, Key
from vigil.records.reply_truncation import truncate_for_record
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.probes.requests import needed_frames, step_messages, with_question
from vigil.scoring.probe_schedule import ProbeSchedule

MAX_FAILURES_IN_A_ROW = 5
"""Number of consecutive server failures after which the command sends no more probes."""


@dataclass(frozen=True, slots=True)
class ProbePlan:
    """The probes of a run: the framings of the question, and the steps at which it is asked."""

    schedule: ProbeSchedule
    framings: tuple[Framing, ...]

    def missing(self, table: ProbeTable, episode: Episode, record: EpisodeRecord) -> dict[int, list[Framing]]:
        """Return {step: framings that are not yet answered at this step} for the steps of a record, in order."""
        found: dict[int, list[Framing]] = {}
        for step in self.schedule.steps(episode, record):
            mine = (record.episode_id, record.epoch, record.attempt, step)
            waiting: list[Framing] = [
                framing for framing in self.framings if not table.is_done(ProbeKey(*mine, framing))
            ]
            if waiting:
                found[step] = waiting
        return found


def framings(word: Literal["state", "doubt", "both"]) -> tuple[Framing, ...]:
    """Return the framings that the value of a setting stands for."""
    return FRAMINGS if word == "both" else (word,)


@dataclass(slots=True)
class FrameMemory:
    """Frames of the episodes that are being played. They are stored until the probes of the episode were asked."""

    schedule: ProbeSchedule
    profile: Profile
    _frames: dict[Key, dict[int, EncodedFrame]] = field(default_factory=dict[Key, dict[int, EncodedFrame]])

    def note(self, key: Key, step: int, picture: EncodedFrame) -> None:
        """Store the frame of a step. If a later or equal step is stored, a new attempt has begun: first delete the
        stored frames.

        The previous frame is deleted unless the schedule or the messages may still need it.
        """
        frames = self._frames.setdefault(key, {})
        if step <= max(frames, default=0):
            frames.clear()
        schedule = self.schedule
        before = step - 1
        is_past_kept = self.profile.row.images > 0
        if not is_past_kept and not schedule.at_goal and not (schedule.period and before % schedule.period == 0):
            frames.pop(before, None)
        frames[step] = picture

    def take(self, key: Key) -> dict[int, EncodedFrame]:
        """Remove the frames of an episode, and return them by step."""
        return self._frames.pop(key, {})


@dataclass(slots=True)
class Prober:
    """Asks the probes of finished episodes, and writes the answers to the run's file of probes."""

    plan: ProbePlan
    profile: Profile
    ask: Ask
    log: ProbeLog
    run_sha256: str
    redact: Callable[[str], str] = lambda text: text
    """Function that removes secrets from error messages."""
    failures_in_a_row: int = 0

    @property
    def has_stopped(self) -> bool:
        """Whether no more probes are sent, because the server failed too often."""
        return self.failures_in_a_row >= MAX_FAILURES_IN_A_ROW

    async def ask_all(self, episode: Episode, record: EpisodeRecord, pictures: Mapping[int, EncodedFrame]) -> None:
        """Ask the missing probes of a record. `pictures` has the record's frames by step. Raises RecordError."""
        missing = self.plan.missing(self.log.table, episode, record)
        steps = [step for step in missing if needed_frames(self.profile, [step]) <= pictures.keys()]
        for step, messages in step_messages(episode, record, self.profile, steps, pictures):
            for framing in missing[step]:
                if not self.has_stopped:
                    self.log.append(await self._ask(record, step, framing, messages))

    async def _ask(
        self, record: EpisodeRecord, step: int, framing: Framing, messages: Sequence[Message]
    ) -> ProbeRecord:
        result = await self._result(with_question(messages, framing))
        self.failures_in_a_row = self.failures_in_a_row + 1 if "error" in result else 0
        return ProbeRecord(
            run_sha256=self.run_sha256,
            episode_id=record.episode_id,
            epoch=record.epoch,
            attempt=record.attempt,
            step=step,
            frame_sha256=record.steps[step - 1].frame_sha256,
            framing=framing,
            question_sha256=question_sha256(framing),
            asked=datetime.now(UTC),
            **result,
        )

    async def _result(self, messages: Sequence[Message]) -> dict[str, Any]:
        try:
            reply = await self.ask(messages)
        except RequestRejected:
            reply = Reply(text="", finish_reason="rejected", provider_rejected=True)
        except ModelAPIError as error:
            return {"error": self.redact(str(error))}
        read = read_probe_answer(reply, self.profile.reply_policy)
        kept = truncate_for_record(reply, split_reasoning(reply.text)[0])
        return {"reply": kept, ("invalid" if isinstance(read, InvalidAction) else "answer"): read}
