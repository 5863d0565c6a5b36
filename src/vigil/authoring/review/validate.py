"""Validation: an episode is valid if its start breaks no rule, and its replayed solution reaches the goal.

The rules about starts are in `vigil.authoring.review.rules`. This module plays the solution through `vigil.env` and
scores it in the same way as runs. Source: `protocol.md` section 4.4.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from vigil.authoring.review.blind_trials import blind_trials
from vigil.authoring.review.control_worlds import ControlWorlds
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.goal_controls import controls_of_goal
from vigil.authoring.review.robustness import ROBUST_RULES, robust_faults
from vigil.authoring.review.rules import MARGIN_M, MARGIN_PX, RULES, broken_by
from vigil.authoring.review.wording_rules import WORDING_RULES, worded_badly
from vigil.authoring.solving import primitive_actions
from vigil.authoring.solving.macro_actions import Unsolvable
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.authoring.solving.solvers import solution
from vigil.env import Env
from vigil.errors import EpisodeError, PackMismatch, SettingError, did_you_mean
from vigil.packs.pack import check_episode_house
from vigil.protocol.actions import REACH_M, Action, InteractPixel
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.family import FamilySpec
from vigil.protocol.goals import OBSERVABLE_M, OBSERVABLE_PX, AgentNearTarget, ObjectInState, ReportStatus
from vigil.protocol.house import House
from vigil.protocol.profile import BASELINE, Profile
from vigil.protocol.world import ObjectState
from vigil.records.record import EpisodeRecord
from vigil.scoring.outcomes import score
from vigil.sim.privileged import PrivilegedSimulator

BUDGET_SHARE = 0.8
"""Maximum length of a solution, as a share of the step budget."""

OTHER_RULES = {
    "house_pinned": "the house is the same file, byte for byte, as when the episode was made",
    "solvable": "the solver finds a way",
    "expected_skills": "the solution uses only the skills that the family expects",
    "within_budget": "the solution takes at most four fifths of the budget",
    "solution_holds": "the solution, replayed, gives W = W_strict = B = 1",
    "not_blind_luck": "agents that walk, turn, click or wait without sight do not complete the episode",
    "negative_controls_fail": "outcomes that only look like success do not count, e.g. an object on top, not inside",
    "margins": "the solution clears every threshold with a margin (2 cm, 20 px)",
}
"""Rule name -> reason, for the rules that are not only about the start."""
SUITE_RULES = {
    "twins_differ_in_one": "the twins have the same instruction, start and goal, and differ in one object's setup",
    "difference_hidden": "in both twins, no mirror is in view at the start, nor is the object that blocks the "
    "target or fills the receptacle",
    "distinguished": "the instruction means the objects of the goal, and no others",
    "some_out_of_view": "at least half of several targets are out of view at the start",
    "twin_impossible": "the exhaustive search does not find a way to reach the goal",
    "obvious_is_full": "on the surface nearest to the hand's height every click is refused; another surface has room",
    "cannot_be_moved": "the object that blocks the target or fills the receptacle cannot be picked up, and is "
    "elsewhere in the other twin",
    "evidence_seen": "all evidence can be seen within four fifths of the budget",
    "enough_to_look_at": "looking at everything in a place that is asked about takes at least half of the budget",
    "time_to_look": "acting on targets that are identified by their state takes at most three fifths of the budget",
    "closes_correctly": "the recorded solution, replayed, is a correct closure",
    "can_be_set_up": "the simulator can set up the start",
    "few_enough": "there are two to five targets, at least three if they are identified by their state; two to 24 "
    "things if the instruction asks to make sure that all are off or closed",
    "gap_visible": "partly open things are open by at least 4 cm, and their free edge can be seen from close by",
    "place_can_be_seen": "a named place can be seen from above, and nothing asked about is in a closed container",
}
"""Rule name -> reason, for the rules of the closure-stress suite (`vigil.authoring.closure.certify` checks them)."""
LIST_RULES = {
    "composed": "all chores of the list can be done, the order of the text does not help, and the walk is not too long",
    "not_shut_away": "if an object is in a closed container, its sentence names the container, or people would look "
    "for it there, in one of at most 8 closed containers",
    "seen_where_picked": "the solver sees at least 100 pixels of each object that it picks up",
    "holds_already": "a chore of kind `already` holds at the start",
    "condition_judged": "a conditional chore says correctly whether its condition holds at the start",
    "refused_at_first": "the first try of the act is refused",
    "text_order_does_not_help": "doing chores in text order fails if some undo others, and takes a clearly longer walk",
    "entangled_as_answered": "a chore has kind `order` if, and only if, it undoes another chore or another "
    "undoes it, in the wrong order",
    "false_claims_fail": "claims that are not true never close a list correctly",
}
"""Rule name -> reason, for the rules that only lists of chores have (`vigil.authoring.chores.certify` checks them)."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A rule that an episode breaks, with a message."""

    episode_id: str
    rule: str
    message: str

    def __str__(self) -> str:
        return f"{self.episode_id}: {self.rule}: {self.message} ({reason_of(self.rule)})"


def reason_of(rule: str) -> str:
    """Return the sentence that says what a rule requires."""
    starting, others = {**RULES, **WORDING_RULES}, {**OTHER_RULES, **ROBUST_RULES, **SUITE_RULES, **LIST_RULES}
    return starting[rule].reason if rule in starting else others[rule]


def check_rule_names(spec: FamilySpec) -> None:
    """Raise SettingError if a family lists a rule that does not exist."""
    for name in spec.rules:
        if name not in {**RULES, **WORDING_RULES}:
            hint = did_you_mean(name, {**RULES, **WORDING_RULES})
            raise SettingError(f"Family {spec.code!r} names rule {name!r}, which does not exist.{hint}")


@dataclass(frozen=True, slots=True)
class NegativeControl:
    """An outcome that looks like success but must not count as success, with its record.

    Examples are: on top instead of inside; the look-alike or a neighbour instead of the target; done and then undone.
    To plan the walks would take too long, so the simulator sets up each outcome. Scoring then works as in any run.
    """

    name: str
    record: EpisodeRecord | None
    """Record of the outcome; None if the outcome is impossible in this house."""


@dataclass(frozen=True, slots=True)
class ValidationResult:
    """Result of the validation of an episode."""

    findings: tuple[Finding, ...]
    actions: tuple[Action, ...] = ()
    """Actions of the solution; empty if an earlier check failed."""
    negative_controls: tuple[NegativeControl, ...] = ()
    """Negative controls, including those that are impossible in this house; empty if an earlier check failed."""

    @property
    def is_valid(self) -> bool:
        """Whether the episode breaks no rule."""
        return not self.findings


class Validator:
    """Validates episodes on one simulator."""

    def __init__(self, simulator: PrivilegedSimulator, *, is_draft: bool = False, profile: str = BASELINE) -> None:
        """With `is_draft`, also apply the rules about wording. Frozen packs may be older than these rules.

        Solutions are replayed under `profile`.
        """
        for spec in FAMILIES.values():
            check_rule_names(spec)
        self._simulator = simulator
        self._is_draft = is_draft
        self._houses: dict[str, House] = {}
        self._view = PrivilegedView(simulator)
        self._env = Env(simulator, lambda episode: self._houses[episode.house.sha256], Profile(name=profile))

    def validate(
        self,
        episode: Episode,
        house: House,
        actions: Iterable[Action] | None = None,
        *,
        exempt: frozenset[str] = frozenset(),
    ) -> ValidationResult:
        """Return the findings about an episode. When a check fails, later checks are left out.

        `actions` is the recorded solution; if it is None, the solver finds a solution. `exempt` has the names of rules
        about the start that are not checked.
        """
        fault = self.begin_fault(episode, house)
        if fault is not None:
            return ValidationResult((fault,))
        start = EpisodeStart(episode, house, self._view)
        found = [Finding(episode.id, *broken) for broken in broken_by(start) if broken[0] not in exempt]
        if not found and self._is_draft:
            found = [Finding(episode.id, *broken) for broken in worded_badly(start)]
        tries = () if found else blind_trials(episode)
        if any(score(episode, self._replay(episode, moves)).W for moves in tries):  # before the solver, which is slower
            found = [Finding(episode.id, "not_blind_luck", "an agent without sight completes it")]
        if found:
            return ValidationResult(tuple(found))
        self._begin(episode, house)
        try:
            steps = tuple(actions) if actions is not None else solution(episode, self._view)
        except Unsolvable as error:
            return ValidationResult((Finding(episode.id, "solvable", str(error)),))
        record = self._replay(episode, steps)
        judged = tuple(self._judge(episode, steps, record))
        if judged:
            return ValidationResult(judged, steps)
        worlds = ControlWorlds(self._simulator, self._view, episode, record)
        controls = tuple(NegativeControl(name, made) for name, made in controls_of_goal(episode.goal, worlds))
        scored = ((made.name, score(episode, made.record)) for made in controls if made.record is not None)
        passed = (name for name, outcome in scored if outcome.W or outcome.B)
        findings = tuple(Finding(episode.id, "negative_controls_fail", name) for name in passed)
        return ValidationResult(findings, steps, controls)

    def robustness(self, episode: Episode, house: House) -> tuple[Finding, ...]:
        """Return a finding for each rule of `vigil.authoring.review.robustness` that a valid episode breaks."""
        fault = self.begin_fault(episode, house)
        if fault is not None:
            return (fault,)
        case = EpisodeStart(episode, house, self._view)
        return tuple(Finding(episode.id, *broken) for broken in robust_faults(case, self._env))

    def play(self, episode: Episode, house: House, actions: Iterable[Action]) -> EpisodeRecord:
        """Play actions in an episode and return the record. Actions after the end of the episode are ignored."""
        self._houses = {house.sha256: house}
        return self._replay(episode, actions)

    def begin_fault(self, episode: Episode, house: House) -> Finding | None:
        """Reset to an episode; return a finding if that is impossible, else None."""
        try:
            check_episode_house(episode, house)
        except PackMismatch as error:
            return Finding(episode.id, "house_pinned", str(error))
        except EpisodeError as error:
            return Finding(episode.id, "objects_exist", str(error))
        try:
            self._begin(episode, house)
        except EpisodeError as error:
            return Finding(episode.id, "start_free", str(error))
        return None

    def _begin(self, episode: Episode, house: House) -> None:
        self._houses = {house.sha256: house}
        self._env.reset(episode)

    def _replay(self, episode: Episode, actions: Iterable[Action]) -> EpisodeRecord:
        observation = self._env.reset(episode)
        for action in actions:
            if observation is None:
                break
            observation = self._env.step(primitive_actions.reply_of(action))
        if self._env.end is None:
            self._env.fail("agent", "the actions stop before the episode ends")
        return self._env.record()

    def _judge(self, episode: Episode, actions: tuple[Action, ...], record: EpisodeRecord) -> Iterator[Finding]:
        for action in actions:
            if not _is_expected(action, episode):
                yield Finding(episode.id, "expected_skills", f"{action.skill_name} is not expected in {episode.family}")
        most = max(2, int(BUDGET_SHARE * episode.max_steps))
        if len(actions) > most:
            yield Finding(
                episode.id, "within_budget", f"{len(actions)} steps; at most {most} of {episode.max_steps} are allowed"
            )
        if record.end == "error":
            yield Finding(
                episode.id, "solution_holds", record.error.message if record.error else "the replay ended as an error"
            )
            return
        outcome = score(episode, record)
        if not (outcome.W and outcome.W_strict and outcome.B):
            outcome_text = f"W={outcome.W:d} W_strict={outcome.W_strict:d} B={outcome.B:d} ({outcome.label})"
            yield Finding(episode.id, "solution_holds", outcome_text)
            return
        yield from (Finding(episode.id, "margins", fault) for fault in _thin_margins(episode, record))


def _is_expected(action: Action, episode: Episode) -> bool:
    skills = FAMILIES[episode.family].skills
    if isinstance(action, InteractPixel) and action.intent == "ground":
        return "interact_pixel(ground)" in skills or "interact_pixel" in skills
    return action.skill_name in skills


def _is_clear(state: ObjectState) -> bool:
    distance_m = state.nearest_visible_m
    near = distance_m is not None and distance_m <= OBSERVABLE_M - MARGIN_M
    return near and state.visible_px >= OBSERVABLE_PX + MARGIN_PX


def _thin_margins(episode: Episode, record: EpisodeRecord) -> Iterator[str]:
    """Yield messages about thresholds that a successful record meets by less than the margin."""
    goal, last = episode.goal, record.worlds[-1].objects[episode.goal.object_id]
    if isinstance(goal, AgentNearTarget):
        nearest = max(last.box_distance_m, last.center_distance_m)
        if nearest > goal.threshold_m - MARGIN_M:
            yield f"ends {nearest:.3f} m from the target"
    if isinstance(goal, ObjectInState) and goal.state == "is_visible" and not _is_clear(last):
        yield f"ends with {last.visible_px} px in view, {last.nearest_visible_m} m away"
    if isinstance(goal, ReportStatus) and last.state_px(goal.state) < OBSERVABLE_PX + MARGIN_PX:
        yield f"ends with {last.state_px(goal.state)} px of the state in view"
    for before, step in zip(record.worlds, record.steps, strict=False):
        action, effect = step.action, step.effect
        if not isinstance(action, InteractPixel) or effect is None or action.intent in ("ground", "drop"):
            continue
        hit = before.objects.get(effect.hit or "")
        away = effect.click_m if action.intent == "place" or hit is None else hit.box_distance_m
        if effect.refusal is not None:
            yield f"step {step.index}: {action.intent} is refused ({effect.refusal})"
        elif away is not None and away > REACH_M - MARGIN_M:
            yield f"step {step.index}: {action.intent} from {away:.3f} m"
