"""Certificates: proof, by search and by replay, that the answer to a task of the closure-stress suite is correct.

Twins are the two sides of one task: two episodes with the same instruction, but different answers. The first side must
satisfy the rules of its family (`vigil.authoring.review`), except those from which the task's kind is exempt. The
second side has separate rules. Source: `protocol.md` section 8, decision 30.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence

from vigil.authoring.closure.receptacle_space import fits_on
from vigil.authoring.closure.tasks import ClosureTask
from vigil.authoring.closure.twins import BrokenRule, check_hidden, check_single_difference, reason_for_absence
from vigil.authoring.drafting.generation import SolvedSide
from vigil.authoring.language.referring import items_of
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.robustness import shows_one_wall
from vigil.authoring.review.rules import ALMOST_CLOSED, WIDE_OPEN
from vigil.authoring.review.validate import BUDGET_SHARE, Finding, Validator
from vigil.authoring.solving.evidence import (
    can_be_partly_open,
    gap_evidence,
    is_partly_open,
    shows_all,
    viewpoint_showing,
)
from vigil.authoring.solving.goal_actions import is_doable
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.solvers import carry_out
from vigil.base.exported import loaded
from vigil.base.geometry import floor_distance
from vigil.errors import EpisodeError
from vigil.packs.pack import protocol_faults
from vigil.protocol.actions import Action, Report, Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Goal, GoalPart, ObjectAtReceptacle
from vigil.protocol.house import House
from vigil.scoring.closure import (
    CLOSURE_KINDS,
    CONCEDED,
    FAIL_REASONS,
    PAIRED,
    SUITE,
    Certificate,
    ClosureAnswer,
    Evidence,
    Kind,
    Reason,
    score_closure,
)
from vigil.sim.privileged import PrivilegedSimulator

MIN_LOOKING_SHARE = 0.5
"""Looking at everything that the instruction asks about must need at least this share of the step budget."""
SUMMARY = "Done."
"""Text of the report that closes the second side of twins."""
BrokenRules = Iterator[tuple[str, str]]
FAULTS_BY_KIND: dict[Kind, Callable[..., BrokenRules]] = {
    name: loaded(kind.faults) for name, kind in CLOSURE_KINDS.items() if kind.faults is not None
}
"""Kind -> the function that yields the faults of a side under the rules that only this kind has."""


def exempt_of(task: ClosureTask) -> frozenset[str]:
    """Return the names of the families' rules that a task may break on purpose."""
    return CLOSURE_KINDS[task.kind].exempt_of(task.form, task.episodes[0].provenance.template)


class Certifier:
    """Certifies tasks on one simulator."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self._validator = Validator(simulator)
        self._view = PrivilegedView(simulator)

    def certify(
        self, task: ClosureTask, house: House, recorded: tuple[tuple[Action, ...], ...] = ()
    ) -> tuple[list[SolvedSide], list[Finding]]:
        """Return the sides of a task with their answers; if a side is faulty, an empty list and the findings about it.

        `recorded` has the actions of each side in a frozen pack. If it is empty, the actions are searched for.
        """
        first = task.episodes[0]
        actions, found = self._solve_side(task, first, house, recorded[0] if recorded else None)
        if found:
            return [], found
        answers = [] if len(task.episodes) > 1 else [ClosureAnswer(episode_id=first.id, kind=task.kind, form=task.form)]
        solved = [actions]
        for second in task.episodes[1:]:
            try:
                answers = self._answers(task, second, house)
                given = recorded[1] if recorded else None
                actions, found = self._other_side(task, second, answers[1], house, given)
            except BrokenRule as broken:
                found = [Finding(second.id, broken.rule, str(broken))]
            if found:
                return [], found
            solved.append(actions)
        return [SolvedSide(*side) for side in zip(task.episodes, solved, answers, strict=True)], []

    def _other_side(
        self,
        task: ClosureTask,
        second: Episode,
        answer: ClosureAnswer,
        house: House,
        recorded: tuple[Action, ...] | None,
    ) -> tuple[tuple[Action, ...], list[Finding]]:
        """Return the actions that close the second side correctly, and findings about this side. Raises BrokenRule."""
        if CLOSURE_KINDS[task.kind].has_branches:
            return self._solve_side(task, second, house, recorded)
        actions = recorded or self._show_evidence_and_report(second, answer)
        return actions, [
            Finding(second.id, *broken) for broken in self._faults_of_second_side(second, answer, house, actions)
        ]

    def _solve_side(
        self, task: ClosureTask, episode: Episode, house: House, recorded: tuple[Action, ...] | None
    ) -> tuple[tuple[Action, ...], list[Finding]]:
        """Return the solution of a side to which the families' rules apply, and findings about this side."""
        unnamed = CLOSURE_KINDS[task.kind].unnamed_roles
        mentioned = {role: each for role, each in episode.bindings.items() if role not in unnamed}
        bare = episode.model_copy(update={"bindings": mentioned})
        exempt = exempt_of(task)
        result = self._validator.validate(bare, house, recorded, exempt=exempt)
        found = list(result.findings)
        if not found:
            self._simulator.reset(episode.start, episode.setup)
            found = [Finding(episode.id, *broken) for broken in self._faults(task, episode, result.actions)]
            if shows_one_wall(EpisodeStart(episode, house, self._view)):
                found.append(Finding(episode.id, "more_than_a_wall", "the first frame shows one wall"))
        return result.actions, found

    def _faults(self, task: ClosureTask, episode: Episode, actions: tuple[Action, ...]) -> BrokenRules:
        """Yield (rule, message) for the faults of a side under the rules of the suite and of the side's kind."""
        yield from (("protocol", fault) for fault in protocol_faults(episode, SUITE))
        if "clear_openness" in exempt_of(task):
            yield from faults_of_gaps(self._view, sorted(episode.setup.objects))
        if task.kind in FAULTS_BY_KIND:
            yield from FAULTS_BY_KIND[task.kind](self._view, task, episode, actions)

    def _answers(self, task: ClosureTask, second: Episode, house: House) -> list[ClosureAnswer]:
        """Return the answers to twins. Raises BrokenRule if they are not twins, or an impossible side is possible."""
        first = task.episodes[0]
        check_single_difference(task, second)
        for side in () if CLOSURE_KINDS[task.kind].has_branches else task.episodes:
            self._begin(side)
            check_hidden(task, side, self._view, is_searched="hidden_at_start" not in exempt_of(task))
        sides, pair = PAIRED[task.kind], f"pair:{first.id}"
        facts = {"kind": task.kind, "form": task.form, "pair": pair, "evidence": task.evidence}
        plan = Certificate(removed=task.removed, has_plan=True)
        answer = ClosureAnswer(episode_id=first.id, side=sides[0], certificate=plan, **facts)
        if sides[1] != "impossible":
            self._begin(second)
            return [answer, ClosureAnswer(episode_id=second.id, side=sides[1], certificate=plan, **facts)]
        reason = self._reason(task, second, house)
        refusal = search_refusal(self._view, second.goal)
        certificate = Certificate(removed=task.removed, has_plan=False, refusal=refusal)
        exact: tuple[Status, ...] = CONCEDED if reason in FAIL_REASONS else CONCEDED[::-1]
        facts |= {"side": sides[1], "accepted": exact, "reason": reason, "certificate": certificate}
        return [answer, ClosureAnswer(episode_id=second.id, **facts)]

    def _reason(self, task: ClosureTask, second: Episode, house: House) -> Reason:
        """Return why the second side is impossible. Raises BrokenRule if the reason does not hold."""
        first = task.episodes[0]
        self._begin(first)
        start = EpisodeStart(first, house, self._view)
        meant = [phrase for phrase, items in start.mentioned if [item.id for item in items] == [first.goal.object_id]]
        removed = self._view.scene.things[task.removed]
        self._begin(second)
        if task.removed != first.goal.object_id:
            if removed.is_pickupable or not removed.is_present:
                raise BrokenRule(
                    "cannot_be_moved",
                    f"{task.removed!r}, which makes the task impossible, can be picked up, or is absent",
                )
            return "no_fit" if isinstance(first.goal, ObjectAtReceptacle) else "locked"
        if removed.is_present:
            if not removed.is_broken:
                raise BrokenRule(
                    "twin_impossible", f"{task.removed!r} is present and not broken, so the task is not impossible"
                )
            return "broken"
        return reason_for_absence(meant, items_of(self._view.scene).values())

    def _show_evidence_and_report(self, second: Episode, answer: ClosureAnswer) -> tuple[Action, ...]:
        """Return the actions that show all evidence (objects that reveal the answer) and then report.

        Raises BrokenRule if some evidence cannot be seen.
        """
        self._begin(second)
        try:
            shown = carry_out(self._show_evidence(MacroActions(self._view, may_tilt=True), answer), self._view)
        except Unsolvable as error:
            raise BrokenRule("evidence_seen", str(error)) from None
        return (*shown, Report(status=answer.accepted[0], summary=SUMMARY))

    def _show_evidence(self, macro_actions: MacroActions, answer: ClosureAnswer) -> Iterator[Action]:
        """Yield the actions that show all evidence. For forms with evidence in several places, the nearest evidence
        comes first; for other forms, one view shows all of it.

        Raises Unsolvable if no reachable place shows the evidence.
        """
        is_of_many = answer.form in CLOSURE_KINDS[answer.kind].forms_of_many
        left = [(each,) for each in answer.evidence] if is_of_many else [answer.evidence]
        while left:
            nearest = min(left, key=lambda evidence: self._distance_to(evidence[0]))
            for action in macro_actions.go(viewpoint_showing(self._view, nearest)):
                yield action
                left = [evidence for evidence in left if not shows_all(self._view, self._view.agent, evidence)]
            if nearest in left:
                raise Unsolvable(
                    f"At the end of the walk to {nearest[0].object_id!r}, the agent does not see all evidence "
                    "about this object."
                )

    def _distance_to(self, evidence: Evidence) -> tuple[float, str]:
        """Return the floor distance (m) from the agent to the thing with the evidence, and the thing's id, for ties."""
        thing = self._view.scene.things[evidence.object_id]
        return floor_distance(self._view.agent.position, thing.position), thing.id

    def _faults_of_second_side(
        self, second: Episode, answer: ClosureAnswer, house: House, actions: tuple[Action, ...]
    ) -> BrokenRules:
        """Yield (rule, message) for the faults of the second side of twins, and of the actions to close it."""
        is_of_many = answer.form in CLOSURE_KINDS[answer.kind].forms_of_many
        if is_of_many and len(actions) < MIN_LOOKING_SHARE * second.max_steps:
            yield (
                "enough_to_look_at",
                f"seeing all that is asked about takes only {len(actions)} of {second.max_steps} steps",
            )
        if len(actions) > BUDGET_SHARE * second.max_steps:
            yield "evidence_seen", f"seeing the evidence takes {len(actions)} of {second.max_steps} steps"
        record = self._validator.play(second, house, actions)
        if record.end == "error":
            yield "closes_correctly", record.error.message if record.error else "the replay ended as an error"
            return
        verdict = score_closure(answer, second, record)
        if verdict.evidence_seen != 1.0:
            yield "evidence_seen", f"only the share {verdict.evidence_seen} of the evidence is seen"
        if not verdict.C or verdict.is_needless or verdict.outcome.W is answer.is_impossible:
            yield "closes_correctly", f"C={verdict.C:d} W={verdict.outcome.W:d} ({verdict.outcome.label})"

    def _begin(self, episode: Episode) -> None:
        """Reset the simulator to an episode's start. Raises BrokenRule if the start is impossible."""
        try:
            self._simulator.reset(episode.start, episode.setup)
        except EpisodeError as error:
            raise BrokenRule("can_be_set_up", str(error)) from None


def faults_of_gaps(view: PrivilegedView, object_ids: Iterable[str]) -> BrokenRules:
    """Yield a fault for each thing that is neither closed, nor wide open, nor open by a gap visible from close by."""
    for thing in (view.scene.things[name] for name in object_ids):
        if thing.openness <= ALMOST_CLOSED or thing.openness >= WIDE_OPEN:
            continue
        if not (can_be_partly_open(thing) and is_partly_open(thing.openness)):
            yield (
                "gap_visible",
                f"{thing.id!r} starts at openness {thing.openness}, which is not clearly open or closed",
            )
            continue
        try:
            viewpoint_showing(view, (gap_evidence(thing, thing.openness),))
        except Unsolvable:
            yield "gap_visible", f"no reachable place shows the free edge of {thing.id!r} from close by"


def search_refusal(view: PrivilegedView, goal: Goal | GoalPart) -> str:
    """Return in words why an exhaustive search finds no way to a goal. Raises BrokenRule if the search finds a way."""
    macro_actions = MacroActions(view, may_tilt=True, is_exhaustive=True)
    target = view.scene.things[goal.object_id]
    if not target.is_present:
        return f"{target.id!r} is not in the house."
    if isinstance(goal, ObjectAtReceptacle):
        if fits_on(view.scene, target.id, goal.receptacle_id):
            raise BrokenRule(
                "twin_impossible",
                f"{target.id!r} also has room on {goal.receptacle_id!r} in the twin that should be impossible",
            )
        return f"{target.id!r} has no room on {goal.receptacle_id!r}, wherever it is put and however it is turned."
    if is_doable(goal, macro_actions):
        raise BrokenRule("twin_impossible", "the goal can also be reached in the twin that should be impossible")
    if target.is_broken:
        return f"{target.id!r} is out of order."
    return f"No reachable place from which it works on {target.id!r}."


def task_of(episodes: Sequence[Episode], answers: Sequence[ClosureAnswer]) -> ClosureTask:
    """Return the task whose sides are these episodes. `answers` has the answer to each episode, in the same order."""
    first = answers[0]
    sides = PAIRED.get(first.kind, ())
    places: dict[str | None, int] = {side: place for place, side in enumerate(sides)}
    ordered = sorted(zip(answers, episodes, strict=True), key=lambda each: places.get(each[0].side, 0))
    removed = first.certificate.removed if first.certificate else ""
    return ClosureTask(first.kind, tuple(episode for _, episode in ordered), removed, first.evidence, first.form)
