"""Verification of a pack of the suite: each task is certified again with its recorded solutions, house by house."""

from collections.abc import Callable, Iterator, Sequence

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.packing import TaskCheck
from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.drafting.drafts import ClosureDraft
from vigil.authoring.review.validate import Finding
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.scoring.closure import PAIRED, ClosureAnswer, closure_answers
from vigil.sim.privileged import PrivilegedSimulator

OnTask = Callable[[int, int, int], None]
"""A function that gets the numbers of tasks done, of all tasks, and of faulty tasks."""


def verify_closure(
    pack: Pack, simulator: PrivilegedSimulator, on_task: OnTask = lambda done, of, faulty: None
) -> list[Finding]:
    """Return the findings about the tasks of a pack of the suite, sorted by episode and rule.

    Raises PackMismatch if the answers were changed.
    """
    answers = closure_answers(pack.folder)
    findings = [Finding(episode.id, "closes_correctly", "it has no answer") for episode in pack.episodes
                if episode.id not in answers]  # fmt: skip
    tasks = [] if findings else list(_tasks(pack, answers))
    certifier, faulty = Certifier(simulator, pack.manifest.versions.rules), 0
    for done, task in enumerate(tasks, start=1):
        found = _verify(certifier, pack, task, answers)
        findings += found
        faulty += bool(found)
        on_task(done, len(tasks), faulty)
    return sorted(findings, key=lambda each: (each.episode_id, each.rule))


def _tasks(pack: Pack, answers: dict[str, ClosureAnswer]) -> Iterator[ClosureTask]:
    """Yield the tasks of a pack, house by house."""
    twins: dict[str, list[Episode]] = {}
    for episode in sorted(pack.episodes, key=lambda each: (each.house.name, each.id)):
        twins.setdefault(answers[episode.id].pair or episode.id, []).append(episode)
    for members in twins.values():
        yield task_of(members, [answers[each.id] for each in members])


def task_of(episodes: Sequence[Episode], answers: Sequence[ClosureAnswer]) -> ClosureTask:
    """Return the task of some sides with their answers, which have the same order."""
    first = answers[0]
    sides = PAIRED.get(first.kind, ())
    ordered = sorted(zip(answers, episodes, strict=True), key=lambda each: sides.index(each[0].side) if sides else 0)  # pyright: ignore
    removed = first.certificate.removed if first.certificate else ""
    return ClosureTask(first.kind, tuple(episode for _, episode in ordered), removed, first.evidence, first.form)


def recertifier(simulator: PrivilegedSimulator, house_of: Callable[[Episode], House]) -> TaskCheck:
    """Return a function that certifies a task again with its recorded solutions."""
    certifier = Certifier(simulator)

    def check(task: ClosureDraft) -> list[Finding]:
        episodes = [draft.episode for draft in task.drafts]
        recorded = tuple(draft.actions for draft in task.drafts)
        return certifier.certify(task_of(episodes, task.answers), house_of(episodes[0]), recorded)[1]

    return check


def _verify(certifier: Certifier, pack: Pack, task: ClosureTask, answers: dict[str, ClosureAnswer]) -> list[Finding]:
    missing = [each for each in task.episodes if each.id not in pack.solutions]
    if missing:
        return [Finding(each.id, "solvable", "no solution is recorded") for each in missing]
    recorded = tuple(pack.solutions[episode.id].actions for episode in task.episodes)
    sides, found = certifier.certify(task, pack.house_of(task.episodes[0]), recorded)
    return found or [
        Finding(side.episode.id, "closes_correctly", "its answer is not the one that the search gives")
        for side in sides
        if side.answer != answers[side.episode.id]
    ]
