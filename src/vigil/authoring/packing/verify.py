"""Verification of a pack: all rules are checked and all solutions replayed, house by house, in worker processes.

Results can be stored in a log with one line per episode. If the same command is run again, it continues from the log.
"""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from vigil.assets.database import AssetDatabase
from vigil.authoring.chores.certify import ListCertifier
from vigil.authoring.closure.certify import Certifier, task_of
from vigil.authoring.closure.twins import BrokenRule
from vigil.authoring.drafting.drafts import DraftsFile, TaskDraft, house_in
from vigil.authoring.packing.selection import Candidate, CandidateCheck
from vigil.authoring.review.blind_trials import blind_trials
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.rules import RULES, binds
from vigil.authoring.review.validate import Finding, Validator
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.json_lines import AppendFile, dump_line, parse_line
from vigil.base.processes.group import map_in_workers
from vigil.base.versions import PackVersions
from vigil.packs.pack import CHORES_SUITE, Pack
from vigil.protocol.actions import Action
from vigil.protocol.episode import Episode, Solution
from vigil.protocol.house import House, canonical_json
from vigil.scoring.chore_answers import ListAnswer, list_answers
from vigil.scoring.closure import SUITE, ClosureAnswer, closure_answers
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator


@dataclass(frozen=True, slots=True)
class VerificationTask:
    """Episodes that are verified together: one episode, or two twins."""

    episodes: tuple[Episode, ...]
    solutions: tuple[tuple[Action, ...] | None, ...]
    """Recorded solution of each episode; None for an episode without a solution."""
    answers: tuple[ClosureAnswer | ListAnswer, ...] | None = None
    """Correct closing of each episode in a pack of a suite, empty if the pack has none of them; None in other packs."""

    @classmethod
    def of_draft(cls, draft: TaskDraft) -> "VerificationTask":
        """Return the verification task for a draft."""
        episodes, solutions = zip(*((side.episode, side.actions) for side in draft.drafts), strict=True)
        return cls(episodes, solutions, draft.answers or None)


@dataclass(frozen=True, slots=True)
class HouseBatch:
    """A house with the tasks to verify in it."""

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
    """Whether to check the robustness rules, too, on episodes that satisfy all other rules."""

    def simulator(self) -> PrivilegedSimulator:
        """Return a new simulator."""
        return make_simulator(self.backend, assets=self.assets or AssetDatabase.default())


class Verifier:
    """Verifies tasks on its own simulator by the families' rules; if tasks have answers, by the suite's rules, too."""

    def __init__(self, settings: VerificationSettings) -> None:
        simulator = settings.simulator()
        self._view = PrivilegedView(simulator)
        self._validator = Validator(simulator)
        self._certifier = Certifier(simulator)
        self._list_certifier = ListCertifier(simulator)
        self._is_robust = settings.is_robust

    def begin(self, episode: Episode, house: House) -> EpisodeStart:
        """Reset to an episode and return its start. Raises BrokenRule if that is impossible."""
        fault = self._validator.begin_fault(episode, house)
        if fault is not None:
            raise BrokenRule(fault.rule, fault.message)
        return EpisodeStart(episode, house, self._view)

    def faults(self, task: VerificationTask, house: House) -> Sequence[Finding]:
        """Return the findings about a task. Robustness is checked only on the sides in which the solver has to act."""
        if task.answers == ():
            return [Finding(each.id, "closes_correctly", "it has no answer") for each in task.episodes]
        unsolved = [each for each, actions in zip(task.episodes, task.solutions, strict=True) if actions is None]
        if unsolved:
            return [Finding(each.id, "solvable", "no solution is recorded") for each in unsolved]
        if task.answers is None:
            found = self._validator.validate(task.episodes[0], house, task.solutions[0]).findings
        else:
            found = self._faults_of_answers(task, task.answers, house)
        if found or not self._is_robust:
            return found
        twins = [each for each in task.answers or () if isinstance(each, ClosureAnswer)]
        idle = {each.episode_id for each in twins if each.side in ("impossible", "already")}
        acted = [each for each in task.episodes if each.id not in idle]
        return [fault for episode in acted for fault in self._validator.robustness(episode, house)]

    def solve(self, task: VerificationTask, house: House) -> tuple[VerificationTask, Sequence[Finding]]:
        """Return a task with new solutions (in a suite, also new answers), and the findings about it.

        If there are findings, the task is returned as it is. Robustness is not checked.
        """
        answers = task.answers
        if not answers:
            result = self._validator.validate(task.episodes[0], house)
            return replace(task, solutions=(result.actions,)), result.findings
        first = answers[0]
        if isinstance(first, ListAnswer):
            side, found = self._list_certifier.solve(task.episodes[0], first, house)
            sides = [] if side is None else [side]
        else:
            twins = [each for each in answers if isinstance(each, ClosureAnswer)]
            sides, found = self._certifier.certify(task_of(task.episodes, twins), house)
        if found:
            return task, found
        solved = {side.episode.id: side for side in sides}
        ordered = [solved[each.id] for each in task.episodes]
        given = tuple(side.answer for side in ordered if side.answer is not None)
        return replace(task, solutions=tuple(side.actions for side in ordered), answers=given), ()

    def _faults_of_answers(
        self, task: VerificationTask, answers: Sequence[ClosureAnswer | ListAnswer], house: House
    ) -> Sequence[Finding]:
        """Return the findings about a task of a suite, whose sides are all solved and answered."""
        first = answers[0]
        if isinstance(first, ListAnswer):
            return self._list_certifier.verify(task.episodes[0], first, house, task.solutions[0] or ())
        twins = [each for each in answers if isinstance(each, ClosureAnswer)]
        given = {each.id: actions or () for each, actions in zip(task.episodes, task.solutions, strict=True)}
        certified = task_of(task.episodes, twins)
        sides, found = self._certifier.certify(certified, house, tuple(given[each.id] for each in certified.episodes))
        return found or [
            Finding(side.episode.id, "closes_correctly", "its answer is not the one that the search gives")
            for side in sides
            if side.answer not in answers
        ]


class EpisodeFindings(BaseModel):
    """Findings about one episode, as stored in a log."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    """Hash of everything on which the findings depend (see `key_of`)."""
    episode_id: str
    findings: tuple[tuple[str, str], ...] = ()
    """Rule and message of each finding."""

    @property
    def faults(self) -> list[Finding]:
        """The findings as `Finding` objects."""
        return [Finding(self.episode_id, rule, message) for rule, message in self.findings]


OnVerified = Callable[[int, int, int], None]
"""Function that is called with numbers of episodes: those verified so far, all, and those with findings."""


def verify_pack(
    pack: Pack,
    settings: VerificationSettings,
    log: Path | None = None,
    on_progress: OnVerified = lambda done, of, faulty: None,
) -> list[Finding]:
    """Return the findings about a pack's episodes, sorted by episode and rule. If `log` exists, it is continued.

    Raises RecordError if the log cannot be read or written, PackMismatch if the answers of a suite were changed.
    """
    results = findings_of(pack_tasks(pack), pack.house_of, settings, log, on_progress)
    return sorted(
        (finding for result in results for finding in result.faults), key=lambda each: (each.episode_id, each.rule)
    )


def pack_tasks(pack: Pack) -> list[VerificationTask]:
    """Return the verification tasks of a pack, with twins in one task. Raises PackMismatch if answers were changed."""
    answers: Mapping[str, ClosureAnswer | ListAnswer] | None = None
    if pack.manifest.suite == SUITE:
        answers = closure_answers(pack.folder)
    elif pack.manifest.suite == CHORES_SUITE:
        answers = list_answers(pack.folder)
    twins: dict[str, list[Episode]] = {}
    for episode in pack.episodes:
        answer = (answers or {}).get(episode.id)
        pair = answer.pair if isinstance(answer, ClosureAnswer) else None
        twins.setdefault(pair or episode.id, []).append(episode)
    solved = {name: solution.actions for name, solution in pack.solutions.items()}
    return [
        VerificationTask(
            tuple(members),
            tuple(solved.get(each.id) for each in members),
            None if answers is None else tuple(answers[each.id] for each in members if each.id in answers),
        )
        for members in twins.values()
    ]


def check_log_of(file: DraftsFile) -> Path:
    """Return the path of the log with robustness results of drafts. Without the log, drafts are checked again."""
    return file.path.with_name(f"{file.path.stem}.checks.jsonl")


def candidate_checker(
    files: Sequence[DraftsFile], settings: VerificationSettings, on_verified: OnVerified = lambda done, of, faulty: None
) -> CandidateCheck:
    """Return a function that checks candidates from these drafts files, and returns the findings about those that fail.

    Episodes are replayed. For a robust pack, the noisy solver also plays them, which takes a second or more for each; a
    log next to the first file stores these results. Tasks of the suite were certified when they were drafted. They are
    certified again only if a reviewer changed their instruction. Raises RecordError if the log cannot be read or
    written.
    """
    log = check_log_of(files[0]) if settings.is_robust else None

    def check(chosen: Sequence[Candidate]) -> dict[str, list[Finding]]:
        due = [candidate.task for candidate in chosen if candidate.is_reworded or not candidate.task.answers]
        tasks = [VerificationTask.of_draft(task) for task in due]
        results = findings_of(tasks, lambda each: house_in(files, each.house.name), settings, log, on_verified)
        faults = {result.episode_id: result.faults for result in results}
        found = {task.drafts[0].episode.id: [f for d in task.drafts for f in faults[d.episode.id]] for task in due}
        return {name: findings for name, findings in found.items() if findings}

    return check


def findings_of(
    tasks: Iterable[VerificationTask],
    house_of: Callable[[Episode], House],
    settings: VerificationSettings,
    log: Path | None = None,
    on_progress: OnVerified = lambda done, of, faulty: None,
) -> list[EpisodeFindings]:
    """Return the findings about each episode. Findings in `log` are reused, and new findings are appended to it.

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
        for found in map_in_workers(partial(Verifier, settings), verify, work, settings.workers):
            results += found
            if file is not None:
                file.append(*map(dump_line, found))
            on_progress(len(results), total, sum(bool(result.findings) for result in results))
    return results


def house_batches(tasks: Iterable[VerificationTask], house_of: Callable[[Episode], House]) -> list[HouseBatch]:
    """Return tasks grouped by house, sorted by house and id."""
    ordered = sorted(tasks, key=lambda task: (task.episodes[0].house.name, task.episodes[0].id))
    grouped = groupby(ordered, key=lambda task: task.episodes[0].house.name)
    members = ((name, tuple(group)) for name, group in grouped)
    return [HouseBatch(name, house_of(group[0].episodes[0]).data, group) for name, group in members]


def key_of(task: VerificationTask, settings: VerificationSettings) -> str:
    """Return the hash of all on which the findings about a task depend: episodes, solutions, answers, blind trials,
    backend, asset database, rules and versions.
    """
    solutions = [
        Solution(episode_id=episode.id, actions=actions).model_dump(mode="json") if actions else None
        for episode, actions in zip(task.episodes, task.solutions, strict=True)
    ]
    more = ["robust"] if settings.is_robust else []
    more += [settings.assets.sha256] if settings.assets and settings.assets.sha256 else []
    more += [name for name, rule in RULES.items() if any(binds(rule, name, each.family) for each in task.episodes)]
    dumped = [[each.model_dump(mode="json") for each in facts] for facts in (task.episodes, task.answers or ())]
    blind = [[[act.model_dump(mode="json") for act in tries] for tries in blind_trials(each)] for each in task.episodes]
    facts = [*dumped, solutions, blind, settings.backend, PackVersions.current().model_dump(), *more]
    return hashlib.sha256(canonical_json(facts)).hexdigest()


def _verify(settings: VerificationSettings, verifier: Verifier, batch: HouseBatch) -> list[EpisodeFindings]:
    house, rows = House(batch.name, batch.document), list[EpisodeFindings]()
    for task in batch.tasks:
        key, faults = key_of(task, settings), verifier.faults(task, house)
        for episode in task.episodes:
            own = tuple((each.rule, each.message) for each in faults if each.episode_id == episode.id)
            rows.append(EpisodeFindings(key=key, episode_id=episode.id, findings=own))
    return rows


def _known(log: AppendFile | None) -> dict[str, list[EpisodeFindings]]:
    """Return key -> findings in the log, one entry per episode; empty if there is no log."""
    found: dict[str, dict[str, EpisodeFindings]] = {}
    if log is None:
        return {}
    for line in log.lines.complete:
        row = parse_line(line, EpisodeFindings, f"Log {str(log.path)!r}", "Remove it.")
        found.setdefault(row.key, {})[row.episode_id] = row
    return {key: list(rows.values()) for key, rows in found.items()}
