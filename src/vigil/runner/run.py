"""Running a pack: settings in, a folder of records out.

Scripted, privileged and `exec:` agents play inside the simulator workers, one episode at a time in each. Models play
from the main process, many episodes at once (`vigil.runner.inspect_task`). The run's folder decides what remains to be
played.
"""

import asyncio
from collections.abc import Awaitable, Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path

from tenacity import AsyncRetrying, RetryCallState, retry_if_result, stop_after_attempt

from vigil.errors import InfrastructureError, SettingError, SimulatorError
from vigil.packs.pack import Pack, manifest_of
from vigil.packs.private import is_private
from vigil.processes.worker import Worker
from vigil.protocol.episode import Episode
from vigil.records.costs import RunTokens
from vigil.records.record import EpisodeRecord, RunHeader, RunSpec
from vigil.records.shards import play_order, shard_episodes
from vigil.runner.models.access import hiding_other_keys
from vigil.runner.models.ask import Ask, RetryPolicy
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.redaction import Secrets, redacted_errors
from vigil.runner.models.thinking import describe_switch
from vigil.runner.play_queue import PlayQueue
from vigil.runner.progress import OnProgress, ProgressCounter
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import (
    RunSettings,
    access_of,
    input_paths,
    log_dir,
    plan_run,
    sampling_of,
    secrets_of,
    worker_plan,
)
from vigil.runner.workers.live import boundary_of, error_record, play_live
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.runner.workers.pool import SimulatorPool, worker_count

ATTEMPTS = 3
"""Maximum number of attempts at an episode before its `error` row is written."""
MAX_ERRORS_IN_A_ROW = 25
"""Number of consecutive errors after which the run stops, because a server or all simulators seem to have failed."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """Result of a run."""

    folder: Path
    header: RunHeader
    episodes: tuple[Episode, ...]
    """Episodes that the run plans to play; for a shard, its part of them."""
    records: tuple[EpisodeRecord, ...]
    """Effective rows, including errors."""
    resumed: int
    """Number of rows from earlier sessions."""
    tokens: RunTokens
    """Tokens of the replies in the rows, as far as the provider reported them."""
    partial_line_file: Path | None = None
    """File with the incomplete last line of a killed run; None when there was none."""
    notes: tuple[str, ...] = ()
    """Notes on rows from earlier sessions: which of them do not count, and why."""

    @property
    def errors(self) -> int:
        """Number of plays that ended as `error`; the same command plays them again."""
        return sum(record.end == "error" for record in self.records)

    @property
    def is_complete(self) -> bool:
        """Whether every planned episode has a row without error."""
        return len(self.records) - self.errors == len(self.episodes) * self.header.spec.epochs


@dataclass(frozen=True, slots=True)
class _RunSession:
    """State of one session of a run."""

    settings: RunSettings
    pack: Pack
    episodes: Sequence[Episode]
    spec: RunSpec
    folder: RunFolder
    progress: ProgressCounter
    secrets: Secrets

    def pending(self) -> list[Assignment]:
        """Return the assignments that remain, by epoch and house, with twins far from each other."""
        return [
            Assignment(episode, epoch)
            for epoch in range(1, self.spec.epochs + 1)
            for episode in play_order(self.episodes, self.pack.pairs)
            if not self.folder.is_done(episode.id, epoch)
        ]

    def save(self, assignment: Assignment, record: EpisodeRecord) -> None:
        """Write a row and report progress. Raises InfrastructureError after MAX_ERRORS_IN_A_ROW consecutive errors."""
        self.folder.append(record)
        self.progress.count(assignment.episode, record)
        if self.progress.errors_in_a_row >= MAX_ERRORS_IN_A_ROW and record.error is not None:
            raise InfrastructureError(
                f"{MAX_ERRORS_IN_A_ROW} episodes in a row ended as an error, the last one at the "
                f"{record.error.boundary}: {record.error.message} The standard error of agents and simulators is in "
                f"{str(self.folder.logs)!r}. All episodes played so far are saved; fix the cause and repeat the "
                "command."
            )


def run_pack(settings: RunSettings, *, on_progress: OnProgress = lambda _: None) -> RunResult:
    """Run the selected episodes of a pack and return the result; `on_progress` is called with each new state.

    Raises InputError (invalid settings, or another run in the folder), ModelAPIError when images do not reach the
    model, SimulatorError when a simulator cannot start, and KeyboardInterrupt. All episodes played so far are saved.
    """
    secrets = secrets_of(settings)
    with redacted_errors(secrets):
        return _run_pack(settings, secrets, on_progress)


def _run_pack(settings: RunSettings, secrets: Secrets, on_progress: OnProgress) -> RunResult:
    pack, episodes, spec = plan_run(settings)
    if settings.model is not None:
        access_of(settings).check()
    path, inputs = log_dir(settings, spec), input_paths(pack, settings.asset_database)
    folder = RunFolder.create_or_resume(path, spec, episodes, inputs, force=settings.force)
    try:
        episodes = shard_episodes(episodes, spec.shard)
        if settings.prices is not None:
            folder.note_prices(settings.prices)
        progress = ProgressCounter(episodes, spec.epochs, folder.records(), on_progress, folder.cost)
        run = _RunSession(settings, pack, episodes, spec, folder, progress, secrets)
        resumed = sum(record.end != "error" for record in folder.records())
        assignments = run.pending()
        if assignments:
            _play_all(run, assignments)
        folder.note_end()
        rows = tuple(folder.records())
        return RunResult(
            folder.path,
            folder.header,
            tuple(episodes),
            rows,
            resumed,
            tokens=folder.tokens,
            partial_line_file=folder.partial_line_file,
            notes=folder.notes,
        )
    finally:
        folder.close()


def _play_all(run: _RunSession, assignments: list[Assignment]) -> None:
    settings = run.settings
    is_model = settings.model is not None
    frames = run.folder.frames if settings.save_frames else None
    plan = worker_plan(settings, run.pack, run.spec.profile, run_id=run.folder.header.run_id, frames=frames)
    with _pool(run, plan, len(assignments)) as pool:
        is_shown_frames = run.spec.agent_kind in ("model", "exec")
        run.folder.note_facts(pool.facts(assignments[0] if is_shown_frames else None))
        if is_model:
            _play_with_model(run, pool, assignments)
        else:
            run.progress.start()
            asyncio.run(_play_in_workers(run, pool, assignments))


@contextmanager
def _pool(run: _RunSession, plan: WorkerPlan, most: int) -> Generator[SimulatorPool, None, None]:
    """Start at most `most` workers, locally or on Ray. Raises SettingError when Ray is not available."""
    settings = run.settings
    timeout_s = settings.timeout_s + (settings.reply_seconds if run.spec.agent_kind == "exec" else 0.0)
    if settings.executor == "local":
        workers = min(worker_count(settings.workers), most)
        with SimulatorPool(plan, workers, timeout_s=timeout_s, logs=run.folder.logs) as pool:
            yield pool
        return
    if find_spec("ray") is None:
        raise SettingError('Ray is not installed here. Run: pip install "vigil-bench[ray]".')
    from vigil.runner.ray_cluster import connect_cluster  # noqa: PLC0415

    with connect_cluster(settings.ray_address, plan) as cluster:
        workers = min(settings.workers or cluster.cpus, most)
        logs, start = run.folder.logs, cluster.start
        with SimulatorPool(cluster.plan, workers, timeout_s=timeout_s, logs=logs, start=start) as pool:
            yield pool


async def _play_in_workers(run: _RunSession, pool: SimulatorPool, assignments: list[Assignment]) -> None:
    """Play with the agent inside the workers, as many episodes at once as there are workers."""
    waiting = PlayQueue(assignments, run.pack.pairs)

    async def work(worker: Worker) -> None:
        last = None
        while (last := waiting.take(last)) is not None:
            run.save(
                last, await _play_with_retries(last, run, lambda attempt: _play_in_worker(pool, worker, attempt, run))
            )

    await asyncio.gather(*map(work, pool.workers))


async def _play_in_worker(
    pool: SimulatorPool, worker: Worker, assignment: Assignment, run: _RunSession
) -> EpisodeRecord:
    started, may_resume = datetime.now(UTC), run.spec.agent_kind == "exec"
    try:
        return await pool.play(assignment, _on_first_frame(assignment, run), may_resume=may_resume, worker=worker)
    except SimulatorError as error:
        return error_record(assignment, run.folder.header.run_id, boundary_of(error), str(error), started)


def _play_with_model(run: _RunSession, pool: SimulatorPool, assignments: list[Assignment]) -> None:
    """Play with a model in this process."""
    # Inspect takes a second or two to import, and only runs of models need it.
    from vigil.runner.inspect_task import evaluate  # noqa: PLC0415
    from vigil.runner.models.inspect_model import Endpoint, preflight  # noqa: PLC0415

    settings, profile = run.settings, run.spec.profile
    identity_log = _identity_log(run)
    identity_log.on_new_identity = lambda: run.folder.note_provider(identity_log.provider_facts())
    endpoint = Endpoint(
        identity_log=identity_log,
        access=access_of(settings),
        sampling=sampling_of(settings),
        max_connections=settings.max_connections,
        reply_seconds=settings.reply_seconds,
        keep_reasoning=settings.keep_reasoning,
        retry_policy=RetryPolicy(
            settings.retries,
            settings.first_wait_s,
            settings.longest_wait_s,
            on_retry=lambda retry_reason: run.progress.note_retry(run.secrets.redact(retry_reason)),
        ),
    )

    async def play_one(assignment: Assignment, ask: Ask) -> EpisodeRecord:
        record = await _play_with_retries(
            assignment,
            run,
            lambda attempt: play_live(
                pool.live(attempt), profile, ask, run.folder.header.run_id, _on_first_frame(attempt, run)
            ),
        )
        run.save(assignment, record)
        return record

    with hiding_other_keys(endpoint.access):
        try:
            if settings.preflight:
                asyncio.run(preflight(endpoint, run.spec.agent, profile, force=settings.force))
            run.progress.start()
            keep_samples = not is_private(manifest_of(settings.pack).meta)
            evaluate(endpoint, assignments, play_one, run.folder.inspect_logs, keep_samples=keep_samples)
        finally:
            run.folder.note_provider(identity_log.provider_facts())


def _identity_log(run: _RunSession) -> ModelIdentityLog:
    """Return the log of answering models; it refuses a model that differs from earlier sessions, unless forced."""
    settings = run.settings
    found, effort = access_of(settings).model_name, settings.reasoning_effort
    set_by = f"--reasoning-effort {effort}" if effort else ""
    if settings.thinking != "default" and found is not None:
        set_by = f"--thinking {settings.thinking}: {describe_switch(settings.thinking, found)}"
    return ModelIdentityLog(
        earlier_names=() if settings.force else run.folder.header.answering_models,
        asked=settings.thinking,
        effort=effort,
        set_by=set_by,
        redact=run.secrets.redact,
    )


def _on_first_frame(assignment: Assignment, run: _RunSession) -> Callable[[], None]:
    """Return the callback that records an attempt just before the agent sees its first frame."""
    return lambda: run.folder.attempts.begin((assignment.episode.id, assignment.epoch))


async def _play_with_retries(
    assignment: Assignment, run: _RunSession, play: Callable[[Assignment], Awaitable[EpisodeRecord]]
) -> EpisodeRecord:
    """Play an episode until it ends without error, at most ATTEMPTS times, waiting longer each time.

    A failure of a model is not retried here, because each request was retried before. Neither is an episode whose
    program saw a frame before its worker was finally lost, because the program would know the episode.
    """
    key, attempts = (assignment.episode.id, assignment.epoch), run.folder.attempts
    wait_s = RetryPolicy(first_wait_s=run.settings.first_wait_s).wait_s

    async def attempt() -> tuple[EpisodeRecord, bool]:
        before = attempts.count(key)
        record = _without_secrets(await play(Assignment(assignment.episode, assignment.epoch, before + 1)), run.secrets)
        has_seen_frame = attempts.count(key) > before
        boundary = None if record.error is None else record.error.boundary
        is_lost = boundary == "worker" and has_seen_frame and run.spec.agent_kind == "exec"
        return record, boundary in (None, "model") or is_lost

    retrying = AsyncRetrying(
        retry=retry_if_result(lambda played: not played[1]),
        stop=stop_after_attempt(ATTEMPTS),
        wait=wait_s,
        retry_error_callback=_last_attempt,
    )
    played: tuple[EpisodeRecord, bool] = await retrying(attempt)
    return played[0]


def _last_attempt(state: RetryCallState) -> tuple[EpisodeRecord, bool]:
    assert state.outcome is not None
    return state.outcome.result()


def _without_secrets(record: EpisodeRecord, secrets: Secrets) -> EpisodeRecord:
    """Return the record with secrets removed from its error message; replies are evidence and stay unchanged."""
    if record.error is None:
        return record
    error = record.error.model_copy(update={"message": secrets.redact(record.error.message)})
    return record.model_copy(update={"error": error})
