"""Verification of a pack: all rules are checked and all solutions replayed, house by house, in worker processes.

Results can be stored in a log with one line per episode, from which the same command continues.
"""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, Protocol

from pydantic import BaseModel, ConfigDict

from vigil.assets.database import AssetDatabase
from vigil.authoring.review.rules import RULES, binds
from vigil.authoring.review.validate import Finding, Validator
from vigil.base.json_lines import AppendFile, dump_line, parse_line
from vigil.base.versions import RULES_VERSION, PackVersions
from vigil.packs.pack import Pack
from vigil.processes.group import map_in_workers
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.house import House, canonical_json
from vigil.scoring.closure import ClosureAnswer
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator


@dataclass(frozen=True, slots=True)
class VerificationTask:
    """An episode, or twins that are verified together."""

    episodes: tuple[Episode, ...]
    solutions: tuple[tuple[Action, ...] | None, ...]
    """Recorded solution of each episode; None without one."""
    answers: tuple[ClosureAnswer, ...] = ()
    """Correct closing of each episode in a pack of the closure suite, else empty."""


@dataclass(frozen=True, slots=True)
class HouseBatch:
    """A house with its tasks."""

    name: str
    document: dict[str, Any]
    tasks: tuple[VerificationTask, ...]


@dataclass(frozen=True, slots=True)
class VerificationSettings:
    """Settings of a verification."""

    backend: str = "mujoco"
    assets: AssetDatabase | None = None
    workers: int = 1
    is_robust: bool = False
    """Whether episodes that satisfy all other rules are also checked by the robustness rules."""
    rules: int = RULES_VERSION
    """Version of the rules by which tasks of a suite are certified: that of their pack."""

    def simulator(self) -> PrivilegedSimulator:
        """Return a new simulator."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


class TaskVerifier(Protocol):
    """A verifier of tasks on its own simulator."""

    def faults(self, task: VerificationTask, house: House) -> Sequence[Finding]:
        """Return the findings about the episodes of a task."""
        ...


class EpisodeVerifier:
    """A verifier of single episodes by the rules of the families."""

    def __init__(self, settings: VerificationSettings) -> None:
        self._validator = Validator(settings.simulator())
        self._is_robust = settings.is_robust

    def faults(self, task: VerificationTask, house: House) -> Sequence[Finding]:
        """Return the findings about the episode of a task."""
        ((episode,), (actions,)) = task.episodes, task.solutions
        if actions is None:
            return (Finding(episode.id, "solvable", "no solution is recorded"),)
        found = self._validator.validate(episode, house, actions).findings
        return found or (self._validator.robustness(episode, house) if self._is_robust else ())


class EpisodeFindings(BaseModel):
    """Findings about one episode, as stored in a log."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    """Hash of all on which the findings depend, as `key_of` returns it."""
    episode_id: str
    findings: tuple[tuple[str, str], ...] = ()
    """Rule and message of each finding."""

    @property
    def faults(self) -> list[Finding]:
        """The findings as objects."""
        return [Finding(self.episode_id, rule, message) for rule, message in self.findings]


@dataclass(frozen=True, slots=True)
class VerificationProgress:
    """Progress of a verification, in numbers of episodes."""

    done: int
    of: int
    faulty: int


OnVerified = Callable[[VerificationProgress], None]


MakeVerifier = Callable[[VerificationSettings], TaskVerifier]


def verify_pack(
    pack: Pack,
    settings: VerificationSettings,
    log: Path | None = None,
    on_progress: OnVerified = lambda progress: None,
    *,
    tasks: Sequence[VerificationTask] | None = None,
    make_verifier: MakeVerifier = EpisodeVerifier,
) -> list[Finding]:
    """Return the findings about a pack's episodes, sorted by episode and rule; an existing `log` is continued.

    `tasks` and `make_verifier` are those of a suite; without them each episode is a task. Raises RecordError if the
    log cannot be read or written.
    """
    chosen = pack_tasks(pack) if tasks is None else tasks
    results = findings_of(chosen, pack.house_of, settings, log, on_progress, make_verifier)
    return sorted(
        (finding for result in results for finding in result.faults), key=lambda each: (each.episode_id, each.rule)
    )


def pack_tasks(pack: Pack) -> list[VerificationTask]:
    """Return a task for each episode of a pack."""
    return episode_tasks(pack.episodes, {name: solution.actions for name, solution in pack.solutions.items()})


def episode_tasks(episodes: Iterable[Episode], solved: Mapping[str, tuple[Action, ...]]) -> list[VerificationTask]:
    """Return a task for each episode; `solved` are the recorded solutions by episode id."""
    return [VerificationTask((episode,), (solved.get(episode.id),)) for episode in episodes]


def findings_of(
    tasks: Iterable[VerificationTask],
    house_of: Callable[[Episode], House],
    settings: VerificationSettings,
    log: Path | None = None,
    on_progress: OnVerified = lambda progress: None,
    make_verifier: MakeVerifier = EpisodeVerifier,
) -> list[EpisodeFindings]:
    """Return the findings of each episode; those in `log` are reused, new ones are appended to it.

    Raises RecordError if the log cannot be read or written.
    """
    keys = {key_of(task, settings): task for task in tasks}
    total = sum(len(task.episodes) for task in keys.values())
    with nullcontext() if log is None else AppendFile(log) as file:
        known = _known(file)
        results = [row for key in keys for row in known.get(key, ())]
        missing = [task for key, task in keys.items() if len(known.get(key, ())) < len(task.episodes)]
        work = house_batches(missing, house_of)
        verify = partial(_verify, settings)
        for found in map_in_workers(partial(make_verifier, settings), verify, work, settings.workers):
            results += found
            if file is not None:
                file.append(*map(dump_line, found))
            on_progress(VerificationProgress(len(results), total, sum(bool(result.findings) for result in results)))
    return results


def house_batches(tasks: Iterable[VerificationTask], house_of: Callable[[Episode], House]) -> list[HouseBatch]:
    """Return tasks grouped by house and sorted."""
    ordered = sorted(tasks, key=lambda task: (task.episodes[0].house.name, task.episodes[0].id))
    grouped = groupby(ordered, key=lambda task: task.episodes[0].house.name)
    members = ((name, tuple(group)) for name, group in grouped)
    return [HouseBatch(name, house_of(group[0].episodes[0]).data, group) for name, group in members]


def key_of(task: VerificationTask, settings: VerificationSettings) -> str:
    """Return the hash of episodes, solutions, answers, the backend, the asset database, the versions and the rules."""
    solutions = [
        Solution(episode_id=episode.id, actions=actions).model_dump(mode="json") if actions else None
        for episode, actions in zip(task.episodes, task.solutions, strict=True)
    ]
    more = ["robust"] if settings.is_robust else []
    more += [settings.assets.sha256] if settings.assets and settings.assets.sha256 else []
    more += [name for name, rule in RULES.items() if any(binds(rule, name, each.family) for each in task.episodes)]
    dumped = [[each.model_dump(mode="json") for each in facts] for facts in (task.episodes, task.answers)]
    facts = [*dumped, solutions, settings.backend, settings.rules, PackVersions.current().model_dump(), *more]
    return hashlib.sha256(canonical_json(facts)).hexdigest()


def _verify(settings: VerificationSettings, verifier: TaskVerifier, batch: HouseBatch) -> list[EpisodeFindings]:
    house, rows = House(batch.name, batch.document), list[EpisodeFindings]()
    for task in batch.tasks:
        key, faults = key_of(task, settings), verifier.faults(task, house)
        for episode in task.episodes:
            own = tuple((each.rule, each.message) for each in faults if each.episode_id == episode.id)
            rows.append(EpisodeFindings(key=key, episode_id=episode.id, findings=own))
    return rows


def _known(log: AppendFile | None) -> dict[str, list[EpisodeFindings]]:
    """Return key -> findings of each episode in a log; empty without a log."""
    found: dict[str, dict[str, EpisodeFindings]] = {}
    if log is None:
        return {}
    for line in log.lines.complete:
        row = parse_line(line, EpisodeFindings, f"Log {str(log.path)!r}", "Remove it.")
        found.setdefault(row.key, {})[row.episode_id] = row
    return {key: list(rows.values()) for key, rows in found.items()}
