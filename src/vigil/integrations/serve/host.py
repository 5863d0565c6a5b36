"""The sessions of a server: the episode that each session plays, and what its client may see."""

import asyncio
import logging
import secrets
import time
from collections import deque
from collections.abc import Coroutine
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from vigil.agents.program import FramePacer
from vigil.errors import SettingError, VigilError
from vigil.integrations.rewards import Shaping, reward_parts, verdict_of
from vigil.integrations.serve.journal import SESSIONS_FILE, Begun, Journal, hashed
from vigil.integrations.serve.messages import ClientReply, SessionError, View
from vigil.integrations.serve.settings import ServeSettings
from vigil.packs.pack import CHORES_SUITE
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord, Key
from vigil.runner.plan import RunPlan
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import RunSettings
from vigil.runner.shared_settings import PackName
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.pool import SimulatorPool
from vigil.web.live_play import LivePlay, open_live_run, plan_live_run, random_order

RECONNECT_SECONDS = 60
"""Time in seconds in which a client may reconnect after its connection broke."""
_T = TypeVar("_T")
_LOG = logging.getLogger(__name__)
_GONE = SessionError(410, "SESSION_ERROR", "There is no such session, or it has ended. Begin another one (reset).")
_FAILED = SessionError(503, "EXECUTION_ERROR", "The environment failed. Repeat the request, or begin a session.")
_INVALID_REPLY = SessionError(422, "VALIDATION_ERROR", "The reply is not valid: /schema describes valid replies.")
_FULL = SessionError(503, "CAPACITY_REACHED", "All sessions are in use. Try again in a few seconds.")


@dataclass(slots=True, eq=False, kw_only=True)
class Session(LivePlay):
    """One episode that a client is playing."""

    hash: str
    """Hash of the session's token."""
    pacer: FramePacer
    ends: float
    """Time (monotonic clock, s) at which the episode's time limit is reached."""
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    timer: asyncio.TimerHandle | None = None

    @property
    def episode(self) -> Episode:
        """The episode. The client does not see it."""
        return self.live.assignment.episode


class Host:
    """The sessions of one run. `open_host` makes a host; call `close` at the end."""

    def __init__(self, plan: RunPlan, settings: ServeSettings, folder: RunFolder, pool: SimulatorPool) -> None:
        self.profile, self.settings = plan.spec.profile, settings
        self._folder, self._pool = folder, pool
        self._journal = Journal(folder.path / SESSIONS_FILE)
        self._episodes = {episode.id: episode for episode in plan.episodes}
        self._order = random_order(list(self._episodes), settings.seed)
        self._sessions: dict[str, Session] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        left = [(name, epoch) for epoch in range(1, settings.epochs + 1) for name in self._order]
        left = [key for key in left if not folder.log.is_done(key)]
        self._broken = self._unfinished(set(left))
        keys = {one.key for one in self._broken}
        self._waiting = deque(key for key in left if key not in keys)

    @property
    def place(self) -> Path:
        """Folder of the run."""
        return self._folder.path

    @property
    def episodes(self) -> int:
        """Number of episodes. A client for training chooses an episode by an index below this number."""
        return len(self._order)

    @property
    def is_finished(self) -> bool:
        """Whether every episode has been played to its end."""
        return not self._waiting and not self._sessions

    async def restore(self) -> None:
        """Continue the sessions of a server that was killed. Clients get the usual time to reconnect."""
        for one in self._broken:
            episode, epoch = self._episodes[one.key[0]], one.key[1]
            assignment = Assignment(episode, epoch=epoch, attempt=one.attempt, started=one.started)
            session = self._add(one.session, assignment, one.replies)
            async with session.lock:
                self._count(session, await session.begin())
        self._broken = []

    async def open(self, index: int | None = None) -> tuple[str, View] | None:
        """Begin a session and return its token and first view; None if no episode is left. Raises SessionError."""
        return await asyncio.shield(self._task(self._open(index)))

    async def view(self, token: str) -> View:
        """Return the current view of a session. Raises SessionError."""
        session = self._find(token)
        async with session.lock:
            return self._shown(session)

    async def step(self, token: str, given: ClientReply, moment: int | None = None) -> View:
        """Carry out a reply and return the next view. A reply to an earlier view is ignored.

        Raises SessionError.
        """
        return await asyncio.shield(self._task(self._step(self._find(token), given, moment)))

    def detach(self, token: str, *, at_once: bool = False) -> None:
        """End a session if its client does not reconnect within a short time; with `at_once`, end it immediately."""
        session = self._sessions.get(hashed(token))
        if session is not None:
            self._abandon_after(session, 0 if at_once else RECONNECT_SECONDS, "closed the connection")

    async def close(self) -> None:
        """End the simulators and release the run's folder. Sessions can be continued later from the journal."""
        for session in self._sessions.values():
            if session.timer is not None:
                session.timer.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._pool.close()
        self._journal.close()
        self._folder.close()

    def _unfinished(self, left: set[Key]) -> list[Begun]:
        """Return the sessions of a killed server that can continue: the last attempts at episodes without a record."""
        errors = {(row.key, row.attempt) for row in self._folder.log.records()}
        begun = [one for one in self._journal.begun.values() if one.key in left]
        return [
            one
            for one in begun
            if one.attempt == self._folder.attempts.count(one.key) and (one.key, one.attempt) not in errors
        ]

    def _take(self, index: int | None) -> Key | None:
        if index is None:
            return self._waiting.popleft() if self._waiting else None
        if not self.settings.training:
            raise SessionError(400, "VALIDATION_ERROR", "The server chooses the episodes: leave out `index`.")
        if not 0 <= index < len(self._order):
            raise SessionError(400, "VALIDATION_ERROR", f"`index` must be from 0 to {len(self._order) - 1}.")
        key = next((key for key in self._waiting if key[0] == self._order[index]), None)
        if key is not None:
            self._waiting.remove(key)
        return key

    def _add(self, token_hash: str, assignment: Assignment, replies: list[Reply]) -> Session:
        session = Session(
            live=self._pool.live(assignment, replies),
            run_id=self._folder.header.run_id,
            moment=len(replies),
            hash=token_hash,
            pacer=FramePacer(self.settings.frame_interval_seconds),
            ends=time.monotonic() + self.settings.episode_seconds,
        )
        self._sessions[token_hash] = session
        return session

    def _find(self, token: str) -> Session:
        session = self._sessions.get(hashed(token))
        if session is None:
            raise _GONE
        return session

    def _shown(self, session: Session) -> View:
        return View(session.episode.instruction, self.profile, session.moment, session.seen)

    async def _open(self, index: int | None) -> tuple[str, View] | None:
        if len(self._sessions) >= self.settings.max_sessions:
            raise _FULL
        key = self._take(index)
        if key is None:
            return None
        token, attempts = secrets.token_urlsafe(32), self._folder.attempts
        assignment = Assignment(self._episodes[key[0]], epoch=key[1], attempt=attempts.count(key) + 1)
        session = self._add(hashed(token), assignment, [])
        async with session.lock:
            try:
                self._journal.begin(session.hash, key, assignment.attempt)
                attempts.begin(key)
                record = self._count(session, await session.begin())
            except VigilError:
                self._sessions.pop(session.hash, None)
                raise
            if record is not None:
                raise _FAILED
            await asyncio.sleep(session.pacer.left)
            self._wait_for_reply(session)
            return token, self._shown(session)

    async def _step(self, session: Session, given: ClientReply, moment: int | None) -> View:
        async with session.lock:
            if self._sessions.get(session.hash) is not session:
                raise _GONE
            if moment is not None and moment != session.moment:
                return self._shown(session)
            try:
                reply = given.reply(time.monotonic() - session.since)
            except ValueError:
                raise _INVALID_REPLY from None
            session.pacer.begin()
            record = await self._advance(session, reply)
            await asyncio.sleep(session.pacer.left)
            if record is not None:
                return View(session.episode.instruction, self.profile, session.moment, None, self._reward(record))
            self._wait_for_reply(session)
            return self._shown(session)

    async def _advance(self, session: Session, reply: Reply) -> EpisodeRecord | None:
        """Carry out a reply. Return the record if the reply ended the episode. Raises SessionError if the simulator
        failed."""
        self._journal.add(session.hash, reply)
        record = self._count(session, await session.advance(reply))
        if record is not None and record.error is not None:
            raise _FAILED
        return record

    def _count(self, session: Session, record: EpisodeRecord | None) -> EpisodeRecord | None:
        """Write the record of an episode that has ended; wait for the client's reply if it has not."""
        if record is None:
            self._wait_for_reply(session)
            return None
        self._sessions.pop(session.hash, None)
        if session.timer is not None:
            session.timer.cancel()
        self._folder.append(record)
        if record.error is not None:
            _LOG.error("An episode ended as an error: %s", record.error.message)
        if self.is_finished:
            self._folder.note_end()
        return record

    def _wait_for_reply(self, session: Session) -> None:
        session.since = time.monotonic()
        left, allowed = session.ends - session.since, self.settings.reply_seconds
        how = "used up the episode's time" if left < allowed else f"did not answer for {allowed} s"
        self._abandon_after(session, min(left, allowed), how)

    def _abandon_after(self, session: Session, seconds: float, how: str) -> None:
        if session.timer is not None:
            session.timer.cancel()
        later = asyncio.get_running_loop().call_later
        session.timer = later(max(0.0, seconds), lambda: self._task(self._abandon(session, session.moment, how)))

    async def _abandon(self, session: Session, moment: int, how: str) -> None:
        """Play the episode to its end with empty replies, because the client stopped answering."""
        async with session.lock:
            if session.moment != moment:
                return  # a reply arrived in the meantime
            while self._sessions.get(session.hash) is session:
                reply = Reply(text="", agent_ended=f"The client {how}.", seconds=time.monotonic() - session.since)
                await self._advance(session, reply)

    def _task(self, work: Coroutine[Any, Any, _T]) -> "asyncio.Task[_T]":
        """Start work that continues even if its client disconnects."""
        task = asyncio.get_running_loop().create_task(_without_details(work))
        self._tasks.add(task)
        task.add_done_callback(self._forget)
        return task

    def _forget(self, task: "asyncio.Task[Any]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # its client may be gone, and then nobody else reads it

    def _reward(self, record: EpisodeRecord) -> float | None:
        if not self.settings.training:
            return None
        verdict = verdict_of(record, self._episodes[record.episode_id], self.profile, None)
        return sum(reward_parts(verdict, Shaping()).values())


async def _without_details(work: Coroutine[Any, Any, _T]) -> _T:
    """Return the result of `work`. A failure is logged here; the client learns only that something failed."""
    try:
        return await work
    except SessionError:
        raise
    except Exception as error:  # noqa: BLE001 - a client must not learn what failed
        _LOG.error("%s", error, exc_info=not isinstance(error, VigilError))
        raise _FAILED from None


def plan_serving(pack: PackName, settings: ServeSettings) -> RunPlan:
    """Return the plan of the run that a server records. Raises InputError."""
    shared = {one.name for one in fields(settings)} & {one.name for one in fields(RunSettings)}
    run_settings = {"pack": pack, **{name: getattr(settings, name) for name in shared}}
    plan = plan_live_run(run_settings, f"remote:{settings.name}", "remote", settings.log_dir)
    if plan.spec.profile.row.declares_criteria:
        raise SettingError(
            f"Profile {settings.profile!r} asks a question before the first frame, which `vigil serve` cannot do. "
            "Choose another profile."
        )
    interval = {"frame_interval_seconds": settings.frame_interval_seconds}
    return replace(plan, spec=plan.spec.model_copy(update=interval))


def open_host(plan: RunPlan, settings: ServeSettings) -> Host:
    """Return the host of a new or continued run. Raises InputError, or SimulatorError if no simulator starts."""
    if settings.training and plan.pack.manifest.suite == CHORES_SUITE:
        raise SettingError(
            "--training works only with packs of the families, but this pack contains lists of chores. Leave out "
            "--training."
        )
    return open_live_run(plan, lambda folder, pool: Host(plan, settings, folder, pool))
