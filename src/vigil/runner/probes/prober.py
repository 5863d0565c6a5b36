"""Asks the probes of a finished episode, and records each answer.

The episode's row is written before its first probe is sent. A failed probe therefore cannot affect the episode.
"""

import asyncio
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any, Literal

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.errors import ModelAPIError
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import split_reasoning
from vigil.records.probe import FRAMINGS, QUESTIONS, Framing, question_sha256, read_probe_answer
from vigil.records.probe_file import ProbeKey, ProbeLog, ProbeRecord, ProbeTable
from vigil.records.record import EpisodeRecord, Key
from vigil.records.reply_truncation import truncate_for_record
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.history import RecordedTurns
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool
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
        """Store the frame of a step. If this step or a later one is already stored, a new attempt has begun: first
        delete the stored frames.

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


Frames = Mapping[int, EncodedFrame]
"""Number of a step -> the frame that the agent saw before its reply of this step."""


def step_messages(
    episode: Episode, record: EpisodeRecord, profile: Profile, steps: Container[int], pictures: Frames
) -> Iterator[tuple[int, list[Message]]]:
    """Yield the number and the messages of each of `steps`, exactly as they were sent when the episode was played.

    `pictures` must have the frames of `needed_frames`.
    """
    conversation = Conversation(profile, episode.instruction)
    if record.criteria is not None:
        conversation.declare(record.criteria.text)
    turns = RecordedTurns(record.steps, profile, episode.max_steps, pictures)
    for step, feedback, cues in turns.add_to(conversation):
        if step.index in steps:
            yield step.index, conversation.messages(pictures[step.index], feedback, cues)


def needed_frames(profile: Profile, steps: Iterable[int]) -> set[int]:
    """Return the steps whose frames are in the messages of `steps`."""
    return {frame for step in steps for frame in range(max(1, step - profile.row.images), step + 1)}


def with_question(messages: Sequence[Message], framing: Framing) -> list[Message]:
    """Return the messages of a step, with a probe's question added after the frame of the last message."""
    *earlier, last = messages
    return [*earlier, replace(last, question=QUESTIONS[framing])]


Play = tuple[Episode, EpisodeRecord]


@dataclass(frozen=True, slots=True)
class MissingProbes:
    """The probes that remain to be asked, and where their frames come from."""

    prober: Prober
    store: FrameStore
    pool: SimulatorPool

    async def ask(
        self, plays: Sequence[Play], at_once: int, on_progress: Callable[[int, int], None] = lambda _done, _total: None
    ) -> None:
        """Ask the probes that `plays` lack, for `at_once` plays at the same time; stop if the server keeps failing.

        `on_progress` is called with (plays done, all plays). Raises RecordError.
        """
        waiting = iter(sorted(plays, key=lambda play: (play[0].house.name, play[1].key)))
        done = 0

        async def work() -> None:
            nonlocal done
            for episode, record in waiting:
                if not self.prober.has_stopped:
                    await self._ask(episode, record)
                done += 1
                on_progress(done, len(plays))

        await asyncio.gather(*(work() for _ in range(min(at_once, len(plays)))))

    async def _ask(self, episode: Episode, record: EpisodeRecord) -> None:
        missing = self.prober.plan.missing(self.prober.log.table, episode, record)
        steps = tuple(sorted(needed_frames(self.prober.profile, missing)))
        saved = {step: self.store.frame(record.steps[step - 1].frame_sha256) for step in steps}
        if all(saved.values()):
            image_format = self.prober.profile.image_format
            frames = {step: encode_frame(frame[1], image_format) for step, frame in saved.items() if frame is not None}
        else:
            frames = await self._drawn(episode, record, steps)
        await self.prober.ask_all(episode, record, frames)

    async def _drawn(self, episode: Episode, record: EpisodeRecord, steps: tuple[int, ...]) -> dict[int, EncodedFrame]:
        return await self.pool.frames(Assignment(episode, record.epoch, record.attempt), record, steps)
