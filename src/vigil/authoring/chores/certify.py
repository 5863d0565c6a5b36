"""Certificates of lists: proof, by search and by replay, that each chore is as its answer says.

The solver does every chore that can be done, reports the truth about each chore, and needs only a part of the step
budget for this. A report with a wrong claim (statement about one chore) must not close the list correctly. Source:
`protocol.md` section 9, decision 62.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Protocol

from vigil.authoring.chores.budgets import budget_for, is_within_budget, max_solver_steps
from vigil.authoring.chores.claim_controls import false_claims
from vigil.authoring.chores.compose import ListTask
from vigil.authoring.chores.rules import (
    BrokenRules,
    absent_phrases,
    faults_of_order,
    faults_of_picks,
    faults_of_start,
    faults_of_states,
    faults_of_words,
)
from vigil.authoring.closure.certify import search_refusal
from vigil.authoring.closure.twins import BrokenRule, reason_for_absence
from vigil.authoring.drafting.generation import SolvedSide
from vigil.authoring.language.referring import items_of
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.validate import Finding, Validator
from vigil.authoring.solving.chores import (
    ChorePlan,
    UnsolvableChore,
    check_looks,
    evidence_of,
    plan_chores,
    solve_chores,
)
from vigil.authoring.solving.goal_actions import expected_status
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.solvers import carry_out, solve
from vigil.packs.pack import invalid_limit
from vigil.protocol.actions import Action, Report, Status
from vigil.protocol.episode import Episode
from vigil.protocol.goals import Chores
from vigil.protocol.house import House
from vigil.protocol.profile import ITEMISED_REPORT
from vigil.records.record import EpisodeRecord
from vigil.scene.things import Thing
from vigil.scoring.chore_answers import ChoreAnswer, ChoreKind, ListAnswer, list_kind
from vigil.scoring.chores import score_list
from vigil.scoring.closure import CONCEDED, FAIL_REASONS, Certificate, Reason, evidence_seen
from vigil.sim.privileged import PrivilegedSimulator

LOOKED_AT: frozenset[ChoreKind] = frozenset({"question", "already", "impossible", "conditional"})
"""Kinds of chores for which an agent must see something, even if it has nothing to do."""


class Sketch(Protocol):
    """The facts about a chore that certifying needs. A proposed chore and a recorded answer both have these facts."""

    @property
    def kind(self) -> ChoreKind: ...  # noqa: D102
    @property
    def form(self) -> str: ...  # noqa: D102
    @property
    def reason(self) -> Reason | None: ...  # noqa: D102
    @property
    def distractor(self) -> str | None: ...  # noqa: D102
    @property
    def removed(self) -> str: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class _AnsweredChore:
    """The `Sketch` of a chore, taken from its answer."""

    kind: ChoreKind
    form: str
    reason: Reason | None
    distractor: str | None
    removed: str


class ListCertifier:
    """Certifies lists on one simulator."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self._validator = Validator(simulator, profile=ITEMISED_REPORT)
        self._view = PrivilegedView(simulator)

    def certify(self, task: ListTask, house: House) -> tuple[list[SolvedSide], list[Finding]]:
        """Return a list with its budget, solution and answer, and no findings; for a faulty list, only findings."""
        episode = task.episode
        found, answer = self._answered(episode, house, task.chores)
        if found or answer is None:
            _blame(task, found)
            return [], found
        try:
            self._simulator.reset(episode.start, episode.setup)
            looked = [place for place, chore in enumerate(task.chores) if chore.kind in LOOKED_AT]
            check_looks(episode, [place for place in looked if task.chores[place].chore not in task.seen], self._view)
            task.seen.update(task.chores[place].chore for place in looked)
            conceded: dict[int, Status] = {
                place: each.accepted[0] for place, each in enumerate(answer.chores) if not each.is_possible
            }
            steps = solve_chores(episode, MacroActions(self._view, may_tilt=True), conceded)
            most = max_solver_steps(answer.rooms)
            actions = carry_out(islice(steps, most + 1), self._view)
        except Unsolvable as error:
            if isinstance(error, UnsolvableChore):
                task.faulty.update(task.chores[error.place].chore.parts)
            return [], [Finding(episode.id, "solvable", str(error))]
        if len(actions) > most:
            return [], [Finding(episode.id, "within_budget", f"the solver needs more than {most} steps")]
        found = [Finding(episode.id, "closes_correctly", fault) for fault in faults_of_claims(answer, actions)]
        if found:
            _blame(task, found)
            return [], found
        budget = budget_for(len(actions), answer.rooms, episode.instruction)
        final = episode.model_copy(update={"max_steps": budget, "max_invalid": invalid_limit(budget)})
        answer = answer.model_copy(update={"solver_steps": len(actions)})
        found = [Finding(episode.id, *broken) for broken in self._faults_of_solution(final, answer, house, actions)]
        _blame(task, found)
        return ([], found) if found else ([SolvedSide(final, actions, answer)], [])

    def solve(self, episode: Episode, answer: ListAnswer, house: House) -> tuple[SolvedSide | None, list[Finding]]:
        """Return a list whose start has changed, with a new solution and answer; None and the findings if it is faulty.

        The chores are those of `answer`, and the budget stays as it is.
        """
        found, again = self._answered(episode, house, [_sketch_of(each) for each in answer.chores])
        if found or again is None:
            return None, found
        self._simulator.reset(episode.start, episode.setup)
        try:
            actions = carry_out(solve(episode, self._view), self._view)
        except Unsolvable as error:
            return None, [Finding(episode.id, "solvable", str(error))]
        again = again.model_copy(update={"solver_steps": len(actions)})
        found = self.verify(episode, again, house, actions)
        return (None, found) if found else (SolvedSide(episode, actions, again), [])

    def verify(self, episode: Episode, answer: ListAnswer, house: House, actions: Sequence[Action]) -> list[Finding]:
        """Return the findings about a list of a frozen pack, given its recorded answer and solution."""
        found, again = self._answered(episode, house, [_sketch_of(each) for each in answer.chores])
        if not found and again is not None:
            if again.model_copy(update={"solver_steps": answer.solver_steps}) != answer:
                return [Finding(episode.id, "closes_correctly", "its answer is not the one that the search gives")]
            faults = self._faults_of_solution(episode, answer, house, tuple(actions))
            found = [Finding(episode.id, *broken) for broken in faults]
        return found

    def _answered(
        self, episode: Episode, house: House, chores: Sequence[Sketch]
    ) -> tuple[list[Finding], ListAnswer | None]:
        """Return the findings about the start of a list, or the list's answer if there are none."""
        fault = self._validator.begin_fault(episode, house)
        if fault is not None:
            return [fault], None
        case = EpisodeStart(episode, house, self._view)
        found = [Finding(episode.id, *broken) for broken in (*faults_of_start(case), *faults_of_words(case))][:1]
        if found:
            return found, None
        goal = episode.goal
        assert isinstance(goal, Chores)
        try:
            conceded = {place for place, chore in enumerate(chores) if chore.reason is not None}
            plan = plan_chores(episode, self._view, conceded)
            answers = [self._answer(case, place, chore, plan) for place, chore in enumerate(chores)]
        except BrokenRule as broken:
            return [Finding(episode.id, broken.rule, str(broken))], None
        except Unsolvable as error:
            return [Finding(episode.id, "solvable", str(error))], None
        rest = (*faults_of_states(case, answers), *faults_of_order(plan, answers))
        found = [Finding(episode.id, *broken) for broken in rest]
        rooms = len(self._view.scene.rooms)
        kind = list_kind(len(answers))
        return found, ListAnswer(episode_id=episode.id, kind=kind, chores=tuple(answers), rooms=rooms)

    def _answer(self, case: EpisodeStart, place: int, chore: Sketch, plan: ChorePlan) -> ChoreAnswer:
        """Return the answer of a chore. Raises BrokenRule, e.g. if a chore that should be impossible can be met."""
        goal, view = case.episode.goal, case.view
        assert isinstance(goal, Chores)
        asked, facts = goal.chores[place], dict[str, object]()
        if asked.question is not None:
            facts["accepted"] = (expected_status(asked.question, view),)
        if chore.kind in ("already", "impossible", "conditional"):
            facts["evidence"] = tuple(each for view_ in evidence_of(case.episode, place, view) for each in view_)
        if chore.reason is not None:
            reason = self._reason(case, place, chore)
            exact: tuple[Status, ...] = CONCEDED if reason in FAIL_REASONS else CONCEDED[::-1]
            refusal = search_refusal(view, asked.parts[0])
            certificate = Certificate(removed=chore.removed, has_plan=False, refusal=refusal)
            facts |= {"reason": reason, "accepted": exact, "certificate": certificate}
        if chore.kind in ("order", "by_the_way"):
            facts["with_chores"] = entangled_with(plan, place, chore.kind)
        distractor = chore.distractor if chore.kind == "look_alike" else None
        return ChoreAnswer(kind=chore.kind, form=chore.form, distractor=distractor, **facts)  # pyright: ignore

    def _reason(self, case: EpisodeStart, place: int, chore: Sketch) -> Reason:
        """Return why a chore cannot be met. Raises BrokenRule if the reason does not hold."""
        goal, things = case.episode.goal, case.view.scene.things
        assert isinstance(goal, Chores)
        part, removed = goal.chores[place].parts[0], things[chore.removed]
        if chore.removed != part.object_id:
            if removed.is_pickupable or not removed.is_present:
                raise BrokenRule(
                    "cannot_be_moved",
                    f"{removed.id!r} should block the chore, but an agent can carry it away, or it is absent",
                )
            return "no_fit" if part.kind == "object_at_receptacle" else "locked"
        if removed.is_present:
            if not removed.is_broken:
                raise BrokenRule(
                    "twin_impossible", f"{removed.id!r} is present and not broken, so the chore is not impossible"
                )
            return "broken"
        return reason_for_absence(absent_phrases(case, place + 1), items_of(case.view.scene).values())

    def _faults_of_solution(
        self, episode: Episode, answer: ListAnswer, house: House, actions: tuple[Action, ...]
    ) -> BrokenRules:
        """Yield (rule, message) for each fault of a solution, i.e. of the actions that should close a list."""
        if not is_within_budget(len(actions), answer.rooms, episode.max_steps):
            yield "within_budget", f"{len(actions)} steps are too many for a budget of {episode.max_steps}"
            return
        with self._simulator.looking_at(_looked_at(episode, answer, self._view.scene.things)):
            record = self._validator.play(episode, house, actions)
        if record.end == "error":
            yield "closes_correctly", record.error.message if record.error else "it ended as an error"
            return
        unclear = list(faults_of_picks(episode, record))
        if unclear:
            yield from unclear
            return
        outcome = score_list(answer, episode, record, has_claims=True)
        for number, each in enumerate(outcome.chores, start=1):
            if not each.B or (answer.chores[number - 1].is_possible and not each.W_strict):
                yield "closes_correctly", f"chore {number}: W={each.W:d} B={each.B:d} ({each.label})"
        yield from _faults_of_record(answer, record)
        yield from (("false_claims_fail", name) for name in false_claims(outcome, episode, record))


def _looked_at(episode: Episode, answer: ListAnswer, things: Mapping[str, Thing]) -> set[str]:
    """Return the ids of the objects whose visible pixels decide whether a solution closes a list correctly: objects
    that can be picked up, that are evidence, or that a question is about."""
    goal = episode.goal
    assert isinstance(goal, Chores)
    ids = {each for each in episode.bound_ids() if things[each].is_pickupable}
    ids |= {each.object_id for chore in answer.chores for each in chore.evidence}
    return ids | {chore.question.object_id for chore in goal.chores if chore.question is not None}


def faults_of_claims(answer: ListAnswer, actions: Sequence[Action]) -> Iterator[str]:
    """Yield what is wrong with the claims in a solution. The actions themselves are not replayed."""
    last = actions[-1]
    claims = (last.claims or {}) if isinstance(last, Report) else {}
    for number, chore in enumerate(answer.chores, start=1):
        if claims.get(number) not in chore.accepted:
            yield f"chore {number}: claimed as {claims.get(number)}"


def _faults_of_record(answer: ListAnswer, record: EpisodeRecord) -> BrokenRules:
    for step in record.steps:
        if step.effect is not None and step.effect.refusal is not None:
            yield "margins", f"step {step.index} is refused ({step.effect.refusal})"
    for number, chore in enumerate(answer.chores, start=1):
        if evidence_seen(chore.evidence, record) not in (None, 1.0):
            yield "evidence_seen", f"chore {number}: not all evidence is seen"


def _blame(task: ListTask, findings: Sequence[Finding]) -> None:
    """Keep the chores that the findings name out of further lists of the home."""
    task.faulty.update(part for place in blamed(findings) for part in task.chores[place].chore.parts)


def blamed(findings: Sequence[Finding]) -> list[int]:
    """Return the indices of those chores of the list that the findings name."""
    named = (re.match(r"[Cc]hore (\d+)\b", finding.message) for finding in findings)
    return [int(found[1]) - 1 for found in named if found is not None]


def entangled_with(plan: ChorePlan, place: int, kind: ChoreKind) -> tuple[int, ...]:
    """Return the numbers (from 1) of the other chores with which the chore at index `place` is entangled.

    For the kind `order`, they undo this chore or are undone by it; for other kinds, doing one of them does this chore,
    too.
    """
    found = plan.entanglement
    if kind == "order":
        others = {a if b == place else b for a, b in found.before if place in (a, b)}
    else:
        others = {other for done, other in found.by_the_way if done == place}
    return tuple(sorted(other + 1 for other in others))


def _sketch_of(answer: ChoreAnswer) -> Sketch:
    removed = answer.certificate.removed if answer.certificate else ""
    return _AnsweredChore(answer.kind, answer.form, answer.reason, answer.distractor, removed)
