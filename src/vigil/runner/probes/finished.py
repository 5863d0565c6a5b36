"""`vigil probe`: asks what a model believed at the steps of a finished run, without playing the run again."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from vigil.agents.frame_encoding import EncodedFrame
from vigil.errors import RecordError
from vigil.packs.pack import Pack
from vigil.records.probe import QUESTIONS
from vigil.records.probe_file import ProbeLog, ProbeTable, read_probes
from vigil.records.record import FRAMES_FOLDER
from vigil.runner.models.access import Endpoint, hiding_other_keys, model_access
from vigil.runner.models.context import CHARS_PER_TOKEN, PICTURE_TOKENS
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.redaction import REDACTED, Secrets, redacted_errors
from vigil.runner.probes.prober import MissingProbes, Play, ProbePlan, Prober, framings, needed_frames, step_messages
from vigil.runner.retries import RetryPolicy
from vigil.runner.settings import FinishedProbeSettings
from vigil.runner.verify_run import recorded_worker_plan
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.pool import SimulatorPool, worker_count
from vigil.scoring.probe_schedule import ProbeSchedule
from vigil.scoring.saved_run import SavedRun, read_run


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
            asyncio.run(_ask(probing, settings, endpoint, _Session(log, pool, secrets, on_progress)))
        return log.table


@dataclass(frozen=True, slots=True)
class _Session:
    log: ProbeLog
    pool: SimulatorPool
    secrets: Secrets
    on_progress: Callable[[int, int], None]


async def _ask(
    probing: FinishedProbing, settings: FinishedProbeSettings, endpoint: Endpoint, session: _Session
) -> None:
    # Inspect takes a second or two to import.
    from vigil.runner.models.inspect_model import ModelClient  # noqa: PLC0415 - loads Inspect

    header, redact = probing.run.header, session.secrets.redact
    earlier = () if settings.force else header.answering_models
    async with ModelClient(endpoint, ModelIdentityLog(earlier_names=earlier, redact=redact)) as client:
        prober = Prober(probing.plan, header.spec.profile, client.ask, session.log, header.sha256, redact)
        missing = MissingProbes(prober, FrameStore(probing.run.folder / FRAMES_FOLDER), session.pool)
        await missing.ask(probing.plays, settings.max_connections, session.on_progress)
