"""Verifying a whole run: workers simulate every recorded episode again from its recorded replies.

With `records_only`, no simulator is needed: each reply must parse to its recorded action, and nothing else is checked.
"""

import asyncio
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vigil.assets.database import AssetDatabase
from vigil.errors import RecordError, SimulatorError
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.records.record import EpisodeRecord, Key, RunHeader
from vigil.runner.run_folder import host_facts
from vigil.runner.settings import VerifySettings
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.runner.workers.pool import SimulatorPool, worker_count
from vigil.runner.workers.resimulation import FactDifference
from vigil.scoring.saved_run import RecordTable, read_run

SAME_HOST = ("machine", "python", "numpy", "processor")
"""Host facts that must be equal for bit-identical numbers; the results of libraries depend on processor features."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Result of verifying a run."""

    header: RunHeader
    checked: int
    """Number of verified records."""
    errors: int
    """Number of rows that ended as an error; they have nothing to verify."""
    is_exact: bool
    """Whether numbers had to be bit-identical."""
    is_records_only: bool
    """Whether only the records were checked, without a simulator, so that hidden states were not compared."""
    differences: tuple[FactDifference, ...]
    frames: int = 0
    """Number of frames compared; 0 when not requested, or when no frame was viewed during the run."""
    notes: tuple[str, ...] = ()
    """Notes that say which rows do not belong to the run, and why."""
    left_out: int = 0
    """Number of rows that do not belong to the run and are not scored. If there are any, the run is not verified."""

    @property
    def is_verified(self) -> bool:
        """Whether everything was reproduced as recorded, and every row of the file belongs to the run."""
        return self.checked > 0 and not self.differences and not self.left_out


def verify_run(
    path: Path,
    settings: VerifySettings | None = None,
    *,
    on_progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Verification:
    """Return how the records of a run compare with a new simulation of their replies.

    `on_progress` is called with the number of done records and of all records. Raises RecordError, PackMismatch,
    SettingError or SimulatorError.
    """
    settings = settings or VerifySettings()
    saved = read_run(path, settings.pack)
    header, table = saved.header, saved.table
    pack = Pack.load(saved.pack_folder, header.spec.pack_sha256)
    scored = sorted(key for key, row in table.rows.items() if row.outcome is not None)
    keys = scored[: settings.limit]
    here = host_facts()
    is_same_host = all(host.get(name) == here[name] for host in header.hosts for name in SAME_HOST)
    is_exact = is_same_host if settings.exact is None else settings.exact
    if settings.records_only:
        earlier = None if header.spec.fork is None else header.spec.fork.profile
        found = [fault for key in keys for fault in check_replies(table.record(key), header.spec.profile, earlier)]
    else:
        workers = max(1, min(worker_count(settings.workers), len(keys)))
        plan = recorded_worker_plan(pack, header, settings.asset_database, settings.backend)
        with SimulatorPool(plan, workers, timeout_s=settings.timeout_s) as pool:
            verifier = _Verifier(pool, pack, table, settings.frames, is_exact)
            found = asyncio.run(verifier.all(keys, on_progress))
    seen = sum(frames_in(table.record(key)) for key in keys) if settings.frames else 0
    return Verification(
        header,
        len(keys),
        len(table.rows) - len(scored),
        is_exact,
        settings.records_only,
        tuple(found),
        seen,
        table.notes,
        len(table.left_out),
    )


def frames_in(record: EpisodeRecord) -> int:
    """Return the number of frames that the agent of a record viewed."""
    return sum(step.frame_sha256 is not None for step in record.steps)


def check_replies(
    record: EpisodeRecord, profile: Profile, recorded_profile: Profile | None = None
) -> Iterator[FactDifference]:
    """Yield the recorded facts about a reply's meaning that do not follow from the reply.

    `recorded_profile` is the profile of the play that the episode continues; None if it continues no play.
    """
    for step in record.steps:
        is_own = step.index > record.replayed_steps
        read = read_reply(step.reply, profile if is_own or recorded_profile is None else recorded_profile)
        for fact in ("action", "invalid", "ignored_keys"):
            recorded, value = getattr(step, fact), getattr(read, fact)
            if recorded != value:
                yield FactDifference(record.episode_id, record.epoch, step.index, fact, recorded, value)


def recorded_worker_plan(
    pack: Pack, header: RunHeader, asset_database: Path | None, backend: str | None = None
) -> WorkerPlan:
    """Return the plan of workers that play a recorded run again, on its own simulator unless `backend` is given.

    Raises SettingError or RecordError if the simulator or the assets are missing.
    """
    backend = backend or header.spec.simulator
    if backend == "thor":
        from vigil.sim.thor.start import require_engine  # noqa: PLC0415 - loads the parts of AI2-THOR

        require_engine(header.simulator_version, instead="--records-only checks what needs no simulator.")
    return WorkerPlan(
        pack=pack.folder,
        run_id=header.run_id,
        profile=header.spec.profile,
        backend=backend,
        quality=header.spec.render_quality,
        asset_database=_asset_database(header, asset_database),
        pack_sha256=pack.sha256,
        recorded_profile=None if header.spec.fork is None else header.spec.fork.profile,
    )


@dataclass(frozen=True, slots=True)
class _Verifier:
    pool: SimulatorPool
    pack: Pack
    table: RecordTable
    frames: bool
    is_exact: bool

    async def all(self, keys: Sequence[Key], on_progress: Callable[[int, int], None]) -> list[FactDifference]:
        """Return the differences of all records, in the order of their keys. Few records are in memory at a time."""
        found: dict[Key, list[FactDifference]] = {}
        houses: dict[str, list[Key]] = {}
        for key in keys:
            houses.setdefault(self.pack.episode(key[0]).house.name, []).append(key)
        waiting = iter(houses.values())  # whole houses, because a worker that has just loaded a house has it ready

        async def work() -> None:
            for of_house in waiting:
                for key in of_house:
                    found[key] = await self.one(self.table.record(key))
                    on_progress(len(found), len(keys))

        await asyncio.gather(*(work() for _ in self.pool.workers))
        return [difference for key in keys for difference in found[key]]

    async def one(self, record: EpisodeRecord) -> list[FactDifference]:
        assignment = Assignment(self.pack.episode(record.episode_id), record.epoch, record.attempt)
        try:
            return await self.pool.resimulate(assignment, record, frames=self.frames, exact=self.is_exact)
        except SimulatorError as error:
            return [FactDifference(record.episode_id, record.epoch, 0, "simulator", "", str(error))]


def _asset_database(header: RunHeader, given: Path | None) -> Path | None:
    expected = header.spec.asset_database_sha256
    if expected is None:
        return None
    noted = header.host.get("asset_database")
    path = given or (Path(noted) if noted else None)
    if path is None or not path.is_file() or AssetDatabase.from_file(path).sha256 != expected:
        raise RecordError(
            f"Run {header.run_id!r} was played with an asset database of SHA-256 {expected[:12]}..., and "
            f"{str(path)!r} is not that file. Give the file with --assets."
        )
    return path
