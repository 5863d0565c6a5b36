"""Live play: a person or a client plays through this process, and the records go into a normal run folder."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from vigil.base.json_lines import AppendFile, parse_line
from vigil.errors import SimulatorError
from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.records.record import AgentKind, EpisodeRecord
from vigil.runner.plan import RUNS_FOLDER, RunPlan, plan_run
from vigil.runner.run_folder import RunFolder
from vigil.runner.settings import RunSettings
from vigil.runner.workers.messages import Assignment, EncodedObservation
from vigil.runner.workers.players import error_record
from vigil.runner.workers.pool import LiveEpisode, SimulatorPool, worker_count

_Row = TypeVar("_Row", bound=BaseModel)
_Session = TypeVar("_Session")


def plan_live_run(
    settings: dict[str, Any], player: str, kind: AgentKind, log_dir: Path | None, pack: Pack | None = None
) -> RunPlan:
    """Return the plan of a run that `player` plays from outside. Raises InputError.

    `settings` are fields of `RunSettings`; `pack` is their pack, if it is loaded already.
    """
    plan = plan_run(RunSettings(agent="noop", **settings), pack)
    folder = log_dir or RUNS_FOLDER / f"{plan.spec.pack}-{player.replace(':', '-')}"
    return replace(
        plan,
        spec=plan.spec.model_copy(update={"agent": player, "agent_kind": kind}),
        worker=replace(plan.worker, agent=""),
        execution=replace(plan.execution, folder=folder),
    )


def open_live_run(plan: RunPlan, make: Callable[[RunFolder, SimulatorPool], _Session]) -> _Session:
    """Return what `make` returns for the folder of the run, new or continued, and its simulators.

    Raises InputError, or SimulatorError if no simulator starts.
    """
    execution = plan.execution
    folder = RunFolder.create_or_resume(execution.folder, plan.spec, plan.pack.episodes, execution.input_paths)
    frames = folder.frames if execution.save_frames else None
    worker = replace(plan.worker, run_id=folder.header.run_id, frames=frames)
    pool = SimulatorPool(worker, worker_count(execution.workers), timeout_s=execution.timeout_s, logs=folder.logs)
    try:
        folder.note_facts(pool.facts(Assignment(plan.episodes[0])))
        return make(folder, pool)
    except BaseException:
        pool.close()
        folder.close()
        raise


@dataclass(slots=True, eq=False, kw_only=True)
class LivePlay:
    """One episode that a person or a client plays. If the simulator fails, the episode ends as an error."""

    live: LiveEpisode
    run_id: str
    moment: int = 0
    """Number of replies that were carried out."""
    seen: EncodedObservation | None = None
    """The current observation; None before the beginning and after the end."""
    since: float = 0.0
    """Time (monotonic clock, s) of the current observation."""

    async def begin(self) -> EpisodeRecord | None:
        """Start the episode. Return its record if it has ended already."""
        try:
            return self._take(await self.live.begin())
        except SimulatorError as error:
            return self._fail(error)

    async def advance(self, reply: Reply) -> EpisodeRecord | None:
        """Carry out a reply. Return the record if it ended the episode."""
        self.moment += 1
        try:
            return self._take(await self.live.advance(reply))
        except SimulatorError as error:
            return self._fail(error)

    def _fail(self, error: SimulatorError) -> EpisodeRecord | None:
        return self._take(error_record(self.live.assignment, self.run_id, error, datetime.now(UTC)))

    def _take(self, answer: EncodedObservation | EpisodeRecord) -> EpisodeRecord | None:
        if isinstance(answer, EncodedObservation):
            self.seen, self.since = answer, time.monotonic()
            return None
        self.seen = None
        self.live.close()
        return answer


def open_journal(path: Path, kind: type[_Row]) -> tuple[AppendFile, list[_Row]]:
    """Open or create a journal, and return its file and its rows.

    Raises RecordError if it is damaged or another process writes to it.
    """
    file = AppendFile(path)
    try:
        lines = file.lines.complete
        rows = [parse_line(line, kind, f"Journal {str(path)!r}", "Choose another --log-dir.") for line in lines]
        file.repair_tail()
    except BaseException:
        file.close()
        raise
    return file, rows


def random_order(episode_ids: Sequence[str], seed: int) -> list[str]:
    """Return the ids in a random order that depends only on `seed`."""
    ids = sorted(episode_ids)
    return [ids[index] for index in np.random.default_rng(seed).permutation(len(ids))]
