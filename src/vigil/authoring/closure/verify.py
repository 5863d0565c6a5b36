"""Verification of a pack of the suite: each task is certified again with its recorded solutions."""

from collections.abc import Callable, Sequence

from vigil.authoring.closure.certify import Certifier
from vigil.authoring.closure.packing import TaskCheck
from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.drafting.drafts import ClosureDraft
from vigil.authoring.packing.verify import VerificationSettings, VerificationTask
from vigil.authoring.review.validate import Finding, Validator
from vigil.packs.pack import Pack
from vigil.protocol.episode import Episode
from vigil.protocol.house import House
from vigil.scoring.closure import PAIRED, ClosureAnswer, closure_answers
from vigil.sim.privileged import PrivilegedSimulator


def suite_tasks(pack: Pack) -> list[VerificationTask]:
    """Return the tasks of a pack of the suite. Raises PackMismatch if the answers were changed."""
    answers = closure_answers(pack.folder)
    twins: dict[str, list[Episode]] = {}
    for episode in pack.episodes:
        answer = answers.get(episode.id)
        twins.setdefault((answer and answer.pair) or episode.id, []).append(episode)
    return [
        VerificationTask(
            tuple(members),
            tuple(pack.solutions[each.id].actions if each.id in pack.solutions else None for each in members),
            tuple(answers[each.id] for each in members if each.id in answers),
        )
        for members in twins.values()
    ]


class SuiteVerifier:
    """A verifier of tasks of the suite, by the rules of the version that a pack was made with."""

    def __init__(self, settings: VerificationSettings) -> None:
        simulator = settings.simulator()
        self._certifier = Certifier(simulator, settings.rules)
        self._validator = Validator(simulator) if settings.is_robust else None

    def faults(self, task: VerificationTask, house: House) -> Sequence[Finding]:
        """Return the findings about a task; robustness is checked of the sides that the solver acts in."""
        if not task.answers:
            return [Finding(each.id, "closes_correctly", "it has no answer") for each in task.episodes]
        recorded = [actions for actions in task.solutions if actions is not None]
        if len(recorded) < len(task.episodes):
            return [
                Finding(episode.id, "solvable", "no solution is recorded")
                for episode, actions in zip(task.episodes, task.solutions, strict=True)
                if actions is None
            ]
        given = {episode.id: actions for episode, actions in zip(task.episodes, recorded, strict=True)}
        answers = {answer.episode_id: answer for answer in task.answers}
        certified = task_of(task.episodes, task.answers)
        sides, found = self._certifier.certify(certified, house, tuple(given[each.id] for each in certified.episodes))
        found = found or [
            Finding(side.episode.id, "closes_correctly", "its answer is not the one that the search gives")
            for side in sides
            if side.answer != answers[side.episode.id]
        ]
        if found or self._validator is None:
            return found
        acted = [each for each in task.episodes if answers[each.id].side not in ("impossible", "already")]
        return [fault for episode in acted for fault in self._validator.robustness(episode, house)]


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
