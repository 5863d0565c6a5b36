"""Verification of a pack: all rules are checked and all solutions replayed, house by house, in worker processes.

Results can be stored in a log with one line per episode, from which the same command continues.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from vigil.assets.database import AssetDatabase
from vigil.authoring.review.rules import RULES, binds
from vigil.authoring.review.validate import Finding, Validator
from vigil.base.json_lines import AppendFile, dump_line, parse_line
from vigil.base.processes import worker_pool
from vigil.base.versions import PackVersions
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.house import House, canonical_json
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator


@dataclass(frozen=True, slots=True)
class HouseBatch:
    """A house with some of its episodes."""

    name: str
    document: dict[str, Any]
    episodes: tuple[tuple[Episode, tuple[Action, ...] | None], ...]
    """Episodes with their recorded solutions; None without one."""


@dataclass(frozen=True, slots=True)
class VerificationSettings:
    """Settings of a verification."""

    backend: str = "mujoco"
    assets: AssetDatabase | None = None
    workers: int = 1
    is_robust: bool = False
    """Whether episodes that satisfy all other rules are also checked by the robustness rules."""

    def simulator(self) -> PrivilegedSimulator:
        """Return a new simulator."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


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


def verify_pack(
    pack: Pack, settings: VerificationSettings, log: Path | None = None, on_progress: OnVerified = lambda progress: None
) -> list[Finding]:
    """Return the findings about a pack's episodes, sorted by episode and rule; an existing `log` is continued.

    Raises RecordError if the log cannot be read or written.
    """
    solved = {name: solution.actions for name, solution in pack.solutions.items()}
    results = findings_of(pack.episodes, solved, pack.house_of, settings, log, on_progress)
    return sorted(
        (finding for result in results for finding in result.faults), key=lambda each: (each.episode_id, each.rule)
    )


def findings_of(
    episodes: Iterable[Episode],
    solved: Mapping[str, tuple[Action, ...]],
    house_of: Callable[[Episode], House],
    settings: VerificationSettings,
    log: Path | None = None,
    on_progress: OnVerified = lambda progress: None,
) -> list[EpisodeFindings]:
    """Return the findings of each episode; those in `log` are reused, new ones are appended to it.

    `solved` are the recorded solutions by episode id. Raises RecordError if the log cannot be read or written.
    """
    keys = {episode.id: (key_of(episode, solved.get(episode.id), settings), episode) for episode in episodes}
    with nullcontext() if log is None else AppendFile(log) as file:
        known = _known(file)
        results = [known[key] for key, _ in keys.values() if key in known]
        missing = [episode for key, episode in keys.values() if key not in known]
        for found in findings_by_house(house_batches(missing, solved, house_of), settings):
            results += found
            if file is not None:
                file.append(*map(dump_line, found))
            faulty = sum(bool(result.findings) for result in results)
            on_progress(VerificationProgress(len(results), len(keys), faulty))
    return results


def house_batches(
    episodes: Iterable[Episode], solved: Mapping[str, tuple[Action, ...]], house_of: Callable[[Episode], House]
) -> list[HouseBatch]:
    """Return episodes with their solutions, grouped by house and sorted."""
    ordered = sorted(episodes, key=lambda episode: (episode.house.name, episode.id))
    found: list[HouseBatch] = []
    for name, group in groupby(ordered, key=lambda episode: episode.house.name):
        members = list(group)
        pairs = tuple((episode, solved.get(episode.id)) for episode in members)
        found.append(HouseBatch(name, house_of(members[0]).data, pairs))
    return found


def findings_by_house(work: Sequence[HouseBatch], settings: VerificationSettings) -> Iterator[list[EpisodeFindings]]:
    """Yield the findings house by house, in the order of the batches."""
    if settings.workers == 1 or len(work) < 2:
        validator = Validator(settings.simulator())
        for bundle in work:
            yield _verify(validator, bundle, settings)
        return
    with worker_pool(settings.workers, _begin_worker, settings) as pool:
        futures: list[Future[list[EpisodeFindings]]] = [pool.submit(_verify_here, bundle, settings) for bundle in work]
        try:
            for future in futures:
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def key_of(episode: Episode, actions: tuple[Action, ...] | None, settings: VerificationSettings) -> str:
    """Return the hash of an episode, its solution, the backend, the asset database, the versions and the rules."""
    solution = Solution(episode_id=episode.id, actions=actions).model_dump(mode="json") if actions else None
    more = ["robust"] if settings.is_robust else []
    more += [settings.assets.sha256] if settings.assets and settings.assets.sha256 else []
    more += [name for name, rule in RULES.items() if binds(rule, name, episode.family)]
    facts = [episode.model_dump(mode="json"), solution, settings.backend, PackVersions.current().model_dump(), *more]
    return hashlib.sha256(canonical_json(facts)).hexdigest()


_validators: list[Validator] = []
"""The validator of this worker process."""


def _begin_worker(settings: VerificationSettings) -> None:
    _validators.append(Validator(settings.simulator()))


def _verify_here(bundle: HouseBatch, settings: VerificationSettings) -> list[EpisodeFindings]:
    return _verify(_validators[0], bundle, settings)


def _verify(validator: Validator, bundle: HouseBatch, settings: VerificationSettings) -> list[EpisodeFindings]:
    house = House(bundle.name, bundle.document)
    found: list[EpisodeFindings] = []
    for episode, actions in bundle.episodes:
        if actions is None:
            findings = (("solvable", "no solution is recorded"),)
        else:
            faults = validator.validate(episode, house, actions).findings
            if settings.is_robust and not faults:
                faults = validator.robustness(episode, house)
            findings = tuple((each.rule, each.message) for each in faults)
        found.append(EpisodeFindings(key=key_of(episode, actions, settings), episode_id=episode.id, findings=findings))
    return found


def _known(log: AppendFile | None) -> dict[str, EpisodeFindings]:
    """Return key -> findings in a log; empty without a log."""
    if log is None:
        return {}
    rows = [parse_line(line, EpisodeFindings, f"Log {str(log.path)!r}", "Remove it.") for line in log.lines.complete]
    return {row.key: row for row in rows}
