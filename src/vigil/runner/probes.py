"""Probes: questions about what a model believes at the steps of an episode, asked when the episode is over.

`vigil run --probe` asks them of each finished episode; `vigil probe` asks them of a finished run, without playing the
run again. The episode's row is written before its first probe is sent, so a failed probe cannot affect the episode.
"""

import asyncio
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Literal

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import EncodedFrame, encode_frame
from vigil.errors import ModelAPIError, RecordError
from vigil.packs.pack import Pack
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.protocol.reasoning import split_reasoning
from vigil.records.probe import FRAMINGS, QUESTIONS, Framing, question_sha256, read_probe_answer
from vigil.records.probe_file import ProbeKey, ProbeLog, ProbeRecord, ProbeTable, read_probes
from vigil.records.record import FRAMES_FOLDER, EpisodeRecord, Key, RunHeader
from vigil.records.reply_truncation import truncate_for_record
from vigil.runner.models.access import Endpoint, hiding_other_keys, model_access
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.context import CHARS_PER_TOKEN, PICTURE_TOKENS
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.redaction import REDACTED, Secrets, redacted_errors
from vigil.runner.retries import RetryPolicy
from vigil.runner.settings import FinishedProbeSettings
from vigil.runner.verify_run import recorded_worker_plan
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.players import add_recorded_turns
from vigil.runner.workers.pool import SimulatorPool, worker_count
from vigil.scoring.probe_schedule import ProbeSchedule
from vigil.scoring.saved_run import SavedRun, read_run

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
class Prober:
    """Asks the probes of finished episodes, and writes the answers to the run's file of probes."""

    plan: ProbePlan
    header: RunHeader
    ask: Ask
    log: ProbeLog
    redact: Callable[[str], str]
    """Function that removes secrets from error messages."""
    failures_in_a_row: int = 0
    frames: dict[Key, dict[int, EncodedFrame]] = field(default_factory=dict[Key, dict[int, EncodedFrame]])
    """Frames of the episodes that are being played, by step, until the probes of the episode are asked."""

    @property
    def profile(self) -> Profile:
        """Profile of the run."""
        return self.header.spec.profile

    @property
    def has_stopped(self) -> bool:
        """Whether no more probes are sent, because the server failed too often."""
        return self.failures_in_a_row >= MAX_FAILURES_IN_A_ROW

    def keep_frame(self, key: Key, step: int, picture: EncodedFrame) -> None:
        """Store the frame of a step. If this step or a later one is already stored, a new attempt has begun: first
        delete the stored frames.

        The previous frame is deleted unless the schedule or the messages may still need it.
        """
        frames, schedule, before = self.frames.setdefault(key, {}), self.plan.schedule, step - 1
        if step <= max(frames, default=0):
            frames.clear()
        is_asked_about = schedule.at_goal or (schedule.period and before % schedule.period == 0)
        if not is_asked_about and self.profile.row.images == 0:
            frames.pop(before, None)
        frames[step] = picture

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
        *earlier, last = messages  # the question comes after the frame of the last message
        result = await self._result([*earlier, replace(last, question=QUESTIONS[framing])])
        self.failures_in_a_row = self.failures_in_a_row + 1 if "error" in result else 0
        return ProbeRecord(
            run_sha256=self.header.sha256,
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


def step_messages(
    episode: Episode,
    record: EpisodeRecord,
    profile: Profile,
    steps: Container[int],
    pictures: Mapping[int, EncodedFrame],
) -> Iterator[tuple[int, list[Message]]]:
    """Yield the number and the messages of each of `steps`, exactly as they were sent when the episode was played.

    `pictures` has, by step, the frames that the agent saw before its replies, at least those of `needed_frames`.
    """
    conversation = Conversation(profile, episode.instruction)
    if record.criteria is not None:
        conversation.declare(record.criteria.text)
    for step, feedback, cues in add_recorded_turns(conversation, record.steps, profile, episode.max_steps, pictures):
        if step.index in steps:
            yield step.index, conversation.messages(pictures[step.index], feedback, cues)


def needed_frames(profile: Profile, steps: Iterable[int]) -> set[int]:
    """Return the steps whose frames are in the messages of `steps`."""
    return {frame for step in steps for frame in range(max(1, step - profile.row.images), step + 1)}


Play = tuple[Episode, EpisodeRecord]


def new_prober(
    plan: ProbePlan,
    header: RunHeader,
    log: ProbeLog,
    asking: Callable[[ModelIdentityLog], Ask],
    redact: Callable[[str], str],
    *,
    force: bool,
) -> Prober:
    """Return the prober of a run; unless `force`, it refuses answers of another model than the run's.

    `asking` returns the function that asks the model and adds each answer to a log.
    """
    identity_log = ModelIdentityLog(earlier_names=() if force else header.answering_models, redact=redact)
    return Prober(plan, header, asking(identity_log), log, redact)


async def ask_missing(
    endpoint: Endpoint,
    prober_of: Callable[[Callable[[ModelIdentityLog], Ask]], Prober],
    store: FrameStore,
    pool: SimulatorPool,
    plays: Sequence[Play],
    on_progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> None:
    """Ask the probes that `plays` lack, several plays at the same time; stop if the server keeps failing.

    Frames that `store` does not have are drawn again. `on_progress` is called with (plays done, all plays). Raises
    RecordError.
    """
    from vigil.runner.models.inspect_model import ModelClient  # noqa: PLC0415 - loads Inspect

    waiting = iter(sorted(plays, key=lambda play: (play[0].house.name, play[1].key)))
    done = 0

    async def work(prober: Prober) -> None:
        nonlocal done
        for episode, record in waiting:
            if not prober.has_stopped:
                await prober.ask_all(episode, record, await _frames(prober, store, pool, episode, record))
            done += 1
            on_progress(done, len(plays))

    async with ModelClient(endpoint) as client:
        prober = prober_of(client.asking)
        await asyncio.gather(*(work(prober) for _ in range(min(endpoint.max_connections, len(plays)))))


async def _frames(
    prober: Prober, store: FrameStore, pool: SimulatorPool, episode: Episode, record: EpisodeRecord
) -> dict[int, EncodedFrame]:
    """Return, by step, the frames in the messages of a record's missing probes: the saved ones, or all drawn again."""
    steps = tuple(sorted(needed_frames(prober.profile, prober.plan.missing(prober.log.table, episode, record))))
    saved = {step: store.frame(record.steps[step - 1].frame_sha256) for step in steps}
    if not all(saved.values()):
        return await pool.frames(Assignment(episode, record.epoch, record.attempt), record, steps)
    image_format = prober.profile.image_format
    return {step: encode_frame(frame[1], image_format) for step, frame in saved.items() if frame is not None}


@dataclass(frozen=True, slots=True)
class FinishedProbing:
    """The probes that a finished run still lacks, and what is needed to ask them."""

    run: SavedRun
    pack: Pack
    plan: ProbePlan
    plays: tuple[Play, ...]
    """Plays of the run that lack probes."""
    table: ProbeTable
    """Probes that were asked before this command."""

    @property
    def probes(self) -> int:
        """Number of probes that remain to be asked."""
        return sum(len(each) for play in self.plays for each in self.plan.missing(self.table, *play).values())

    def input_tokens(self) -> tuple[int, int]:
        """Return the minimum and maximum number of tokens of the requests, estimated as for `vigil run --dry-run`."""
        profile = self.run.header.spec.profile
        chars = pictures = 0
        for episode, record in self.plays:
            missing = self.plan.missing(self.table, episode, record)
            needed = needed_frames(profile, missing)
            frames = {step: EncodedFrame(b"", profile.image_format) for step in needed}
            for step, messages in step_messages(episode, record, profile, missing, frames):
                images = sum(message.picture is not None for message in messages)
                chars += sum(len(message.text) for message in messages) * len(missing[step])
                chars += sum(len(QUESTIONS[framing]) for framing in missing[step])
                pictures += images * len(missing[step])
        least, most = PICTURE_TOKENS
        text = round(chars / CHARS_PER_TOKEN)
        return text + pictures * least, text + pictures * most


def plan_probing(folder: Path, settings: FinishedProbeSettings) -> FinishedProbing:
    """Return the probes that the run in `folder` still lacks.

    Raises PackMismatch or RecordError, for example if the run's requests cannot be sent again.
    """
    run = read_run(folder, settings.pack)
    spec = run.header.spec
    if spec.agent_kind != "model":
        raise RecordError(
            f"Run {run.header.run_id!r} was played by {spec.agent!r}, which is not a model: only a model can be probed."
        )
    if REDACTED in spec.model_dump_json(include={"sampling", "model_args"}):
        raise RecordError(
            f"Run {run.header.run_id!r} had secret settings, which are not recorded, so its requests cannot be "
            "sent again. Probe a new run while it is played: vigil run --probe."
        )
    table = read_probes(folder, run.header.sha256)
    plan = ProbePlan(settings.steps or ProbeSchedule(period=1), framings(settings.framing))
    scored = sorted(key for key, row in run.table.rows.items() if row.outcome is not None)
    plays = ((run.table.episodes[key[0]], run.table.record(key)) for key in scored)
    missing = tuple(play for play in plays if plan.missing(table, *play))
    return FinishedProbing(run, Pack.load(run.pack_folder, spec.pack_sha256), plan, missing, table)


def probe_run(
    probing: FinishedProbing,
    settings: FinishedProbeSettings,
    on_progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> ProbeTable:
    """Ask the missing probes and return all probes of the run; `on_progress` is called with (plays done, all plays).

    Raises RecordError, SettingError or SimulatorError; the answers received until then are saved.
    """
    spec = probing.run.header.spec
    url = settings.base_url or spec.base_url
    endpoint = Endpoint(
        model_access(spec.agent, url, spec.model_args, settings.api_key_env),
        dict(spec.sampling),
        settings.max_connections,
        settings.reply_seconds,
        RetryPolicy(settings.retries, settings.first_wait_s),
    )
    secrets = Secrets.of(url=endpoint.access.base_url, key=endpoint.access.api_key or "")
    folder, header = probing.run.folder, probing.run.header
    with redacted_errors(secrets), ProbeLog(folder, header.sha256) as log:
        if not probing.plays:
            return log.table
        endpoint.access.check()
        workers = min(worker_count(settings.workers), len(probing.plays))
        plan = recorded_worker_plan(probing.pack, header, settings.asset_database)
        with hiding_other_keys(endpoint.access), SimulatorPool(plan, workers, timeout_s=settings.timeout_s) as pool:
            prober_of = partial(new_prober, probing.plan, header, log, redact=secrets.redact, force=settings.force)
            store = FrameStore(folder / FRAMES_FOLDER)
            asyncio.run(ask_missing(endpoint, prober_of, store, pool, probing.plays, on_progress))
        return log.table
