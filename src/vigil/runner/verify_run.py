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
from vigil.runner.workers.resimulation import ComparisonSettings, FactDifference
from vigil.scoring.saved_run import SavedRun, read_run

OnProgress = Callable[[int, int], None]
SAME_HOST = ("machine", "python", "numpy", "processor")
"""Host facts that must be equal for bit-identical numbers; the results of libraries depend on processor features."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Result of verifying a run: what was checked, and which recorded facts differ."""

    header: RunHeader
    checked: int
    """Number of verified records."""
    errors: int
    """Number of rows that ended as an error; they have nothing to verify."""
    is_exact: bool
    """Whether numbers had to be bit-identical to the recorded numbers."""
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
    on_progress: OnProgress = lambda _done, _total: None,
) -> Verification:
    """Return how the records of a run compare with a new simulation of their replies.

    `on_progress` is called with the number of done records and of all records. Raises RecordError, PackMismatch,
    SettingError or SimulatorError.
    """
    settings = settings or VerifySettings()
    (found,) = verify_runs([read_run(path, settings.pack)], settings, on_progress=on_progress)
    if isinstance(found, Exception):
        raise found
    return found


def verify_runs(
    runs: Sequence[SavedRun], settings: VerifySettings, *, on_progress: OnProgress = lambda _done, _total: None
) -> list[Verification | Exception]:
    """Return, for each run, what `verify_run` returns or the error that it raises.

    All runs must have the same `simulation_of`, so that each house is loaded only once. Raises PackMismatch,
    SettingError, or RecordError if the assets are missing.
    """
    pack = Pack.load(runs[0].pack_folder, runs[0].header.spec.pack_sha256)
    compared = [_Compared.of(run, settings) for run in runs]
    if settings.records_only:
        found = [each.check_replies() for each in compared]
    else:
        total = sum(len(each.keys) for each in compared)
        workers = max(1, min(worker_count(settings.workers), total))
        plan = recorded_worker_plan(pack, runs[0].header, settings.asset_database, settings.backend)
        with SimulatorPool(plan, workers, timeout_s=settings.timeout_s) as pool:
            found = asyncio.run(_resimulate(pool, pack, compared, on_progress))
    return [
        each if isinstance(each, Exception) else run.verification(each)
        for run, each in zip(compared, found, strict=True)
    ]


def simulation_of(run: SavedRun) -> tuple[object, ...]:
    """Return the facts that must be equal for runs to be verified together: the pack and how it is simulated."""
    header, spec = run.header, run.header.spec
    return (spec.pack_sha256, spec.simulator, header.simulator_version, spec.render_quality, spec.asset_database_sha256)


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
class _Compared:
    """A run whose records are compared with a new simulation."""

    run: SavedRun
    keys: list[Key]
    """Keys (episode and epoch) of the records to verify."""
    settings: ComparisonSettings
    is_records_only: bool

    @classmethod
    def of(cls, run: SavedRun, settings: VerifySettings) -> "_Compared":
        header = run.header
        scored = sorted(key for key, row in run.table.rows.items() if row.outcome is not None)
        here = host_facts()
        is_same_host = all(host.get(name) == here[name] for host in header.hosts for name in SAME_HOST)
        is_exact = is_same_host if settings.exact is None else settings.exact
        earlier = None if header.spec.fork is None else header.spec.fork.profile
        compare = ComparisonSettings(settings.frames, is_exact, header.spec.profile, earlier)
        return cls(run, scored[: settings.limit], compare, settings.records_only)

    def check_replies(self) -> list[FactDifference]:
        """Return the differences that are found without a simulator."""
        earlier, profile = self.settings.recorded_profile, self.run.header.spec.profile
        return [fault for key in self.keys for fault in check_replies(self.run.table.record(key), profile, earlier)]

    def verification(self, found: list[FactDifference]) -> Verification:
        """Return the result of verifying the run; `found` are the differences from the new simulation."""
        table = self.run.table
        scored = sum(row.outcome is not None for row in table.rows.values())
        return Verification(
            self.run.header,
            len(self.keys),
            len(table.rows) - scored,
            self.settings.exact,
            self.is_records_only,
            tuple(found),
            sum(frames_in(table.record(key)) for key in self.keys) if self.settings.frames else 0,
            table.notes,
            len(table.left_out),
        )


async def _resimulate(
    pool: SimulatorPool, pack: Pack, runs: Sequence[_Compared], on_progress: OnProgress
) -> list[list[FactDifference] | Exception]:
    """Return, for each run, the differences of its records in the order of their keys, or the error that ended its
    verification. Few records are in memory at a time."""
    found: dict[tuple[int, Key], list[FactDifference]] = {}
    faults: dict[int, Exception] = {}
    houses: dict[str, list[tuple[int, Key]]] = {}
    for number, run in enumerate(runs):
        for key in run.keys:
            houses.setdefault(pack.episode(key[0]).house.name, []).append((number, key))
    waiting = iter(houses.values())  # whole houses, because a worker that has just loaded a house has it ready
    total = sum(len(run.keys) for run in runs)

    async def work() -> None:
        for of_house in waiting:
            for number, key in of_house:
                try:
                    found[number, key] = [] if number in faults else await _differences(pool, pack, runs[number], key)
                except Exception as fault:  # noqa: BLE001 - one run's error does not end the others' verification
                    faults[number], found[number, key] = fault, []
                on_progress(len(found), total)

    await asyncio.gather(*(work() for _ in pool.workers))
    return [
        faults.get(number) or [difference for key in run.keys for difference in found[number, key]]
        for number, run in enumerate(runs)
    ]


async def _differences(pool: SimulatorPool, pack: Pack, run: _Compared, key: Key) -> list[FactDifference]:
    record = run.run.table.record(key)
    assignment = Assignment(pack.episode(record.episode_id), record.epoch, record.attempt)
    try:
        return await pool.resimulate(assignment, record, run.settings)
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
            f"Run {header.run_id!r} was played with an asset database of SHA-256 {expected[:12]}..., but "
            f"{str(path)!r} is not that file. Give the file with --assets."
        )
    return path
