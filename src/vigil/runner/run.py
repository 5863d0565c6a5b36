"""Running a pack: settings in, a folder of records out.

Scripted, privileged and `exec:` agents play inside the simulator workers, one episode a worker; models play from the
main process, many episodes at once (`vigil.runner.inspect_task`). What has been played is decided by the run's folder.
"""

import asyncio
import hashlib
import os
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from vigil.agents.choose import is_exec, make_agent
from vigil.agents.exec_agent import REPLY_SECONDS
from vigil.episode import Episode, Family
from vigil.errors import InfrastructureError, SettingError, SimulatorError
from vigil.pack import Pack, Selection
from vigil.profile import BASELINE, Coordinates, ImageFormat, Profile, PromptVariant, ReplyPolicy, coordinates_for
from vigil.prompt import policy_sha256, policy_version
from vigil.record import AgentKind, EpisodeRecord, RunHeader, RunSpec
from vigil.runner.ask import Ask, Patience
from vigil.runner.live import lost_record, play_live
from vigil.runner.pool import PATIENCE_S, SimulatorPool, WorkerLost
from vigil.runner.progress import OnProgress, Tally
from vigil.runner.run_folder import RunFolder
from vigil.runner.serving import serving, without_secrets
from vigil.runner.wire import Plan, PrivilegedFactory, Quality, Ticket
from vigil.sim import BACKENDS

ATTEMPTS = 3
"""How often an episode is played at most before its `error` row is written."""
MAX_ERRORS_IN_A_ROW = 25
"""After so many the run stops: the server is gone, or no simulator works."""
RUNS_FOLDER = Path("runs")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """All that `vigil run` takes. Exactly one of `agent` and `model` is set."""

    pack: str | Path = "starter"
    agent: str | None = None
    """A scripted agent, `exec:COMMAND`, or a privileged one that `agent_factory` makes."""
    agent_factory: PrivilegedFactory | None = None
    model: str | None = None
    """`provider/model` as Inspect knows it."""
    base_url: str | None = None
    log_dir: Path | None = None
    """The run's folder; None for one under `runs/` that the same settings find again."""
    families: tuple[Family, ...] = ()
    episode_ids: tuple[str, ...] = ()
    limit: int | None = None
    epochs: int = 1
    workers: int | None = None
    """Simulator processes; None for one a CPU."""
    max_connections: int = 16
    """Requests to the model, and episodes alive, at once."""
    profile: str = BASELINE
    prompt_variant: PromptVariant = "default"
    coordinates: Coordinates | None = None
    """None takes the published table's entry for the model."""
    reply_policy: ReplyPolicy = "strict"
    image_format: ImageFormat = "png"
    temperature: float | None = None
    top_p: float | None = None
    max_tokens: int | None = None
    reasoning_effort: str | None = None
    extra_body: Mapping[str, Any] = field(default_factory=dict)
    model_args: Mapping[str, Any] = field(default_factory=dict)
    backend: str = "mujoco"
    render_quality: Quality = "default"
    asset_database: Path | None = None
    save_frames: bool = False
    preflight: bool = True
    retries: int = 8
    first_wait_s: float = 1.0
    request_seconds: int = 600
    patience_s: float = PATIENCE_S
    seed: int = 0


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run left behind."""

    folder: Path
    header: RunHeader
    episodes: tuple[Episode, ...]
    """Those that the run was meant to play."""
    records: tuple[EpisodeRecord, ...]
    """The rows that stand, errors included."""
    resumed: int
    """How many of them were there before."""

    @property
    def errors(self) -> int:
        """Episodes that ended as `error`; the same command plays them again."""
        return sum(record.end == "error" for record in self.records)

    @property
    def is_complete(self) -> bool:
        """Whether every planned episode has a row without error."""
        return len(self.records) - self.errors == len(self.episodes) * self.header.spec.epochs


@dataclass(frozen=True, slots=True)
class _Run:
    """One session of a run: what the parts below share."""

    settings: RunSettings
    pack: Pack
    episodes: Sequence[Episode]
    spec: RunSpec
    folder: RunFolder
    tally: Tally

    def pending(self) -> list[Ticket]:
        """Returns what is still to be played, epoch by epoch, by episode id."""
        return [
            Ticket(episode, epoch)
            for epoch in range(1, self.spec.epochs + 1)
            for episode in self.episodes
            if not self.folder.is_done(episode.id, epoch)
        ]

    def keep(self, ticket: Ticket, record: EpisodeRecord) -> None:
        """Writes a row and tells about it. Raises InfrastructureError when nothing works any more."""
        self.folder.append(record)
        self.tally.count(ticket.episode, record)
        if self.tally.errors_in_a_row >= MAX_ERRORS_IN_A_ROW and record.error is not None:
            raise InfrastructureError(
                f"{MAX_ERRORS_IN_A_ROW} episodes in a row ended as an error, the last one at the "
                f"{record.error.boundary}: {record.error.message} What was played is kept; mend this and give the same "
                "command again."
            )


def run_pack(settings: RunSettings, *, on_progress: OnProgress = lambda _: None) -> RunResult:
    """Runs the selected episodes of a pack and returns what stands afterwards.

    Raises InputError (bad settings, another run in the folder), ModelAPIError when pictures do not reach the model,
    SimulatorError when no simulator starts, KeyboardInterrupt; what was played until then is kept.
    """
    pack, episodes, spec = plan_run(settings)
    folder = RunFolder.create_or_resume(log_dir(settings, spec), spec)
    try:
        run = _Run(settings, pack, episodes, spec, folder, Tally(episodes, spec.epochs, folder.records(), on_progress))
        resumed = sum(record.end != "error" for record in folder.records())
        tickets = run.pending()
        if tickets:
            _play_all(run, tickets)
        folder.note_end()
        return RunResult(folder.path, folder.header, tuple(episodes), tuple(folder.records()), resumed)
    finally:
        folder.close()


def plan_run(settings: RunSettings) -> tuple[Pack, list[Episode], RunSpec]:
    """Returns the pack, the episodes to play and the run's identity. Raises InputError."""
    _check(settings)
    pack = Pack.load(settings.pack)
    episodes = pack.select(Selection(settings.families, settings.episode_ids, settings.limit))
    profile = profile_of(settings)
    sampling = {
        "temperature": settings.temperature,
        "top_p": settings.top_p,
        "max_tokens": settings.max_tokens,
        "reasoning_effort": settings.reasoning_effort,
        "extra_body": dict(settings.extra_body) or None,
    }
    spec = RunSpec(
        agent=settings.model or settings.agent or "",
        agent_kind=_kind(settings),
        base_url=settings.base_url,
        sampling=without_secrets({name: value for name, value in sampling.items() if value is not None}),
        model_args=without_secrets(settings.model_args),
        profile=profile,
        prompt_policy=policy_version(profile),
        prompt_policy_sha256=policy_sha256(profile),
        pack=pack.name,
        pack_sha256=pack.sha256,
        episode_ids=tuple(episode.id for episode in episodes),
        epochs=settings.epochs,
        seed=settings.seed,
        simulator=settings.backend,
        render_quality=settings.render_quality,
    )
    return pack, episodes, spec


def profile_of(settings: RunSettings) -> Profile:
    """Returns the condition of evaluation that the settings ask for."""
    fitting = coordinates_for(settings.model) if settings.model else "pixel"
    return Profile.model_validate(
        {
            "name": settings.profile,
            "prompt_variant": settings.prompt_variant,
            "coordinates": settings.coordinates or fitting,
            "reply_policy": settings.reply_policy,
            "image_format": settings.image_format,
        }
    )


def log_dir(settings: RunSettings, spec: RunSpec) -> Path:
    """Returns the run's folder: as set, or one under `runs/` named after what the run is."""
    if settings.log_dir is not None:
        return settings.log_dir
    identity = spec.model_copy(update={"base_url": None}).model_dump_json()
    words = "".join(char if char.isalnum() or char in "._" else "-" for char in f"{spec.pack}-{spec.agent}")
    return RUNS_FOLDER / f"{words[:80].strip('-')}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


def _kind(settings: RunSettings) -> AgentKind:
    if settings.model is not None:
        return "model"
    if settings.agent_factory is not None:
        return "privileged"
    return "exec" if is_exec(settings.agent or "") else "scripted"


def _check(settings: RunSettings) -> None:
    if (settings.agent is None) == (settings.model is None):
        raise SettingError("A run needs an agent or a model: give exactly one of --agent and --model.")
    for name, least in (("epochs", 1), ("max_connections", 1), ("retries", 0), ("request_seconds", 1)):
        if getattr(settings, name) < least:
            raise SettingError(f"Setting {name} is {getattr(settings, name)}; it must be {least} or more.")
    if settings.workers is not None and settings.workers < 1:
        raise SettingError(f"Setting workers is {settings.workers}; it must be 1 or more.")
    if settings.backend not in BACKENDS:
        raise SettingError(f"Simulator {settings.backend!r} does not exist. Choose one of: {', '.join(BACKENDS)}.")
    if settings.agent is not None and settings.agent_factory is None:
        make_agent(settings.agent, Profile())
    if settings.model is not None:
        serving(settings.model, settings.base_url, settings.model_args)


def _play_all(run: _Run, tickets: list[Ticket]) -> None:
    settings = run.settings
    is_model = settings.model is not None
    plan = Plan(
        pack=run.pack.folder,
        run_id=run.folder.header.run_id,
        profile=run.spec.profile,
        backend=settings.backend,
        quality=settings.render_quality,
        asset_database=settings.asset_database,
        frames=run.folder.frames if settings.save_frames else None,
        agent="" if is_model else run.spec.agent,
        agent_factory=settings.agent_factory,
        seed=settings.seed,
    )
    patience_s = settings.patience_s + (REPLY_SECONDS if run.spec.agent_kind == "exec" else 0.0)
    workers = min(settings.workers or os.cpu_count() or 1, len(tickets))
    with SimulatorPool(plan, workers, patience_s=patience_s, logs=run.folder.logs) as pool:
        run.folder.note_facts(pool.facts())
        run.tally.start()
        if is_model:
            _play_outside(run, pool, tickets)
        else:
            asyncio.run(_play_inside(run, pool, tickets))


async def _play_inside(run: _Run, pool: SimulatorPool, tickets: list[Ticket]) -> None:
    """Plays with the agent inside the workers, as many episodes at once as there are workers."""
    waiting = iter(tickets)

    async def work() -> None:
        for ticket in waiting:
            run.keep(ticket, await _attempts(ticket, run, lambda attempt: _inside(pool, attempt, run)))

    await asyncio.gather(*(work() for _ in pool.workers))


async def _inside(pool: SimulatorPool, ticket: Ticket, run: _Run) -> EpisodeRecord:
    started = datetime.now(UTC)
    try:
        return await pool.play(ticket)
    except SimulatorError as error:
        boundary = "worker" if isinstance(error, WorkerLost) else "simulator"
        return lost_record(ticket, run.folder.header.run_id, boundary, str(error), started)


def _play_outside(run: _Run, pool: SimulatorPool, tickets: list[Ticket]) -> None:
    """Plays with a model in this process."""
    # Inspect takes a second or two to import, and nothing but a model's run needs it.
    from vigil.runner.inspect_task import Endpoint, evaluate, preflight  # noqa: PLC0415

    settings, profile = run.settings, run.spec.profile
    endpoint = Endpoint(
        serving=serving(run.spec.agent, settings.base_url, settings.model_args),
        sampling={**run.spec.sampling, **({"extra_body": dict(settings.extra_body)} if settings.extra_body else {})},
        max_connections=settings.max_connections,
        request_seconds=settings.request_seconds,
        patience=Patience(settings.retries, settings.first_wait_s, rng=np.random.default_rng(settings.seed)),
    )
    if settings.preflight:
        asyncio.run(preflight(endpoint, run.spec.agent, profile.image_format))

    async def play_one(ticket: Ticket, ask: Ask) -> EpisodeRecord:
        record = await _attempts(
            ticket, run, lambda attempt: play_live(pool.live(attempt), profile, ask, run.folder.header.run_id)
        )
        run.keep(ticket, record)
        return record

    evaluate(endpoint, tickets, play_one, run.folder.inspect_logs)


async def _attempts(ticket: Ticket, run: _Run, play: Callable[[Ticket], Awaitable[EpisodeRecord]]) -> EpisodeRecord:
    """Plays an episode until it ends without error, at most ATTEMPTS times, waiting longer each time.

    A model's failure is not tried again: every single request was.
    """
    patience = Patience(first_wait_s=run.settings.first_wait_s)
    attempt = 1
    while True:
        record = await play(Ticket(ticket.episode, ticket.epoch, attempt))
        is_final = record.error is None or record.error.boundary == "model" or attempt == ATTEMPTS
        if is_final:
            return record
        await asyncio.sleep(patience.wait_s(attempt, None))
        attempt += 1
