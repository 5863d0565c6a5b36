"""Running a pack: carry out a plan, and write a folder of records.

Scripted, privileged and `exec:` agents play inside the simulator workers, one episode at a time in each worker. Models
play from the main process, many episodes at once (`vigil.runner.inspect_task`). The records in the run's folder decide
which episodes are still to be played.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from tenacity import AsyncRetrying, retry_if_result, stop_after_attempt

from vigil.base.processes.worker import LocalProcess, StartProcess, Worker
from vigil.errors import InfrastructureError, SettingError
from vigil.packs.private import is_private
from vigil.protocol.episode import Episode
from vigil.records.costs import RunTokens
from vigil.records.probe_file import ProbeLog, ProbeTable
from vigil.records.record import EpisodeRecord, RunHeader
from vigil.records.record_file import StoredRecords
from vigil.records.shards import play_order
from vigil.runner.models.access import Endpoint, hiding_other_keys
from vigil.runner.models.ask import Ask
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.providers import describe_switch
from vigil.runner.models.redaction import redacted_errors
from vigil.runner.plan import RunPlan, plan_run
from vigil.runner.probes import Play, Prober, ask_missing, new_prober
from vigil.runner.progress import OnProgress, ProgressCounter
from vigil.runner.retries import ATTEMPTS, RetryPolicy
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import RunSettings
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.messages import Assignment
from vigil.runner.workers.players import ModelPlayer, PlayOnce, PlayOne, play_in_worker
from vigil.runner.workers.pool import SimulatorPool, usable_cpus

MAX_ERRORS_IN_A_ROW = 25
"""Number of consecutive errors after which the run stops, because a server or all simulators seem to have failed."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """Result of a run: its records, and facts about the session that has ended."""

    folder: Path
    header: RunHeader
    episodes: tuple[Episode, ...]
    """Episodes that the run plans to play; for a shard, only the shard's part of them."""
    records: StoredRecords
    """The row that counts for each play, including errors; each is read from the run's folder when it is needed."""
    resumed: int
    """Number of rows from earlier sessions."""
    tokens: RunTokens
    """Tokens of the replies in the rows, as far as the provider reported them."""
    partial_line_file: Path | None = None
    """File with the incomplete last line of a killed run; None when there was none."""
    notes: tuple[str, ...] = ()
    """Notes that say which rows from earlier sessions do not count, and why."""
    probes: ProbeTable | None = None
    """Probes of all sessions; None if this session asked none."""

    @property
    def errors(self) -> int:
        """Number of plays that ended as `error`; the same command plays them again."""
        return self.records.errors

    @property
    def is_complete(self) -> bool:
        """Whether every planned episode has a row without error."""
        return len(self.records) - self.errors == len(self.episodes) * self.header.spec.epochs


@dataclass(frozen=True, slots=True)
class _RunSession:
    """State of one session of a run: its plan, folder, progress and probes."""

    plan: RunPlan
    folder: RunFolder
    progress: ProgressCounter
    probes: ProbeLog | None
    """Log of the probes; None if the run asks none."""

    def pending(self) -> list[Assignment]:
        """Return the assignments that remain, sorted by epoch and house, with twins far from each other."""
        forks = self.plan.forks
        return [
            Assignment(episode, epoch, fork=None if forks is None else forks.fork(episode))
            for epoch in range(1, self.plan.spec.epochs + 1)
            for episode in play_order(self.plan.episodes, self.plan.pack.pairs)
            if not self.folder.log.is_done((episode.id, epoch))
        ]

    def unprobed(self) -> list[Play]:
        """Return the plays of earlier sessions that still lack probes."""
        asked = self.plan.execution.probes
        if self.probes is None or asked is None:
            return []
        by_id, table = {episode.id: episode for episode in self.plan.episodes}, self.probes.table
        plays = [(by_id[record.episode_id], record) for record in self.folder.log.records()]
        return [play for play in plays if asked.missing(table, *play)]

    def prober(self, asking: Callable[[ModelIdentityLog], Ask]) -> Prober:
        """Return the prober of a run with probes, which asks through the function that `asking` returns."""
        asked, plan = self.plan.execution.probes, self.plan
        assert self.probes is not None
        assert asked is not None
        redact, force = plan.secrets.redact, plan.execution.force
        return new_prober(asked, self.folder.header, self.probes, asking, redact, force=force)

    async def play(self, assignment: Assignment, play_once: PlayOnce) -> EpisodeRecord:
        """Play an episode until it ends without error, at most ATTEMPTS times with growing waits, and save its row.

        Raises InfrastructureError after MAX_ERRORS_IN_A_ROW consecutive errors.
        """
        retrying = AsyncRetrying(
            retry=retry_if_result(self._is_played_again),
            stop=stop_after_attempt(ATTEMPTS),
            wait=RetryPolicy(first_wait_s=self.plan.execution.first_wait_s).wait_s,
            retry_error_callback=lambda state: state.outcome and state.outcome.result(),
        )
        record: EpisodeRecord = await retrying(self._attempt, assignment, play_once)
        self.folder.append(record)
        self.progress.count(assignment.episode, record)
        if self.progress.errors_in_a_row >= MAX_ERRORS_IN_A_ROW and record.error is not None:
            raise InfrastructureError(
                f"{MAX_ERRORS_IN_A_ROW} episodes in a row ended as an error, the last one at the "
                f"{record.error.boundary}: {record.error.message} The standard error of agents and simulators is in "
                f"{str(self.folder.logs)!r}. All episodes played so far are saved; fix the cause and repeat the "
                "command."
            )
        return record

    async def _attempt(self, assignment: Assignment, play_once: PlayOnce) -> EpisodeRecord:
        """Play an episode once. Secrets are removed from an error's message, not from replies, which are evidence."""
        key, attempts = (assignment.episode.id, assignment.epoch), self.folder.attempts
        this = replace(assignment, attempt=attempts.count(key) + 1)
        record = await play_once(this, lambda: attempts.begin(key))
        if record.error is None:
            return record
        message = self.plan.secrets.redact(record.error.message)
        return record.model_copy(update={"error": record.error.model_copy(update={"message": message})})

    def _is_played_again(self, record: EpisodeRecord) -> bool:
        """Return whether an episode is played again after this attempt.

        A failure of a model is not retried here, because each request was already retried. If a program saw a frame and
        the worker was then lost, the episode is not played again either: the program would know the episode.
        """
        boundary = None if record.error is None else record.error.boundary
        has_seen_frame = self.folder.attempts.count(record.key) >= record.attempt
        is_lost = boundary == "worker" and has_seen_frame and self.plan.spec.agent_kind == "exec"
        return boundary not in (None, "model") and not is_lost


def run_pack(settings: RunSettings, *, on_progress: OnProgress = lambda _: None) -> RunResult:
    """Run the selected episodes of a pack and return the result, like `play_run`."""
    return play_run(plan_run(settings), on_progress=on_progress)


def play_run(plan: RunPlan, *, on_progress: OnProgress = lambda _: None) -> RunResult:
    """Play what remains of a planned run and return the result; `on_progress` is called with each new state.

    Raises InputError for invalid settings or a folder with another run, ModelAPIError when images do not reach the
    model, SimulatorError when a simulator cannot start, and KeyboardInterrupt. All episodes played so far are saved.
    """
    execution = plan.execution
    with redacted_errors(plan.secrets), ExitStack() as stack:
        if plan.endpoint is not None:
            plan.endpoint.access.check()
        folder = RunFolder.create_or_resume(
            execution.folder, plan.spec, plan.pack.episodes, execution.input_paths, force=execution.force
        )
        stack.callback(folder.close)
        if execution.prices is not None:
            folder.note_prices(execution.prices)
        earlier = folder.log.records()
        progress = ProgressCounter(plan, earlier, on_progress, folder.cost)
        probes = None
        if execution.probes is not None:
            probes = stack.enter_context(ProbeLog(folder.path, folder.header.sha256))
        _play_all(_RunSession(plan, folder, progress, probes))
        folder.note_end()
        return RunResult(
            folder.path,
            folder.header,
            plan.episodes,
            folder.log.records(),
            len(earlier) - earlier.errors,
            tokens=folder.log.tokens,
            partial_line_file=folder.log.partial_line_file,
            notes=folder.notes,
            probes=None if probes is None else probes.table,
        )


def _play_all(run: _RunSession) -> None:
    assignments, unprobed = run.pending(), run.unprobed()
    if not assignments and not unprobed:
        return
    with _pool(run, len(assignments) + len(unprobed)) as pool:
        if assignments:
            is_shown_frames = run.plan.spec.agent_kind in ("model", "exec")
            run.folder.note_facts(pool.facts(assignments[0] if is_shown_frames else None))
            if run.plan.endpoint is not None:
                _play_with_model(run, run.plan.endpoint, pool, assignments)
            else:
                run.progress.start()
                asyncio.run(_play_in_workers(run, pool, assignments))
        if unprobed and run.plan.endpoint is not None:
            with hiding_other_keys(run.plan.endpoint.access):
                store = FrameStore(run.folder.frames)
                asyncio.run(ask_missing(run.plan.endpoint, run.prober, store, pool, unprobed))


@contextmanager
def _pool(run: _RunSession, most: int) -> Generator[SimulatorPool, None, None]:
    """Start at most `most` workers, locally or on Ray. Raises SettingError when Ray is not available."""
    execution, folder = run.plan.execution, run.folder
    frames = folder.frames if execution.save_frames else None
    plan, cpus = replace(run.plan.worker, run_id=folder.header.run_id, frames=frames), usable_cpus()
    start: StartProcess = LocalProcess
    with ExitStack() as stack:
        if execution.executor == "ray":
            if find_spec("ray") is None:
                raise SettingError('Ray is not installed here. Run: pip install "vigil-bench[ray]".')
            from vigil.runner.ray_cluster import connect_cluster  # noqa: PLC0415 - loads Ray

            plan, cpus, start = stack.enter_context(connect_cluster(execution.ray_address, plan))
        workers = min(execution.workers or cpus, most)
        yield stack.enter_context(
            SimulatorPool(plan, workers, timeout_s=execution.timeout_s, logs=folder.logs, start=start)
        )


async def _play_in_workers(run: _RunSession, pool: SimulatorPool, assignments: Sequence[Assignment]) -> None:
    """Play with the agent inside the workers; each worker plays one episode at a time."""
    waiting = PlayQueue(assignments, run.plan.pack.pairs)
    run_id, may_resume = run.folder.header.run_id, run.plan.spec.agent_kind == "exec"

    async def work(worker: Worker) -> None:
        last, play_once = None, partial(play_in_worker, pool, worker, run_id, may_resume)
        while (last := waiting.take(last)) is not None:
            await run.play(last, play_once)

    await asyncio.gather(*map(work, pool.workers))


def _play_with_model(
    run: _RunSession, endpoint: Endpoint, pool: SimulatorPool, assignments: Sequence[Assignment]
) -> None:
    """Play with a model that is asked from this process."""
    # Inspect takes a second or two to import, and only runs of models need it.
    from vigil.runner.inspect_task import evaluate  # noqa: PLC0415 - loads Inspect
    from vigil.runner.models.inspect_model import ModelClient, preflight  # noqa: PLC0415 - the same

    plan, spec, folder = run.plan, run.plan.spec, run.folder
    identity_log = _identity_log(run, endpoint)

    def on_retry(reason: str) -> None:
        run.progress.note_retry(plan.secrets.redact(reason))

    endpoint = replace(endpoint, retry_policy=replace(endpoint.retry_policy, on_retry=on_retry))
    with hiding_other_keys(endpoint.access):
        try:
            if plan.execution.preflight:
                check = preflight(endpoint, identity_log, spec.agent, spec.profile, force=plan.execution.force)
                asyncio.run(check)
            run.progress.start()
            client = ModelClient(endpoint, identity_log)
            play_one = _play_one(run, pool, client.ask, None if run.probes is None else run.prober(client.asking))
            keep_samples = not is_private(plan.pack.manifest.meta)
            evaluate(client, assignments, play_one, folder.inspect_logs, keep_samples=keep_samples)
        finally:
            folder.note_provider(identity_log.provider_facts())


def _play_one(run: _RunSession, pool: SimulatorPool, ask: Ask, prober: Prober | None) -> PlayOne:
    """Return the function that plays an episode, writes its row to disk, and then asks its probes."""
    profile, run_id = run.plan.spec.profile, run.folder.header.run_id
    if prober is None:
        return partial(run.play, play_once=ModelPlayer(pool, profile, ask, run_id).play)
    player = ModelPlayer(pool, profile, ask, run_id, prober.keep_frame)

    async def play_one(assignment: Assignment) -> EpisodeRecord:
        record = await run.play(assignment, player.play)
        await prober.ask_all(assignment.episode, record, prober.frames.pop(record.key, {}))
        return record

    return play_one


def _identity_log(run: _RunSession, endpoint: Endpoint) -> ModelIdentityLog:
    """Return the log of answering models; it refuses a model that differs from earlier sessions, unless forced."""
    spec, name = run.plan.spec, endpoint.access.model_name
    effort = endpoint.sampling.get("reasoning_effort")
    set_by = f"--reasoning-effort {effort}" if effort else ""
    thinking = "unknown" if spec.thinking == "default" else spec.thinking
    if effort is not None:
        thinking = "off" if effort == "none" else "on"
    if spec.thinking != "default" and name is not None:
        set_by = f"--thinking {spec.thinking}: {describe_switch(spec.thinking, name)}"
    identity_log = ModelIdentityLog(
        earlier_names=() if run.plan.execution.force else run.folder.header.answering_models,
        thinking=thinking,
        set_by=set_by,
        redact=run.plan.secrets.redact,
    )
    identity_log.on_new_identity = lambda: run.folder.note_provider(identity_log.provider_facts())
    return identity_log


class PlayQueue:
    """Queue of assignments. They are taken in order, but assignments that a worker should not play next are skipped."""

    def __init__(self, assignments: Iterable[Assignment], pairs: Mapping[str, str]) -> None:
        """`pairs` maps the id of each episode that has a twin to the name of the pair."""
        self._waiting = deque(assignments)
        self._pairs = pairs

    def take(self, last: Assignment | None) -> Assignment | None:
        """Return the next assignment for a worker that has just played `last`; None when nothing is left.

        The twin of `last`, and the same episode in another epoch, are only taken if nothing else is left.
        """
        if not self._waiting:
            return None
        pair = None if last is None else self._pair_of(last)
        at = next((at for at, each in enumerate(self._waiting) if self._pair_of(each) != pair), 0)
        found = self._waiting[at]
        del self._waiting[at]
        return found

    def _pair_of(self, assignment: Assignment) -> str:
        return self._pairs.get(assignment.episode.id, assignment.episode.id)
