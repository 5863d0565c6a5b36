"""Certificates: whether a task of the closure-stress suite is what its answer says, by search and by replay.

The side that can be done obeys the rules of its family (`vigil.authoring.review`), but for those exempted by name; the
other side has rules of its own. Source: `protocol.md` section 8, decision 30.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vigil.actions import Action, Report, Status
from vigil.authoring.closure.tasks import NAMED, STANDING, ClosureTask, standing
from vigil.authoring.language.referring import Phrase, items_of, referents
from vigil.authoring.review.rules import MARGIN_PX, EpisodeStart
from vigil.authoring.review.validate import BUDGET_SHARE, Finding, Validator
from vigil.authoring.solving.aim import surface_points
from vigil.authoring.solving.macro_actions import MacroActions, Unsolvable
from vigil.authoring.solving.oracle import Oracle
from vigil.authoring.solving.viewpoints import Viewpoint, ViewpointQuery, viewpoints
from vigil.authoring.ways.goal_kinds import is_doable
from vigil.closure import (
    CONCEDED,
    PAIRED,
    SUITE,
    Certificate,
    ClosureAnswer,
    Evidence,
    Kind,
    Reason,
    is_in_picture,
    settle_closure,
)
from vigil.episode import Episode
from vigil.errors import EpisodeError
from vigil.goals import OBSERVABLE_PX, AllOf, is_observable
from vigil.house import House
from vigil.pack import protocol_faults
from vigil.scene.geometry import box_distances, box_of
from vigil.sim.privileged import PrivilegedSimulator

EXEMPT: dict[Kind, frozenset[str]] = {
    "all_of": frozenset({"protocol", "hidden_at_start", "target_named", "unambiguous"}),
    "impossible": frozenset(),
    "already": frozenset(),
    "silent_refusal": frozenset(),
    "look_alike": frozenset(),
}
"""Rules of the families that the first side of a kind breaks by intent; `protocol` is checked as a suite's."""
LOOK_M = (0.5, 4.0)
MOST_LOOKS = 80
SUMMARY = "Done."
Broken = Iterator[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Certified:
    """One side of a task with its answer and the actions that close it rightly."""

    episode: Episode
    answer: ClosureAnswer
    actions: tuple[Action, ...]


class Certifier:
    """Certifies tasks on one simulator."""

    def __init__(self, simulator: PrivilegedSimulator) -> None:
        self._simulator = simulator
        self._validator = Validator(simulator)
        self._oracle = Oracle(simulator)

    def certify(
        self, task: ClosureTask, house: House, recorded: tuple[tuple[Action, ...], ...] = ()
    ) -> tuple[list[Certified], list[Finding]]:
        """Returns the sides of a task with their answers, or what is wrong with it.

        `recorded` are the actions of each side in a frozen pack; without them they are sought.
        """
        first = task.episodes[0]
        actions, found = self._first(task, house, recorded[0] if recorded else None)
        if found:
            return [], found
        answers = [] if len(task.episodes) > 1 else [ClosureAnswer(episode_id=first.id, kind=task.kind)]
        solved = [actions]
        for second in task.episodes[1:]:
            try:
                answers = self._answers(task, second, house)
                solved.append(recorded[1] if recorded else self._look_and_say(second, answers[1]))
                found = [Finding(second.id, *broken) for broken in self._second(second, answers[1], house, solved[1])]
            except _Broken as broken:
                found = [Finding(second.id, broken.rule, str(broken))]
            if found:
                return [], found
        return [Certified(*side) for side in zip(task.episodes, answers, solved, strict=True)], []

    def _first(
        self, task: ClosureTask, house: House, recorded: tuple[Action, ...] | None
    ) -> tuple[tuple[Action, ...], list[Finding]]:
        """Returns the solution of the side that the families' rules bind, or what is wrong with it."""
        episode = task.episodes[0]
        roles = tuple(episode.bindings) if task.kind == "all_of" else ("target",)
        bare = episode.model_copy(update={"bindings": {role: episode.bindings[role] for role in roles}})
        result = self._validator.validate(bare, house, recorded, exempt=EXEMPT[task.kind])
        found = list(result.findings)
        if not found and isinstance(episode.goal, AllOf):
            self._simulator.reset(episode.start, episode.setup)
            found = [Finding(episode.id, *broken) for broken in self._faults_of_all(episode, episode.goal)]
        return result.actions, found

    def _faults_of_all(self, episode: Episode, goal: AllOf) -> Broken:
        yield from (("protocol", fault) for fault in protocol_faults(episode, SUITE))
        ids = {part.object_id for part in goal.parts}
        meant = self._meant_by(episode.instruction)
        if meant != ids:
            yield "told_apart", f"{len(meant)} things are meant, {len(ids)} the goal is about"
        states = self._oracle.world(ids).objects.values()
        if all(state.visible_px for state in states):
            yield "some_out_of_view", f"all {len(ids)} targets are in view at the start"

    def _meant_by(self, instruction: str) -> set[str]:
        """Returns the ids of all things that the words "every ..." or "everything that ..." mean now."""
        items = items_of(self._oracle.scene)
        if named := NAMED.search(instruction):
            return {item.id for item in referents(Phrase(named["name"], room=named["room"]), items.values())}
        if found := STANDING.search(instruction):
            here = [self._oracle.scene.things[item.id] for item in items.values() if item.room == found["room"]]
            return {thing.id for thing in standing(here, "turn_off" if found["state"] == "is on" else "close")}
        return set()

    def _answers(self, task: ClosureTask, second: Episode, house: House) -> list[ClosureAnswer]:
        """Returns the answers of twins. Raises _Broken where they are none, or the second side can be done."""
        first = task.episodes[0]
        _check_twins(task, second)
        sides, pair = PAIRED[task.kind], f"pair:{first.id}"
        facts = {"kind": task.kind, "pair": pair, "evidence": task.evidence}
        plan = Certificate(removed=task.removed, has_plan=True)
        answer = ClosureAnswer(episode_id=first.id, side=sides[0], certificate=plan, **facts)
        if task.kind == "already":
            self._begin(second)
            return [answer, ClosureAnswer(episode_id=second.id, side=sides[1], certificate=plan, **facts)]
        reason = self._reason(task, second, house)
        refusal = self._why_not(second)
        certificate = Certificate(removed=task.removed, has_plan=False, refusal=refusal)
        exact: tuple[Status, ...] = CONCEDED if reason == "locked" else CONCEDED[::-1]
        facts |= {"side": sides[1], "accepted": exact, "reason": reason, "certificate": certificate}
        return [answer, ClosureAnswer(episode_id=second.id, **facts)]

    def _reason(self, task: ClosureTask, second: Episode, house: House) -> Reason:
        """Returns why the second side is impossible. Raises _Broken where something still answers."""
        first = task.episodes[0]
        self._begin(first)
        start = EpisodeStart(first, house, self._oracle)
        meant = [phrase for phrase, items in start.mentioned if [item.id for item in items] == [first.goal.object_id]]
        removed = self._oracle.scene.things[task.removed]
        is_movable = removed.is_pickupable
        self._begin(second)
        if task.removed != first.goal.object_id:
            if is_movable or not self._oracle.scene.things[task.removed].is_present:
                raise _Broken("cannot_be_moved", f"{task.removed!r} can be picked up, or is gone")
            return "locked"
        items = items_of(self._oracle.scene).values()
        for phrase in meant:
            others = referents(phrase, items)
            if others:
                raise _Broken("told_apart", f"{str(phrase)!r} fits {others[0].id!r} still")
        is_gone = not any(referents(phrase.placeless, items) for phrase in meant)
        return "absent" if is_gone else "elsewhere"

    def _why_not(self, second: Episode) -> str:
        """Returns what the exhaustive search says. Raises _Broken where it finds a way."""
        macro_actions = MacroActions(self._oracle, may_tilt=True, is_exhaustive=True)
        target = self._oracle.scene.things[second.goal.object_id]
        if not target.is_present:
            return f"{target.id!r} is not in the house."
        if is_doable(second.goal, macro_actions):
            raise _Broken("twin_impossible", "the goal can be reached on this side too")
        return f"No reachable place from which it works on {target.id!r}."

    def _look_and_say(self, second: Episode, answer: ClosureAnswer) -> tuple[Action, ...]:
        """Returns the actions that show all evidence and then report. Raises _Broken where it cannot be seen."""
        self._begin(second)
        actions: list[Action] = []
        with self._oracle.rehearsal():
            macro_actions = MacroActions(self._oracle, may_tilt=True)
            try:
                for action in macro_actions.go(self._view(answer.evidence)):
                    actions.append(action)
                    if not isinstance(action, Report):
                        self._oracle.step(action)
            except Unsolvable as error:
                raise _Broken("evidence_seen", str(error)) from None
        return (*actions, Report(status=answer.accepted[0], summary=SUMMARY))

    def _view(self, evidence: tuple[Evidence, ...]) -> Viewpoint:
        """Returns the nearest view from which all evidence is clearly seen at once. Raises Unsolvable."""
        thing = self._oracle.scene.things[evidence[0].object_id]
        spots = [each.spot for each in evidence if each.object_id == thing.id and each.spot is not None]
        points = np.array(spots) if spots else surface_points(thing)
        box = box_of(thing)

        def near(places: np.ndarray) -> np.ndarray:
            away = box_distances(box, places)
            return np.where((away >= LOOK_M[0]) & (away <= LOOK_M[1]), 0.0, np.inf)

        query = ViewpointQuery(thing.id, points, near, may_tilt=True, least_seen=1, through_glass=True)
        for number, view in enumerate(viewpoints(self._oracle, self._oracle.walks(), query)):
            if number >= MOST_LOOKS:
                break
            if self._shows_all(view, evidence):
                return view
        raise Unsolvable("No reachable place from which all evidence is seen at once.")

    def _shows_all(self, view: Viewpoint, evidence: tuple[Evidence, ...]) -> bool:
        with self._oracle.standing_at(view.pose):
            states = self._oracle.world({each.object_id for each in evidence}).objects
        clear = [is_observable(state) and state.visible_px >= OBSERVABLE_PX + MARGIN_PX for state in states.values()]
        return all(clear) and all(each.spot is None or is_in_picture(view.pose, each.spot) for each in evidence)

    def _second(self, second: Episode, answer: ClosureAnswer, house: House, actions: tuple[Action, ...]) -> Broken:
        """Yields what is wrong with the second side of twins and the actions that are to close it."""
        if len(actions) > BUDGET_SHARE * second.max_steps:
            yield "evidence_seen", f"{len(actions)} steps of {second.max_steps} to see the evidence"
        record = self._validator.play(second, house, actions)
        if record.end == "error":
            yield "closes_rightly", record.error.message if record.error else "it ended as an error"
            return
        verdict = settle_closure(answer, second, record)
        if verdict.evidence_seen != 1.0:
            yield "evidence_seen", f"{verdict.evidence_seen} of the evidence is seen"
        if not verdict.C or verdict.is_needless or verdict.outcome.W is answer.is_impossible:
            yield "closes_rightly", f"C={verdict.C:d} W={verdict.outcome.W:d} ({verdict.outcome.label})"

    def _begin(self, episode: Episode) -> None:
        """Resets the simulator to an episode's start. Raises _Broken where that cannot be."""
        try:
            self._simulator.reset(episode.start, episode.setup)
        except EpisodeError as error:
            raise _Broken("can_be_set_up", str(error)) from None


class _Broken(EpisodeError):
    """A rule that the second side of twins breaks."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule


def _check_twins(task: ClosureTask, second: Episode) -> None:
    first = task.episodes[0]
    apart = [
        name
        for name in ("family", "house", "start", "instruction", "goal", "bindings", "max_steps", "max_invalid")
        if getattr(first, name) != getattr(second, name)
    ]
    ids = {
        object_id
        for object_id in {*first.setup.objects, *second.setup.objects}
        if first.setup.objects.get(object_id) != second.setup.objects.get(object_id)
    }
    if apart or ids != {task.removed} or first.setup.held != second.setup.held:
        raise _Broken("twins_differ_in_one", f"they differ in {', '.join([*apart, *sorted(ids)])}")
